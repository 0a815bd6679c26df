"""Places of moved and new lights, and maps of skies, in the axes of other programs.

Lights shine along -z there. Mitsuba's environment maps have pixels at the poles; the maps of other
programs have their outermost rows half a pixel away, which matters for a map of eight rows. So the
exported map, of latitude and longitude, is a finer one for the convention of OpenEXR: the top row
is next to +y, the middle of the map looks along +z, and its left half has +x. The scene's up axis
is +y in it, and a `to_world` is in the pixels.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lightpaint.arrays import Doubles, Floats, Position
from lightpaint.scene.lights.texels import GridSize, Sky
from lightpaint.scene.properties.site import EmitterPlace, across, rotation_between

#: Distance up to which positions count as equal, relative to the largest coordinate of a light.
SAME_PLACE = 1e-3

_Y, _Z = (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)

#: Columns and rows of a map, unless the scene is loaded with others.
MAP_SIZE = (512, 256)

#: The up axis of a map.
MAP_UP = (0.0, 1.0, 0.0)

#: Rotation from a map's axes to those by which Blender looks up an environment texture: its middle
#: is +x, its left half +y, and its top +z.
_TO_BLENDER = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


def old_position(place: EmitterPlace) -> Position | None:
    """Return the position of a light in the scene's file; None for new lights, and at infinity."""
    if place.new:
        return None
    return place.position if place.moved_from is None else place.moved_from.position


def is_changed(place: EmitterPlace) -> bool:
    """Return whether a light is new, or differs in place from the scene's file."""
    return bool(place.new) or place.moved_from is not None


def has_new_cone(place: EmitterPlace) -> bool:
    """Return whether the cone of a spot differs from that in the scene's file."""
    if place.cutoff is None or place.moved_from is None:
        return bool(place.new) and place.cutoff is not None
    old_place = place.moved_from
    return (old_place.cutoff, old_place.beam) != (place.cutoff, place.beam)


def axis_conversions(up: Position, program_up: Position) -> list[Doubles]:
    """Return candidate rotations from the scene's axes to a program's, (3, 3) each, likeliest
    first.

    A camera that looks straight down, or is upside down, suggests a wrong up axis. So the rotation
    from `up` to `program_up` is followed by the identity, y up to z up, and z up to y up.
    """
    return [
        rotation_between(up, program_up),
        np.eye(3),
        rotation_between(_Y, _Z),
        rotation_between(_Z, _Y),
    ]


@dataclass(frozen=True)
class Conversion:
    """The conversion of a scene's positions to a program's.

    rotation: (3, 3), from the scene's axes to the program's. size: the largest coordinate of a
    light in the scene. is_known: False if none of the lights that both have is at the same
    position.
    """

    rotation: Doubles
    size: float
    is_known: bool = True

    def point(self, position: Position) -> Doubles:
        """Return a point of the scene in the program's axes."""
        return np.asarray(self.rotation @ np.array(position))

    def is_at(self, position: Position, point: Doubles) -> bool:
        """Return whether `point` in the program equals `position` in the scene, up to rounding."""
        distance = np.linalg.norm(self.point(position) - point)
        return bool(distance <= SAME_PLACE * self.size)

    def frame(self, place: EmitterPlace, old_axes: Doubles | None = None) -> Doubles:
        """Return the axes x, y and z of a light in the program, as rows of (3, 3).

        old_axes: its current axes there, whose lengths and roll are kept; None for a new light.
        """
        if place.direction is None:
            return np.eye(3) if old_axes is None else old_axes
        way = self.rotation @ np.array(place.direction)
        if old_axes is not None and old_axes[2].any():
            return np.asarray(old_axes @ rotation_between((-old_axes[2]).tolist(), way).T)
        # As in the element of a new panel, whose height is along the first perpendicular vector.
        up = self.rotation @ across(place.direction)[0]
        return np.stack([np.cross(up, -way), up, -way])


def conversion_of(
    places: Sequence[EmitterPlace], rotations: Sequence[Doubles], current: Mapping[str, Doubles]
) -> Conversion:
    """Return the conversion with the rotation that matches most lights; of equals the first.

    current: positions of the lights in the program, by name.
    """
    places_known = [
        x for place in places for x in (old_position(place), place.position) if x is not None
    ]
    size = float(np.abs(places_known).max(initial=0.0))
    pairs = [
        (old_place, current[place.name])
        for place in places
        if place.name in current and (old_place := old_position(place)) is not None
    ]
    conversions = [Conversion(rotation, size) for rotation in rotations]
    counts = [sum(way.is_at(a, b) for a, b in pairs) for way in conversions]
    best_index = int(np.argmax(counts))
    return replace(conversions[best_index], is_known=not pairs or counts[best_index] > 0)


@dataclass(frozen=True)
class SkyMap:
    """The map of a sky: name of the light, name of the file, and image (h, w, 3)."""

    name: str
    file: str
    image: Floats


def map_axes(up: Position) -> Doubles:
    """Return the rotation from the scene's axes to a map's, (3, 3). up: the scene's up axis."""
    return rotation_between(up, MAP_UP)


def blender_axes(up: Position) -> Doubles:
    """Return the rotation from the scene's axes to the axes of Blender's environment textures."""
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
