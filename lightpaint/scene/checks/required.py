"""Checks for parameters without which a Mitsuba plugin crashes.

The list was found by loading and rendering each plugin without parameters; other plugins report
what they lack.
"""

from pathlib import Path
from typing import Any

from lightpaint.errors import SceneError
from lightpaint.files import one_line
from lightpaint.scene.checks.tokens import place_of_node

#: Plugin → alternative parameters, one of which is required, and XML for the error message.
REQUIRED = {
    "bitmap": (("filename", "bitmap", "data"), '<string name="filename" value="..."/>'),
    "blendbsdf": (("weight",), '<float name="weight" value="..."/>'),
    "volume": (("volume",), '<volume name="volume" type="..."/>'),
}


def check_required(path: Path, state: Any) -> None:
    """Raise SceneError if a plugin of a parsed scene lacks a required parameter."""
    for node in state.nodes:
        plugin = str(node.props.plugin_name())
        names, form = REQUIRED.get(plugin, ((), ""))
        if names and not any(name in node.props for name in names):
            kind = str(node.type).rpartition(".")[2].lower()
            given_names = [name for name in node.props if not name.startswith("_")]
            has = f", which has {one_line(', '.join(given_names))}," if given_names else ""
            place = place_of_node(state, node)
            raise SceneError(
                f"{path}: {place}the {kind} {plugin!r}{has} needs {names[0]!r}: write {form} in it"
            )
