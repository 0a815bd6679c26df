"""Marks that know the room: where light from a place would fall, as a painter constructs it.

A `Room` holds what each pixel sees (`clean.Surfaces`). Its marks go where a brush goes:

    canvas.light(room.beam(at, towards, cutoff=40), color=(0.6, 0.4, 0.2), on=room.surfaces.albedo)

A mark is a cone, a distance and the tilt of a surface: no shadow but the sun's, nothing reflected,
nothing rendered. Positions are metres, y up.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from brush import Mark
from clean import Floats, Surfaces

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Painted:
    """A mark whose coverage, (h, w) in [0, 1], is known already."""

    amount: Floats

    def coverage(self, height: int, width: int) -> Floats:
        """Returns (height, width)."""
        if self.amount.shape != (height, width):
            raise ValueError(f"a mark of {self.amount.shape} on a canvas of {(height, width)}")
        return self.amount

    def __and__(self, other: Mark) -> Painted:
        """Where both are, as with masking tape."""
        return Painted(self.amount * other.coverage(*self.amount.shape))

    def __invert__(self) -> Painted:
        """Everywhere else."""
        return Painted(1 - self.amount)


@dataclass(frozen=True)
class Room:
    """Marks over the surfaces of one picture."""

    surfaces: Surfaces

    def beam(self, at: Vector, towards: Vector, *, cutoff: float, full: float = 0.0) -> Painted:
        """A spot: 1 where it points, on a surface that faces it; full and cutoff in degrees."""
        away, distance = self._from(at)
        axis = np.subtract(towards, at)
        reach = float(np.linalg.norm(axis))
        angle = np.degrees(np.arccos(np.clip(away @ (axis / reach), -1, 1)))
        cone = _ease((cutoff - angle) / max(cutoff - full, 1e-3))
        near = np.minimum((reach / np.maximum(distance, 1e-3)) ** 2, 4.0)
        return Painted(np.clip(cone * near * self._facing(away), 0, 1).astype(np.float32))

    def glow(self, at: Vector, reach: float, *, wrap: float = 0.4) -> Painted:
        """A soft lamp: half as bright at `reach`; `wrap` goes round to what faces away."""
        away, distance = self._from(at)
        fall = 1 / (1 + (distance / reach) ** 2)
        lit = wrap + (1 - wrap) * self._facing(away)
        return Painted((fall * lit).astype(np.float32))

    def facing(self, direction: Vector) -> Painted:
        """Surfaces that face a direction, as an overcast sky sees them."""
        unit = np.asarray(direction) / np.linalg.norm(direction)
        return Painted(np.clip(0.5 + 0.5 * self.surfaces.normal @ unit, 0, 1).astype(np.float32))

    def within(self, low: Vector, high: Vector, *, soft: float = 0.02) -> Painted:
        """A box in space, with edges `soft` metres wide."""
        inside = np.minimum(self.surfaces.position - low, np.asarray(high) - self.surfaces.position)
        return Painted(_ease(0.5 + inside.min(axis=-1) / soft))

    def sunlight(
        self,
        direction: Vector,
        window: tuple[Vector, Vector],
        *,
        panes: tuple[int, int] = (1, 1),
        blocks: Sequence[tuple[Vector, Vector]] = (),
    ) -> Painted:
        """The sun through a window whose thin side is x, glazed at its high x in (y, z) panes.

        `blocks`, boxes, throw shadows.
        """
        unit = np.asarray(direction) / np.linalg.norm(direction)
        lit = np.clip(-self.surfaces.normal @ unit, 0, 1)
        low, high = (np.asarray(corner) for corner in window)
        for x, cells in ((low[0], (1, 1)), (high[0], panes)):
            # Back along the ray to the plane, and how far from a frame or a bar that is.
            way = (self.surfaces.position[..., 0] - x) / unit[0]
            there = (self.surfaces.position - way[..., None] * unit)[..., 1:]
            size = (high - low)[1:] / cells
            cell = (there - low[1:]) / size
            inside = (0.5 - np.abs(cell % 1 - 0.5)) * size - 0.02
            inside = np.where((cell > 0) & (cell < cells), inside, -1.0).min(axis=-1)
            soft = 0.02 + 0.012 * np.abs(way)
            beyond = self.surfaces.position[..., 0] > x
            lit = lit * np.where(beyond, 1.0, _ease(0.5 + inside / soft))
        for block in blocks:
            lit = lit * ~self._behind(unit, *block)
        return Painted(lit.astype(np.float32))

    def _behind(self, unit: Floats, low: Vector, high: Vector) -> NDArrayBool:
        """Whether the ray back to the sun from 2 cm off the surface meets a box."""
        start = self.surfaces.position + 0.02 * self.surfaces.normal
        inverse = -1 / np.where(np.abs(unit) < 1e-9, 1e-9, unit)
        one, two = (np.asarray(low) - start) * inverse, (np.asarray(high) - start) * inverse
        enter, leave = np.minimum(one, two).max(axis=-1), np.maximum(one, two).min(axis=-1)
        hit: NDArrayBool = (leave > np.maximum(enter, 0)) & (enter > -1e-3)
        return hit

    def _from(self, at: Vector) -> tuple[Floats, Floats]:
        """The unit direction from a place to every pixel's surface, and the distance."""
        path = self.surfaces.position - np.asarray(at, np.float32)
        distance = np.linalg.norm(path, axis=-1)
        return path / np.maximum(distance, 1e-6)[..., None], distance

    def _facing(self, away: Floats) -> Floats:
        """How far a surface faces the light that comes along `away`."""
        facing: Floats = np.clip(-(self.surfaces.normal * away).sum(axis=-1), 0, 1)
        return facing


NDArrayBool = np.ndarray[tuple[int, ...], np.dtype[np.bool_]]


def _ease(value: Floats) -> Floats:
    """0 below 0, 1 above 1, a cubic S between."""
    t = np.clip(value, 0, 1)
    eased: Floats = (t * t * (3 - 2 * t)).astype(np.float32)
    return eased
