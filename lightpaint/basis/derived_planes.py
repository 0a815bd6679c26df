"""Planes derived from others: sums of several, means over blocks, pictures joined in a row.

Planes that fit into memory are computed at once. The rest is computed from rows of the others on
each request, and takes no more memory than these rows.
"""

from collections.abc import Sequence
from itertools import accumulate, pairwise

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles, Floats, Indices
from lightpaint.basis.file import file_planes
from lightpaint.basis.file.file_planes import RowPlanes
from lightpaint.basis.planes import BLOCK_PIXELS, MemoryPlanes, Planes
from lightpaint.images.pixel_blocks import block_sums

#: Rows of pixels that are averaged at a time: those of a chunk of a file that is compressed.
READ_ROWS = 16

#: If less than one in so many blocks is requested, only the pixels of those are read.
SPARSE = 8

#: A plane by its number among others; None for a black one.
PlaneReference = tuple[Planes, int] | None


def compose_planes(
    picks: Sequence[PlaneReference], size: tuple[int, int], *, in_memory: bool
) -> Planes:
    """Return planes of (height, width) pixels, one for each of `picks`.

    in_memory: whether they are copied there, or else stay where they are.
    """
    composed = ComposedPlanes(picks, size)
    return MemoryPlanes(np.stack(list(composed))) if in_memory else composed


class ComposedPlanes(RowPlanes):
    """Planes that stay with the others that they come from. picks: one for each light."""

    def __init__(self, picks: Sequence[PlaneReference], size: tuple[int, int]) -> None:
        self._picks, self._size = tuple(picks), size

    @property
    def count(self) -> int:
        """n."""
        return len(self._picks)

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) in pixels."""
        return self._size

    def plane(self, i: int) -> Floats:
        """Return the plane of light i, (h, w, 3)."""
        pick = self._picks[i]
        return np.zeros((*self._size, 3), np.float32) if pick is None else pick[0].plane(pick[1])

    def rows(self, top: int, bottom: int) -> Floats:
        """Return some rows of all planes, (n, bottom - top, w, 3)."""
        top, bottom = max(top, 0), min(bottom, self._size[0])
        composed = np.zeros((self.count, max(bottom - top, 0), self._size[1], 3), np.float32)
        sources = {id(pick[0]): pick[0] for pick in self._picks if pick is not None}
        for key, source in sources.items():
            rows = source.rows(top, bottom)
            for i, pick in enumerate(self._picks):
                if pick is not None and id(pick[0]) == key:
                    composed[i] = rows[pick[1]]
        return composed


def block_means(planes: Planes, weight: Doubles, side: int) -> Planes:
    """Return means over blocks of side × side pixels, weighted, as planes of a pixel for each.

    weight: (h, w), >= 0, of pixels from the top left corner on; others belong to no block. Where a
    block has no weight its mean is 0. Remainders at the right and at the bottom form smaller ones.
    """
    means = BlockPlanes(planes, weight, side)
    if not isinstance(planes, RowPlanes):
        return MemoryPlanes(np.stack(list(means)))
    height, width = means.size
    is_small = 12 * means.count * height * width <= file_planes.PICKED_MAX_BYTES
    return MemoryPlanes(means.array()) if is_small else means


class BlockPlanes(RowPlanes):
    """Means over blocks of pixels of other planes. For the arguments see `block_means`."""

    def __init__(self, whole: Planes, weight: Doubles, side: int) -> None:
        self._whole, self._weight, self._side = whole, weight, side
        total = block_sums(weight, side)
        self._total = np.where(total > 0, total, 1)[..., None]

    @property
    def count(self) -> int:
        """n."""
        return self._whole.count

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) in blocks."""
        return self._total.shape[0], self._total.shape[1]

    def plane(self, i: int) -> Floats:
        """Return the plane of light i, (h, w, 3)."""
        return self._means(self._whole.plane(i), 0, self.size[0])

    def rows(self, top: int, bottom: int) -> Floats:
        """Return some rows of all planes, (n, bottom - top, w, 3)."""
        top, bottom = max(top, 0), min(bottom, self.size[0])
        blocks = np.empty((self.count, max(bottom - top, 0), self.size[1], 3), np.float32)
        step = max(1, READ_ROWS // self._side)
        for first in range(top, bottom, step):
            end = min(first + step, bottom)
            lit = self._whole.rows(first * self._side, end * self._side)
            for means, plane in zip(blocks, lit, strict=True):
                means[first - top : end - top] = self._means(plane, first, end)
        return blocks

    def pixels(self, where: slice | Indices) -> Floats:
        """Return some blocks of all planes, (n, p, 3): of a few, from their own pixels alone."""
        if isinstance(where, slice) or SPARSE * len(where) > np.ptp(where) + 1:
            return super().pixels(where)
        means = np.empty((self.count, len(where), 3), np.float32)
        step = max(1, BLOCK_PIXELS // self._side**2)
        for first in range(0, len(where), step):
            part = slice(first, first + step)
            means[:, part] = self._picked_means(where[part])
        return means

    def _picked_means(self, blocks: Indices) -> npt.NDArray[np.float32]:
        """Return the means of some blocks, (n, p, 3)."""
        side, (height, width) = self._side, self._weight.shape
        rows, columns = np.divmod(blocks, self.size[1])
        # One block beside the other: (side, p * side) places in the picture.
        along = np.arange(side)
        y, x = np.broadcast_arrays(
            side * rows[:, None] + along[:, None, None], side * columns[:, None] + along
        )
        is_inside = ((y < height) & (x < width)).reshape(side, -1)
        y, x = (
            np.minimum(values, n - 1).reshape(side, -1) for values, n in ((y, height), (x, width))
        )
        weight = (self._weight[y, x] * is_inside)[..., None]
        lit = self._whole.pixels((y * self._whole.size[1] + x).ravel())
        total = self._total.reshape(-1, 1)[blocks]
        sums = (block_sums(values.reshape(side, -1, 3) * weight, side)[0] for values in lit)
        return np.array([values / total for values in sums], np.float32)

    def _means(self, lit: Floats, top: int, bottom: int) -> npt.NDArray[np.float32]:
        """Return some rows of means of a plane's pixels, which begin with the first of them."""
        first = top * self._side
        weight = self._weight[first : bottom * self._side]
        counted = lit[: len(weight), : weight.shape[1]] * weight[..., None]
        return (block_sums(counted, self._side) / self._total[top:bottom]).astype(np.float32)


def in_one_row(parts: Sequence[Planes]) -> Planes:
    """Return the planes of several pictures of the same lights as those of one, a single row."""
    if any(isinstance(part, RowPlanes) for part in parts):
        return JoinedRow(parts)
    flat = [part.pixels(slice(None)) for part in parts]
    return MemoryPlanes((flat[0] if len(flat) == 1 else np.concatenate(flat, axis=1))[:, None])


class JoinedRow(RowPlanes):
    """The pixels of several pictures of the same lights behind each other, read on request."""

    def __init__(self, parts: Sequence[Planes]) -> None:
        self._parts = tuple(parts)
        ends = accumulate((part.size[0] * part.size[1] for part in parts), initial=0)
        self._ends = list(ends)

    @property
    def count(self) -> int:
        """n."""
        return self._parts[0].count

    @property
    def size(self) -> tuple[int, int]:
        """(1, pixels)."""
        return 1, self._ends[-1]

    def plane(self, i: int) -> Floats:
        """Return the plane of light i, (1, p, 3)."""
        return np.concatenate([part.plane(i).reshape(-1, 3) for part in self._parts])[None]

    def rows(self, top: int, bottom: int) -> Floats:
        """Return the single row of all planes, (n, 1, p, 3), if it is asked for."""
        return self.pixels(slice(None))[:, None][:, top:bottom]

    def pixels(self, where: slice | Indices) -> Floats:
        """Return some of the pixels, (n, p, 3)."""
        if isinstance(where, slice):
            start, stop, step = where.indices(self.size[1])
            if step == 1 and start < stop:
                pieces = [
                    part.pixels(slice(max(start - first, 0), min(stop, end) - first))
                    for part, (first, end) in zip(self._parts, pairwise(self._ends), strict=True)
                    if start < end and first < stop
                ]
                return pieces[0] if len(pieces) == 1 else np.concatenate(pieces, axis=1)
            where = np.arange(start, stop, step)
        joined = np.empty((3, self.count, len(where)), np.float32).transpose(1, 2, 0)
        of_part = np.searchsorted(self._ends, where, side="right") - 1
        for k in np.unique(of_part):
            in_part = np.flatnonzero(of_part == k)
            joined[:, in_part] = self._parts[int(k)].pixels(where[in_part] - self._ends[k])
        return joined

    def mix(self, weights: Doubles) -> npt.NDArray[np.float32]:
        """Return Σ w_i Φ_i, (1, p, 3)."""
        return np.concatenate([part.mix(weights).reshape(-1, 3) for part in self._parts])[None]
