"""Mitsuba's parsed form of a scene XML, from which loaded scenes are built.

The parsed form is kept and copied for every load, because instantiating changes it, and only one
loaded scene should exist at a time.
"""

import hashlib
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from copy import copy
from pathlib import Path
from typing import Any

from lightpaint.errors import SceneError
from lightpaint.scene.checks.assets import check_assets
from lightpaint.scene.checks.required import check_required
from lightpaint.scene.checks.xml_limits import check_nodes, check_xml
from lightpaint.scene.normals import make_normals_reproducible
from lightpaint.scene.properties.emission import EmitterSetting, child_named, set_emission
from lightpaint.scene.properties.film import Film
from lightpaint.scene.properties.integrator import (
    Integrator,
    IntegratorChoice,
    integrator_nodes,
    read_integrator,
    replace_integrator,
)
from lightpaint.scene.runtime.mitsuba_errors import mitsuba_errors
from lightpaint.scene.runtime.plugins import check_plugins


class ParsedScene:
    """The nodes of a scene XML, from Mitsuba's own parser."""

    def __init__(
        self,
        path: Path,
        parameters: Mapping[str, str],
        variant: str,
        integrator_choice: IntegratorChoice | None = None,
    ) -> None:
        """Parse the XML. integrator_choice: an integrator that replaces the scene's own."""
        import mitsuba as mi

        self.path = path
        self.parameters = parameters
        self.config = mi.parser.ParserConfig(variant)
        # Merging meshes would lose the order and the names of their emitters.
        self.config.merge_meshes = False
        self.resolver = mi.FileResolver(mi.file_resolver())
        self.resolver.prepend(str(path.resolve().parent))
        with self._resolving(), mitsuba_errors(path):
            self.state = self._parse()
        if self.state.nodes[0].props.plugin_name() != "scene":
            raise SceneError(f"{path} is not a scene: its root element must be <scene>")
        self.files = tuple(Path(str(f)) for f in self.state.files)
        self.integrator_choice, self.replaced = self._replace_integrator(integrator_choice)
        with mitsuba_errors(path, self.integrator_choice):
            check_plugins(self.state, self.resolver)
        kinds = mi.ObjectType
        self.emitter_nodes = self._nodes_of(kinds.Emitter)
        self.shape_of = self._shapes_by_child(kinds.Emitter)
        self.parent_of = self._shapes_by_child(kinds.Shape)
        self.sensor_nodes = self.children_of(0, kinds.Sensor)
        self.sensor_names = tuple(
            self.state.nodes[k].props.id() or f"sensor_{i}" for i, k in enumerate(self.sensor_nodes)
        )
        self.names = self._name_lights()
        #: Parameters changed by `with_motions`, as XML: node → name → element.
        self.moved: dict[int, dict[str, str]] = {}

    def _parse(self) -> Any:
        """Return the parsed form of the XML, after checking it and the files that it refers to."""
        import mitsuba as mi

        path, parser = self.path, mi.parser
        check_xml(path, self.parameters, mi.file_resolver())
        state = parser.parse_file(self.config, str(path), **self.parameters)
        # Reading a property marks it as used, and Mitsuba reports unused ones: so check copies.
        check_nodes(path, parser.ParserState(state))
        parser.transform_all(self.config, state)
        check_required(path, parser.ParserState(state))
        has_exr = check_assets(path, parser.ParserState(state), self.resolver)
        # An exception about a damaged offset table in Mitsuba's OpenEXR reader sometimes ends the
        # process if it is thrown in one of several threads.
        self.config.parallel = self.config.parallel and not has_exr
        return state

    def _replace_integrator(
        self, integrator_choice: IntegratorChoice | None
    ) -> tuple[IntegratorChoice | None, tuple[tuple[int, int], ...]]:
        """Replace the integrator. Returns the choice, and the positions of the replaced elements:
        file index, byte offset.
        """
        if integrator_choice is None:
            return None, ()
        nodes = [self.state.nodes[k] for k in integrator_nodes(self.state)]
        # The parser's offset is just after the `<`.
        places = tuple((int(node.file_index), int(node.offset) - 1) for node in nodes)
        return replace_integrator(self.state, integrator_choice), places

    def _nodes_of(self, kind: Any) -> list[int]:
        return [k for k, node in enumerate(self.state.nodes) if node.type == kind]

    def _shapes_by_child(self, kind: Any) -> dict[int, int]:
        """Return the shape of each node of this kind that is inside a shape."""
        import mitsuba as mi

        return {
            child: shape
            for shape in self._nodes_of(mi.ObjectType.Shape)
            for child in self.children_of(shape, kind)
        }

    def children_of(self, parent: int, kind: Any = None) -> list[int]:
        """Return the nodes inside a node, or referenced by it. kind: restricts them to this
        kind.
        """
        import mitsuba as mi

        props = self.state.nodes[parent].props
        reference = mi.Properties.Type.ResolvedReference
        children = [props[k].index() for k in props if props.type(k) == reference]
        return [c for c in children if kind is None or self.state.nodes[c].type == kind]

    def _name_lights(self) -> dict[int, str]:
        """Return names by node: emitter id, or else the id of its shape, or else `<plugin>_<k>`."""
        names: dict[int, str] = {}
        taken: set[str] = set()
        count: dict[str, int] = {}
        for node in self.emitter_nodes:
            props = self.state.nodes[node].props
            plugin = props.plugin_name()
            count[plugin] = count.get(plugin, -1) + 1
            shape = self.shape_of.get(node)
            shape_id = self.state.nodes[shape].props.id() if shape is not None else ""
            base = props.id() or shape_id or f"{plugin}_{count[plugin]}"
            name, k = base, 2
            while name in taken:
                name, k = f"{base}_{k}", k + 1
            taken.add(name)
            names[node] = name
        return names

    def instantiate(self, settings: Mapping[int, EmitterSetting], *films: Film) -> Any:
        """Build an `mi.Scene` with emitter settings, by node.

        films: replace those of their sensors; other sensors keep their films.
        """
        import mitsuba as mi

        state = mi.parser.ParserState(self.state)
        for node, name in self.names.items():
            state.nodes[node].props.set_id(name)
        # Sensors that belong to shapes are listed with the others after loading; ids identify them.
        for node, name in zip(self.sensor_nodes, self.sensor_names, strict=True):
            state.nodes[node].props.set_id(name)
        for node, setting in settings.items():
            set_emission(state, node, setting, on_shape=node in self.shape_of)
        for film in films:
            props = state.nodes[self.sensor_nodes[film.sensor]].props
            for key in list(props):
                reference = mi.Properties.Type.ResolvedReference
                if (
                    props.type(key) == reference
                    and state.nodes[props[key].index()].type == mi.ObjectType.Film
                ):
                    del props[key]
            props["film"] = film.load()
        with self._resolving(), mitsuba_errors(self.path, self.integrator_choice):
            scene = mi.parser.instantiate(self.config, state)
        make_normals_reproducible(scene)
        return scene

    def shape_plugin(self, emitter: int) -> str:
        """Return the plugin of the shape of an emitter; "" if it has no shape."""
        shape = self.shape_of.get(emitter)
        return "" if shape is None else str(self.state.nodes[shape].props.plugin_name())

    def relocated(self, old: Path, new: Path) -> "ParsedScene":
        """Return this scene after its files in the folder `old` are moved to `new`."""
        import mitsuba as mi

        other = copy(self)
        other.path = new / self.path.relative_to(old)
        other.files = tuple(relocated_path(file, old, new) for file in self.files)
        other.resolver = mi.FileResolver(self.resolver)
        other.resolver.clear()
        for k in range(len(self.resolver)):
            other.resolver.append(str(relocated_path(Path(str(self.resolver[k])), old, new)))
        return other

    def image_file(self, node: int, parameter: str) -> tuple[Path, bool]:
        """Return the file of an emitter's image, and whether its stored values are linear."""
        texture = child_named(self.state, node, parameter)
        props = self.state.nodes[node if texture is None else texture].props
        if "filename" not in props:
            raise SceneError(f"light {self.names[node]!r} emits an image that is in no file")
        path = Path(str(self.resolver.resolve(props["filename"])))
        return path, bool(props.get("raw", False))

    def integrator(self) -> Integrator:
        """Return the scene's integrator."""
        return read_integrator(self.state, self.path)

    def has_media(self) -> bool:
        import mitsuba as mi

        return bool(self._nodes_of(mi.ObjectType.Medium))

    def content(self, sensor: int) -> str:
        import mitsuba as mi

        # The parsed form includes the content of files that only the parser reads.
        parsed = mi.parser.write_string(self.state)
        digest = hashlib.sha256(repr((mi.__version__, parsed)).encode())
        for path in (*self.files, *self.assets()):
            with Path(path).open("rb") as file:
                digest.update(os.fstat(file.fileno()).st_size.to_bytes(8, "little"))
                while data := file.read(2**24):
                    digest.update(data)
        digest.update(repr((sorted(self.parameters.items()), sensor)).encode())
        if self.integrator_choice is not None:
            digest.update(str(self.integrator_choice).encode())
        return digest.hexdigest()[:32]

    def assets(self) -> Iterator[Path]:
        """Yield the files that plugins read: meshes, textures, tables."""
        for name in self._asset_names():
            path = Path(str(self.resolver.resolve(name)))
            if path.is_file():
                yield path

    def _asset_names(self) -> Iterator[str]:
        """Yield the names of assets as given in the scene."""
        import mitsuba as mi

        for node in self.state.nodes:
            for key in node.props:
                if "file" in key and node.props.type(key) == mi.Properties.Type.String:
                    yield str(node.props[key])

    def places(self) -> set[Path]:
        """Return the paths of its files, and of files that would be used if they existed.

        These are more than Mitsuba tries: every file name in every search folder.
        """
        folders = {Path(str(self.resolver[k])) for k in range(len(self.resolver))}
        folders |= {file.parent for file in self.files}
        files = {*self.files, *self.assets()}
        names = {Path(name) for name in self._asset_names()}
        names |= {x.relative_to(y) for x in files for y in folders if x.is_relative_to(y)}
        return files | {folder / name for folder in folders for name in names}

    @contextmanager
    def _resolving(self) -> Iterator[None]:
        """Make relative paths resolve beside the scene's files within the block."""
        import mitsuba as mi

        resolver_before = mi.file_resolver()
        mi.set_file_resolver(self.resolver)
        try:
            yield
        finally:
            mi.set_file_resolver(resolver_before)


def relocated_path(path: Path, old: Path, new: Path) -> Path:
    """Return `path` after the folder `old` was moved to `new`, without passing through `old`."""
    if ".." not in path.parts and path.is_relative_to(old):
        return new / path.relative_to(old)
    real, old_real = Path(os.path.realpath(path)), Path(os.path.realpath(old))
    if real.is_relative_to(old_real):
        return Path(os.path.realpath(new)) / real.relative_to(old_real)
    # The path may lead through the old folder.
    return real if old_real.name in path.parts else path
