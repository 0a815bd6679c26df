"""Planes whose rows are read on demand, so that they may exceed memory.

The rows come from a basis file, from other planes, or from a temporary file.
"""

import mmap
import os
import tempfile
from collections import OrderedDict
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from contextlib import suppress
from functools import cached_property
from threading import Lock
from typing import ClassVar
from weakref import finalize, ref

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles, Floats, Indices, read_only
from lightpaint.basis.file.light_channels import PLANE_CHANNELS, LitRows, is_lit_part
from lightpaint.basis.planes import MemoryPlanes, Planes, PlanesBase, as_slice, mix
from lightpaint.images.formats import PartLayout, RowFile
from lightpaint.threads import parallel_map

#: Bytes of recently read strips of rows of some planes that are kept, and the number of these
#: strips, so that each thread can walk along one of them.
STRIP_CACHE_BYTES, STRIP_CACHE_COUNT = 2**26, (os.cpu_count() or 1) + 2

#: Number of planes of which strips are kept: walks go along images and their noise, and one at a
#: time along something else.
WALKED_PLANES = 3

#: Maximum size in bytes of planes of which a copy is in memory rather than in a temporary file.
UNSPOOLED_MAX_BYTES = 2**28

#: Maximum size in bytes of exact mixes that are kept, of which one always is.
MIXES_MAX_BYTES = 2**24

#: Maximum size in bytes of picked pixels that are copied into memory.
PICKED_MAX_BYTES = 2**27


class RowPlanes(PlanesBase):
    """Planes that are read by rows; subclasses implement `rows`.

    Walks over pixels visit the same rows repeatedly, so a few strips of rows are kept. chunk_rows:
    number of rows that the file stores as one chunk, which can only be read together.
    """

    chunk_rows = 1

    @cached_property
    def strip_rows(self) -> int:
        """Number of rows in a strip."""
        step = max(1, STRIP_CACHE_BYTES // (STRIP_CACHE_COUNT * 12 * self.count * self.size[1]))
        # Whole chunks of the file; otherwise a chunk on a boundary would be unpacked twice.
        return max(step // self.chunk_rows, 1) * self.chunk_rows

    @cached_property
    def _strips(self) -> "_StripCache":
        return _StripCache()

    def pixels(self, where: slice | Indices) -> Floats:
        """Return some pixels of all planes, (n, p, 3)."""
        height, width = self.size
        length = self.strip_rows * width
        if isinstance(where, slice):
            start, stop, step = where.indices(height * width)
            if step != 1:
                return self.pixels(np.arange(start, stop, step))
            parts = [
                self._strip(k)[:, max(start - k * length, 0) : stop - k * length]
                for k in range(start // length, max(-(-stop // length), start // length + 1))
            ]
            return parts[0] if len(parts) == 1 else joined_pixels(parts)
        picked = np.empty((self.count, 3, len(where)), np.float32)
        of_strip = where // length
        for k in np.unique(of_strip):
            in_strip = np.flatnonzero(of_strip == k)
            places, strip = where[in_strip] - k * length, self._strip(int(k)).transpose(0, 2, 1)
            if strip.flags.c_contiguous:  # of which `take` needs no copy
                picked[:, :, as_slice(in_strip)] = strip.take(places, axis=2)
            else:
                picked[:, :, in_strip] = strip[:, :, places]
        return picked.transpose(0, 2, 1)

    def _strip(self, k: int) -> Floats:
        """Return the pixels of a strip, (n, p, 3)."""
        strip = self._strips.get(k, self._read_strip)
        return strip.reshape(self.count, -1, 3)

    def _read_strip(self, k: int) -> Floats:
        """Read a strip, (n, rows, w, 3)."""
        step = self.strip_rows
        return self.rows(k * step, min((k + 1) * step, self.size[0]))

    def picked(self, where: slice | Indices) -> Planes:
        """Return these pixels as planes with a single row, copied into memory if they are few."""
        height, width = self.size
        if isinstance(where, slice):
            where = np.arange(height * width)[where]
        if self.count * len(where) * 12 <= PICKED_MAX_BYTES:
            return MemoryPlanes(np.ascontiguousarray(self.pixels(where)[:, None]))
        return PickedPlanes(self, where)

    def mixes(self, weights: Doubles) -> npt.NDArray[np.float32]:
        """Return several sums Σ w_i Φ_i, (k, h, w, 3), in one walk. weights: (k, n, 3)."""
        (height, width), step = self.size, self.strip_rows
        mixed = np.empty((len(weights), height, width, 3), np.float32)

        def fill(top: int) -> None:
            rows = self.rows(top, min(top + step, height))
            for into, one in zip(mixed, weights, strict=True):
                into[top : top + step] = mix(rows, one)

        parallel_map(fill, range(0, height, step), unit="strips")
        return mixed

    def replaced(self, planes: Mapping[int, Floats]) -> Planes:
        """Return planes in which some lights have other planes, (h, w, 3) each."""
        return ReplacedPlanes(self, planes)

    def array(self) -> Floats:
        """Return all planes, (n, h, w, 3). The whole array must fit in memory."""
        return np.ascontiguousarray(self.rows(0, self.size[0]))


class KeptMixes:
    """The latest exact mixes of planes that never change: a solve and its analysis ask for the
    same picture several times.
    """

    def __init__(self) -> None:
        self._latest: tuple[tuple[bytes, Doubles], ...] = ()  # by weights

    def get(self, weights: Doubles, make: Callable[[Doubles], Doubles]) -> Doubles:
        """Return the mix of weights, (n, 3), read-only; `make` makes one that is not kept."""
        key = np.asarray(weights, np.float64).tobytes()
        for known, mixed in self._latest:
            if known == key:
                return mixed
        mixed = read_only(make(weights))
        count = max(1, MIXES_MAX_BYTES // max(mixed.nbytes, 1))
        self._latest = ((key, mixed), *self._latest)[:count]
        return mixed


class _StripCache:
    """The strips of rows that were read last.

    It does not know the planes, so that both vanish with the last reference to these. Caches that
    were used long ago lose their strips to others.
    """

    #: The caches, the one that was used last at the end.
    _used: ClassVar["OrderedDict[int, ref[_StripCache]]"] = OrderedDict()
    _used_lock = Lock()

    def __init__(self) -> None:
        self._strips: OrderedDict[int, Future[Floats]] = OrderedDict()
        self._lock = Lock()

    def _release_others(self) -> None:
        """Forget the strips of all but the caches that were used last."""
        with self._used_lock:
            self._used[id(self)] = ref(self)
            self._used.move_to_end(id(self))
            unused = []
            while len(self._used) > WALKED_PLANES:
                unused.append(self._used.popitem(last=False)[1]())
        for cache in unused:
            if cache is not None:
                with cache._lock:
                    cache._strips.clear()

    def get(self, k: int, read: Callable[[int], Floats]) -> Floats:
        """Return the k-th strip, which `read(k)` reads; wait for a thread that is about it."""
        self._release_others()
        with self._lock:
            strip = self._strips.get(k)
            is_mine = strip is None
            if strip is None:
                strip = self._strips[k] = Future()
            self._strips.move_to_end(k)
            while len(self._strips) > STRIP_CACHE_COUNT:
                self._strips.popitem(last=False)
        if is_mine:
            try:
                strip.set_result(read(k))
            except BaseException as error:
                with self._lock:
                    self._strips.pop(k, None)
                strip.set_exception(error)
        return strip.result()


class FilePlanes(RowPlanes):
    """Planes in parts of an OpenEXR file.

    parts: one for each light, with pictures of the same size. number: index of the planes into
    `PLANE_CHANNELS`. scales: factor for the stored numbers of each part.
    """

    def __init__(
        self,
        file: RowFile,
        parts: Sequence[PartLayout],
        number: int,
        scales: Sequence[float] | None = None,
    ) -> None:
        self._file, self._parts, self._number = file, tuple(parts), number
        self.count, self.size = len(parts), parts[0].display
        name = PLANE_CHANNELS[number][0]
        halves = (is_lit_part(x.channels) or x.channels[name].itemsize == 2 for x in parts)
        self.is_noisy = 2 * sum(halves) > self.count
        self.chunk_rows = max(part.lines for part in parts)
        self._scales = tuple(scales or (1.0 for _ in parts))
        self._lit_rows: dict[int, LitRows] = {}

    def plane(self, i: int) -> Floats:
        """Return the plane of light i, (h, w, 3)."""
        height, width = self.size
        image = np.empty((height, width, 3), np.float32)
        self._read(i, 0, height, image.transpose(2, 0, 1))
        return image

    def rows(self, top: int, bottom: int) -> Floats:
        """Return rows `top` to `bottom` of all planes, (n, bottom - top, w, 3)."""
        top, bottom = max(top, 0), min(bottom, self.size[0])
        # Channels first, which is how they are stored and summed.
        block = np.empty((self.count, 3, max(bottom - top, 0), self.size[1]), np.float32)
        for i, rows in enumerate(block):
            self._read(i, top, bottom, rows)
        return block.transpose(0, 2, 3, 1)

    def _read(self, i: int, top: int, bottom: int, into: Floats) -> None:
        """Read rows of light i into (3, bottom - top, w)."""
        part = self._parts[i]
        if is_lit_part(part.channels):
            if i not in self._lit_rows:
                self._lit_rows[i] = LitRows.of(self._file, part)
            self._lit_rows[i].read(self._file, part, slice(top, bottom), self._number, into)
        else:
            names = PLANE_CHANNELS[self._number]
            self._file.read_rows(part, top, bottom, names, into)
        if self._scales[i] != 1:
            into *= np.float32(self._scales[i])


class PickedPlanes(RowPlanes):
    """Selected pixels of other planes as a single row, read on demand."""

    def __init__(self, whole: RowPlanes, where: Indices) -> None:
        self._whole, self._where = whole, where
        self.count, self.size, self.is_noisy = whole.count, (1, len(where)), whole.is_noisy

    def plane(self, i: int) -> Floats:
        """Return the plane of light i, (1, p, 3)."""
        return self._whole.plane(i).reshape(-1, 3)[self._where][None]

    def rows(self, top: int, bottom: int) -> Floats:
        """Return the single row of all planes, (n, 1, p, 3), or no row if it is outside the
        range.
        """
        return self.pixels(slice(0, len(self._where)))[:, None][:, top:bottom]

    def pixels(self, where: slice | Indices) -> Floats:
        """Return some pixels of all planes, (n, p, 3)."""
        return self._whole.pixels(self._where[where])

    def mixes(self, weights: Doubles) -> npt.NDArray[np.float32]:
        """Return several sums Σ w_i Φ_i, (k, 1, p, 3)."""
        whole = self._whole.mixes(weights)
        return whole.reshape(len(whole), -1, 3)[:, None, self._where]

    def exact_mix(self, weights: Doubles) -> Doubles:
        """Return Σ w_i Φ_i channel by channel, (3, p), summed in float64."""
        return self._whole.exact_mix(weights)[:, self._where]


class ReplacedPlanes(RowPlanes):
    """Planes of which some lights have been replaced."""

    def __init__(self, whole: RowPlanes, planes: Mapping[int, Floats]) -> None:
        self._whole, self._planes = whole, dict(planes)
        self.count, self.size, self.chunk_rows = whole.count, whole.size, whole.chunk_rows

    def plane(self, i: int) -> Floats:
        """Return the plane of light i, (h, w, 3)."""
        return self._planes[i] if i in self._planes else self._whole.plane(i)

    def rows(self, top: int, bottom: int) -> Floats:
        """Return rows `top` to `bottom` of all planes, (n, bottom - top, w, 3)."""
        block = self._whole.rows(top, bottom)
        for k, plane in self._planes.items():
            block[k] = plane[top:bottom]
        return block


def joined_pixels(parts: Sequence[Floats]) -> Floats:
    """Return pixels of the same planes, (n, p, 3) each, one after the other.

    Channels come first in memory, which is how they are stored and summed.
    """
    joined = np.empty((len(parts[0]), 3, sum(x.shape[1] for x in parts)), np.float32)
    np.concatenate([x.transpose(0, 2, 1) for x in parts], axis=2, out=joined)
    return joined.transpose(0, 2, 1)


def spooled(planes: Planes) -> Planes:
    """Return planes in memory unchanged, and others copied: small ones into memory, large ones to a
    temporary file.

    If the file does not fit on the disk, planes are returned unchanged and computed on each
    request.
    """
    if not isinstance(planes, RowPlanes):
        return planes
    if 12 * planes.count * planes.size[0] * planes.size[1] <= UNSPOOLED_MAX_BYTES:
        channels = np.empty((planes.count, 3, *planes.size), np.float32)
        fill_channels(planes, channels)
        return MemoryPlanes(channels.transpose(0, 2, 3, 1))
    with suppress(OSError):
        return SpooledPlanes(planes)
    return planes


def fill_channels(planes: RowPlanes, into: Floats) -> None:
    """Copy planes strip by strip `into` an array, (n, 3, h, w), channels first: so they are
    summed.
    """
    step = planes.strip_rows
    for top in range(0, planes.size[0], step):
        rows = planes.rows(top, min(top + step, planes.size[0]))
        into[:, :, top : top + step] = rows.transpose(0, 3, 1, 2)


class SpooledPlanes(RowPlanes):
    """A copy of planes in a temporary file, strip by strip, each of which is read at once.

    Raises OSError if the disk is full.
    """

    def __init__(self, planes: RowPlanes) -> None:
        self.count, self.size = planes.count, planes.size
        self._file = TemporaryArray((planes.count * 3 * planes.size[0] * planes.size[1],))
        for top, bottom in self._ranges(0, planes.size[0]):
            rows = planes.rows(top, bottom)
            self._file.write(self._place(top), rows.transpose(0, 3, 1, 2))

    def _ranges(self, top: int, bottom: int) -> list[tuple[int, int]]:
        """Return the first row and the end of each strip that some rows touch."""
        step, height = self.strip_rows, self.size[0]
        starts = range(top // step * step, bottom, step)
        return [(start, min(start + step, height)) for start in starts]

    def _place(self, top: int) -> int:
        """Return the number of values before the strip that begins at a row."""
        return 3 * self.count * top * self.size[1]

    def plane(self, i: int) -> Floats:
        """Return the plane of light i, (h, w, 3)."""
        height, width = self.size
        image = np.empty((height, width, 3), np.float32)
        for top, bottom in self._ranges(0, height):
            strip = np.empty((3, bottom - top, width), np.float32)
            self._file.read(self._place(top) + i * strip.size, strip)
            image[top:bottom] = strip.transpose(1, 2, 0)
        return image

    def rows(self, top: int, bottom: int) -> Floats:
        """Return rows `top` to `bottom` of all planes, (n, bottom - top, w, 3)."""
        top, bottom = max(top, 0), min(bottom, self.size[0])
        parts = []
        for first, end in self._ranges(top, bottom):
            strip = np.empty((self.count, 3, end - first, self.size[1]), np.float32)
            self._file.read(self._place(first), strip)
            parts.append(strip[:, :, max(top - first, 0) : bottom - first])
        if not parts:
            return np.zeros((self.count, 0, self.size[1], 3), np.float32)
        block = parts[0] if len(parts) == 1 else np.concatenate(parts, axis=2)
        return block.transpose(0, 2, 3, 1)


class TemporaryArray:
    """A float32 array, initially zero, in a temporary file that is deleted with it.

    Raises OSError if the temporary folder is full.
    """

    def __init__(self, shape: tuple[int, ...]) -> None:
        with tempfile.TemporaryFile() as file:
            if hasattr(os, "posix_fallocate"):  # or a full disk would kill the process later
                os.posix_fallocate(file.fileno(), 0, 4 * int(np.prod(shape)))
            self.array = np.memmap(file, np.float32, "r+", shape=shape)  # keeps the file open
            self._file = os.dup(file.fileno())
        finalize(self, os.close, self._file)

    def read(self, first: int, into: Floats) -> None:
        """Read numbers from the one with index `first` on, in row-major order.

        Calls of the system take less time than page faults in the mapped array, and leave no pages
        in the memory of the process. into: contiguous float32.
        """
        part = into.reshape(-1).view(np.uint8).data
        if not hasattr(os, "preadv"):
            into.reshape(-1)[...] = self.array.reshape(-1)[first : first + into.size]
            self.release()
            return
        begin = 4 * first
        while part.nbytes and (count := os.preadv(self._file, [part], begin)):
            part, begin = part[count:], begin + count

    def write(self, first: int, numbers: Floats) -> None:
        """Write numbers from the one with index `first` on, in row-major order."""
        part = np.ascontiguousarray(numbers, np.float32).reshape(-1).view(np.uint8).data
        if not hasattr(os, "pwrite"):
            self.array.reshape(-1)[first : first + numbers.size] = numbers.reshape(-1)
            self.release()
            return
        begin = 4 * first
        while part.nbytes:
            count = os.pwrite(self._file, part, begin)
            part, begin = part[count:], begin + count

    def release(self) -> None:
        """Release the memory of the parts that were read or written; the file keeps their
        content.
        """
        if hasattr(mmap, "MADV_DONTNEED"):
            self.array._mmap.madvise(mmap.MADV_DONTNEED)  # type: ignore[attr-defined]
