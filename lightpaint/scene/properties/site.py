"""Positions, directions and cones of emitters as plain values, and rotations of directions."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from lightpaint.arrays import Doubles, Floats, Position

#: Kinds of lights that can be added to a scene.
NewKind = Literal["point", "spot", "panel"]


@dataclass(frozen=True)
class Site:
    """Position, direction and cone of an emitter in a loaded scene.

    position: None for a light at infinity. direction: unit vector that it points along; None if it
    has no direction. cutoff, beam: degrees from its axis; None except for spots.
    """

    position: Position | None = None
    direction: Position | None = None
    cutoff: float | None = None
    beam: float | None = None

    @property
    def target(self) -> Position | None:
        """A point on its axis, one unit away; for a light at infinity, one unit from the origin."""
        if self.direction is None:
            return None
        (x, y, z), (i, j, k) = self.position or (0.0, 0.0, 0.0), self.direction
        return x + i, y + j, z + k

    @property
    def without_shape(self) -> "Site":
        """The site alone, without what a kind of light adds to it."""
        return Site(self.position, self.direction, self.cutoff, self.beam)

    def is_near(self, other: "Site") -> bool:
        """Return whether two sites differ only by the rounding in a file."""
        pairs = zip(self._numbers, other._numbers, strict=False)
        has_same_length = len(self._numbers) == len(other._numbers)
        return has_same_length and all(
            math.isclose(a, b, rel_tol=1e-5, abs_tol=1e-5) for a, b in pairs
        )

    @property
    def _numbers(self) -> tuple[float, ...]:
        cone = (x for x in (self.cutoff, self.beam) if x is not None)
        return (*(self.position or ()), *(self.direction or ()), *cone)


@dataclass(frozen=True)
class EmitterPlace:
    """Position, direction and cone of an emitter in an answer.

    position, direction, cutoff, beam: as in `Site`. moved_from: its site in the file of the scene,
    if that differs. new: its kind if it is not in any file of the scene, else "". size: width and
    height of a new panel.
    """

    name: str
    position: Position | None = None
    direction: Position | None = None
    cutoff: float | None = None
    beam: float | None = None
    moved_from: Site | None = None
    new: NewKind | Literal[""] = ""
    size: tuple[float, float] | None = None

    @property
    def site(self) -> Site:
        """Its site, without the other fields."""
        return Site(self.position, self.direction, self.cutoff, self.beam)

    @classmethod
    def of(cls, name: str, site: Site, moved_from: Site | None = None) -> "EmitterPlace":
        """Return the place of an emitter of the scene's file, moved or not."""
        numbers = (site.position, site.direction, site.cutoff, site.beam)
        return cls(name, *numbers, None if moved_from == site else moved_from)


def rotation_between(old: Sequence[float], new: Sequence[float] | Doubles) -> Doubles:
    """Return the smallest rotation, (3, 3), from direction `old` to direction `new`."""
    a, b = np.array(unit(old)), np.array(unit(new))
    cosine = float(a @ b)
    if cosine < -1 + 1e-12:
        # Half a turn about any perpendicular axis.
        axis = across(a)[0]
        return np.asarray(2 * np.outer(axis, axis) - np.eye(3))
    v = np.cross(a, b)
    cross = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return np.asarray(np.eye(3) + cross + cross @ cross / (1 + cosine))


def across(direction: Sequence[float] | Doubles) -> Doubles:
    """Return two unit vectors perpendicular to a direction and to each other, (2, 3)."""
    axis = np.array(unit(direction))
    normal = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    normal /= np.linalg.norm(normal)
    return np.stack([normal, np.cross(axis, normal)])


def unit(vector: Sequence[float] | Floats) -> Position:
    """Return `vector` normalised to length 1."""
    values = np.asarray(vector, dtype=float)
    x, y, z = (values / np.linalg.norm(values)).tolist()
    return x, y, z
