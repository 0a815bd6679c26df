"""An answer for other programs: its lights, and what a format needs of it and makes.

Image lights among them are maps: of skies all around, walls and slides.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lightpaint.arrays import RGB, Floats, Position, as_position
from lightpaint.basis import LightGroups, joined_texels
from lightpaint.colour import photometry
from lightpaint.errors import LightpaintError
from lightpaint.lighting import Lighting
from lightpaint.luminaires import FULL
from lightpaint.progress import Listener
from lightpaint.relit.emission_xml import safe_name
from lightpaint.relit.export.nuke import NukeLight, RigKind
from lightpaint.relit.export.program_axes import SkyMap, lat_long, map_axes, map_size_for
from lightpaint.relit.relit_files import enlarged, images_of_texels, settings_of
from lightpaint.relit.relit_scene import scene_of
from lightpaint.scene import Emitter, Scaling, Scene
from lightpaint.scene.lights.texels import Sky, Slide, Wall
from lightpaint.sentences import Hint, Sentence

#: Kind of light for each plugin; area lights are panels if they are flat.
KINDS: dict[str, RigKind] = {
    "point": "point",
    "spot": "spot",
    "directional": "sun",
    "area": "panel",
}

#: Least columns of the image of a wall, whose texels other programs may sample more coarsely, and
#: least columns of a texel.
WALL_COLUMNS, TEXEL_COLUMNS = 512, 4

#: Shapes whose second texture coordinate Mitsuba turns round, unless they say otherwise.
FLIPPED_SHAPES = ("obj",)


def emitters_of(scene: Scene, lighting: Lighting) -> list[tuple[str, str, RGB]]:
    """Return name, Mitsuba's parameter and emission of every adjusted emitter but texels.

    The parameter is "" if the emission is a multiple of that in the scene, as for a sky. A
    projector of one colour has the intensity along its axis. Emissions include the emitter's gain.
    """
    regrouped_scene = scene_of(scene, lighting)
    return [
        (emitter.name, *_quantity(emitter, rgb))
        for emitter, rgb in settings_of(regrouped_scene, lighting.emission)
        if emitter.texel is None
    ]


def _quantity(emitter: Emitter, rgb: RGB) -> tuple[str, RGB]:
    kind = emitter.kind
    if kind is None or kind.scaling is not Scaling.COLOUR or kind.unit == FULL:
        return "", rgb
    if emitter.plugin != "projector":
        return kind.parameter, _times(emitter.gain, rgb)
    # Its irradiance is π times smaller than what a plane at distance 1 gets.
    return "intensity", _times(math.pi * emitter.gain, rgb)


def _times(factor: float, rgb: RGB) -> RGB:
    r, g, b = rgb
    return factor * r, factor * g, factor * b


def rig_lights(scene: Scene, lighting: Lighting) -> tuple[list[NukeLight], list[str]]:
    """Return points, spots, suns and panels as in `lighting`, and the names of other emitters.

    Lights that stay as they are belong to them; skies, meshes, projectors, and lights that are
    multiples of a picture are the others. Raises LightingError if the lighting is of another scene.
    """
    regrouped_scene = scene_of(scene, lighting)
    places = {place.name: place for place in lighting.places}
    rig, left = [], []
    for light in regrouped_scene.lights:
        is_known = light.is_fixed or not lighting[light.name].is_partly_reached
        for emitter in light.members:
            if not _has_point(emitter):
                left.append(emitter.name)
                continue
            assert emitter.kind is not None
            rgb = emitter.emission
            if not light.is_fixed:
                rgb = light.emission_of(emitter, lighting.emission[light.name])
            kelvin = photometry(rgb, unit=emitter.kind.unit).kelvin if is_known else None
            place = places.get(emitter.name)
            rig.append(
                NukeLight(
                    emitter.name,
                    KINDS[emitter.plugin],
                    _intensity(emitter, rgb),
                    emitter.site,
                    kelvin=kelvin,
                    is_moved=place is not None and place.moved_from is not None,
                    is_new=place is not None and bool(place.new),
                )
            )
    return rig, joined_texels(left)


def _has_point(emitter: Emitter) -> bool:
    """Return whether an emitter is of one colour, and shines from a point or in one direction."""
    is_plain = emitter.kind is not None and emitter.kind.scaling is Scaling.COLOUR
    if emitter.texel is not None or emitter.obstacle or not is_plain:
        return False
    if emitter.plugin == "area":
        return emitter.site.direction is not None and bool(emitter.unit_flux)
    return emitter.plugin in KINDS


def _intensity(emitter: Emitter, rgb: RGB) -> RGB:
    """Return the emission, of a panel its intensity along its axis: its radiance times its area."""
    if emitter.plugin != "area":
        return _times(emitter.gain, rgb)
    assert emitter.unit_flux is not None
    return _times(emitter.unit_flux / math.pi, rgb)


@dataclass(frozen=True)
class WallImage:
    """The image of a wall: name of the light, name of the file, and image (h, w, 3).

    The first row is that at the largest second texture coordinate (v) of the shape's own file, as
    other programs have it, or the top of a rectangle seen from its front.
    """

    name: str
    file: str
    image: Floats
    is_rectangle: bool


@dataclass(frozen=True)
class SlideImage:
    """The slide of a projector: name of the light, name of the file, and image (h, w, 3), upright.

    position: of the projector. axes: the rows of its axes x, to the right of the image, y, upwards,
    and z, against the light. half_size: half the width and height of the slide at distance 1.
    """

    name: str
    file: str
    image: Floats
    position: Position
    axes: tuple[Position, ...]
    half_size: tuple[float, float]


def sky_maps_of(scene: Scene, lighting: Lighting) -> list[SkyMap]:
    """Return the maps of all skies whose texels are adjusted."""
    maps, from_map = [], map_axes(lighting.up).T
    for regrouped_scene, light, image in _images(scene, lighting):
        if light.texel is None or not isinstance(light.texel.domain, Sky):
            continue
        name, props = light.texel.image, regrouped_scene.parsed.state.nodes[light.node].props
        to_world = np.eye(3)
        if "to_world" in props:
            to_world = np.array(props["to_world"].matrix, float).reshape(4, 4)[:3, :3]
        to_light = np.linalg.inv(to_world) @ from_map
        shown = lat_long(image, to_light, scene.map_size or map_size_for(image))
        maps.append(SkyMap(name, f"{safe_name(name)}.latlong.exr", shown))
    return maps


def wall_images_of(scene: Scene, lighting: Lighting) -> list[WallImage]:
    """Return the images of all walls whose texels are adjusted."""
    images = []
    for regrouped_scene, light, image in _images(scene, lighting):
        if light.texel is None or not isinstance(light.texel.domain, Wall):
            continue
        domain, (columns, rows) = light.texel.domain, light.texel.layout.size
        width = max(WALL_COLUMNS, TEXEL_COLUMNS * columns)
        size = scene.map_size or domain.picture_size((columns, rows), width)
        shown = domain.as_stored(enlarged(image, light, size))
        if not _has_flipped_coordinates(regrouped_scene, light):
            shown = shown[::-1]
        name = light.texel.image
        is_rectangle = regrouped_scene.parsed.shape_plugin(light.node) == "rectangle"
        images.append(WallImage(name, f"{safe_name(name)}.image.exr", shown, is_rectangle))
    return images


def slide_images_of(scene: Scene, lighting: Lighting) -> list[SlideImage]:
    """Return the slides of all projectors whose texels are adjusted."""
    images = []
    for regrouped_scene, light, image in _images(scene, lighting):
        if light.texel is None or not isinstance(light.texel.domain, Slide):
            continue
        name, size = light.texel.image, light.texel.layout.size
        width = max(WALL_COLUMNS, TEXEL_COLUMNS * size[0])
        shown_size = scene.map_size or light.texel.domain.picture_size(size, width)
        shown = enlarged(image, light, shown_size)
        props: Any = regrouped_scene.parsed.state.nodes[light.node].props
        to_world = np.eye(4)
        if "to_world" in props:
            to_world = np.array(props["to_world"].matrix, float).reshape(4, 4)
        # A projector of Mitsuba has its x axis to the left, and shines along z.
        axes = to_world[:3, :3].T * np.array([[-1.0], [1.0], [-1.0]])
        axes = axes / np.linalg.norm(axes, axis=1, keepdims=True)
        columns, rows = scene.map_size or size
        images.append(
            SlideImage(
                name,
                f"{safe_name(name)}.slide.exr",
                shown,
                as_position(to_world[:3, 3]),
                tuple(as_position(axis) for axis in axes),
                half_slide(props, columns / rows),
            )
        )
    return images


def half_slide(props: Any, aspect: float) -> tuple[float, float]:
    """Return half the width and height of a projector's slide at distance 1.

    props: of the projector, in which its field of view is as in Mitsuba's cameras. aspect: width
    over height of the slide.
    """
    if "fov" in props:
        half, axis = np.tan(np.radians(float(props["fov"])) / 2), str(props.get("fov_axis", "x"))
    else:
        length = float(str(props.get("focal_length", "50mm")).removesuffix("mm"))
        half, axis = np.hypot(36, 24) / (2 * length), "diagonal"
    if axis in ("smaller", "larger"):
        axis = "x" if (aspect < 1) == (axis == "smaller") else "y"
    width = {"x": half, "y": half * aspect, "diagonal": half / np.hypot(1, 1 / aspect)}[axis]
    return float(width), float(width / aspect)


def _images(scene: Scene, lighting: Lighting) -> Iterator[tuple[Scene, Emitter, Floats]]:
    """Yield the scene with the groups of the lighting, one texel, and the image of each image light
    with adjusted texels.
    """
    regrouped_scene = scene_of(scene, lighting)
    settings = dict(settings_of(regrouped_scene, lighting.emission))
    for texels, image in images_of_texels(regrouped_scene, settings):
        yield regrouped_scene, texels[0], image


def _has_flipped_coordinates(scene: Scene, light: Emitter) -> bool:
    """Return whether Mitsuba turns the second texture coordinate of a wall's shape round."""
    props: Any = scene.parsed.state.nodes[scene.parsed.shape_of[light.node]].props
    if "flip_tex_coords" in props:
        return bool(props["flip_tex_coords"])
    return str(props.plugin_name()) in FLIPPED_SHAPES


#: The map of an image light.
AnyMap = SkyMap | WallImage | SlideImage

#: A function that makes the text of a file, or its bytes.
Writer = Callable[[], str | bytes]


@dataclass(frozen=True)
class Source:
    """The source of a lighting: a scene, light groups, or neither.

    stage: USD stage with lights named as in the scene. rig: show whose fixtures the lights are.
    """

    scene: Scene | None = None
    light_groups: LightGroups | None = None
    stage: Path | None = None
    rig: Path | None = None

    @property
    def files(self) -> list[Path]:
        """The files from which the source was read."""
        files = [x for x in (self.stage, self.rig) if x is not None]
        if self.scene is not None:
            files += self.scene.read_files
        return files + (self.light_groups.files if self.light_groups is not None else [])


@dataclass(frozen=True)
class ExportContext:
    """The answer that is exported, its source, and where its files go.

    folder: folder of the files. listen: receives remarks on what a format leaves out. maps: of
    image lights, which are files beside these.
    """

    lighting: Lighting
    source: Source
    folder: Path
    listen: Listener
    maps: Sequence[AnyMap] = ()


class ExportFormat(ABC):
    """A format.

    Attributes:
        name: Its name in commands and manifests.
        file: Name of its file for a scene.
        file_of_groups: The same for light groups; None if it has nothing for these.
        needs_source: Whether it needs the scene or the light groups of the lighting.
        needs_rig: Whether it needs the show whose fixtures the lights are.
        refers_to_maps: Whether its file refers to maps of image lights.
        keeps_lighting: Whether it gets the lighting as it is; in others, lights whose colours the
            painting does not tell keep the colours of the scene.
    """

    name: str
    file: str
    file_of_groups: str | None = None
    needs_source: bool = True
    needs_rig: bool = False
    refers_to_maps: bool = False
    keeps_lighting: bool = False

    @abstractmethod
    def of_scene(self, export: ExportContext) -> Writer:
        """Return the writer for the lights of a scene."""

    def of_groups(self, export: ExportContext) -> Writer:
        """Return the writer for the multipliers of light groups."""
        raise NotImplementedError(self.name)

    def name_for(self, source: Source) -> str:
        """Return the name of the file. Raises LightpaintError for a source that is not enough."""
        if source.light_groups is not None:
            if self.file_of_groups is None:
                raise LightpaintError(
                    f"{self.name} needs a scene: give it with ",
                    Hint("scene"),
                    ", and leave ",
                    Hint("light_groups"),
                    " out",
                )
        elif source.scene is None and self.needs_source:
            raise LightpaintError(self.needed_source)
        return self.file if source.light_groups is None else str(self.file_of_groups)

    @property
    def needed_source(self) -> Sentence:
        """The text of the error for a missing source."""
        return Sentence(f"{self.name} needs the scene: give it with ", Hint("scene"))
