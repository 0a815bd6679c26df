"""Strips of the lit pixels of many planes, in memory or in a temporary file."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Bools, Doubles, Floats, Indices, as_singles
from lightpaint.basis.file.file_planes import TemporaryArray

#: Number of planes of a strip that are looked for in the mapped file until its pages are released.
READS_PER_RELEASE = 64

#: The lit pixels of one plane in a strip, (m,), and their numbers, (3, m).
LitPart = tuple[npt.NDArray[Any], npt.NDArray[Any]]


@dataclass(frozen=True)
class LitStrip:
    """The lit pixels of all planes in some rows, plane by plane.

    lit: (m,) uint16 or uint32, their indices in the strip. numbers: (3, m). begins: (n + 1,), where
    the indices of each plane begin. size: number of pixels of the strip.
    """

    lit: npt.NDArray[Any]
    numbers: npt.NDArray[Any]
    begins: Indices
    size: int

    @classmethod
    def of(cls, parts: Sequence[LitPart], pixels: slice) -> "LitStrip":
        """Return a strip. parts: of each plane its lit pixels of the picture, (m,) uint32, and
        their numbers, (3, m). pixels: of the picture.
        """
        size = pixels.stop - pixels.start
        kind = np.uint16 if size <= 2**16 else np.uint32
        lit = np.concatenate([x for x, _ in parts])
        numbers = np.concatenate([x for _, x in parts], axis=1)
        begins = np.cumsum([0, *(x.size for x, _ in parts)])
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

    def lit_of(self, i: int) -> LitPart:
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

    def mixes(self, weights: Doubles) -> Doubles:
        """Return sums Σ w_i of the planes, (k, 3, pixels) float64. weights: (k, n, 3), with the
        scales.
        """
        from scipy.sparse import csc_array

        lit, begins = self.lit.astype(np.int32), self.begins.astype(np.int32)
        shape, mixed = (self.size, weights.shape[1]), np.empty((len(weights), 3, self.size))
        for c, channel in enumerate(self.numbers):
            light = csc_array((as_singles(channel).astype(np.float64), lit, begins), shape)
            for into, one in zip(mixed, weights, strict=True):
                into[c] = light @ one[:, c]
        return mixed


class StripsInMemory:
    """Strips in memory."""

    def __init__(self, strips: Iterable[LitStrip]) -> None:
        self._strips = list(strips)
        self.lit_count = sum(strip.lit.size for strip in self._strips)
        self.nbytes = sum(strip.nbytes for strip in self._strips)

    def strip(self, k: int) -> LitStrip:
        """Return the k-th strip."""
        return self._strips[k]

    def lit_of(self, k: int, i: int) -> LitPart:
        """Return the lit pixels of plane i in the k-th strip."""
        return self._strips[k].lit_of(i)

    def lit_of_planes(self, k: int, planes: Sequence[int]) -> list[LitPart]:
        """Return the same of several planes."""
        return [self._strips[k].lit_of(i) for i in planes]


class StripsInFile:
    """Strips in a temporary file, each of which is read at once. size: in bytes, of all, at most.

    Raises OSError if the disk is full.
    """

    def __init__(self, strips: Iterable[LitStrip], size: int, count: int) -> None:
        # Both arrays of a strip begin at a whole float32 of the file.
        self._file, end = TemporaryArray((size // 4 + 2 * count,)), 0
        self._strips: list[tuple[LitStrip, int, int]] = []  # without pixels, and where these are
        self.lit_count = self.nbytes = self._reads = 0
        for strip in strips:
            places = []
            for array in (strip.lit, strip.numbers):
                places.append(end)
                end = append_array(self._file, end, array)
            lit, numbers = strip.lit[:0].copy(), strip.numbers[:, :0].copy()
            self._strips.append((replace(strip, lit=lit, numbers=numbers), places[0], places[1]))
            self.lit_count += strip.lit.size
            self.nbytes += strip.nbytes

    def strip(self, k: int) -> LitStrip:
        """Return the k-th strip."""
        strip, *places = self._strips[k]
        m, arrays = int(strip.begins[-1]), []
        for first, empty, count in zip(places, (strip.lit, strip.numbers), (m, 3 * m), strict=True):
            words = np.empty(-(-count * empty.itemsize // 4), np.float32)
            self._file.read(first, words)
            arrays.append(words.view(empty.dtype)[:count])
        return replace(strip, lit=arrays[0], numbers=arrays[1].reshape(3, m))

    def lit_of_planes(self, k: int, planes: Sequence[int]) -> list[LitPart]:
        """Return the lit pixels of several planes in the k-th strip, which is read once."""
        strip = self.strip(k)
        return [(lit.copy(), numbers.copy()) for lit, numbers in map(strip.lit_of, planes)]

    def lit_of(self, k: int, i: int) -> LitPart:
        """Return the lit pixels of plane i in the k-th strip."""
        strip, *places = self._strips[k]
        m, part = int(strip.begins[-1]), slice(strip.begins[i], strip.begins[i + 1])
        kinds = strip.lit.dtype, strip.numbers.dtype
        lit, numbers = (
            mapped_array(self._file, *x) for x in zip(places, kinds, (m, 3 * m), strict=True)
        )
        found = np.array(lit[part]), np.array(numbers.reshape(3, m)[:, part])
        self._reads += 1
        if self._reads % READS_PER_RELEASE == 0:
            self._file.release()
        return found


def append_array(file: TemporaryArray, first: int, array: npt.NDArray[Any]) -> int:
    """Write the bytes of an array from a number of a file on; return the number after them."""
    words = np.zeros(-(-array.nbytes // 4), np.float32)
    words.view(np.uint8)[: array.nbytes] = np.ascontiguousarray(array).reshape(-1).view(np.uint8)
    file.write(first, words)
    return first + words.size


def mapped_array(
    file: TemporaryArray, first: int, kind: npt.DTypeLike, count: int
) -> npt.NDArray[Any]:
    """Return an array, (count,), of which `append_array` wrote the bytes, as part of the file."""
    words = -(-count * np.dtype(kind).itemsize // 4)
    return np.asarray(file.array[first : first + words]).view(kind)[:count]


class WholePlanes:
    """A few planes of all pixels, (3, p) float32 each, by the number of their light.

    planes: with their numbers, one after the other. size: p. in_memory: whether they stay there, or
    go to a temporary file. Raises OSError if the disk is full.
    """

    def __init__(
        self, planes: Iterable[tuple[int, Floats]], count: int, size: int, *, in_memory: bool
    ) -> None:
        self._size, self._places = size, dict[int, int]()
        self._array: Floats | TemporaryArray
        shape = count, 3, size
        self._array = (
            np.empty(shape, np.float32) if in_memory or not count else TemporaryArray(shape)
        )
        for place, (i, plane) in enumerate(planes):
            self._places[i] = place
            if isinstance(self._array, TemporaryArray):
                self._array.write(3 * size * place, plane)
            else:
                self._array[place] = plane

    def __len__(self) -> int:
        return len(self._places)

    def __iter__(self) -> Iterator[int]:
        return iter(self._places)

    def __contains__(self, i: int) -> bool:
        return i in self._places

    def pixels(self, i: int, first: int = 0, stop: int | None = None) -> Floats:
        """Return the pixels of plane i from `first` up to `stop`, by default all, (3, p)."""
        stop, place = self._size if stop is None else stop, self._places[i]
        if not isinstance(self._array, TemporaryArray):
            return self._array[place, :, first:stop]
        part = np.empty((3, stop - first), np.float32)
        for c, channel in enumerate(part):
            self._array.read((3 * place + c) * self._size + first, channel)
        return part
