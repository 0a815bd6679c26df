"""Quick planes: an estimate of a light's plane at any place in a tenth of a second, for dragging.

Direct light has edges, and is computed by one frozen path per pixel. Indirect light is smooth, and
is computed on a small film, averaged along surfaces. Each pixel interpolates it from the four cells
around it, weighted by the similarity of their surfaces to its own.
"""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from itertools import product
from math import isqrt, prod
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Floats, aligned
from lightpaint.images import DARKEST, Features, SurfaceFilter
from lightpaint.placement import FrozenPaths, PathSums
from lightpaint.scene import Scene, reduction_to
from lightpaint.scene.properties.site import Site
from lightpaint.scene.runtime.render_lock import tracing

#: Approximate number of first hits in the picture, and the largest number per pixel.
FIRST_HITS, MOST_PER_PIXEL = 2**19, 16

#: Approximate number of cells in the film of indirect light, and paths of the whole film.
CELLS, PATHS = 2**13, 2**15

#: Distance from a cell's tangent plane, relative to the spacing of cells, at which its weight is
#: 1/e; and the strength of the dependence on its normal.
NEAR_PLANE, NORMAL_POWER = 0.5, 16.0

#: Least weight of a cell: without a similar surface, all four count.
LEAST_WEIGHT = 1e-4


class QuickPlanes:
    """The planes of points, spots and suns on the film of a scene.

    loaded: that scene, which has to stay loaded. features: of each pixel, with positions.
    """

    def __init__(self, scene: Scene, loaded: Any, features: Features) -> None:
        small = scene.reduced(f"1/{reduction_to(scene.film, CELLS)}")
        cells = _sampled(features, small.size)
        self.size, self._grids = scene.size, dict[int, _PixelGrid]()
        hits = isqrt(min(max(FIRST_HITS // prod(scene.size), 1), MOST_PER_PIXEL)) ** 2
        paths = min(max(PATHS // prod(small.size), 1), MOST_PER_PIXEL)
        direct = FrozenPaths(scene, loaded, first_hits=hits, bounces=0)
        self._paths = direct
        scattered = FrozenPaths(small, loaded, first_hits=1, bounces=paths)
        self._cell_size, self._filter = small.size, SurfaceFilter(cells)
        later = scattered.indirect
        self._indirect = None if later is None else PathSums(scattered, later)
        self._spread = _Spreading(features, cells)

    def plane(self, site: Site, step: int = 1) -> npt.NDArray[np.float32]:
        """Return the image of a light at unit intensity, (h, w, 3) linear Rec.709.

        step: compute only every step-th pixel of every step-th row, and repeat it.
        """
        grid = self._grid(step)
        direct = grid.direct(site)
        if self._indirect is None:
            plane = np.array(direct, np.float32)
        else:
            cells = np.array(self._indirect(site), np.float32).reshape(*self._cell_size, 3)
            plane = grid.spread(self._filter(cells), direct)
        plane = repeated(plane.reshape(*grid.size, 3), step, self.size)
        self._paths.add_panel(plane.reshape(-1, 3), site)
        return plane

    def _grid(self, step: int) -> "_PixelGrid":
        """Return every step-th pixel of every step-th row; it is kept."""
        if (grid := self._grids.get(step)) is None:
            grid = self._grids[step] = _PixelGrid.of(self._paths, self._spread, self.size, step)
        return grid


def _sampled(features: Features, size: tuple[int, int]) -> Features:
    """Return the features at the centres of cells; the picture has (height, width) of them."""
    assert features.position is not None
    where = np.ix_(
        *(
            ((np.arange(count) + 0.5) * whole / count).astype(np.intp)
            for count, whole in zip(size, features.size, strict=True)
        )
    )
    return Features(features.albedo[where], features.normal[where], features.position[where])


def repeated(plane: Floats, step: int, size: tuple[int, int]) -> npt.NDArray[np.float32]:
    """Return every pixel of a plane (h, w, 3) as a square of so many, cut to a size."""
    if step == 1:
        return np.asarray(plane, np.float32)
    wide = np.repeat(plane, step, axis=1)[:, : size[1]]
    return np.ascontiguousarray(np.repeat(wide, step, axis=0)[: size[0]], np.float32)


@dataclass(frozen=True)
class _PixelGrid:
    """Every few pixels of every few rows of a picture: their direct light, and what spreads the
    indirect one to them.
    """

    size: tuple[int, int]
    direct: PathSums
    spread: "_Spreading"

    @classmethod
    def of(
        cls, paths: FrozenPaths, spread: "_Spreading", size: tuple[int, int], step: int
    ) -> "_PixelGrid":
        """Return every step-th pixel of every step-th row of a picture."""
        vertices = paths.direct
        if step == 1:
            return cls(size, PathSums(paths, vertices), spread)
        height, width = (-(-n // step) for n in size)
        rows, columns = np.divmod(vertices.pixels, size[1])
        here = np.flatnonzero((rows % step == 0) & (columns % step == 0))
        pixels = rows[here] // step * width + columns[here] // step
        direct = PathSums(paths, vertices.at(here, pixels), height * width)
        all_pixels = np.arange(size[0] * size[1]).reshape(size)[::step, ::step]
        return cls((height, width), direct, spread.at(all_pixels.ravel()))


class _Spreading:
    """Interpolation of light from cells to pixels, by similarity of the four cells around each."""

    def __init__(self, features: Features, cells: Features) -> None:
        import drjit as dr
        import mitsuba as mi

        assert features.position is not None
        assert cells.position is not None
        (height, width), (rows, columns) = features.size, cells.size
        y, along_y = _between(height, rows)
        x, along_x = _between(width, columns)
        spacing = _spacing(cells.position)
        indices = np.empty((4, height * width), np.uint32)
        weights = np.empty((4, height * width), np.float32)
        for k, (a, b) in enumerate(product(range(2), repeat=2)):
            where = np.ix_(y[a], x[b])
            normal, position = cells.normal[where], cells.position[where]
            off = np.abs(((features.position - position) * normal).sum(axis=-1))
            alike = np.clip((features.normal * normal).sum(axis=-1), 0, 1) ** NORMAL_POWER
            alike *= np.exp(-off / (NEAR_PLANE * spacing))
            indices[k] = np.add.outer(y[a] * columns, x[b]).ravel()
            weights[k] = (np.outer(along_y[a], along_x[b]) * (alike + LEAST_WEIGHT)).ravel()
        weights /= np.maximum(weights.sum(axis=0), 1e-30)
        albedo = np.maximum(features.albedo, DARKEST).reshape(-1, 3)
        self._cell_albedo = np.maximum(cells.albedo, DARKEST).reshape(-1, 3)
        with tracing():
            self._cells = [mi.UInt32(aligned(3 * row, np.uint32)) for row in indices]
            self._weights = [mi.Float(aligned(row, np.float32)) for row in weights]
            self._albedo = [mi.Float(aligned(row, np.float32)) for row in albedo.T]
            dr.make_opaque(self._cells, self._weights, self._albedo)
        self._add = dr.freeze(_add_spread)

    def at(self, pixels: npt.NDArray[np.intp]) -> "_Spreading":
        """Return the interpolation to these pixels alone."""
        import drjit as dr
        import mitsuba as mi

        others = copy(self)
        with tracing():
            where = mi.UInt32(aligned(pixels, np.uint32))
            others._cells = [dr.gather(mi.UInt32, x, where) for x in self._cells]
            others._weights = [dr.gather(mi.Float, x, where) for x in self._weights]
            others._albedo = [dr.gather(mi.Float, x, where) for x in self._albedo]
            dr.make_opaque(others._cells, others._weights, others._albedo)
        others._add = dr.freeze(_add_spread)
        return others

    def __call__(self, indirect: Floats, direct: Any) -> npt.NDArray[np.float32]:
        """Return the light of pixels, (3 · pixels,): the direct light and the light of the cells
        around.

        indirect: of the cells, (rows, columns, 3). direct: of the pixels, as Dr.Jit has it.
        """
        import mitsuba as mi

        light = indirect.reshape(-1, 3) / self._cell_albedo
        with tracing():
            table = mi.Float(aligned(light.ravel(), np.float32))
            lit = self._add(table, self._cells, self._weights, self._albedo, direct)
            return np.array(lit, np.float32)


def _add_spread(table: Any, cells: Any, weights: Any, albedo: Any, direct: Any) -> Any:
    """Add to the light of pixels the light of the cells around each. table: theirs, over albedo."""
    import drjit as dr
    import mitsuba as mi

    pixel = 3 * dr.arange(mi.UInt32, dr.width(weights[0]))
    for channel in range(3):
        spread = dr.zeros(mi.Float, 1)
        for cell, weight in zip(cells, weights, strict=True):
            spread = dr.fma(dr.gather(mi.Float, table, cell + channel), weight, spread)
        mode = dr.ReduceMode.NoConflicts
        dr.scatter_add(direct, spread * albedo[channel], pixel + channel, mode=mode)
    return direct


def _between(count: int, cells: int) -> tuple[Sequence[npt.NDArray[np.intp]], Sequence[Floats]]:
    """Return the two cells that each of `count` pixels lies between, along an axis, and weights."""
    at = (np.arange(count) + 0.5) * cells / count - 0.5
    first = np.floor(at).astype(np.intp)
    share = at - first
    neighbours = [np.clip(first + k, 0, cells - 1) for k in range(2)]
    return neighbours, [1 - share, share]


def _spacing(position: Floats) -> float:
    """Return the typical distance between surfaces of neighbouring cells."""
    steps = np.linalg.norm(np.diff(position, axis=1), axis=-1)
    return float(max(np.median(steps), 1e-12)) if steps.size else 1.0
