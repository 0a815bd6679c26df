"""A Mitsuba scene with named lights, loaded as often as needed with other emissions.

The parsed XML is kept, not the loaded scene: only one loaded scene should be alive at a
time, and no reference to one of its emitters may outlive it.
"""

import gc
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from lightpaint.errors import SceneError
from lightpaint.images.exr import Floats
from lightpaint.scene.emitters import RGB, EmissionKind, describe_form, emission_kind, read_emission
from lightpaint.scene.parsed import EmitterSetting, Integrator, ParsedScene, View
from lightpaint.scene.resolution import reduced, reduction
from lightpaint.scene.variant import use_variant


@dataclass(frozen=True)
class Light:
    """One light of a scene: what a person adjusts.

    emission: present linear RGB emission in the unit of `kind`; 1 for what is a multiple.
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
class Scene:
    """A parsed scene, seen through one of its sensors.

    view: the sensor it is seen through, and its film.
    spp: samples per pixel the scene itself asks for.
    has_null: whether rays may pass a surface as if it were not there.
    identity: hash of the content of all XML files and assets, the parameters and the sensor;
    the same for the scene on a reduced film.
    """

    path: Path
    parameters: Mapping[str, str]
    view: View
    sensor_names: tuple[str, ...]
    spp: int
    integrator: Integrator
    has_media: bool
    has_null: bool
    lights: tuple[Light, ...]
    files: tuple[Path, ...]
    identity: str
    _parsed: "ParsedScene" = field(repr=False)

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

    @property
    def originals(self) -> tuple[Path, ...]:
        """All files the scene consists of: XML, meshes, textures, tables."""
        return (*self.files, *self._parsed.assets())

    def load(self, emission: Mapping[str, RGB] | None = None) -> Any:
        """The `mi.Scene`, its lights set to `emission` (those not named stay as they are).

        The film is replaced by a box-filtered RGB float32 one of the same size, for basis
        and verification alike. A light set to black is never sampled. Drop the scene, and
        all that came from it, before loading another. Lights that are images can only be
        black or as authored here: other multiples take files (see relight).
        """
        emission = emission or {}
        # Mitsuba refuses a scene in which no emitter may be sampled.
        all_dark = len(emission) == len(self.lights) and not any(map(any, emission.values()))
        settings = {}
        for name, rgb in emission.items():
            light = self.light(name)
            # A light the scene keeps switched off is sampled again once it shines.
            weight = light.sampling_weight or 1.0
            weight = weight if any(rgb) or all_dark else 0.0
            settings[light.node] = EmitterSetting(light.kind, rgb, weight)
        return self._parsed.instantiate(settings, self.view)

    def emitted_image(self, light: Light) -> Floats:
        """The image that `light` emits, (h, w, 3) linear Rec.709, without its scale."""
        import mitsuba as mi

        path, raw = self._parsed.image_file(light.node, light.kind.parameter)
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
    if path.is_dir():
        raise SceneError(f"{path} is a folder, not a scene XML")
    if not path.is_file():
        raise SceneError(f"no such scene file: {path}")
    if path.suffix.lower() in (".exr", ".json", ".png"):
        raise SceneError(f"{path} is not a scene: this command takes a Mitsuba XML first")
    values = {key: str(value) for key, value in (parameters or {}).items()}
    parsed = ParsedScene(path, values, backend.variant)
    index = _sensor_index(sensor, parsed.sensor_names, path)

    loaded = parsed.instantiate({})
    lights = _find_lights(parsed, loaded)
    camera = _camera(loaded, parsed.sensor_names[index])
    view = View.of(camera, index)
    spp = int(camera.sampler().sample_count())
    has_null = _has_null_surfaces(loaded)
    del loaded, camera
    gc.collect()
    if min(view.crop_size) < 1:
        raise SceneError(
            f"{path} has a film of {view.crop_size[0]}x{view.crop_size[1]} pixels: "
            "there is nothing to render"
        )
    if not lights:
        raise SceneError(f"{path} has no lights: add at least one emitter")

    return Scene(
        path=path,
        parameters=values,
        view=view,
        sensor_names=parsed.sensor_names,
        spp=spp,
        integrator=parsed.integrator(),
        has_media=parsed.has_media(),
        has_null=has_null,
        lights=lights,
        files=parsed.files,
        identity=parsed.identity(index),
        _parsed=parsed,
    )


def _camera(loaded: Any, name: str) -> Any:
    return next(sensor for sensor in loaded.sensors() if sensor.id() == name)


def _has_null_surfaces(loaded: Any) -> bool:
    import mitsuba as mi

    bsdfs = (shape.bsdf() for shape in loaded.shapes())
    return any(b is not None and mi.has_flag(b.flags(), mi.BSDFFlags.Null) for b in bsdfs)


def _find_lights(parsed: ParsedScene, loaded: Any) -> tuple[Light, ...]:
    """The lights that take part in the scene, in document order."""
    node_of = {name: node for node, name in parsed.names.items()}
    found = []
    for emitter in loaded.emitters():
        name = emitter.id()
        if name not in node_of:
            raise SceneError(f"emitter {name!r} does not stand in {parsed.path} as itself")
        node = parsed.state.nodes[node_of[name]]
        plugin = node.props.plugin_name()
        kind = emission_kind(emitter, plugin, name)
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
