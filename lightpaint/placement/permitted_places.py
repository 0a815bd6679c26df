"""The places that a light may hang at: a ball, a box, rails, surfaces, or all free space.

A search needs three things: the nearest permitted place, the directions in which a light there can
slide, and random places.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from lightpaint.arrays import Doubles, Floats, Indices
from lightpaint.display_text import some_names
from lightpaint.errors import NoPlaceError, SceneError
from lightpaint.placement.free_space import CLEARANCE, FreeSpace
from lightpaint.scene import Scene

#: Number of random places, per requested place, from which distant ones are chosen.
OVERSAMPLING = 20

#: Number of random places that determine the free side of triangles.
TESTED = 2000


class Places(Protocol):
    """Permitted places."""

    def nearest(self, place: Doubles) -> Doubles:
        """Return the permitted place nearest to `place`, (3,)."""
        ...

    def tangents(self, place: Doubles) -> Doubles:
        """Return unit vectors that a light at a permitted place can slide along, (d, 3)."""
        ...

    def random(self, count: int, rng: np.random.Generator) -> Doubles:
        """Return random places, (k, 3)."""
        ...


@dataclass(frozen=True)
class OnePlace:
    """The place of a light that does not slide."""

    place: Doubles

    def nearest(self, place: Doubles) -> Doubles:
        """Return that place."""
        return self.place

    def tangents(self, place: Doubles) -> Doubles:
        """Return no vectors."""
        return np.zeros((0, 3))

    def random(self, count: int, rng: np.random.Generator) -> Doubles:
        """Return that place alone."""
        return self.place[None]


@dataclass(frozen=True)
class BallOfPlaces:
    """All places within a distance of one."""

    middle: Doubles
    radius: float

    def nearest(self, place: Doubles) -> Doubles:
        """Return the place, or the one of the surface towards it."""
        away = place - self.middle
        length = float(np.linalg.norm(away))
        return np.asarray(self.middle + away * min(1, self.radius / max(length, 1e-300)))

    def tangents(self, place: Doubles) -> Doubles:
        """Return the three axes."""
        return np.eye(3)

    def random(self, count: int, rng: np.random.Generator) -> Doubles:
        """Return places inside, even in volume."""
        many = rng.uniform(-1, 1, (2 * count, 3))
        many = many[np.linalg.norm(many, axis=1) <= 1][:count]
        return np.asarray(self.middle + self.radius * many)


@dataclass(frozen=True)
class BoxOfPlaces:
    """All places in a box. chosen: those that `random` picks from, (k, 3); None for all of it."""

    low: Doubles
    high: Doubles
    chosen: Floats | None = None

    def nearest(self, place: Doubles) -> Doubles:
        """Return the place, moved into the box."""
        return np.clip(place, self.low, self.high)

    def tangents(self, place: Doubles) -> Doubles:
        """Return the three axes, without those along which the box is flat."""
        return np.eye(3)[self.high > self.low]

    def random(self, count: int, rng: np.random.Generator) -> Doubles:
        """Return places inside."""
        if self.chosen is None:
            return np.asarray(rng.uniform(self.low, self.high, (count, 3)))
        return np.asarray(self.chosen[rng.permutation(len(self.chosen))[:count]], np.float64)


@dataclass(frozen=True)
class Rails:
    """Places on line segments. ends: (r, 2, 3)."""

    ends: Doubles

    def nearest(self, place: Doubles) -> Doubles:
        """Return the nearest place on any of them."""
        return np.asarray(self._nearest(place)[1])

    def tangents(self, place: Doubles) -> Doubles:
        """Return the direction of the rail that the place is on, (1, 3)."""
        way = np.diff(self.ends[self._nearest(place)[0]], axis=0)
        return np.asarray(way / np.linalg.norm(way))

    def random(self, count: int, rng: np.random.Generator) -> Doubles:
        """Return places, even in length."""
        length = np.linalg.norm(self.ends[:, 1] - self.ends[:, 0], axis=1)
        rail = rng.choice(len(length), count, p=length / length.sum())
        share = rng.random((count, 1))
        return np.asarray(self.ends[rail, 0] * (1 - share) + self.ends[rail, 1] * share)

    def _nearest(self, place: Doubles) -> tuple[int, Doubles]:
        start, way = self.ends[:, 0], self.ends[:, 1] - self.ends[:, 0]
        share = ((place - start) * way).sum(axis=1) / np.square(way).sum(axis=1)
        feet = start + np.clip(share, 0, 1)[:, None] * way
        k = int(np.argmin(np.square(feet - place).sum(axis=1)))
        return k, feet[k]


@dataclass(frozen=True)
class Triangles:
    """Places on triangles. corners: (t, 3, 3)."""

    corners: Doubles

    def nearest(self, place: Doubles) -> Doubles:
        """Return the nearest place on any of them."""
        return np.asarray(self._nearest(place)[1])

    def tangents(self, place: Doubles) -> Doubles:
        """Return two directions in the triangle that the place is on, (2, 3)."""
        corners = self.corners[self._nearest(place)[0]]
        along = corners[1] - corners[0]
        along /= np.linalg.norm(along)
        other = np.cross(np.cross(along, corners[2] - corners[0]), along)
        return np.stack([along, other / np.linalg.norm(other)])

    def random(self, count: int, rng: np.random.Generator) -> Doubles:
        """Return places, even in area."""
        return self.scattered(count, rng)[1]

    def scattered(self, count: int, rng: np.random.Generator) -> tuple[Indices, Doubles]:
        """Return the triangles of random places, (k,), and these, (k, 3), even in area."""
        area = np.linalg.norm(self.normals, axis=1)
        triangle = rng.choice(len(area), count, p=area / area.sum())
        u, v = rng.random((2, count, 1))
        u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
        a, b, c = np.moveaxis(self.corners[triangle], 1, 0)
        return triangle, np.asarray(a + u * (b - a) + v * (c - a))

    @cached_property
    def normals(self) -> Doubles:
        """Normals as long as twice the areas, (t, 3)."""
        a, b, c = np.moveaxis(self.corners, 1, 0)
        return np.cross(b - a, c - a)

    def _nearest(self, place: Doubles) -> tuple[int, Doubles]:
        """Return the nearest triangle, and the nearest place on it.

        That is the foot of the perpendicular if it lies inside, else the nearest on an edge.
        """
        a, b, c = np.moveaxis(self.corners, 1, 0)
        normal = self.normals
        squares = np.maximum(np.square(normal).sum(axis=1, keepdims=True), 1e-300)
        foot = place - ((place - a) * normal).sum(axis=1, keepdims=True) / squares * normal
        is_inside = np.ones(len(a), dtype=bool)
        feet = [foot]
        for start, end in ((a, b), (b, c), (c, a)):
            edge = end - start
            is_inside &= (np.cross(edge, foot - start) * normal).sum(axis=1) >= 0
            length = np.maximum(np.square(edge).sum(axis=1, keepdims=True), 1e-300)
            share = ((place - start) * edge).sum(axis=1, keepdims=True) / length
            feet.append(start + np.clip(share, 0, 1) * edge)
        away = np.square(np.stack(feet) - place).sum(axis=2)
        away[0, ~is_inside] = np.inf
        kind, k = np.unravel_index(int(np.argmin(away)), away.shape)
        return int(k), feet[int(kind)][k]


@dataclass(frozen=True)
class EitherPlaces:
    """Places of several kinds: on rails, or on surfaces."""

    parts: Sequence[Places]

    def nearest(self, place: Doubles) -> Doubles:
        """Return the nearest place of any kind."""
        return self._part(place)[1]

    def tangents(self, place: Doubles) -> Doubles:
        """Return the tangents of the nearest kind of place."""
        return self._part(place)[0].tangents(place)

    def random(self, count: int, rng: np.random.Generator) -> Doubles:
        """Return as many places of each kind."""
        per_part = -(-count // len(self.parts))
        return np.concatenate([part.random(per_part, rng) for part in self.parts])

    def _part(self, place: Doubles) -> tuple[Places, Doubles]:
        nearest = [(part, part.nearest(place)) for part in self.parts]
        return min(
            nearest, key=lambda part_and_place: float(np.linalg.norm(part_and_place[1] - place))
        )


def places_on(
    scene: Scene,
    loaded: Any,
    surfaces: Sequence[str],
    space: FreeSpace,
    *,
    clear: float | None,
    seed: int,
) -> Triangles:
    """Return places at a distance in front of shapes, on the side that sees the picture.

    surfaces: their ids. clear: the distance; None for a small part of the room.

    Raises SceneError for shapes that do not exist or are not flat, and for those without free
    places.
    """
    corners = np.concatenate([_triangles(scene, loaded, name) for name in surfaces])
    distance = CLEARANCE * space.spread if clear is None else clear
    length = np.linalg.norm(Triangles(corners).normals, axis=1, keepdims=True)
    corners, length = corners[length[:, 0] > 0], length[length[:, 0] > 0]
    unit = Triangles(corners).normals / length
    rng = np.random.default_rng(seed)
    triangle, places = Triangles(corners).scattered(TESTED, rng)
    votes = np.zeros((2, len(corners)))
    for k, side in enumerate((1, -1)):
        off = places + side * distance * unit[triangle]
        np.add.at(votes[k], triangle, space.usable(loaded, off, 0.9 * distance))
    is_free = votes.max(axis=0) > 0
    if not is_free.any():
        listed = some_names(surfaces)
        raise NoPlaceError(
            f"no place {distance:.3g} from {listed} is free and sees anything of the picture"
        )
    front = np.where(votes[0] >= votes[1], 1, -1)[:, None]
    return Triangles((corners + (front * distance * unit)[:, None])[is_free])


def _triangles(scene: Scene, loaded: Any, name: str) -> Doubles:
    """Return the triangles of a shape, (t, 3, 3)."""
    import mitsuba as mi

    names = scene.shape_names
    if name not in names:
        raise SceneError(
            f"{scene.path} has no shape {name!r} to hang lights on: it has {some_names(names)}"
        )
    corners = []
    for shape_name, shape in zip(names, loaded.shapes(), strict=True):
        if shape_name != name:
            continue
        parameters = mi.traverse(shape)
        if "faces" in parameters:
            points = np.array(parameters["vertex_positions"], dtype=float).reshape(-1, 3)
            faces = np.array(parameters["faces"]).reshape(-1, 3)
            corners.append(points[faces])
        elif str(shape).startswith("Rectangle"):
            matrix = np.array(parameters["to_world"].matrix, dtype=float).reshape(4, 4)
            square = np.array([[-1, -1, 0, 1], [1, -1, 0, 1], [1, 1, 0, 1], [-1, 1, 0, 1]])
            points = (square @ matrix.T)[:, :3]
            corners.append(points[[[0, 1, 2], [0, 2, 3]]])
        else:
            raise SceneError(
                f"lights can hang on rectangles and meshes, and shape {name!r} is neither"
            )
    return np.concatenate(corners)
