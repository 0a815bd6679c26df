"""The panel itself in a picture: the share of each pixel that its front fills.

Paths meet a panel on their way from the camera, too. Its outline is a sharp edge, often brighter
than all else, so the share of each cell that it covers is computed, and not sampled: otherwise the
noise of edges would outweigh all that the panel lights.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from lightpaint.arrays import Doubles, Floats, Indices, aligned
from lightpaint.scene.runtime.render_lock import tracing

#: Half of a cell, in cells: sight lines go through its middle and the middle of two of its edges.
_HALF = 0.5


@dataclass(frozen=True)
class SightLines:
    """Lines of sight through cells of a picture, up to what the camera sees there.

    origins, directions: (3, r, 3), through the middle of each cell, and of its edges to the right
    and below. lengths: (r,), up to the next surface. pixels: (r,). cells: of each pixel.
    """

    origins: Floats
    directions: Floats
    lengths: Floats
    pixels: Indices
    cells: int

    @classmethod
    def of(cls, loaded: Any, camera: Any, size: tuple[int, int], side: int) -> "SightLines":
        """Return the lines through side x side cells of each pixel."""
        import mitsuba as mi

        height, width = size
        pixels = np.repeat(np.arange(height * width), side**2)
        cell = np.tile(np.arange(side**2), height * width)
        x = (pixels % width + (cell % side + 0.5) / side) / width
        y = (pixels // width + (cell // side + 0.5) / side) / height
        origins, directions = list[Floats](), list[Floats]()
        lengths = np.zeros(0, np.float32)
        with tracing():
            for right, below in ((0, 0), (_HALF, 0), (0, _HALF)):
                shifted = x + right / (side * width), y + below / (side * height)
                position = mi.Point2f(*(mi.Float(aligned(its, np.float32)) for its in shifted))
                rays, _ = camera.sample_ray(
                    camera.shutter_open(), 0.5, position, mi.Point2f(0.5, 0.5)
                )
                if not origins:
                    hits = loaded.ray_intersect_preliminary(mi.Ray3f(rays))
                    lengths = np.broadcast_to(np.array(hits.t, np.float32), x.shape)
                for listed, its in ((origins, rays.o), (directions, rays.d)):
                    rows = np.array(its, np.float32).reshape(3, -1).T
                    listed.append(np.broadcast_to(rows, (len(x), 3)))
        return cls(np.stack(origins), np.stack(directions), lengths, pixels, side**2)

    def near(self, place: Sequence[float], radius: float) -> "SightLines":
        """Return the lines that pass within `radius` of a place, before any surface."""
        between = np.asarray(place, np.float32) - self.origins[0]
        along = np.einsum("rk,rk->r", between, self.directions[0])
        off = np.einsum("rk,rk->r", between, between) - along**2
        wide = radius + along * self._widths
        is_near = (along > -radius) & (off < wide**2) & (along - radius < self.lengths)
        return self._at(np.flatnonzero(is_near))

    def some(self, count: int) -> "SightLines":
        """Return at most `count` of the lines, evenly."""
        step = math.ceil(len(self.pixels) / count)
        return self if step < 2 else self._at(np.arange(step // 2, len(self.pixels), step))

    def _at(self, indices: Indices) -> "SightLines":
        return SightLines(
            self.origins[:, indices],
            self.directions[:, indices],
            self.lengths[indices],
            self.pixels[indices],
            self.cells,
        )

    @cached_property
    def _widths(self) -> Floats:
        """Widths of cells at a distance of 1, (r,)."""
        half = np.linalg.norm(self.directions[1] - self.directions[0], axis=1)
        return np.asarray(2 * half)

    def covered(
        self, place: Sequence[float], directions: Floats | Doubles, half_sides: Floats
    ) -> Floats:
        """Return the share of its pixel that a panel fills in each cell, (k, r), for directions.

        half_sides: of the panel in each direction, (k, 2, 3).
        """
        axes = np.asarray(directions, np.float32)
        if not len(self.pixels) or not len(axes):
            return np.zeros((len(axes), len(self.pixels)), np.float32)
        between = np.asarray(place, np.float32) - self.origins
        facing = np.moveaxis(self.directions @ axes.T, -1, 1)
        is_seen = (facing < -1e-6).all(axis=0)
        facing[facing > -1e-6] = -1
        length = np.moveaxis(between @ axes.T, -1, 1) / facing
        is_seen &= (length > 0).all(axis=0) & (length[0] < self.lengths)
        filled = is_seen / np.float32(self.cells)
        rulers = half_sides / np.square(half_sides).sum(axis=2, keepdims=True)
        for sideways in np.moveaxis(rulers, 1, 0):
            # A coordinate on the panel, which goes from -1 to 1, and how wide a cell is there.
            at = length * np.moveaxis(self.directions @ sideways.T, -1, 1)
            at -= np.moveaxis(between @ sideways.T, -1, 1)
            half = np.abs(at[1] - at[0]) + np.abs(at[2] - at[0]) + np.float32(1e-9)
            inside = np.minimum(at[0] + half, 1) - np.maximum(at[0] - half, -1)
            filled *= np.clip(inside / (2 * half), 0, 1)
        return np.asarray(filled)
