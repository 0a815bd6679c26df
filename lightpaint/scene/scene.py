"""A Mitsuba scene with named lights, loaded as often as needed with other emissions.

The parsed XML is kept, not the loaded scene: only one loaded scene should be alive at a
time, and no reference to one of its emitters may outlive it.
"""

import gc
import hashlib
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from lightpaint.arrays import RGB, Floats
from lightpaint.errors import SceneError
from lightpaint.files import file_length
from lightpaint.scene.checks.xml import MAX_XML
from lightpaint.scene.emitters import (
    AS_AUTHORED,
    check_rendered,
    describe_form,
    emission_kind,
    flux_of_unit,
    read_emission,
    why_not_adjusted,
)
from lightpaint.scene.lights import (
    REST,
    Emitter,
    Light,
    choose_lights,
    free_names,
    lights_of,
    point_emitter,
)
from lightpaint.scene.lights_file import LightsFile, lights_file_beside, read_lights_file
from lightpaint.scene.parsed import (
    EmitterSetting,
    Integrator,
    ParsedScene,
    Position,
    View,
    mitsuba_errors,
)
from lightpaint.scene.resolution import reduced, reduction
from lightpaint.scene.variant import use_variant

#: Pixels of a film, its samples per pixel and characters of a name beyond which each is a mistake.
MAX_PIXELS = 2**28
MAX_SPP = 2**20
MAX_NAME = 1000


@dataclass(frozen=True)
class Scene:
    """A parsed scene, seen through one of its sensors.

    view: the sensor it is seen through, and its film.
    spp: samples per pixel the scene itself asks for.
    has_null: whether rays may pass a surface as if it were not there.
    emitters: all of them; lights: what is adjusted, and last what is kept, if anything is.
    content: hash of all XML files and assets, the parameters and the sensor; the same on a
    reduced film.
    lights_file: the lights file that went into `lights`, if one did.
    """

    path: Path
    parameters: Mapping[str, str]
    view: View
    sensor_names: tuple[str, ...]
    spp: int
    integrator: Integrator
    has_media: bool
    has_null: bool
    emitters: tuple[Emitter, ...]
    lights: tuple[Light, ...]
    files: tuple[Path, ...]
    content: str
    lights_file: Path | None
    _parsed: "ParsedScene" = field(repr=False)

    @property
    def identity(self) -> str:
        """What makes two bases of this scene the same: `content`, and how emitters are tied."""
        # Of a scene whose emitters are all adjusted one by one it is the content alone.
        if all(x.member_names == (x.name,) and not x.is_fixed for x in self.lights):
            return self.content
        tied = [(x.name, x.member_names, x.is_fixed) for x in self.lights]
        return hashlib.sha256(repr((self.content, tied)).encode()).hexdigest()[:32]

    @property
    def plane_of(self) -> Mapping[str, int]:
        """Index among the lights of the one that an emitter belongs to, by the emitter's name."""
        return {m.name: k for k, light in enumerate(self.lights) for m in light.members}

    def with_lights(
        self, members: Mapping[str, Sequence[str]], fixed: Collection[str] = ()
    ) -> "Scene":
        """This scene with its emitters tied to other lights.

        members: name of a light → names of its emitters; fixed: lights that stay as they are.
        Raises SceneError unless every emitter of the scene, and no other, is named once.
        """
        given = [name for names in members.values() for name in names]
        there = {emitter.name for emitter in self.emitters}
        if set(given) != there:
            raise SceneError(
                f"{self.path} has other emitters than are asked for: it lacks "
                f"{', '.join(sorted(set(given) - there)) or 'none'} and also has "
                f"{', '.join(sorted(there - set(given))) or 'none'}"
            )
        if len(given) > len(there) or not all(members.values()):
            raise SceneError(
                f"every emitter belongs to one light, and every light has one: not so in {members}"
            )
        return replace(self, lights=lights_of(self.emitters, members, fixed))

    @property
    def sensor(self) -> int:
        """Index of the sensor it is seen through."""
        return self.view.sensor

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) in pixels of the sensor's film, or of its crop window."""
        width, height = self.view.crop_size
        return height, width

    def light(self, name: str) -> Light:
        """The light called `name`. Raises SceneError if there is none."""
        for light in self.lights:
            if light.name == name:
                return light
        raise SceneError(
            f"{self.path} has no light {name!r}: it has {', '.join(x.name for x in self.lights)}"
        )

    def reduced(self, resolution: str) -> "Scene":
        """This scene on a smaller film of the same field of view.

        resolution: `1/4`, or `320x180`: a part of the film that cuts it into whole blocks of
        pixels. Raises SceneError, with sizes that would do, for any other.
        """
        return replace(self, view=reduced(self.view, reduction(self.view, resolution)))

    def camera(self, loaded: Any) -> Any:
        """The sensor this scene is seen through, in what `load` returned."""
        return _camera(loaded, self.sensor_names[self.sensor])

    def eye(self, loaded: Any) -> Any:
        """Where that sensor stands, as an `mi.Point3f`."""
        return self.camera(loaded).world_transform().translation()

    def lit_by_points(self, positions: Sequence[Position]) -> "Scene":
        """This scene under point lights alone, one at each of `positions`, in their order.

        Its own emitters stay where they are, black: what blocks or reflects light still does.
        They are the last light, which is fixed.
        """
        names = free_names("candidate", len(positions), [x.name for x in self.emitters])
        dark = {x.node: EmitterSetting(x.kind, (0.0, 0.0, 0.0), 0.0) for x in self.emitters}
        parsed = self._parsed.lit_by_points(dark, dict(zip(names, positions, strict=True)))
        points = tuple(
            point_emitter(name, node, position)
            for name, node, position in zip(
                names, parsed.emitter_nodes[-len(names) :], positions, strict=True
            )
        )
        members = {name: [name] for name in names}
        members |= {free_names(REST, 1, members)[0]: [x.name for x in self.emitters]}
        lit_by = hashlib.sha256(repr((self.content, positions)).encode()).hexdigest()[:32]
        emitters = (*self.emitters, *points)
        return replace(
            self,
            emitters=emitters,
            lights=lights_of(emitters, members, fixed=[*members][-1:]),
            content=lit_by,
            _parsed=parsed,
        )

    @property
    def originals(self) -> tuple[Path, ...]:
        """All files the scene consists of: XML, meshes, textures, tables."""
        return (*self.files, *self._parsed.assets())

    def load(self, emission: Mapping[str, RGB] | None = None) -> Any:
        """The `mi.Scene`, its lights set to `emission` (those not named stay as they are).

        The film is replaced by a box-filtered RGB float32 one of the same size, for basis
        and verification alike. A light set to black is never sampled. Drop the scene, and
        all that came from it, before loading another. Lights that are images, and what is
        kept, can only be black or as authored here: other multiples take files (see relight).
        """
        settings: dict[int, EmitterSetting] = {}
        for name, rgb in (emission or {}).items():
            light = self.light(name)
            if not light.is_fixed:
                settings |= {m.node: _setting(m, light.emission_of(m, rgb)) for m in light.members}
            elif not any(rgb):
                settings |= {m.node: _setting(m, rgb) for m in light.members}
            elif tuple(rgb) != AS_AUTHORED:
                raise SceneError(f"what is kept can be loaded black or as it is, not times {rgb}")
        own = {emitter.node: emitter.sampling_weight for emitter in self.emitters}
        if not any((own | {node: x.sampling_weight for node, x in settings.items()}).values()):
            # Mitsuba refuses a scene in which no emitter may be sampled.
            settings = {
                node: replace(x, sampling_weight=own[node] or 1.0) for node, x in settings.items()
            }
        return self._parsed.instantiate(settings, self.view)

    def emitted_image(self, emitter: Emitter) -> Floats:
        """The image that `emitter` emits, (h, w, 3) linear Rec.709, without its scale."""
        import mitsuba as mi

        assert emitter.kind is not None
        path, raw = self._parsed.image_file(emitter.node, emitter.kind.parameter)
        bitmap = mi.Bitmap(str(path))
        if raw:
            bitmap.set_srgb_gamma(False)
        rgb = bitmap.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False)
        return np.array(rgb)


def load_scene(
    path: str | Path,
    *,
    sensor: int | str | None = None,
    parameters: Mapping[str, object] | None = None,
    variant: str | None = None,
    lights: Iterable[str] | None = None,
    groups: Mapping[str, Iterable[str]] | None = None,
    lights_file: str | Path | None = None,
    use_lights_file: bool = True,
) -> Scene:
    """Read a Mitsuba scene XML and find its lights.

    sensor: index or id of the sensor to look through (the first by default).
    parameters: values for the `$name` parameters of the XML (Mitsuba's `-D`).
    variant: Mitsuba variant to run, where the process has none yet.
    lights: names or patterns (`window_*`) of the lights to adjust; the others are kept as
    they are. All by default.
    groups: name → names or patterns of emitters that are adjusted as one light.
    lights_file: TOML with such lights and groups, instead of the one beside the scene.
    `lights` replaces what it lists, `groups` are added to its own or replace namesakes;
    without `lights` they are adjusted beside what it lists.
    use_lights_file: False leaves the one beside the scene alone.

    Raises SceneError, with Mitsuba's own message where it refuses the scene, and
    BackendError if Mitsuba cannot run.
    """
    backend = use_variant(variant)
    path = Path(path)
    file_length(path, "scene file", SceneError, limit=MAX_XML)
    if path.suffix.lower() in (".exr", ".json", ".png"):
        raise SceneError(f"{path} is not a scene: this command takes a Mitsuba XML first")
    values = {key: str(value) for key, value in (parameters or {}).items()}
    with mitsuba_errors(path):
        parsed = ParsedScene(path, values, backend.variant)
    index = _sensor_index(sensor, parsed.sensor_names, path)

    asked = _lights_file(path, lights_file, use_lights_file=use_lights_file)
    with mitsuba_errors(path):
        loaded = parsed.instantiate({})
        emitters = _find_emitters(parsed, loaded)
        camera = _camera(loaded, parsed.sensor_names[index])
        view = View.of(camera, index)
        spp = int(camera.sampler().sample_count())
        has_null = _has_null_surfaces(loaded)
        del loaded, camera
        gc.collect()
        integrator, content = parsed.integrator(), parsed.content(index)
    _check_view(path, view, spp)
    if not emitters:
        raise SceneError(f"{path} has no lights: add at least one emitter")
    if max(len(emitter.name) for emitter in emitters) > MAX_NAME:
        raise SceneError(f"{path} has an emitter whose name has more than {MAX_NAME} characters")

    return Scene(
        path=path,
        parameters=values,
        view=view,
        sensor_names=parsed.sensor_names,
        spp=spp,
        integrator=integrator,
        has_media=parsed.has_media(),
        has_null=has_null,
        emitters=emitters,
        lights=choose_lights(
            emitters,
            scene=str(path),
            lights=_chosen(asked, lights, groups or {}),
            groups={**asked.groups, **(groups or {})},
        ),
        files=parsed.files,
        content=content,
        lights_file=asked.path,
        _parsed=parsed,
    )


def _check_view(path: Path, view: View, spp: int) -> None:
    width, height = view.crop_size
    if min(width, height) < 1:
        raise SceneError(
            f"{path} has a film of {width}x{height} pixels: there is nothing to render"
        )
    if width * height > MAX_PIXELS:
        raise SceneError(
            f"{path} has a film of {width}x{height} pixels: no more than {MAX_PIXELS} can be "
            "rendered; make its width and height smaller"
        )
    if spp > MAX_SPP:
        raise SceneError(
            f"{path} asks for {spp} samples per pixel: no more than {MAX_SPP} can be rendered; "
            "make its sample_count smaller"
        )


def _camera(loaded: Any, name: str) -> Any:
    return next(sensor for sensor in loaded.sensors() if sensor.id() == name)


def _has_null_surfaces(loaded: Any) -> bool:
    import mitsuba as mi

    bsdfs = (shape.bsdf() for shape in loaded.shapes())
    return any(b is not None and mi.has_flag(b.flags(), mi.BSDFFlags.Null) for b in bsdfs)


def _lights_file(scene: Path, named: str | Path | None, *, use_lights_file: bool) -> LightsFile:
    if named is not None:
        return read_lights_file(Path(named))
    beside = lights_file_beside(scene)
    return read_lights_file(beside) if use_lights_file and beside.is_file() else LightsFile()


def _chosen(
    asked: LightsFile, lights: Iterable[str] | None, groups: Iterable[str]
) -> Iterable[str] | None:
    """What to adjust, by the lights file and by what was given along with it."""
    if lights is not None or asked.lights is None:
        return lights
    # Who makes a group here and now means to adjust it.
    return (*asked.lights, *groups)


def _setting(emitter: Emitter, rgb: RGB) -> EmitterSetting:
    # An emitter the scene keeps switched off is sampled again once it shines.
    weight = (emitter.sampling_weight or 1.0) if any(rgb) and not emitter.by_chance else 0.0
    return EmitterSetting(emitter.kind, rgb, weight)


def _find_emitters(parsed: ParsedScene, loaded: Any) -> tuple[Emitter, ...]:
    """The emitters that take part in the scene, in document order."""
    node_of = {name: node for node, name in parsed.names.items()}
    found = []
    for emitter in loaded.emitters():
        name = emitter.id()
        if name not in node_of:
            raise SceneError(f"emitter {name!r} does not stand in {parsed.path} as itself")
        node = parsed.state.nodes[node_of[name]]
        plugin = node.props.plugin_name()
        kind = emission_kind(emitter, plugin)
        if kind is None:
            check_rendered(emitter, plugin, name, parsed.integrator().plugin)
        emission = read_emission(emitter, kind, name)
        found.append(
            Emitter(
                name=name,
                plugin=plugin,
                kind=kind,
                emission=emission,
                form=describe_form(emitter, plugin),
                sampling_weight=float(emitter.sampling_weight()),
                node=node_of[name],
                file=node.file_index,
                offset=node.offset - 1,
                obstacle=why_not_adjusted(plugin, kind, emission),
                unit_flux=flux_of_unit(emitter, plugin, kind),
            )
        )
    return tuple(sorted(found, key=lambda emitter: emitter.node))


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
