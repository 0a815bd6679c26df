"""Planes of many lights, of which only the lit pixels are kept, in memory or in temporary files.

A light of a thousand reaches little of a picture, and few samples find even that: five of six
pixels are black. Each walk over the planes then takes a quarter of the time, and a tenth of the
memory of float32.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property, partial
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
from lightpaint.basis.file.file_planes import KeptMixes, RowPlanes, TemporaryArray
from lightpaint.basis.file.lit_strips import (
    LitPart,
    LitStrip,
    StripsInFile,
    StripsInMemory,
    WholePlanes,
    append_array,
    mapped_array,
)
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

#: Size in bytes of a set of planes up to which it stays in memory. With two larger ones, little
#: else of a solve or a painter fits into a gigabyte; strips of a file are read in a twentieth of
#: the time of a sum over them.
MAX_BYTES_IN_MEMORY = 2**27

#: Bytes of collected planes that go to one temporary file, and strips that are made of such planes
#: until the pages of the files are released.
SPOOLED_BYTES, STRIPS_PER_RELEASE = 2**26, 8

#: Number of planes that are taken out of all strips in one walk.
PLANES_PER_WALK = 128


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
        return self.in_kind(np.float32).at_its_pixels(pixels)

    def at_its_pixels(self, pixels: int) -> npt.NDArray[Any]:
        """Return the numbers of all pixels, (3, pixels), as stored."""
        plane, lit = np.zeros((3, pixels), self.numbers.dtype), self.pixels.astype(np.intp)
        # A third of the time that all three channels take at once.
        for into, channel in zip(plane, self.numbers, strict=True):
            into[lit] = channel
        return plane


class LitPlanes(RowPlanes):
    """Planes of which only the lit pixels are in memory. planes: one for each light, which are
    copied. size: (height, width). release: called from time to time while they are copied.
    """

    def __init__(
        self,
        planes: Sequence[LitPlane],
        size: tuple[int, int],
        release: Callable[[], None] = lambda: None,
    ) -> None:
        self.count, self.size = len(planes), size
        self._scales = np.array([plane.scale for plane in planes], np.float32)
        (height, width), step = size, self.strip_rows
        edges = [width * row for row in [*range(0, height, step), height]]
        self._begins = edges[:-1]  # of strips, in pixels
        self._mixes = KeptMixes()
        is_half = [plane.numbers.dtype == np.float16 for plane in planes]
        self.is_noisy = 2 * sum(is_half) > len(planes)
        # A few clean ones are kept whole, in float32.
        clean = [i for i in range(len(planes)) if self.is_noisy and not is_half[i]]
        kind = np.float16 if self.is_noisy else np.float32
        nothing = LitPlane(np.zeros(0, np.uint32), np.zeros((3, 0), kind), 1.0)
        same = [nothing if i in clean else x.in_kind(kind) for i, x in enumerate(planes)]
        # As lists, of which there are hundreds of thousands of slices.
        cuts = [np.searchsorted(x.pixels, np.array(edges, np.uint32)).tolist() for x in same]

        def strips() -> Iterator[LitStrip]:
            for k, ends in enumerate(with_progress(list(pairwise(edges)), "strips")):
                parts = [slice(cut[k], cut[k + 1]) for cut in cuts]
                pairs = zip(same, parts, strict=True)
                yield LitStrip.of([(x.pixels[y], x.numbers[:, y]) for x, y in pairs], slice(*ends))
                if k % STRIPS_PER_RELEASE == 0:
                    release()

        def keep(*, in_memory: bool) -> None:
            whole = ((i, planes[i].dense(height * width)) for i in clean)
            self._clean = WholePlanes(whole, len(clean), height * width, in_memory=in_memory)
            release()
            nbytes, count = sum(plane.nbytes for plane in same), len(edges) - 1
            kept = StripsInMemory if in_memory else partial(StripsInFile, size=nbytes, count=count)
            self._lit: StripsInMemory | StripsInFile = kept(strips())

        total = sum(plane.nbytes for plane in same) + 12 * len(clean) * height * width
        try:
            keep(in_memory=total <= MAX_BYTES_IN_MEMORY)
        except OSError:  # no room on the disk
            keep(in_memory=True)

    @property
    def nbytes(self) -> int:
        """Bytes of memory that the planes take."""
        return self._lit.nbytes

    def stored(self, i: int) -> LitPlane:
        """Return the plane of light i as it is stored."""
        scale = float(self._scales[i])
        if i in self._clean:
            return LitPlane.of([*self._clean.pixels(i)], scale)
        return self._joined(i, [self._lit.lit_of(k, i) for k in range(len(self._begins))])

    def _joined(self, i: int, of_strips: Sequence[LitPart]) -> LitPlane:
        """Return the plane of light i by its parts in all strips, of which it is a copy."""
        lit = [x + np.uint32(y) for (x, _), y in zip(of_strips, self._begins, strict=True)]
        numbers = np.concatenate([x for _, x in of_strips], axis=1)
        return LitPlane(np.concatenate(lit), numbers, float(self._scales[i]))

    def __iter__(self) -> Iterator[Floats]:
        progress = iter(with_progress(range(self.count), "lights"))
        for first in range(0, self.count, PLANES_PER_WALK):
            lights = range(first, min(first + PLANES_PER_WALK, self.count))
            parts = [self._lit.lit_of_planes(k, lights) for k in range(len(self._begins))]
            for i, of_strips in zip(lights, zip(*parts, strict=True), strict=True):
                next(progress, None)
                if i in self._clean:
                    yield self.plane(i)
                else:
                    stored = self._joined(i, of_strips)
                    yield self._dense(*self._light_of(stored))
        next(progress, None)

    def lit_plane(self, i: int) -> tuple[slice | Indices, Floats]:
        """Return pixels of light i, outside of which it is black, and their light, (3, p)."""
        if i not in self._clean:
            return self._light_of(self.stored(i))
        values = self._clean.pixels(i).copy()
        if self._scales[i] != 1:
            values *= self._scales[i]
        return slice(None), values

    def _light_of(self, stored: LitPlane) -> tuple[Indices, Floats]:
        """Return the lit pixels of a plane that is stored by them, and their light, (3, p)."""
        values = as_singles(stored.numbers)
        if stored.scale != 1:
            values *= np.float32(stored.scale)
        return stored.pixels.astype(np.intp), values

    def plane(self, i: int) -> Floats:
        """Return the plane of light i, (h, w, 3)."""
        return self._dense(*self.lit_plane(i))

    def _dense(self, pixels: slice | Indices, values: Floats) -> Floats:
        """Return the plane, (h, w, 3), with light, (3, p), in some pixels alone."""
        plane = np.zeros((3, self.size[0] * self.size[1]), np.float32)
        plane[:, pixels] = values
        return np.ascontiguousarray(plane.T).reshape(*self.size, 3)

    def pixels(self, where: slice | Indices) -> Floats:
        """Return some pixels of all planes, (n, p, 3)."""
        if isinstance(where, slice) or (lit := self.lit_entries(where)) is None:
            return super().pixels(where)
        picked = np.zeros((3, *lit.shape), np.float32)
        picked.reshape(3, -1)[:, lit.places] = lit.values
        return picked.transpose(1, 2, 0)

    def rows(self, top: int, bottom: int) -> Floats:
        """Return rows `top` to `bottom` of all planes, (n, bottom - top, w, 3)."""
        (height, width), step = self.size, self.strip_rows
        top, bottom = max(top, 0), min(bottom, height)
        if top >= bottom:
            return np.zeros((self.count, 0, width, 3), np.float32)
        strips = [
            self._read_strip(k)[:, max(top - k * step, 0) : bottom - k * step]
            for k in range(top // step, -(-bottom // step))
        ]
        return strips[0] if len(strips) == 1 else np.concatenate(strips, axis=1)

    @cached_property
    def _is_mostly_black(self) -> bool:
        pixels = self.size[0] * self.size[1]
        lit = pixels * len(self._clean) + self._lit.lit_count
        return lit <= MAX_LIT_SHARE * self.count * pixels

    @property
    def strip_pixels(self) -> int:
        """Number of pixels of a strip, or 1 if `lit_entries` has none of them."""
        return self.strip_rows * self.size[1] if self._is_mostly_black else 1

    def lit_entries(self, where: slice | Indices) -> LitEntries | None:
        """Return the lit ones of some pixels, in row-major order, of all planes; None if many
        are.
        """
        pixels = self.size[0] * self.size[1]
        if not self._is_mostly_black:
            return None
        if isinstance(where, slice):
            where = np.arange(*where.indices(pixels))
        ends = np.searchsorted(where, [*self._begins, pixels])
        parts = []
        for k in np.flatnonzero(np.diff(ends)):
            inside = slice(ends[k], ends[k + 1])
            strip = self._lit.strip(int(k))
            columns = np.full(strip.size, -1)
            columns[where[inside] - self._begins[k]] = np.arange(inside.start, inside.stop)
            parts.append(strip.entries(columns))
        first = int(where[0]) if len(where) else 0
        for i in self._clean if len(where) else ():
            plane = self._clean.pixels(i, first, int(where[-1]) + 1)
            parts.append((np.full(len(where), i), np.arange(len(where)), plane[:, where - first]))
        lights, columns, values = (np.concatenate(x, axis=-1) for x in zip(*parts, strict=True))
        if (self._scales != 1).any():
            values *= self._scales[lights]
        return LitEntries(lights, columns, values, (self.count, len(where)))

    def _read_strip(self, k: int) -> Floats:
        """Return a strip, (n, rows, w, 3)."""
        block, begin = self._lit.strip(k).decoded(), k * self.strip_rows * self.size[1]
        for i in self._clean:
            block[i] = self._clean.pixels(i, begin, begin + block.shape[2])
        if (self._scales != 1).any():
            block *= self._scales[:, None, None]
        return block.reshape(self.count, 3, -1, self.size[1]).transpose(0, 2, 3, 1)

    def mixes(self, weights: Doubles) -> npt.NDArray[np.float32]:
        """Return several sums Σ w_i Φ_i, (k, h, w, 3), in one walk. weights: (k, n, 3)."""
        if len(weights) == 1:  # which may be known
            mixed = self.exact_mix(weights[0])[None]
        else:
            mixed = self._exact_mixes(np.asarray(weights))
        images = mixed.transpose(0, 2, 1).astype(np.float32, order="C")
        return images.reshape(len(weights), *self.size, 3)

    def power_and_totals(self, mask: Bools) -> tuple[Doubles, Doubles]:
        """Return ‖Φᵢ‖² over the counted pixels and Σ Φᵢ over all pixels, (n, 3) each."""
        counted, (power, totals) = mask.ravel(), np.zeros((2, self.count, 3))
        for k, begin in enumerate(with_progress(self._begins, "strips")):
            strip = self._lit.strip(k)
            of_strip = strip.power_and_totals(counted[begin : begin + strip.size])
            power += of_strip[0]
            totals += of_strip[1]
        for i in self._clean:
            plane = self._clean.pixels(i)
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
        sums = np.zeros((3, self.count, bottom - top, columns))
        first, last = top * side, min(bottom * side, height)
        weights = np.zeros(self.size)
        weights[first:last, :width] = weight[first:last]
        row, column = np.indices((self.strip_rows, self.size[1])).reshape(2, -1)
        # Pixels outside have no weight, whatever their block.
        column = np.minimum(column // side, columns - 1)
        step = self.strip_rows
        for k in with_progress(range(first // step, -(-last // step)), "strips"):
            strip = self._lit.strip(k)
            begin = max(k * step // side - top, 0)  # of the blocks that it touches
            end = min(-(-(k * step + step) // side) - top, bottom - top)
            of_block = np.clip((row + k * step) // side - top, begin, end - 1) - begin
            groups = (of_block * columns + column)[: strip.size]
            start = k * step * self.size[1]
            of_strip = weights.ravel()[start : start + strip.size]
            found = strip.sums_of_groups(groups, of_strip, (end - begin) * columns)
            sums[:, :, begin:end] += found.reshape(3, self.count, end - begin, columns)
        for i in self._clean:
            plane = self._clean.pixels(i, first * self.size[1], last * self.size[1])
            rows = plane.reshape(3, last - first, self.size[1])
            channels = rows[:, :, :width] * weight[first:last]
            sums[:, i] = [block_sums(channel, side) for channel in channels]
        scaled: Doubles = sums.transpose(1, 2, 3, 0) * self._scales[:, None, None, None]
        return scaled

    def exact_mix(self, weights: Doubles) -> Doubles:
        """Return Σ w_i Φ_i channel by channel, (3, p), summed in float64; read-only."""
        return self._mixes.get(weights, lambda one: self._exact_mixes(np.array([one]))[0])

    def _exact_mixes(self, weights: Doubles) -> Doubles:
        """Return several exact mixes, (k, 3, p), in one walk. weights: (k, n, 3)."""
        scaled = weights * self._scales[:, None]
        numbers = range(len(self._begins))
        strips = parallel_map(lambda k: self._lit.strip(k).mixes(scaled), numbers, unit="strips")
        mixed = np.concatenate(strips, axis=2)
        for i in self._clean:
            mixed += scaled[:, i, :, None] * self._clean.pixels(i)
        return np.asarray(mixed)


class LitCollector:
    """Planes that are collected light by light, as long as there is room for their lit pixels, in
    memory or in temporary files.
    """

    def __init__(self, size: tuple[int, int]) -> None:
        self._size, self._bytes = size, 0
        self._planes: dict[str, tuple[LitPlane, ...]] | None = {}
        self._in_memory: list[str] = []
        self._files: list[TemporaryArray] = []

    def add(self, name: str, planes: Sequence[LitPlane]) -> None:
        """Add the planes of a light; drop all if they take too much room."""
        if self._planes is None:
            return
        self._planes[name] = tuple(planes)
        self._in_memory.append(name)
        self._bytes += sum(plane.nbytes for plane in planes)
        if self._bytes > MAX_BYTES:
            self._planes, self._files = None, []
        elif sum(x.nbytes for key in self._in_memory for x in self._planes[key]) > SPOOLED_BYTES:
            with suppress(OSError):  # no room on the disk
                self._spool(self._planes)
            self._in_memory = []

    def _spool(self, planes: dict[str, tuple[LitPlane, ...]]) -> None:
        """Move the planes in memory to a temporary file, of which they are parts then."""
        moved = [plane for key in self._in_memory for plane in planes[key]]
        file, end = TemporaryArray((sum(x.nbytes // 4 + 2 for x in moved),)), 0

        def of_file(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
            nonlocal end
            first, end = end, append_array(file, end, array)
            return mapped_array(file, first, array.dtype, array.size).reshape(array.shape)

        for key in self._in_memory:
            planes[key] = tuple(
                replace(x, pixels=of_file(x.pixels), numbers=of_file(x.numbers))
                for x in planes[key]
            )
        file.release()
        self._files.append(file)

    def planes(self, names: Sequence[str]) -> list[LitPlanes] | None:
        """Return each set of planes, in the order of `names`, and forget them; None if there was no
        room.
        """
        if self._planes is None:
            return None

        def release() -> None:
            for file in self._files:
                file.release()

        sets = list(zip(*(self._planes.pop(name) for name in names), strict=True))
        joined = []
        while sets:  # one is gone before the next is joined
            joined.append(LitPlanes(sets.pop(0), self._size, release))
            release_freed_memory()
        return joined
