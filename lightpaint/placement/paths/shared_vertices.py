"""Vertices of many paths that share the light of a few, one in each cell of the scene's surfaces.

Light from a lamp near a surface is bright on a small spot there, which few paths of a pixel meet by
chance: its indirect image would be noise. Many paths cost little to trace, but a shadow ray from
each of their vertices does, for every place of a light. Since irradiance changes little within a
cell, the vertices of all paths in a cell take the light of one of them, and only the throughput is
each one's own.
"""

import math
from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import Doubles, Floats, Indices, aligned
from lightpaint.placement.paths.camera_paths import Vertices
from lightpaint.placement.paths.panel_site import PanelSite

#: Share of vertices on either side whose distance does not count for the size of cells, and the
#: number of faces of the box of the others.
FAR_SHARE, FACES = 0.02, 6

#: Growth of cells, at least, while there are too many of them.
GROWTH = 1.05

#: Odd factors that spread cells over 64 bits.
_MIXERS = np.array(
    [0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9, 0x27D4EB2F165667C5], np.uint64
)


@dataclass(frozen=True)
class SharedVertices(Vertices):
    """Vertices, one of each cell, whose light those of all paths in the cell take.

    pixels: none of its own, 0 for each. paths: the vertices of all paths. cells: (p,), of each of
    these.
    """

    paths: Vertices
    cells: Indices

    @classmethod
    def of(cls, paths: Vertices, most: int, rng: np.random.Generator) -> "SharedVertices":
        """Return at most `most` of the vertices of paths, which stand for all of them."""
        import drjit as dr
        import mitsuba as mi

        throughput = np.array(paths.throughput, dtype=np.float32).reshape(3, -1)
        cells = _cells(paths, most, rng)
        chosen = _one_of_each(cells, throughput.max(axis=0), rng)
        index = mi.UInt32(aligned(chosen, np.uint32))
        interaction = dr.gather(mi.SurfaceInteraction3f, paths.interaction, index)
        ones = mi.Color3f(1.0) + dr.zeros(mi.Color3f, len(chosen))
        dr.make_opaque(interaction, ones)
        # Only the throughput of the others counts from here on.
        others = Vertices(None, throughput, paths.pixels, segments=paths.segments)
        return cls(interaction, ones, np.zeros(len(chosen), np.int64), others, cells)

    def pixel_sums(self, light: Floats, count: int, blocked: Indices | None = None) -> Floats:
        """Return the sums of the light of all paths of each pixel, (3, h · w).

        light: (3, v). blocked: indices of the vertices of paths that do not count.
        """
        of_paths = np.take(light, self.cells, axis=1)
        of_paths *= self.paths.throughput
        return self.paths.pixel_sums(of_paths, count, blocked)

    def blocked(self, site: PanelSite) -> Indices | None:
        """Return the indices of vertices of paths that a panel cuts off."""
        return self.paths.blocked(site)


def _cells(vertices: Vertices, most: int, rng: np.random.Generator) -> Indices:
    """Return the number of each vertex's cell, (v,), of at most `most`.

    Cells are of one side of surfaces that look in similar directions.
    """
    points = vertices.points.astype(float)
    normals = np.array(vertices.interaction.n, dtype=np.float32).reshape(3, -1).T
    is_front = np.array(vertices.interaction.wi.z, dtype=np.float32) > 0
    facing = (np.rint(2 * normals).astype(np.int64) + 2) @ np.array([50, 10, 2]) + is_front
    start = rng.random(3)
    side = _first_side(points, most)
    while True:
        place = np.floor(points / side + start).astype(np.int64)
        key = np.concatenate([place, facing[:, None]], axis=1).astype(np.uint64) * _MIXERS
        _, cells = np.unique(key.sum(axis=1, dtype=np.uint64), return_inverse=True)
        count = int(cells.max(initial=-1)) + 1
        if count <= most:
            return np.asarray(cells, dtype=np.int64)
        side *= max(GROWTH, math.sqrt(count / most))


def _first_side(points: Doubles, most: int) -> float:
    """Return the side of cells of which a box around most of the points has about `most`."""
    low, high = np.quantile(points, (FAR_SHARE, 1 - FAR_SHARE), axis=0)
    _, *longest = np.sort(high - low)
    return max(math.sqrt(FACES * float(np.prod(longest)) / most), 1e-6)


def _one_of_each(cells: Indices, odds: Floats, rng: np.random.Generator) -> Indices:
    """Return a random member of each cell, (cells,). odds: of each member, (v,)."""
    arrival = rng.exponential(size=len(odds)) / np.maximum(odds, 1e-30)
    last_first = np.argsort(-arrival, kind="stable")
    chosen = np.zeros(int(cells.max(initial=-1)) + 1, np.int64)
    chosen[cells[last_first]] = last_first
    return chosen
