"""Arrays as bytes for a file: lossless, small where neighbours or two states are alike.

The bytes of numbers are sorted by their place in the number, since those in front hardly change
from pixel to pixel, and zlib does the rest: half the bytes of zlib alone, in half the time.
"""

import math
import zlib
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.errors import PaintError
from lightpaint.paint.store.history_steps import Patch, Pixels, Region

#: The fastest level, since strokes must not wait.
ZLIB_LEVEL = 1

#: Head and end of a zlib stream (RFC 1950, 1951); between them are blocks, each packed alone.
ZLIB_HEAD, ZLIB_END = b"\x78\x01", b"\x03\x00"

#: Zeros that are packed at a time.
ZEROS_LENGTH = 2**20
_ZEROS = memoryview(bytes(ZEROS_LENGTH))


def pack(array: npt.NDArray[np.generic]) -> bytes:
    """Return the values of `array` as compressed bytes, without shape and type."""
    plain = np.ascontiguousarray(array, array.dtype.newbyteorder("<"))
    rows = plain.reshape(-1).view(np.uint8).reshape(-1, plain.itemsize)
    return zlib.compress(np.ascontiguousarray(rows.T).data, ZLIB_LEVEL)


def unpack(data: bytes, dtype: str, shape: tuple[int, ...]) -> npt.NDArray[np.generic]:
    """Return the array that `pack` compressed. Raises PaintError for bytes of anything else.

    No more is unpacked than such an array has.
    """
    kind = np.dtype(dtype).newbyteorder("<")
    size = math.prod(shape) * kind.itemsize
    try:
        unpacking = zlib.decompressobj()
        plain = unpacking.decompress(data, size + 1)
    except zlib.error as error:
        raise PaintError(f"a damaged picture: {error}") from None
    if len(plain) != size:
        raise PaintError(f"a damaged picture: {len(plain)} bytes, not {size}")
    rows = np.frombuffer(plain, np.uint8).reshape(kind.itemsize, -1)
    if not rows.any():  # as before the first stroke on a layer
        return np.zeros(shape, kind)
    return np.ascontiguousarray(rows.T).reshape(-1).view(kind).reshape(shape)


def is_marked(patch: Patch) -> bool:
    """Return whether a patch has "at least" marks, before or after: its bytes then hold them."""
    return patch.before.at_least is not None or patch.after.at_least is not None


def pack_patches(patches: Sequence[Patch]) -> tuple[bytes, bytes]:
    """Return the pixels before a step, and their XOR with those after it: zero where it
    left them.
    """
    before, change = [], []
    for patch in patches:
        region, marked = patch.region, is_marked(patch)
        first, last = (_to_bits(pixels, region, marked) for pixels in (patch.before, patch.after))
        before += first
        change += [_changed_bits(*pair) for pair in zip(first, last, strict=True)]
    return _pack_parts(before), _pack_parts(change)


def unpack_patches(
    places: Sequence[tuple[Region, bool]], before: bytes, change: bytes
) -> list[tuple[Pixels, Pixels]]:
    """Return the pixels before and after each patch of a step, to the last bit.

    places: region of each patch, and whether it is marked. Raises PaintError for a damaged file.
    """
    counts = [count for place in places for count in _part_counts(*place)]
    firsts, changes = iter(_unpack_parts(before, counts)), iter(_unpack_parts(change, counts))
    pairs = []
    for region, marked in places:
        first = [next(firsts) for _ in _part_counts(region, marked)]
        last = [_changed_bits(bits, next(changes)) for bits in first]
        pairs.append((_from_parts(first, region), _from_parts(last, region)))
    return pairs


def pack_pixels(pixels: Pixels) -> bytes:
    """Return the pixels of a region, packed."""
    height, width = pixels.importance.shape
    return _pack_parts(_to_bits(pixels, (0, height, 0, width), pixels.at_least is not None))


def unpack_pixels(data: bytes, region: Region, *, marked: bool) -> Pixels:
    """Return the pixels that `pack_pixels` packed. Raises PaintError for anything else."""
    return _from_parts(_unpack_parts(data, _part_counts(region, marked)), region)


def _size(region: Region) -> tuple[int, int]:
    top, bottom, left, right = region
    return bottom - top, right - left


def _part_counts(region: Region, marked: bool) -> list[int]:
    """Return how many numbers light, importance and marks have; a number holds 32 marks."""
    pixels = math.prod(_size(region))
    return [3 * pixels, pixels] + [-(-3 * pixels // 32)] * marked


def _pack_parts(parts: Sequence[npt.NDArray[np.uint32]]) -> bytes:
    """Return what `pack` returns for the parts one after the other.

    Parts of zeros, such as the colour of masks, are never made: they have one stride of no length.
    """
    blocks, check = [ZLIB_HEAD], 1
    for byte in range(4):
        for part in parts:
            if part.strides == (0,):
                for start in range(0, part.size, ZEROS_LENGTH):
                    count = min(ZEROS_LENGTH, part.size - start)
                    blocks.append(_zeros_block(count))
                    check = zlib.adler32(_ZEROS[:count], check)
            else:
                values = part.astype("<u4", copy=False).view(np.uint8).reshape(-1, 4)[:, byte]
                data = np.ascontiguousarray(values).data
                blocks.append(_block(data, ZLIB_LEVEL))
                check = zlib.adler32(data, check)
    return b"".join([*blocks, ZLIB_END, check.to_bytes(4, "big")])


def _block(data: bytes | memoryview, level: int) -> bytes:
    """Return data as a part of a zlib stream that refers to no other part."""
    packing = zlib.compressobj(level, zlib.DEFLATED, -zlib.MAX_WBITS)
    return packing.compress(data) + packing.flush(zlib.Z_FULL_FLUSH)


@lru_cache(64)
def _zeros_block(count: int) -> bytes:
    """Return zeros as a part of a zlib stream: a session has masks of few sizes."""
    return _block(_ZEROS[:count], 9)


def _packed_zeros(bits: npt.NDArray[np.uint32]) -> npt.NDArray[np.uint32]:
    """Return the same numbers, without memory if all are zero."""
    return bits if bits.any() else _zero_bits(bits.size)


def _changed_bits(
    before: npt.NDArray[np.uint32], after: npt.NDArray[np.uint32]
) -> npt.NDArray[np.uint32]:
    """Return the XOR of two parts. Those without memory are zero."""
    if before.strides == (0,):
        return after
    return before if after.strides == (0,) else _packed_zeros(before ^ after)


def _to_bits(pixels: Pixels, region: Region, marked: bool) -> list[npt.NDArray[np.uint32]]:
    """Return light, importance and marks of a region, each (n,): zeros without memory."""
    image, importance, at_least = pixels
    size = _size(region)
    marks = at_least if at_least is not None else np.zeros((*size, 3), bool)
    if image.shape != (*size, 3) or importance.shape != size or marks.shape != image.shape:
        shapes = " and ".join(str(x.shape) for x in (image, importance, marks))
        raise PaintError(f"pixels of shapes {shapes} for the region {region}")
    flat = [_float_bits(image), _float_bits(importance)]
    if marked:
        padded = np.zeros(32 * -(-marks.size // 32), bool)
        padded[: marks.size] = marks.reshape(-1)
        flat.append(np.packbits(padded).view("<u4").astype(np.uint32))
    return flat


def _float_bits(values: npt.NDArray[np.floating]) -> npt.NDArray[np.uint32]:
    """Return the bits of numbers, (n,): zeros without memory."""
    if not any(values.strides) and not values.view(np.uint32).any():
        return _zero_bits(values.size)
    return _packed_zeros(np.ascontiguousarray(values, np.float32).reshape(-1).view(np.uint32))


def _unpack_parts(data: bytes, counts: Sequence[int]) -> list[npt.NDArray[np.uint32]]:
    """Return the parts that `_pack_parts` packed: zeros without memory. counts: numbers of each."""
    unpacking, parts = zlib.decompressobj(), [_zero_bits(count) for count in counts]
    filled = [(k, count) for k, count in enumerate(counts) if count]
    for byte in range(4):
        for k, count in filled:
            plain = np.frombuffer(_unpacked(unpacking, data, count), np.uint8)
            data = unpacking.unconsumed_tail
            if not plain.any():
                continue
            if parts[k].strides == (0,):
                parts[k] = np.zeros(count, np.dtype("<u4"))
            parts[k].view(np.uint8).reshape(-1, 4)[:, byte] = plain
    if not unpacking.eof and _unpacked(unpacking, data, 1, is_end=True):
        raise PaintError("a damaged picture: more bytes than it has")
    return parts


def _unpacked(unpacking: Any, data: bytes, count: int, *, is_end: bool = False) -> bytes:
    """Return the next bytes of a stream. Raises PaintError if there are fewer, unless `is_end`."""
    pieces: list[bytes] = []
    left = count
    try:
        while left:
            pieces.append(unpacking.decompress(data, left))
            data, left = unpacking.unconsumed_tail, left - len(pieces[-1])
            if not pieces[-1]:
                break
    except zlib.error as error:
        raise PaintError(f"a damaged picture: {error}") from None
    if left and not is_end:
        raise PaintError(f"a damaged picture: {left} bytes are missing")
    return b"".join(pieces)


def _zero_bits(count: int) -> npt.NDArray[np.uint32]:
    return np.broadcast_to(np.uint32(0), (count,))


def _from_parts(parts: Sequence[npt.NDArray[np.uint32]], region: Region) -> Pixels:
    """Return the pixels of light, importance and maybe marks; they cannot be written."""
    light, importance, *marks = parts
    size = _size(region)
    at_least = None
    if marks:
        flags = np.unpackbits(marks[0].astype("<u4").view(np.uint8), count=light.size)
        at_least = flags.view(bool).reshape(*size, 3) if flags.any() else None
    return Pixels(_floats(light, (*size, 3)), _floats(importance, size), at_least)


def _floats(bits: npt.NDArray[np.uint32], shape: tuple[int, ...]) -> npt.NDArray[np.float32]:
    """Return bits as numbers that cannot be written."""
    if bits.strides == (0,):
        return np.broadcast_to(np.float32(0), shape)
    values = np.ascontiguousarray(bits, np.uint32).view(np.float32).reshape(shape)
    values.flags.writeable = False
    return values
