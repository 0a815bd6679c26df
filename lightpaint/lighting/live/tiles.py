"""Normal equations that follow the brush (Schoeneman et al. 1993, Eq 7, 8, 9).

The picture is cut into tiles, and M, b and ‖Ψ‖² are sums over them. A stroke makes some tiles
dirty, and their sums are formed anew: its cost is the cost of the tiles it touches. Nothing is ever
subtracted, so that nothing drifts: undoing a stroke restores the same bits, and an updated problem
equals the one built from scratch bit for bit.
"""

import threading
from functools import partial
from itertools import pairwise, product
from math import prod

import numpy as np

from lightpaint.arrays import Doubles, Floats
from lightpaint.basis import Planes, as_planes
from lightpaint.errors import SizeError
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.threads import one_thread, parallel_map

#: Pixels along the side of a tile. Smaller tiles fit a brush better, but there are more to add.
TILE_SIDE = 16

#: Maximum number of bytes for the sums of all tiles; tiles are larger if they would take more.
MAX_SUM_BYTES = 2**29

#: Bytes of pixels, in float64, that are summed together: they stay in the processor's cache.
CHUNK_BYTES = 2**21

#: Maximum number of lights for which calls, not arithmetic, determine the time of a tile.
MAX_CHEAP_LIGHTS = 32


class TiledEquations:
    """The problem of one basis, target and importance, which stay the caller's arrays.

    planes: (n, h, w, 3) if an array; target: (h, w, 3); importance: (h, w), or (h, w, 1 or 3) where
    channels differ, finite and >= 0. Call `update` after painting on them.

    The sums of the tiles are the base of a pyramid, each of whose nodes is the sum of two by
    two below it: a dirty tile costs its own sum and three additions per level, and the order
    of summation does not depend on the order of strokes.
    """

    def __init__(
        self,
        planes: Planes | Floats,
        target: Floats,
        importance: Floats,
        *,
        side: int | None = None,
        twin: "TiledEquations | None" = None,
    ) -> None:
        """Sum all tiles. twin: equations of the same planes and strokes, whose reads of planes are
        shared.
        """
        planes = as_planes(planes)
        self._count = n = planes.count
        height, width = planes.size
        if importance.ndim == 2:
            importance = importance[..., None]
        fits = importance.shape in ((height, width, 1), (height, width, 3))
        if target.shape != (height, width, 3) or not fits:
            raise SizeError(
                f"target {target.shape} and importance {importance.shape} do not fit basis images "
                f"of {(height, width)}"
            )
        self._target = target
        self._importance = importance
        self.side = tile_side(n, height, width) if side is None else side
        self._tile_reader: _TileReader = (
            _TileReader(planes, self.side) if twin is None else twin._tile_reader
        )
        self._tile_reader.is_shared = twin is not None
        # A stroke of colour changes b and ‖Ψ‖², but not M, which has a pyramid of its own.
        shape = -(-height // self.side), -(-width // self.side)
        self._M = _pyramid(shape, (3, n, n))
        self._b = _pyramid(shape, (3, n + 1))
        self.update((slice(0, height), slice(0, width)))

    @property
    def equations(self) -> NormalEquations:
        """The current M, b and ‖Ψ‖²."""
        M, b = self._M[-1][0, 0], self._b[-1][0, 0]
        return NormalEquations(M.copy(), b[:, :-1].copy(), b[:, -1].copy())

    def tiles_in(self, region: tuple[slice, slice]) -> tuple[range, range]:
        """Return rows and columns of the tiles that a rectangle, slices of rows and columns,
        touches.

        Raises ValueError for one that runs backwards.
        """
        height, width = self._target.shape[:2]
        return _tiles(region[0], height, self.side), _tiles(region[1], width, self.side)

    def update(self, region: tuple[slice, slice], *, with_M: bool = True) -> None:
        """Sum the tiles of a painted rectangle anew. with_M: whether its importance changed."""
        rows, columns = self.tiles_in(region)
        if not (rows and columns):
            return
        rows_per_chunk = max(CHUNK_BYTES // (8 * 3 * (self._count + 1) * self.side**2), 1)
        wide = min(rows_per_chunk, len(columns))
        blocks = product(_split_range(rows, rows_per_chunk // wide), _split_range(columns, wide))
        sum_block = partial(self._sum, with_M=with_M)
        if with_M and self._count > MAX_CHEAP_LIGHTS:
            parallel_map(sum_block, blocks)
        else:
            with one_thread():
                for block in blocks:
                    sum_block(block)
        for pyramid in (self._M, self._b) if with_M else (self._b,):
            _sum_pyramid(pyramid, rows, columns)

    def update_as_complement(
        self, region: tuple[slice, slice], whole: Doubles, painted: "TiledEquations", w: Doubles
    ) -> None:
        """Update the sums where importance is 1 less the importance of `painted`, without reading
        pixels.

        whole: the `base` at importance 1. painted: of the same images. w: (n, 3), the weights of
        which the target is the sum.
        """
        rows, columns = self.tiles_in(region)
        if not (rows and columns):
            return
        n = self._count
        tiles = np.s_[rows.start : rows.stop, columns.start : columns.stop]
        M = np.subtract(whole[tiles], painted.base[tiles], out=self._M[0][tiles])
        b = np.matmul(M, w.T[..., None])[..., 0]
        self._b[0][tiles][..., :n] = b
        self._b[0][tiles][..., n] = np.einsum("rcki,ik->rck", b, w)
        for pyramid in (self._M, self._b):
            _sum_pyramid(pyramid, rows, columns)

    @property
    def base(self) -> Doubles:
        """M of each tile, (rows, columns, 3, n, n), read-only."""
        return self._M[0]

    def _sum(self, block: tuple[range, range], *, with_M: bool) -> None:
        """Compute Σ D f g over each tile of a block, for images with the target and pairs of
        images.
        """
        n, side = self._count, self.side
        tiles = len(block[0]), len(block[1])
        rows, columns = (slice(part.start, part.stop) for part in block)
        where = (
            slice(rows.start * side, rows.stop * side),
            slice(columns.start * side, columns.stop * side),
        )
        D = np.empty((*tiles, self._importance.shape[2], side * side))
        target = np.empty((*tiles, 3, 1, side * side))
        _cut(self._importance[where][None], side, out=D[:, :, :, None])
        _cut(self._target[where][None], side, out=target)
        if not D.all():
            # Pixels without weight may hold anything.
            np.copyto(target, 0, where=(D == 0)[:, :, :, None])
        painted = target * D[:, :, :, None]
        lit = self._tile_reader(where, tiles)
        with np.errstate(invalid="ignore"):
            b = np.matmul(lit, painted.swapaxes(-1, -2))[..., 0]
        if not np.isfinite(b).all():
            lit = np.where((D == 0)[:, :, :, None], 0, lit)
            b = np.matmul(lit, painted.swapaxes(-1, -2))[..., 0]
        self._b[0][rows, columns, :, :n] = b
        self._b[0][rows, columns, :, n] = np.matmul(target, painted.swapaxes(-1, -2))[..., 0, 0]
        if with_M:
            channel = _BUFFERS.array("one", lit.shape)
            np.multiply(lit, np.sqrt(D)[:, :, :, None], out=channel)
            two = channel
            if n <= MAX_CHEAP_LIGHTS:
                # For the product of an array with itself numpy computes only half, for two arrays
                # all of it, which is faster for few lights.
                two = _BUFFERS.array("two", lit.shape)
                two[...] = channel
            np.matmul(channel, two.swapaxes(-1, -2), out=self._M[0][rows, columns])


class _TileReader:
    """A reader of basis images, cut into tiles, in float64.

    is_shared: whether the last block is kept for a second reader.
    """

    def __init__(self, planes: Planes, side: int) -> None:
        self._planes, self._side = planes, side
        self._last: tuple[tuple[slice, slice], Doubles] | None = None
        self.is_shared = False

    def __call__(self, where: tuple[slice, slice], tiles: tuple[int, int]) -> Doubles:
        """Return the tiles at `where`, (rows, columns, 3, n, side²), read-only."""
        last = self._last
        if last is not None and last[0] == where:
            return last[1]
        cut = np.empty((*tiles, 3, self._planes.count, self._side**2))
        rows, columns = where
        lit = self._planes.rows(rows.start, rows.stop)[:, :, columns]
        _cut(lit, self._side, out=cut)
        if self.is_shared:
            self._last = (where, cut)
        return cut


class _Buffers(threading.local):
    """Memory of a thread that is reused: new pages from the system take as long as the sums."""

    def __init__(self) -> None:
        self._arrays: dict[str, Doubles] = {}

    def array(self, name: str, shape: tuple[int, ...]) -> Doubles:
        """Return an array of any content, valid until the next call with that name."""
        size = prod(shape)
        if 8 * size > 2 * CHUNK_BYTES:
            return np.empty(shape)
        if name not in self._arrays or self._arrays[name].size < size:
            self._arrays[name] = np.empty(size)
        return self._arrays[name][:size].reshape(shape)


_BUFFERS = _Buffers()


def _split_range(whole: range, size: int) -> list[range]:
    """Return ranges of `size`, the last one shorter, that make up the whole."""
    starts = range(whole.start, whole.stop, size)
    return [range(first, min(first + size, whole.stop)) for first in starts]


def _cut(pictures: Floats, side: int, out: Doubles) -> None:
    """Cut a block of tiles: (n, h, w, channels) into (rows, columns, channels, n, side²).

    Tiles that the border of the picture cuts off are 0 beyond it.
    """
    n, height, width, channels = pictures.shape
    rows, columns = out.shape[:2]
    if (height, width) != (rows * side, columns * side):
        part = pictures
        pictures = np.zeros((n, rows * side, columns * side, channels), part.dtype)
        pictures[:, :height, :width] = part
    tiles = pictures.reshape(n, rows, side, columns, side, channels).transpose(1, 3, 5, 0, 2, 4)
    out.reshape(rows, columns, channels, n, side, side)[...] = tiles


def _pyramid(shape: tuple[int, int], node: tuple[int, ...]) -> list[Doubles]:
    """Return zeros for rows and columns of nodes, for each two by two of these, and so on up to
    one.
    """
    rows, columns = shape
    levels = []
    while rows * columns > 1:
        # Every node has both pairs, even if they are zeros.
        levels.append(np.zeros((rows + rows % 2, columns + columns % 2, *node)))
        rows, columns = -(-rows // 2), -(-columns // 2)
    return [*levels, np.zeros((1, 1, *node))]


def _sum_pyramid(pyramid: list[Doubles], rows: range, columns: range) -> None:
    """Sum anew all nodes above these nodes of the base."""
    top, bottom, left, right = rows.start, rows.stop, columns.start, columns.stop
    for below, above in pairwise(pyramid):
        top, bottom, left, right = top // 2, -(-bottom // 2), left // 2, -(-right // 2)
        four = below[2 * top : 2 * bottom, 2 * left : 2 * right]
        two = four[0::2] + four[1::2]
        np.add(two[:, 0::2], two[:, 1::2], out=above[top:bottom, left:right])


def tile_side(n: int, height: int, width: int) -> int:
    """Return the side of a tile in pixels: `TILE_SIDE`, or more to keep all sums within
    `MAX_SUM_BYTES`.
    """
    node_bytes = 3 * (n * n + n + 1) * 8
    side = TILE_SIDE
    # There are at most four nodes for each tile, inner ones and unused leaves included.
    while 4 * node_bytes * -(-height // side) * -(-width // side) > MAX_SUM_BYTES and side < max(
        height, width
    ):
        side *= 2
    return side


def _tiles(along: slice, length: int, side: int) -> range:
    """Return the numbers of the tiles that a slice of pixels touches."""
    start, stop, step = along.indices(length)
    if step < 0:
        raise ValueError("the slices of a region go forwards: give steps > 0")
    return range(start // side, -(-stop // side)) if stop > start else range(0)
