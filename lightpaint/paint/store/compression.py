"""Arrays as bytes for a file: lossless, small where neighbours or two states are alike.

The bytes of numbers are sorted by their place in the number, since those in front hardly change
from pixel to pixel, and zlib does the rest: half the bytes of zlib alone, in half the time.
"""

import math
import zlib
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from lightpaint.errors import PaintError
from lightpaint.paint.store.canvas_pixels import Pixels, Region
from lightpaint.paint.store.history_steps import Patch

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


def unpack_patch(
    places: Sequence[tuple[Region, bool]], k: int, before: bytes, change: bytes
) -> tuple[Pixels, Pixels]:
    """Return the pixels before and after of patch k, to the last bit.

    places: region of each patch of the step, and whether it is marked. Raises PaintError for a
    damaged file.
    """
    ends = np.cumsum([0, *(_value_count(*place) for place in places)]).tolist()
    before_bits, change_bits = (
        np.asarray(unpack(x, "uint32", (ends[-1],)))[ends[k] : ends[k + 1]]
        for x in (before, change)
    )
    return _from_bits(before_bits, *places[k]), _from_bits(before_bits ^ change_bits, *places[k])


def pack_pixels(pixels: Pixels) -> bytes:
    """Return the pixels of a region, packed."""
    height, width = pixels.importance.shape
    return _pack_parts(_to_bits(pixels, (0, height, 0, width), pixels.at_least is not None))


def unpack_pixels(data: bytes, region: Region, *, marked: bool) -> Pixels:
    """Return the pixels that `pack_pixels` packed. Raises PaintError for anything else."""
    bits = unpack(data, "uint32", (_value_count(region, marked),))
    return _from_bits(bits, region, marked)


def _size(region: Region) -> tuple[int, int]:
    top, bottom, left, right = region
    return bottom - top, right - left


def _value_count(region: Region, marked: bool) -> int:
    """Return how many numbers a region has: light, importance, and 32 marks in each."""
    pixels = math.prod(_size(region))
    return 4 * pixels + marked * -(-3 * pixels // 32)


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
    return bits if bits.any() else np.broadcast_to(np.uint32(0), bits.shape)


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
        return np.broadcast_to(np.uint32(0), (values.size,))
    return _packed_zeros(np.ascontiguousarray(values, np.float32).reshape(-1).view(np.uint32))


def _from_bits(bits: npt.NDArray[np.generic], region: Region, marked: bool) -> Pixels:
    size = _size(region)
    light, end = 3 * math.prod(size), 4 * math.prod(size)
    values = np.ascontiguousarray(bits).view(np.float32)
    values.flags.writeable = False
    at_least = None
    if marked:
        flags = np.unpackbits(np.asarray(bits[end:]).astype("<u4").view(np.uint8), count=light)
        at_least = flags.view(bool).reshape(*size, 3) if flags.any() else None
    return Pixels(values[:light].reshape(*size, 3), values[light:end].reshape(size), at_least)
