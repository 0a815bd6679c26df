"""Planes computed from other planes or pictures: selections, means over blocks, several pictures in
one row, one picture in the colours of several lights.

If the result fits in memory, it is computed at once. Otherwise it is computed from the source's
rows on each request, and takes no more memory than these rows.
"""

from collections.abc import Sequence
from itertools import accumulate, pairwise

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles, Floats, Indices
from lightpaint.basis.file import file_planes
from lightpaint.basis.file.deferred_planes import loaded
from lightpaint.basis.file.file_planes import RowPlanes
from lightpaint.basis.file.lit_planes import LitPlanes
from lightpaint.basis.planes import BLOCK_PIXELS, MemoryPlanes, Planes
from lightpaint.images import block_sums
from lightpaint.progress import with_progress

#: Number of rows of pixels averaged at a time: one chunk of a compressed file.
READ_ROWS = 16

#: If fewer than one in this many blocks is requested, only their own pixels are read.
SPARSE = 8

#: A plane by its number among others; None for a black plane.
PlaneReference = tuple[Planes, int] | None


def compose_planes(
    picks: Sequence[PlaneReference], size: tuple[int, int], *, in_memory: bool
) -> Planes:
    """Return planes of (height, width) pixels, one for each of `picks`.

    in_memory: whether they are copied into memory, or read from their sources on request.
    """
    composed = ComposedPlanes(picks, size)
    return MemoryPlanes(np.stack(list(composed))) if in_memory else composed


class ComposedPlanes(RowPlanes):
    """Planes picked from other planes, which are read on request. picks: one for each light."""

    def __init__(self, picks: Sequence[PlaneReference], size: tuple[int, int]) -> None:
        self._picks = tuple(picks)
        self.count, self.size = len(picks), size

    def plane(self, i: int) -> Floats:
        """Return the plane of light i, (h, w, 3)."""
        pick = self._picks[i]
        return np.zeros((*self.size, 3), np.float32) if pick is None else pick[0].plane(pick[1])

    def rows(self, top: int, bottom: int) -> Floats:
        """Return rows `top` to `bottom` of all planes, (n, bottom - top, w, 3)."""
        top, bottom = max(top, 0), min(bottom, self.size[0])
        composed = np.zeros((self.count, max(bottom - top, 0), self.size[1], 3), np.float32)
        sources = {id(pick[0]): pick[0] for pick in self._picks if pick is not None}
        for key, source in sources.items():
            rows = source.rows(top, bottom)
            for i, pick in enumerate(self._picks):
                if pick is not None and id(pick[0]) == key:
                    composed[i] = rows[pick[1]]
        return composed

    def pixels(self, where: slice | Indices) -> Floats:
        """Return some pixels of all planes, (n, p, 3). Few of them are read alone."""
        if isinstance(where, slice):
            return super().pixels(where)
        composed = np.zeros((self.count, len(where), 3), np.float32)
        sources = {id(pick[0]): pick[0] for pick in self._picks if pick is not None}
        for key, source in sources.items():
            pixels = source.pixels(where)
            for i, pick in enumerate(self._picks):
                if pick is not None and id(pick[0]) == key:
                    composed[i] = pixels[pick[1]]
        return composed


def block_means(planes: Planes, weight: Doubles, side: int) -> Planes:
    """Return weighted means over blocks of side × side pixels, as planes with one pixel per block.

    weight: (h, w), >= 0, for pixels from the top left corner on; pixels outside it belong to no
    block. A block without weight has mean 0. Blocks at the right and bottom edges may be smaller.
    """
    means = BlockPlanes(planes, weight, side)
    if not isinstance(planes, RowPlanes):
        return MemoryPlanes(np.stack(list(means)))
    height, width = means.size
    is_small = 12 * means.count * height * width <= file_planes.PICKED_MAX_BYTES
    return MemoryPlanes(means.array()) if is_small else means


class BlockPlanes(RowPlanes):
    """Means over blocks of pixels of other planes. See `block_means` for the arguments."""

    def __init__(self, whole: Planes, weight: Doubles, side: int) -> None:
        self._whole, self._weight, self._side = whole, weight, side
        total = block_sums(weight, side)
        self._total = np.where(total > 0, total, 1)[..., None]
        self.count, self.size = whole.count, (len(total), total.shape[1])  # in blocks

    def plane(self, i: int) -> Floats:
        """Return the plane of light i, (h, w, 3)."""
        return self._means(self._whole.plane(i), 0, self.size[0])

    def rows(self, top: int, bottom: int) -> Floats:
        """Return rows `top` to `bottom` of all planes, (n, bottom - top, w, 3)."""
        top, bottom = max(top, 0), min(bottom, self.size[0])
        blocks = np.empty((self.count, max(bottom - top, 0), self.size[1], 3), np.float32)
        step = max(1, READ_ROWS // self._side)
        whole = loaded(self._whole)
        for first in with_progress(range(top, bottom, step), "strips"):
            end = min(first + step, bottom)
            if isinstance(whole, LitPlanes):
                sums = whole.block_sums(self._weight, self._side, first, end)
                blocks[:, first - top : end - top] = sums / self._total[first:end]
                continue
            source_rows = self._whole.rows(first * self._side, end * self._side)
            for means, plane in zip(blocks, source_rows, strict=True):
                means[first - top : end - top] = self._means(plane, first, end)
        return blocks

    def pixels(self, where: slice | Indices) -> Floats:
        """Return some blocks of all planes, (n, p, 3). If they are few, only their own pixels are
        read.
        """
        if isinstance(where, slice) or (len(where) > 0 and SPARSE * len(where) > np.ptp(where) + 1):
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
        # Indices of the blocks' pixels, with blocks side by side: (side, p * side).
        offsets = np.arange(side)
        y, x = np.broadcast_arrays(
            side * rows[:, None] + offsets[:, None, None], side * columns[:, None] + offsets
        )
        is_inside = ((y < height) & (x < width)).reshape(side, -1)
        y, x = (
            np.minimum(values, n - 1).reshape(side, -1) for values, n in ((y, height), (x, width))
        )
        weight = (self._weight[y, x] * is_inside)[..., None]
        source_rows = self._whole.pixels((y * self._whole.size[1] + x).ravel())
        total = self._total.reshape(-1, 1)[blocks]
        sums = (block_sums(values.reshape(side, -1, 3) * weight, side)[0] for values in source_rows)
        return np.array([values / total for values in sums], np.float32)

    def _means(self, source_rows: Floats, top: int, bottom: int) -> npt.NDArray[np.float32]:
        """Return block rows `top` to `bottom` of one plane.

        source_rows: its pixels, starting with the pixels of `top`.
        """
        first = top * self._side
        weight = self._weight[first : bottom * self._side]
        pixels = source_rows[: len(weight), : weight.shape[1]]
        weighted = np.empty(pixels.shape)
        for c in range(3):  # NumPy multiplies along an axis of three slowly
            np.multiply(pixels[..., c], weight, out=weighted[..., c])
        return (block_sums(weighted, self._side) / self._total[top:bottom]).astype(np.float32)


def in_one_row(parts: Sequence[Planes]) -> Planes:
    """Return the planes of several pictures of the same lights as one picture with a single row."""
    if any(isinstance(part, RowPlanes) for part in parts):
        return JoinedRow(parts)
    flat = [part.pixels(slice(None)) for part in parts]
    return MemoryPlanes((flat[0] if len(flat) == 1 else np.concatenate(flat, axis=1))[:, None])


class JoinedRow(RowPlanes):
    """The pixels of several pictures of the same lights in one row, read on request."""

    def __init__(self, parts: Sequence[Planes]) -> None:
        self._parts = tuple(parts)
        ends = accumulate((part.size[0] * part.size[1] for part in parts), initial=0)
        self._ends = list(ends)
        self.count, self.size = parts[0].count, (1, self._ends[-1])

    def plane(self, i: int) -> Floats:
        """Return the plane of light i, (1, p, 3)."""
        return np.concatenate([part.plane(i).reshape(-1, 3) for part in self._parts])[None]

    def rows(self, top: int, bottom: int) -> Floats:
        """Return the single row of all planes, (n, 1, p, 3), or no row if it is outside the
        range.
        """
        return self.pixels(slice(None))[:, None][:, top:bottom]

    def pixels(self, where: slice | Indices) -> Floats:
        """Return some pixels of all planes, (n, p, 3)."""
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
        values = np.empty((3, self.count, len(where)), np.float32).transpose(1, 2, 0)
        of_part = np.searchsorted(self._ends, where, side="right") - 1
        for k in np.unique(of_part):
            in_part = np.flatnonzero(of_part == k)
            values[:, in_part] = self._parts[int(k)].pixels(where[in_part] - self._ends[k])
        return values

    def mixes(self, weights: Doubles) -> npt.NDArray[np.float32]:
        """Return several sums Σ w_i Φ_i, (k, 1, p, 3)."""
        parts = (part.mixes(weights).reshape(len(weights), -1, 3) for part in self._parts)
        return np.concatenate(list(parts), axis=1)[:, None]


class ScaledPlanes(RowPlanes):
    """Planes Φ_i = c_i P of one picture P, while no light has been rendered alone. They take the
    memory of one plane.

    picture: (h, w, 3) float32. colours: (n, 3).
    """

    def __init__(self, picture: Floats, colours: Doubles) -> None:
        self._picture, self._colours = picture, np.asarray(colours, np.float32)
        self.count, self.size = len(colours), (picture.shape[0], picture.shape[1])

    @classmethod
    def summing_to(cls, picture: Floats, weights: Doubles) -> "ScaledPlanes":
        """Return planes with Σ w_i Φ_i = P, to which all lights that are on contribute alike.

        picture: P, (h, w, 3). weights: (n, 3).
        """
        is_on = weights != 0
        share = 1 / np.maximum(is_on.sum(axis=0), 1)
        return cls(picture, np.divide(share, weights, out=np.zeros(weights.shape), where=is_on))

    def plane(self, i: int) -> Floats:
        """Return the plane of light i, (h, w, 3)."""
        return np.asarray(self._picture * self._colours[i])

    def rows(self, top: int, bottom: int) -> Floats:
        """Return rows `top` to `bottom` of all planes, (n, bottom - top, w, 3)."""
        return self._picture[top:bottom] * self._colours[:, None, None]

    def pixels(self, where: slice | Indices) -> Floats:
        """Return some pixels of all planes, (n, p, 3)."""
        return np.asarray(self._picture.reshape(-1, 3)[where] * self._colours[:, None])

    def mixes(self, weights: Doubles) -> npt.NDArray[np.float32]:
        """Return several sums Σ w_i Φ_i, (k, h, w, 3). weights: (k, n, 3)."""
        colours = (np.asarray(weights) * self._colours).sum(axis=1).astype(np.float32)
        return np.asarray(self._picture * colours[:, None, None])
