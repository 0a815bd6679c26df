"""A Mitsuba scene with named lights, loaded as often as needed with other emissions.

The parsed XML is kept, not the loaded scene: only one loaded scene should be alive at a
time, and no reference to one of its emitters may outlive it.
"""

import gc
import hashlib
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from lightpaint.errors import SceneError
from lightpaint.scene.emitters import RGB, EmissionKind, describe_form, emission_kind, read_emission
from lightpaint.scene.variant import use_variant


@dataclass(frozen=True)
class Light:
    """One light of a scene: what a person adjusts.

    emission: present linear RGB emission in the unit of `kind`.
    file, offset: where its element's `<` stands: index into Scene.files, byte offset.
    """

    name: str
    plugin: str
    kind: EmissionKind
    emission: RGB
    form: str
    sampling_weight: float
    node: int
    file: int
    offset: int


@dataclass(frozen=True)
class Integrator:
    """The part of the scene's integrator that decides which light paths there are."""

    plugin: str
    max_depth: int
    rr_depth: int
    hide_emitters: bool


@dataclass(frozen=True)
class Scene:
    """A parsed scene, seen through one of its sensors.

    size: (height, width) in pixels of the sensor's film, or of its crop window.
    spp: samples per pixel the scene itself asks for.
    identity: hash of the content of all XML files and assets, the parameters and the sensor.
    """

    path: Path
    parameters: Mapping[str, str]
    sensor: int
    sensor_names: tuple[str, ...]
    size: tuple[int, int]
    spp: int
    integrator: Integrator
    has_media: bool
    lights: tuple[Light, ...]
    files: tuple[Path, ...]
    identity: str
    _parsed: "_Parsed" = field(repr=False)

    def light(self, name: str) -> Light:
        """The light called `name`. Raises SceneError if there is none."""
        for light in self.lights:
            if light.name == name:
                return light
        raise SceneError(
            f"{self.path} has no light {name!r}: it has {', '.join(x.name for x in self.lights)}"
        )

    def load(self, emission: Mapping[str, RGB] | None = None) -> Any:
        """The `mi.Scene`, its lights set to `emission` (those not named stay as they are).

        The film is replaced by a box-filtered RGB float32 one of the same size, for basis
        and verification alike. A light set to black is never sampled. Drop the scene, and
        all that came from it, before loading another.
        """
        emission = emission or {}
        dark = {name for name, rgb in emission.items() if not any(rgb)}
        if dark >= {light.name for light in self.lights}:
            # Mitsuba refuses a scene in which no emitter may be sampled.
            dark = set()
        edits = {self.light(n).node: (self.light(n), c, n in dark) for n, c in emission.items()}
        return self._parsed.instantiate(edits, self._parsed.sensor_nodes[self.sensor])


def load_scene(
    path: str | Path,
    *,
    sensor: int | str | None = None,
    parameters: Mapping[str, object] | None = None,
    variant: str | None = None,
) -> Scene:
    """Read a Mitsuba scene XML and find its lights.

    sensor: index or id of the sensor to look through (the first by default).
    parameters: values for the `$name` parameters of the XML (Mitsuba's `-D`).
    variant: Mitsuba variant to run, where the process has none yet.

    Raises SceneError, with Mitsuba's own message where it refuses the scene, and
    BackendError if Mitsuba cannot run.
    """
    backend = use_variant(variant)
    path = Path(path)
    if not path.is_file():
        raise SceneError(f"no such scene file: {path}")
    values = {key: str(value) for key, value in (parameters or {}).items()}
    parsed = _Parsed(path, values, backend.variant)
    index = _sensor_index(sensor, parsed.sensor_names, path)

    loaded = parsed.instantiate({}, None)
    lights = _find_lights(parsed, loaded)
    camera = loaded.sensors()[index]
    width, height = (int(v) for v in camera.film().crop_size())
    window = [*camera.film().size(), *camera.film().crop_size(), *camera.film().crop_offset()]
    parsed.film_window = tuple(int(v) for v in window)  # type: ignore[assignment]
    spp = int(camera.sampler().sample_count())
    del loaded, camera
    gc.collect()
    if not lights:
        raise SceneError(f"{path} has no lights: add at least one emitter")

    return Scene(
        path=path,
        parameters=values,
        sensor=index,
        sensor_names=parsed.sensor_names,
        size=(height, width),
        spp=spp,
        integrator=parsed.integrator(),
        has_media=parsed.has_media(),
        lights=lights,
        files=parsed.files,
        identity=parsed.identity(index),
        _parsed=parsed,
    )


class _Parsed:
    """Mitsuba's parsed form of the XML, and how to make scenes of it."""

    def __init__(self, path: Path, parameters: Mapping[str, str], variant: str) -> None:
        import mitsuba as mi

        self.path = path
        self.parameters = parameters
        self.config = mi.parser.ParserConfig(variant)
        # Merged meshes would lose the order and the names of their emitters.
        self.config.merge_meshes = False
        self.resolver = mi.FileResolver(mi.file_resolver())
        self.resolver.prepend(str(path.resolve().parent))
        self.film_window: tuple[int, int, int, int, int, int] | None = None
        with self._resolving(), _mitsuba_errors(path):
            self.state = mi.parser.parse_file(self.config, str(path), **parameters)
            mi.parser.transform_all(self.config, self.state)
        if self.state.nodes[0].props.plugin_name() != "scene":
            raise SceneError(f"{path} is not a scene: its root element must be <scene>")
        self.files = tuple(Path(str(f)) for f in self.state.files)
        kinds = mi.ObjectType
        self.emitter_nodes = self._nodes_of(kinds.Emitter)
        self.sensor_nodes = self._children_of(0, kinds.Sensor)
        self.sensor_names = tuple(
            self.state.nodes[k].props.id() or f"sensor_{i}" for i, k in enumerate(self.sensor_nodes)
        )
        self.names = self._name_lights()

    def _nodes_of(self, kind: Any) -> list[int]:
        return [k for k, node in enumerate(self.state.nodes) if node.type == kind]

    def _children_of(self, parent: int, kind: Any = None) -> list[int]:
        import mitsuba as mi

        props = self.state.nodes[parent].props
        reference = mi.Properties.Type.ResolvedReference
        children = [props[k].index() for k in props if props.type(k) == reference]
        return [c for c in children if kind is None or self.state.nodes[c].type == kind]

    def _name_lights(self) -> dict[int, str]:
        """Names by node: emitter id, else the id of its shape, else `<plugin>_<k>`."""
        import mitsuba as mi

        shape_of = {
            child: shape
            for shape in self._nodes_of(mi.ObjectType.Shape)
            for child in self._children_of(shape, mi.ObjectType.Emitter)
        }
        names: dict[int, str] = {}
        taken: set[str] = set()
        count: dict[str, int] = {}
        for node in self.emitter_nodes:
            props = self.state.nodes[node].props
            plugin = props.plugin_name()
            count[plugin] = count.get(plugin, -1) + 1
            shape = shape_of.get(node)
            shape_id = self.state.nodes[shape].props.id() if shape is not None else ""
            base = props.id() or shape_id or f"{plugin}_{count[plugin]}"
            name, k = base, 2
            while name in taken:
                name, k = f"{base}_{k}", k + 1
            taken.add(name)
            names[node] = name
        return names

    def instantiate(
        self, edits: Mapping[int, tuple[Light, RGB, bool]], sensor_node: int | None
    ) -> Any:
        """Make a `mi.Scene`. edits: node → (light, RGB emission, whether it is dark)."""
        import mitsuba as mi

        state = mi.parser.ParserState(self.state)
        for node, name in self.names.items():
            state.nodes[node].props.set_id(name)
        for node, (light, rgb, is_dark) in edits.items():
            props = state.nodes[node].props
            props[light.kind.parameter] = mi.ScalarColor3f(*rgb)
            # A light the scene keeps switched off is sampled again once it shines.
            props["sampling_weight"] = 0.0 if is_dark else light.sampling_weight or 1.0
        if sensor_node is not None:
            props = state.nodes[sensor_node].props
            for key in list(props):
                reference = mi.Properties.Type.ResolvedReference
                if (
                    props.type(key) == reference
                    and state.nodes[props[key].index()].type == mi.ObjectType.Film
                ):
                    del props[key]
            props["film"] = self._film()
        with self._resolving(), _mitsuba_errors(self.path):
            return mi.parser.instantiate(self.config, state)

    def _film(self) -> Any:
        import mitsuba as mi

        assert self.film_window is not None
        width, height, crop_width, crop_height, crop_x, crop_y = self.film_window
        return mi.load_dict(
            {
                "type": "hdrfilm",
                "width": width,
                "height": height,
                "crop_width": crop_width,
                "crop_height": crop_height,
                "crop_offset_x": crop_x,
                "crop_offset_y": crop_y,
                "pixel_format": "rgb",
                "component_format": "float32",
                "rfilter": {"type": "box"},
            }
        )

    def integrator(self) -> Integrator:
        import mitsuba as mi

        nodes = self._children_of(0, mi.ObjectType.Integrator)
        if not nodes:
            # Mitsuba's own choice for a scene that names none.
            return Integrator("path", -1, 5, False)
        props = self.state.nodes[nodes[0]].props
        return Integrator(
            props.plugin_name(),
            int(props.get("max_depth", -1)),
            int(props.get("rr_depth", 5)),
            bool(props.get("hide_emitters", False)),
        )

    def has_media(self) -> bool:
        import mitsuba as mi

        return bool(self._nodes_of(mi.ObjectType.Medium))

    def identity(self, sensor: int) -> str:
        digest = hashlib.sha256()
        for path in (*self.files, *self._assets()):
            data = Path(path).read_bytes()
            digest.update(len(data).to_bytes(8, "little"))
            digest.update(data)
        digest.update(repr((sorted(self.parameters.items()), sensor)).encode())
        return digest.hexdigest()[:32]

    def _assets(self) -> Iterator[Path]:
        import mitsuba as mi

        for node in self.state.nodes:
            for key in node.props:
                if node.props.type(key) == mi.Properties.Type.String:
                    path = Path(str(self.resolver.resolve(node.props[key])))
                    if path.is_file():
                        yield path

    @contextmanager
    def _resolving(self) -> Iterator[None]:
        """Let relative paths be found beside the scene's files meanwhile."""
        import mitsuba as mi

        before = mi.file_resolver()
        mi.set_file_resolver(self.resolver)
        try:
            yield
        finally:
            mi.set_file_resolver(before)


def _find_lights(parsed: _Parsed, loaded: Any) -> tuple[Light, ...]:
    """The lights that take part in the scene, in document order."""
    node_of = {name: node for node, name in parsed.names.items()}
    found = []
    for emitter in loaded.emitters():
        name = emitter.id()
        if name not in node_of:
            raise SceneError(f"emitter {name!r} does not stand in {parsed.path} as itself")
        node = parsed.state.nodes[node_of[name]]
        plugin = node.props.plugin_name()
        kind = emission_kind(plugin, name)
        found.append(
            Light(
                name=name,
                plugin=plugin,
                kind=kind,
                emission=read_emission(emitter, kind, name),
                form=describe_form(emitter, plugin),
                sampling_weight=float(emitter.sampling_weight()),
                node=node_of[name],
                file=node.file_index,
                offset=node.offset - 1,
            )
        )
    return tuple(sorted(found, key=lambda light: light.node))


def _sensor_index(wanted: int | str | None, names: Sequence[str], path: Path) -> int:
    if not names:
        raise SceneError(f"{path} has no sensor: add one to look through")
    if wanted is None:
        return 0
    if isinstance(wanted, str) and wanted in names:
        return names.index(wanted)
    try:
        index = int(wanted)
    except ValueError:
        index = -1
    if not 0 <= index < len(names):
        listed = ", ".join(f"{k} ({name})" for k, name in enumerate(names))
        raise SceneError(f"{path} has no sensor {wanted!r}: it has {listed}")
    return index


@contextmanager
def _mitsuba_errors(path: Path) -> Iterator[None]:
    """Turn what Mitsuba throws into one line: its own words, without its source places."""
    try:
        yield
    except RuntimeError as error:
        text = re.sub(r"\[\w+\.cpp:\d+\]\s*", "", str(error))
        text = " ".join(text.split())
        undefined = re.search(r"undefined parameter: \$(\w+)", text)
        hint = f"; set it with -D {undefined[1]}=VALUE" if undefined else ""
        raise SceneError(f"Mitsuba refuses {path}: {text}{hint}") from None
