"""Planes of many lights in memory, of which only the lit pixels are kept.

A light of a thousand reaches little of a picture, and few samples find even that: five of six
pixels are black. Each walk over the planes then takes a quarter of the time, and a tenth of the
memory of float32.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import (
    Bools,
    Doubles,
    Floats,
    Indices,
    as_singles,
    release_freed_memory,
)
from lightpaint.basis.file.file_planes import KeptMixes, RowPlanes
from lightpaint.basis.planes import LitEntries
from lightpaint.images import block_sums
from lightpaint.progress import with_progress
from lightpaint.threads import parallel_map

#: Number of lights from which planes may be kept by their lit pixels.
MIN_LIGHTS = 128

#: Share of the pixels of all planes that are lit, up to which these are faster one by one.
MAX_LIT_SHARE = 0.25

#: Maximum size in bytes of both sets of planes, images and noise, that are kept so.
MAX_BYTES = 2**30


@dataclass(frozen=True)
class LitPlane:
    """The lit pixels of one plane: their indices, (m,) uint32, in row-major order, and numbers.

    numbers: (3, m), as stored: light divided by `scale`.
    """

    pixels: npt.NDArray[np.uint32]
    numbers: npt.NDArray[Any]
    scale: float

    @classmethod
    def of(cls, channels: Sequence[npt.NDArray[Any]], scale: float) -> "LitPlane":
        """Return the plane that has these stored channels, (h, w) each."""
        flat = [np.ascontiguousarray(channel).ravel() for channel in channels]
        # Bits rather than numbers, of which halves are slow; all but the bit of the sign.
        bits = [channel.view(f"u{channel.itemsize}") for channel in flat]
        pixels = np.flatnonzero((bits[0] | bits[1] | bits[2]) << 1)
        numbers = np.stack([channel[pixels] for channel in flat])
        return cls(pixels.astype(np.uint32), numbers, scale)

    @property
    def nbytes(self) -> int:
        """Bytes of memory that it takes."""
        return self.pixels.nbytes + self.numbers.nbytes

    def in_kind(self, kind: npt.DTypeLike) -> "LitPlane":
        """Return this plane with numbers of this kind."""
        return replace(self, numbers=self.numbers.astype(kind, copy=False))

    def at(self, pixels: npt.NDArray[np.uint32]) -> "LitPlane":
        """Return this plane with these lit pixels, which include its own."""
        numbers = np.zeros((3, pixels.size), self.numbers.dtype)
        numbers[:, np.searchsorted(pixels, self.pixels)] = self.numbers
        return replace(self, pixels=pixels, numbers=numbers)

    def dense(self, pixels: int) -> npt.NDArray[np.float32]:
        """Return all pixels, (3, pixels), not yet multiplied by the scale."""
        plane = np.zeros((3, pixels), np.float32)
        plane[:, self.pixels] = self.numbers
        return plane


@dataclass(frozen=True)
class _LitStrip:
    """The lit pixels of all planes in some rows, plane by plane.

    lit: (m,) uint16 or uint32, their indices in the strip. numbers: (3, m). begins: (n + 1,), where
    the indices of each plane begin. size: number of pixels of the strip.
    """

    lit: npt.NDArray[Any]
    numbers: npt.NDArray[Any]
    begins: Indices
    size: int

    @classmethod
    def of(cls, planes: Sequence[LitPlane], parts: Sequence[slice], pixels: slice) -> "_LitStrip":
        """Return a strip of planes. parts: slices of their lit pixels. pixels: of the picture."""
        size = pixels.stop - pixels.start
        kind = np.uint16 if size <= 2**16 else np.uint32
        numbers = np.concatenate([x.numbers[:, y] for x, y in zip(planes, parts, strict=True)], 1)
        lit = np.concatenate([x.pixels[y] for x, y in zip(planes, parts, strict=True)])
        begins = np.cumsum([0, *(part.stop - part.start for part in parts)])
        return cls((lit - np.uint32(pixels.start)).astype(kind), numbers, begins, size)

    @property
    def nbytes(self) -> int:
        """Bytes of memory that it takes."""
        return self.lit.nbytes + self.numbers.nbytes

    def power_and_totals(self, counted: Bools) -> Doubles:
        """Return Σ x² over the counted pixels and Σ x over all, (2, n, 3), before the scales.

        counted: (pixels,).
        """
        is_lit = np.diff(self.begins) > 0
        first, sums = self.begins[:-1][is_lit], np.zeros((2, len(is_lit), 3))
        if not first.size:
            return sums
        is_counted = counted[self.lit]
        for c, channel in enumerate(self.numbers):
            values = as_singles(channel).astype(np.float64)
            # The numbers of a plane follow each other.
            sums[1, is_lit, c] = np.add.reduceat(values, first)
            sums[0, is_lit, c] = np.add.reduceat(np.square(values, out=values) * is_counted, first)
        return sums

    def of_planes(self, values: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Return a value of each plane, (n,), for each of its lit pixels, (m,)."""
        return np.repeat(values, np.diff(self.begins))

    def decoded(self) -> npt.NDArray[np.float32]:
        """Return the planes, (n, 3, pixels), not yet multiplied by their scales."""
        n = len(self.begins) - 1
        places = self.of_planes(3 * self.size * np.arange(n))
        places += self.lit
        block = np.zeros(3 * n * self.size, np.float32)
        for c, channel in enumerate(self.numbers):
            block[c * self.size :][places] = as_singles(channel)
        return block.reshape(n, 3, self.size)

    def lit_of(self, i: int) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
        """Return the lit pixels of plane i and their numbers, (3, m)."""
        part = slice(self.begins[i], self.begins[i + 1])
        return self.lit[part], self.numbers[:, part]

    def entries(self, columns: Indices) -> tuple[Indices, Indices, npt.NDArray[np.float32]]:
        """Return lights, columns, (m,) each, and numbers, (3, m), of the pixels that have a column.

        columns: (pixels,), -1 for a pixel without one.
        """
        lights, its_columns = self.of_planes(np.arange(len(self.begins) - 1)), columns[self.lit]
        numbers = self.numbers
        if columns.min(initial=0) < 0:
            has_column = its_columns >= 0
            lights, its_columns = lights[has_column], its_columns[has_column]
            numbers = numbers[:, has_column]
        return lights, its_columns, as_singles(numbers)

    def sums_of_groups(self, groups: Indices, weight: Doubles, count: int) -> Doubles:
        """Return Σ of weighted numbers over each group of pixels, (3, n, count) float64.

        groups: (pixels,), the group of each pixel. weight: (pixels,).
        """
        n, weights = len(self.begins) - 1, weight[self.lit]
        places = self.of_planes(count * np.arange(n)) + groups[self.lit]
        sums = [
            np.bincount(places, as_singles(channel) * weights, minlength=n * count)
            for channel in self.numbers
        ]
        return np.reshape(sums, (3, n, count))

    def mix(self, weights: Doubles) -> Doubles:
        """Return Σ w_i of the planes, (3, pixels) float64. weights: (n, 3), with the scales."""
        from scipy.sparse import csc_array

        lit, begins = self.lit.astype(np.int32), self.begins.astype(np.int32)
        shape = self.size, len(weights)
        channels = (as_singles(channel).astype(np.float64) for channel in self.numbers)
        return np.stack(
            [csc_array((x, lit, begins), shape) @ weights[:, c] for c, x in enumerate(channels)]
        )


class LitPlanes(RowPlanes):
    """Planes of which only the lit pixels are in memory. planes: one for each light, which are
    copied. size: (height, width).
    """

    def __init__(self, planes: Sequence[LitPlane], size: tuple[int, int]) -> None:
        self._count, self._size = len(planes), size
        self._scales = np.array([plane.scale for plane in planes], np.float32)
        (height, width), step = size, self.strip_rows
        edges = [width * row for row in [*range(0, height, step), height]]
        self._begins = edges[:-1]  # of strips, in pixels
        self._mixes = KeptMixes()
        is_half = [plane.numbers.dtype == np.float16 for plane in planes]
        self._is_noisy = 2 * sum(is_half) > len(planes)
        # A few clean ones are kept whole, in float32.
        self._clean = {
            i: plane.dense(height * width)
            for i, plane in enumerate(planes)
            if self._is_noisy and not is_half[i]
        }
        kind = np.float16 if self._is_noisy else np.float32
        nothing = LitPlane(np.zeros(0, np.uint32), np.zeros((3, 0), kind), 1.0)
        same = [nothing if i in self._clean else x.in_kind(kind) for i, x in enumerate(planes)]
        # As lists, of which there are hundreds of thousands of slices.
        cuts = [np.searchsorted(x.pixels, np.array(edges, np.uint32)).tolist() for x in same]
        self._lit = [
            _LitStrip.of(same, [slice(cut[k], cut[k + 1]) for cut in cuts], slice(*ends))
            for k, ends in enumerate(with_progress(list(pairwise(edges)), "strips"))
        ]

    @property
    def count(self) -> int:
        """Number of lights."""
        return self._count

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) in pixels."""
        return self._size

    @property
    def nbytes(self) -> int:
        """Bytes of memory that the planes take."""
        return sum(strip.nbytes for strip in self._lit)

    @property
    def is_noisy(self) -> bool:
        """True if most planes are stored in half floats, whose rounding their noise hides."""
        return self._is_noisy

    def stored(self, i: int) -> LitPlane:
        """Return the plane of light i as it is stored."""
        scale = float(self._scales[i])
        if i in self._clean:
            return LitPlane.of([*self._clean[i]], scale)
        # One copy of all strips: there are many, of few lit pixels each.
        of_strips = [strip.lit_of(i) for strip in self._lit]
        lit = [x + np.uint32(y) for (x, _), y in zip(of_strips, self._begins, strict=True)]
        return LitPlane(
            np.concatenate(lit), np.concatenate([x for _, x in of_strips], axis=1), scale
        )

    def lit_plane(self, i: int) -> tuple[slice | Indices, Floats]:
        """Return pixels of light i, outside of which it is black, and their light, (3, p)."""
        pixels: slice | Indices
        if i in self._clean:
            pixels, values = slice(None), self._clean[i].copy()
        else:
            stored = self.stored(i)
            pixels, values = stored.pixels.astype(np.intp), as_singles(stored.numbers)
        if self._scales[i] != 1:
            values *= self._scales[i]
        return pixels, values

    def plane(self, i: int) -> Floats:
        """Return the plane of light i, (h, w, 3)."""
        pixels, values = self.lit_plane(i)
        plane = np.zeros((3, self._size[0] * self._size[1]), np.float32)
        plane[:, pixels] = values
        return np.ascontiguousarray(plane.T).reshape(*self._size, 3)

    def pixels(self, where: slice | Indices) -> Floats:
        """Return some pixels of all planes, (n, p, 3)."""
        if isinstance(where, slice) or (lit := self.lit_entries(where)) is None:
            return super().pixels(where)
        picked = np.zeros((3, *lit.shape), np.float32)
        picked.reshape(3, -1)[:, lit.places] = lit.values
        return picked.transpose(1, 2, 0)

    def rows(self, top: int, bottom: int) -> Floats:
        """Return rows `top` to `bottom` of all planes, (n, bottom - top, w, 3)."""
        (height, width), step = self._size, self.strip_rows
        top, bottom = max(top, 0), min(bottom, height)
        if top >= bottom:
            return np.zeros((self._count, 0, width, 3), np.float32)
        strips = [
            self._read_strip(k)[:, max(top - k * step, 0) : bottom - k * step]
            for k in range(top // step, -(-bottom // step))
        ]
        return strips[0] if len(strips) == 1 else np.concatenate(strips, axis=1)

    @cached_property
    def _is_mostly_black(self) -> bool:
        pixels = self._size[0] * self._size[1]
        lit = pixels * len(self._clean) + sum(strip.lit.size for strip in self._lit)
        return lit <= MAX_LIT_SHARE * self._count * pixels

    @property
    def strip_pixels(self) -> int:
        """Number of pixels of a strip, or 1 if `lit_entries` has none of them."""
        return self.strip_rows * self._size[1] if self._is_mostly_black else 1

    def lit_entries(self, where: slice | Indices) -> LitEntries | None:
        """Return the lit ones of some pixels, in row-major order, of all planes; None if many
        are.
        """
        pixels = self._size[0] * self._size[1]
        if not self._is_mostly_black:
            return None
        if isinstance(where, slice):
            where = np.arange(*where.indices(pixels))
        ends = np.searchsorted(where, [*self._begins, pixels])
        parts = []
        for k in np.flatnonzero(np.diff(ends)):
            inside = slice(ends[k], ends[k + 1])
            columns = np.full(self._lit[k].size, -1)
            columns[where[inside] - self._begins[k]] = np.arange(inside.start, inside.stop)
            parts.append(self._lit[k].entries(columns))
        for i, plane in self._clean.items():
            parts.append((np.full(len(where), i), np.arange(len(where)), plane[:, where]))
        lights, columns, values = (np.concatenate(x, axis=-1) for x in zip(*parts, strict=True))
        if (self._scales != 1).any():
            values *= self._scales[lights]
        return LitEntries(lights, columns, values, (self._count, len(where)))

    def _read_strip(self, k: int) -> Floats:
        """Return a strip, (n, rows, w, 3)."""
        block, begin = self._lit[k].decoded(), k * self.strip_rows * self._size[1]
        for i, plane in self._clean.items():
            block[i] = plane[:, begin : begin + block.shape[2]]
        if (self._scales != 1).any():
            block *= self._scales[:, None, None]
        return block.reshape(self._count, 3, -1, self._size[1]).transpose(0, 2, 3, 1)

    def mixes(self, weights: Doubles) -> npt.NDArray[np.float32]:
        """Return several sums Σ w_i Φ_i, (k, h, w, 3), in one walk. weights: (k, n, 3)."""
        mixed = np.stack([self.exact_mix(one).T for one in weights]).astype(np.float32)
        return mixed.reshape(len(weights), *self._size, 3)

    def power_and_totals(self, mask: Bools) -> tuple[Doubles, Doubles]:
        """Return ‖Φᵢ‖² over the counted pixels and Σ Φᵢ over all pixels, (n, 3) each."""
        counted, (power, totals) = mask.ravel(), np.zeros((2, self._count, 3))
        for k, begin in enumerate(with_progress(self._begins, "strips")):
            strip = self._lit[k]
            of_strip = strip.power_and_totals(counted[begin : begin + strip.size])
            power += of_strip[0]
            totals += of_strip[1]
        for i, plane in self._clean.items():
            power[i] = np.square(plane, dtype=np.float64) @ counted
            totals[i] = plane.sum(axis=1, dtype=np.float64)
        scales = self._scales.astype(np.float64)[:, None]
        return power * np.square(scales), totals * scales

    def block_sums(self, weight: Doubles, side: int, top: int, bottom: int) -> Doubles:
        """Return weighted sums over rows `top` to `bottom` of blocks of side × side pixels, (n,
        rows, columns, 3).

        weight: (h', w'), of pixels from the top left corner on; others are in no block. Smaller
        blocks are at its right and bottom edges.
        """
        (height, width), columns = weight.shape, -(-weight.shape[1] // side)
        sums = np.zeros((3, self._count, bottom - top, columns))
        first, last = top * side, min(bottom * side, height)
        weights = np.zeros(self._size)
        weights[first:last, :width] = weight[first:last]
        row, column = np.indices((self.strip_rows, self._size[1])).reshape(2, -1)
        # Pixels outside have no weight, whatever their block.
        column = np.minimum(column // side, columns - 1)
        step = self.strip_rows
        for k in with_progress(range(first // step, -(-last // step)), "strips"):
            strip = self._lit[k]
            begin = max(k * step // side - top, 0)  # of the blocks that it touches
            end = min(-(-(k * step + step) // side) - top, bottom - top)
            of_block = np.clip((row + k * step) // side - top, begin, end - 1) - begin
            groups = (of_block * columns + column)[: strip.size]
            start = k * step * self._size[1]
            of_strip = weights.ravel()[start : start + strip.size]
            found = strip.sums_of_groups(groups, of_strip, (end - begin) * columns)
            sums[:, :, begin:end] += found.reshape(3, self._count, end - begin, columns)
        for i, plane in self._clean.items():
            channels = plane.reshape(3, *self._size)[:, first:last, :width] * weight[first:last]
            sums[:, i] = [block_sums(channel, side) for channel in channels]
        scaled: Doubles = sums.transpose(1, 2, 3, 0) * self._scales[:, None, None, None]
        return scaled

    def exact_mix(self, weights: Doubles) -> Doubles:
        """Return Σ w_i Φ_i channel by channel, (3, p), summed in float64; read-only."""
        return self._mixes.get(weights, self._mix)

    def _mix(self, weights: Doubles) -> Doubles:
        scaled = weights * self._scales[:, None]
        strips = parallel_map(lambda strip: strip.mix(scaled), self._lit, unit="strips")
        mixed = np.concatenate(strips, axis=1)
        for i, plane in self._clean.items():
            mixed += scaled[i][:, None] * plane
        return np.asarray(mixed)


class LitCollector:
    """Planes that are collected light by light, as long as there is room for their lit pixels."""

    def __init__(self, size: tuple[int, int]) -> None:
        self._size, self._bytes = size, 0
        self._planes: dict[str, tuple[LitPlane, ...]] | None = {}

    def add(self, name: str, planes: Sequence[LitPlane]) -> None:
        """Add the planes of a light; drop all if they take too much memory."""
        if self._planes is None:
            return
        self._planes[name] = tuple(planes)
        self._bytes += sum(plane.nbytes for plane in planes)
        if self._bytes > MAX_BYTES:
            self._planes = None

    def planes(self, names: Sequence[str]) -> list[LitPlanes] | None:
        """Return each set of planes, in the order of `names`, and forget them; None if there was no
        room.
        """
        if self._planes is None:
            return None
        sets = list(zip(*(self._planes.pop(name) for name in names), strict=True))
        joined = []
        while sets:  # one is gone before the next is joined
            joined.append(LitPlanes(sets.pop(0), self._size))
            release_freed_memory()
        return joined
