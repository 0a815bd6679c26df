"""Which of Mitsuba's plugins a scene may name, and whose native code is run for them.

Mitsuba looks for `plugins/NAME.so` in every folder of its file resolver, the working folder and
the scene's before its own, and runs what it finds. All of its own plugins are therefore loaded
when it starts, from its own folder; a name that is loaded is never looked for again. Scenes may
name these, and no others.
"""

import difflib
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

from lightpaint.errors import BackendError
from lightpaint.files import one_line
from lightpaint.scene.checks.tokens import place_of_node

#: Names the folder of plugins that a user adds to Mitsuba's own.
VARIABLE = "LIGHTPAINT_PLUGINS"

#: Integrators that Mitsuba has in Python, where its variant compiles: there is no file of these.
IN_PYTHON = frozenset(
    ["direct_projective", "prb", "prb_basic", "prb_projective", "prbvolpath", "volprim_rf_basic"]
)
#: The root of a scene, which is part of Mitsuba's core.
BUILT_IN = frozenset({"scene"})

ENDINGS = (".so", ".dylib", ".dll")


class UnknownPluginError(RuntimeError):
    """A plugin that a scene names, and that neither Mitsuba nor the user has."""


@cache
def loaded_plugins() -> frozenset[str]:
    """Load all of Mitsuba's plugins, and those of the folder that the user names; their names.

    Raises BackendError if that folder is none, or has a file that is no plugin of this Mitsuba.
    """
    import mitsuba as mi

    own = Path(mi.__file__).resolve().parent / "plugins"
    names = _loaded(own)
    if named := os.environ.get(VARIABLE):
        folder = Path(named).absolute()
        if not folder.is_dir():
            raise BackendError(f"{VARIABLE} names {folder}, which is no folder")
        added = {path.stem for path in _files(folder)}
        if taken := sorted(added & (names | IN_PYTHON)):
            raise BackendError(
                f"{VARIABLE}: {folder} has a plugin {taken[0]!r}, which Mitsuba has itself: give "
                "it another name"
            )
        found = _loaded(folder)
        if lacking := sorted(added - found):
            raise BackendError(
                f"{VARIABLE}: {folder} has {lacking[0]!r}, which this Mitsuba cannot load as a "
                "plugin"
            )
        names |= found
    return names | BUILT_IN


def check_plugins(state: Any, resolver: Any) -> None:
    """Raise UnknownPluginError if a parsed scene names a plugin that is not loaded.

    To be called before anything is made of the scene. resolver: where Mitsuba will look for files.
    """
    known = loaded_plugins()
    for node in _in_use(state):
        name = str(node.props.plugin_name())
        if name in known:
            continue
        kind = str(node.type).rpartition(".")[2].lower()
        lead = f"{place_of_node(state, node)}Mitsuba has no {kind} plugin {one_line(repr(name))}"
        if name in IN_PYTHON:
            if file := _in_the_way(name, resolver):
                raise UnknownPluginError(
                    f"{lead} but in Python, and {file} would be run in its place: move that away"
                )
            continue
        close = difflib.get_close_matches(name, known | IN_PYTHON, n=1, cutoff=0.75)
        meant = f"; did you mean {close[0]!r}?" if close else ""
        raise UnknownPluginError(f"{lead}{meant}")


def _in_use(state: Any) -> Iterator[Any]:
    """The nodes that something is made of: not those of an integrator that was replaced."""
    import mitsuba as mi

    resolved = mi.Properties.Type.ResolvedReference
    found, waiting = {0}, [0]
    while waiting:
        node = state.nodes[waiting.pop()]
        yield node
        props = node.props
        below = {int(props[key].index()) for key in props if props.type(key) == resolved} - found
        found |= below
        waiting += sorted(below)


def _in_the_way(name: str, resolver: Any) -> Path | None:
    """A file that Mitsuba would take for the plugin `name`; None if there is none."""
    folders = [Path(), *(Path(str(resolver[k])) for k in range(len(resolver)))]
    files = (folder / "plugins" / f"{name}{end}" for folder in folders for end in ENDINGS)
    return next(filter(Path.exists, files), None)


def _files(folder: Path) -> list[Path]:
    return sorted(path for path in folder.iterdir() if path.suffix in ENDINGS and path.is_file())


def _loaded(folder: Path) -> frozenset[str]:
    """Load the plugins in `folder`, wherever others of such names are. Returns their names."""
    import mitsuba as mi

    manager = mi.PluginManager.instance()
    # What is loaded may read Mitsuba's tables at once.
    own = Path(mi.__file__).resolve().parent
    with tempfile.TemporaryDirectory(prefix="lightpaint-") as above, _only_in(Path(above), own):
        (Path(above) / "plugins").symlink_to(folder, target_is_directory=True)
        kinds = {path.stem: manager.plugin_type(path.stem) for path in _files(folder)}
    return frozenset(name for name, kind in kinds.items() if kind != mi.ObjectType.Unknown)


@contextmanager
def _only_in(*folders: Path) -> Iterator[None]:
    """Have Mitsuba look for files in these folders alone meanwhile."""
    import mitsuba as mi

    before = mi.file_resolver()
    resolver = mi.FileResolver(before)
    resolver.clear()
    for folder in folders:
        resolver.append(str(folder))
    mi.set_file_resolver(resolver)
    try:
        yield
    finally:
        mi.set_file_resolver(before)
