"""The plugins that a scene may use, and a guard against foreign native code.

Mitsuba looks for `plugins/NAME.so` in every folder of its file resolver, including the working
folder and the scene's, before its own folder, and runs what it finds. Therefore all of its own
plugins are loaded at start from its own folder; Mitsuba never looks for a loaded name again. Scenes
may use only these plugins.
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
from lightpaint.luminaires import LUMINAIRE_PLUGINS
from lightpaint.luminaires.registration import check_can_have_luminaires
from lightpaint.scene.checks.tokens import place_of_node

#: Environment variable that names a folder with the user's own plugins.
VARIABLE = "LIGHTPAINT_PLUGINS"

#: Integrators that Mitsuba implements in Python for JIT variants, and emitters that lightpaint
#: adds; they have no plugin file.
IN_PYTHON = LUMINAIRE_PLUGINS | {
    *("direct_projective", "prb", "prb_basic", "prb_projective", "prbvolpath", "volprim_rf_basic"),
}
#: The root of a scene, which is part of Mitsuba's core.
BUILT_IN = frozenset({"scene"})

ENDINGS = (".so", ".dylib", ".dll")


class UnknownPluginError(RuntimeError):
    """A plugin of a scene that is neither Mitsuba's nor the user's."""


@cache
def loaded_plugins() -> frozenset[str]:
    """Load all plugins of Mitsuba and of the user's folder, and return their names.

    Raises BackendError if that folder does not exist, or contains a file that is not a plugin for
    this Mitsuba.
    """
    import mitsuba as mi

    plugin_folder = Path(mi.__file__).resolve().parent / "plugins"
    names = _load_folder(plugin_folder)
    if user_folder := os.environ.get(VARIABLE):
        folder = Path(user_folder).absolute()
        if not folder.is_dir():
            raise BackendError(
                f"{VARIABLE} is {folder}, which is not a folder: set it to a folder of plugins"
            )
        added_plugins = {path.stem for path in _files(folder)}
        if duplicates := sorted(added_plugins & (names | IN_PYTHON)):
            raise BackendError(
                f"{VARIABLE}: {folder} has a plugin {duplicates[0]!r}, which Mitsuba has itself: "
                "give it another name"
            )
        plugins = _load_folder(folder)
        if missing := sorted(added_plugins - plugins):
            raise BackendError(
                f"{VARIABLE}: {folder} has {missing[0]!r}, which this Mitsuba cannot load as a "
                "plugin"
            )
        names |= plugins
    return names | BUILT_IN


def check_plugins(state: Any, resolver: Any) -> None:
    """Raise UnknownPluginError if a parsed scene uses a plugin that is not loaded.

    Must be called before the scene is built. resolver: the resolver that Mitsuba will use.
    """
    import mitsuba as mi

    plugins = loaded_plugins()
    for node in _in_use(state):
        name = str(node.props.plugin_name())
        if name in plugins:
            continue
        kind = str(node.type).rpartition(".")[2].lower()
        prefix = f"{place_of_node(state, node)}Mitsuba has no {kind} plugin {one_line(repr(name))}"
        if name in LUMINAIRE_PLUGINS:
            check_can_have_luminaires(mi.variant())
        if name in IN_PYTHON:
            if file := _shadowing_file(name, resolver):
                raise UnknownPluginError(
                    f"{prefix} except in Python, and {file} would run instead: move that file away"
                )
            continue
        close = difflib.get_close_matches(name, plugins | IN_PYTHON, n=1, cutoff=0.75)
        suggestion = f"; did you mean {close[0]!r}?" if close else ""
        raise UnknownPluginError(f"{prefix}{suggestion}")


def _in_use(state: Any) -> Iterator[Any]:
    """Yield the nodes that objects will be built from, which excludes the nodes of a replaced
    integrator.
    """
    import mitsuba as mi

    resolved = mi.Properties.Type.ResolvedReference
    reached_indices, open_indices = {0}, [0]
    while open_indices:
        node = state.nodes[open_indices.pop()]
        yield node
        props = node.props
        referenced_indices = {
            int(props[key].index()) for key in props if props.type(key) == resolved
        } - reached_indices
        reached_indices |= referenced_indices
        open_indices += sorted(referenced_indices)


def _shadowing_file(name: str, resolver: Any) -> Path | None:
    """Return the file that Mitsuba would load as the plugin `name`; None if there is none."""
    folders = [Path(), *(Path(str(resolver[k])) for k in range(len(resolver)))]
    files = (folder / "plugins" / f"{name}{end}" for folder in folders for end in ENDINGS)
    return next(filter(Path.exists, files), None)


def _files(folder: Path) -> list[Path]:
    return sorted(path for path in folder.iterdir() if path.suffix in ENDINGS and path.is_file())


def _load_folder(folder: Path) -> frozenset[str]:
    """Load the plugins in `folder`, whatever plugins other folders contain. Returns their names."""
    import mitsuba as mi

    manager = mi.PluginManager.instance()
    # Plugins may read Mitsuba's data files while loading.
    plugin_folder = Path(mi.__file__).resolve().parent
    with (
        tempfile.TemporaryDirectory(prefix="lightpaint-") as parent_folder,
        _resolving_only_in(Path(parent_folder), plugin_folder),
    ):
        (Path(parent_folder) / "plugins").symlink_to(folder, target_is_directory=True)
        kinds = {path.stem: manager.plugin_type(path.stem) for path in _files(folder)}
    return frozenset(name for name, kind in kinds.items() if kind != mi.ObjectType.Unknown)


@contextmanager
def _resolving_only_in(*folders: Path) -> Iterator[None]:
    """Restrict Mitsuba's file search to these folders within the block."""
    import mitsuba as mi

    resolver_before = mi.file_resolver()
    resolver = mi.FileResolver(resolver_before)
    resolver.clear()
    for folder in folders:
        resolver.append(str(folder))
    mi.set_file_resolver(resolver)
    try:
        yield
    finally:
        mi.set_file_resolver(resolver_before)
