"""Names of the shapes of a scene."""

from collections.abc import Iterator
from pathlib import PurePath
from typing import Any

from lightpaint.scene.scene_tree import ParsedScene

#: A shape that is visible only where instances refer to it.
GROUP = "shapegroup"


def shape_names(parsed: ParsedScene) -> tuple[str, ...]:
    """Return names of a loaded scene's shapes, in order: id, else mesh file, material or kind."""
    import mitsuba as mi

    shapes = parsed.children_of(0, mi.ObjectType.Shape)
    kinds = (parsed.state.nodes[k].props.plugin_name() for k in shapes)
    return tuple(
        next(filter(None, _names_of(parsed, k)))
        for k, kind in zip(shapes, kinds, strict=True)
        if kind != GROUP
    )


def _names_of(parsed: ParsedScene, node: int) -> Iterator[str]:
    """Yield possible names of a shape, the best first."""
    import mitsuba as mi

    def ids(kind: Any) -> Iterator[str]:
        return (str(parsed.state.nodes[k].props.id()) for k in parsed.children_of(node, kind))

    props = parsed.state.nodes[node].props
    yield str(props.id())
    if "filename" in props:
        yield PurePath(str(props["filename"])).stem
    # An instance has the name of its group.
    yield from ids(mi.ObjectType.Shape)
    yield from ids(mi.ObjectType.BSDF)
    yield str(props.plugin_name())
