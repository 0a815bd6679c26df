"""The maps of image lights for other programs: of skies all around, and of walls."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.relit.emission_xml import safe_name
from lightpaint.relit.export.sky_maps import SkyMap, lat_long, map_axes, map_size_for
from lightpaint.relit.relight import scene_of
from lightpaint.relit.relit_files import enlarged, images_of_texels, settings_of
from lightpaint.scene.lights.emitters import Emitter
from lightpaint.scene.lights.texels.flat_images import Wall
from lightpaint.scene.lights.texels.sky import Sky
from lightpaint.scene.scene import Scene

#: Least columns of the image of a wall, whose texels other programs may sample more coarsely, and
#: least columns of a texel.
WALL_COLUMNS, TEXEL_COLUMNS = 512, 4

#: Shapes whose second texture coordinate Mitsuba turns round, unless they say otherwise.
FLIPPED_SHAPES = ("obj",)


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
