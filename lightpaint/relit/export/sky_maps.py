"""Skies in texels as maps of latitude and longitude, which other programs shine with.

Mitsuba's environment maps have pixels at the poles; those of other programs have their outermost
rows half a pixel away, which matters for a map of eight rows. So the exported map is a finer one
for the convention of OpenEXR: the top row is next to +y, the middle of the map looks along +z, and
its left half has +x. The scene's up axis is +y in it, and a `to_world` is in the pixels.
"""

from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import Doubles, Floats, Position
from lightpaint.scene.lights.texels.image_domains import GridSize, Sky
from lightpaint.scene.properties.site import rotation_between

#: Columns and rows of a map, unless the scene is loaded with others.
MAP_SIZE = (512, 256)

#: The up axis of a map.
UP = (0.0, 1.0, 0.0)

#: Rotation from a map's axes to those by which Blender looks up an environment texture: its middle
#: is +x, its left half +y, and its top +z.
_TO_BLENDER = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


@dataclass(frozen=True)
class SkyMap:
    """The map of a sky: name of the light, name of the file, and image (h, w, 3)."""

    name: str
    file: str
    image: Floats


def map_axes(up: Position) -> Doubles:
    """Return the rotation from the scene's axes to a map's, (3, 3). up: the scene's up axis."""
    return rotation_between(up, UP)


def blender_axes(up: Position) -> Doubles:
    """Return the rotation from the scene's axes to those of Blender's environment textures."""
    return np.asarray(_TO_BLENDER @ map_axes(up))


def map_size_for(image: Floats) -> GridSize:
    """Return columns and rows of the map of an image: MAP_SIZE, or its first multiple in which a
    texel is at least four pixels wide.
    """
    columns, rows = MAP_SIZE
    factor = max(1, -(-4 * image.shape[1] // columns))
    return factor * columns, factor * rows


def lat_long(texels: Floats, to_light: Doubles, size: GridSize) -> Floats:
    """Return the map of a sky, (rows, columns, 3) of `size`, as Mitsuba interpolates its texels.

    texels: (rows, columns, 3). to_light: (3, 3), from the map's axes to the light's own.
    """
    columns, rows = size
    longitude = np.pi - 2 * np.pi * (np.arange(columns) + 0.5) / columns
    latitude = np.pi / 2 - np.pi * (np.arange(rows)[:, None] + 0.5) / rows
    x, z = np.sin(longitude) * np.cos(latitude), np.cos(longitude) * np.cos(latitude)
    directions = np.stack([x, np.broadcast_to(np.sin(latitude), x.shape), z], axis=-1)
    return Sky().seen(texels, directions @ to_light.T).astype(np.float32)
