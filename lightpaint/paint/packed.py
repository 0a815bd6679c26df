"""Arrays as bytes for a file: lossless, small where neighbours or two states are alike.

The bytes of numbers are sorted by their place in the number, since those in front hardly change
from pixel to pixel, and zlib does the rest: half the bytes of zlib alone, in half the time.
"""

import math
import zlib
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from lightpaint.errors import PaintError
from lightpaint.paint.steps import Patch, Pixels, Region

#: Of zlib: quick, which is what counts under the hand.
LEVEL = 1


def packed(array: npt.NDArray[np.generic]) -> bytes:
    """The values of `array`, little endian; shape and type are kept elsewhere."""
    plain = np.ascontiguousarray(array, array.dtype.newbyteorder("<"))
    rows = plain.reshape(-1).view(np.uint8).reshape(-1, plain.itemsize)
    return zlib.compress(np.ascontiguousarray(rows.T).data, LEVEL)


def unpacked(data: bytes, dtype: str, shape: tuple[int, ...]) -> npt.NDArray[np.generic]:
    """What `packed` made bytes of. Raises PaintError for bytes of anything else.

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
    return np.ascontiguousarray(rows.T).reshape(-1).view(kind).reshape(shape)


def packed_patches(patches: Sequence[Patch]) -> tuple[bytes, bytes]:
    """Pixels before a step, and how those after it differ: not at all where it left them."""
    before = np.concatenate([_bits(patch.before, patch.region) for patch in patches])
    after = np.concatenate([_bits(patch.after, patch.region) for patch in patches])
    return packed(before), packed(before ^ after)


def unpacked_patch(
    regions: Sequence[Region], k: int, before: bytes, change: bytes
) -> tuple[Pixels, Pixels]:
    """Pixels before and after of patch k, to the last bit. regions: of all patches of the step.

    Raises PaintError for a damaged file.
    """
    ends = np.cumsum([0, *(_values(region) for region in regions)]).tolist()
    was, is_other = (
        np.asarray(unpacked(x, "uint32", (ends[-1],)))[ends[k] : ends[k + 1]]
        for x in (before, change)
    )
    return _pixels(was, regions[k]), _pixels(was ^ is_other, regions[k])


def _values(region: Region) -> int:
    """How many numbers a region has, of light and importance."""
    top, bottom, left, right = region
    return 4 * (bottom - top) * (right - left)


def _bits(pixels: Pixels, region: Region) -> npt.NDArray[np.uint32]:
    image, importance = pixels
    top, bottom, left, right = region
    size = (bottom - top, right - left)
    if image.shape != (*size, 3) or importance.shape != size:
        raise PaintError(
            f"pixels of shapes {image.shape} and {importance.shape} for the region {region}"
        )
    flat = [np.asarray(x, np.float32).reshape(-1) for x in (image, importance)]
    return np.concatenate(flat).view(np.uint32)


def _pixels(bits: npt.NDArray[np.generic], region: Region) -> Pixels:
    top, bottom, left, right = region
    size = (bottom - top, right - left)
    values = np.ascontiguousarray(bits).view(np.float32)
    values.flags.writeable = False
    rest = 3 * size[0] * size[1]
    return values[:rest].reshape(*size, 3), values[rest:].reshape(size)
