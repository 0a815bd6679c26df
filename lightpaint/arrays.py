"""Types of the arrays that the folders pass to each other. They need no library but NumPy."""

import ctypes
import sys
from collections.abc import Iterable
from contextlib import suppress
from functools import cache
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

_Kind = TypeVar("_Kind", bound=np.generic)

#: Pixels and values computed from them, in any precision.
Floats = npt.NDArray[np.floating[Any]]

#: Inner products, weights and everything that is solved for.
Doubles = npt.NDArray[np.float64]

Bools = npt.NDArray[np.bool_]
Indices = npt.NDArray[np.intp]

#: Rows and columns of an image, to index it with.
Slices = tuple[slice, slice]

#: One colour, linear Rec.709.
RGB = tuple[float, float, float]

#: A point, in units of the scene.
Position = tuple[float, float, float]

#: Numbers that the processor's cache has room for, with copies of them.
_CACHED_NUMBERS = 2**14

#: Bytes from which on a process gives memory back between the stages of a solve.
LARGE_MEMORY = 2**30

#: Bytes that the registers of any processor hold at most: arrays that Dr.Jit makes begin so.
ALIGNMENT = 64

#: Bits of float32: all but the sign, infinity, and 2⁻¹⁴, the least half float of full precision.
_MAGNITUDE, _INFINITY, _LEAST_NORMAL = map(np.uint32, (2**31 - 1, 255 << 23, 113 << 23))

#: Bits of a half float that is infinite, and of one that is not a number.
_HALF_INFINITY, _HALF_SIGN = np.uint16(0x7C00), np.uint16(0x8000)
_HALF_NAN = np.uint32(0x7E00)

#: Of a half float whose digits are shifted to their places in float32: its sign and digits, and
#: the ratio of what its exponent means there and here.
_SIGN_AND_DIGITS = np.uint32(0x8FFFE000).view(np.int32)
_RAISED_EXPONENT = np.float32(2.0**112)

#: Half floats that are converted at a time, the number up to which they are looked up, and a
#: subnormal float32.
_NUMBERS_AT_A_TIME, _FEW_NUMBERS, _SUBNORMAL = 2**16, 2**11, np.float32(2.0**-136)


def largest(image: Floats) -> Floats:
    """Return the largest of the three channels, (…), of (…, 3): a fifth of the time of
    max(axis=-1).
    """
    red, green, blue = (image[..., c] for c in range(3))
    return np.asarray(np.maximum(np.maximum(red, green), blue))


def in_any_channel(mask: Bools) -> Bools:
    """Return where a mask of three channels, (…, 3), is set in one, (…): a ninth of the time of
    any(axis=-1).
    """
    red, green, blue = (mask[..., c] for c in range(3))
    return np.asarray(red | green | blue, np.bool_)


def in_all_channels(mask: Bools) -> Bools:
    """Return where a mask of three channels, (…, 3), is set in each, (…)."""
    red, green, blue = (mask[..., c] for c in range(3))
    return np.asarray(red & green & blue, np.bool_)


def mean_square(image: Floats) -> Doubles:
    """Return the mean of the squares of the three channels, (…) float64, of (…, 3): an eighth of
    the time of mean(axis=-1), with equal bits.
    """
    total, green, blue = (np.square(image[..., c], dtype=np.float64) for c in range(3))
    return np.asarray((total + green + blue) / 3, np.float64)


def read_only(array: npt.NDArray[_Kind]) -> npt.NDArray[_Kind]:
    """Make `array` read-only, since several owners share it, and return it."""
    array.flags.writeable = False
    return array


def release_freed_memory() -> None:
    """Return the memory of arrays that are gone to the system, where its C library keeps it.

    Between small objects that stay, glibc keeps the memory of arrays up to 32 MB: after a file with
    a thousand lights four times as much as the lights take. A process that has never held
    `LARGE_MEMORY` keeps it: the system would clear the same pages again for the next arrays.
    """
    if sys.platform == "linux" and _peak_memory() >= LARGE_MEMORY:
        with suppress(OSError, AttributeError):  # another C library
            ctypes.CDLL(None).malloc_trim(0)


def _peak_memory() -> int:
    """Return the most memory that this process has held at a time, in bytes, on Linux."""
    import resource  # which Windows has not

    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def as_rgb(values: Iterable[Any]) -> RGB:
    """Return the three numbers of an array or any other iterable as one colour."""
    r, g, b = (float(v) for v in values)
    return r, g, b


def as_position(values: Iterable[Any]) -> Position:
    """Return the three numbers of an array or any other iterable as a place or a direction."""
    return as_rgb(values)


def as_singles(numbers: npt.NDArray[np.float16]) -> Floats:
    """Return half floats as float32."""
    singles = np.empty(numbers.shape, np.float32)
    copy_as_singles(numbers, singles)
    return singles


def aligned(values: npt.ArrayLike, kind: type[_Kind]) -> npt.NDArray[_Kind]:
    """Return a copy, (n,), in memory that begins at a multiple of `ALIGNMENT`.

    values: (n,), converted to `kind`. Dr.Jit uses the memory of an array as it lies, and compiles
    one kernel for arrays that begin at such a place and another for those that do not, for each
    array that a kernel reads.
    """
    values_array = np.asarray(values)
    size = np.dtype(kind).itemsize
    room = np.empty(values_array.size + ALIGNMENT // size, kind)
    begin = -room.ctypes.data % ALIGNMENT // size
    copy = room[begin : begin + values_array.size]
    copy[:] = values_array
    return copy


def copy_as_singles(
    values: npt.NDArray[Any], into: npt.NDArray[np.float32], *, are_finite: bool = False
) -> None:
    """Copy numbers into an array of float32 of the same shape.

    are_finite: whether they are known to have neither infinities nor NaN.

    Many half floats are shifted to where float32 has its digits, and multiplied by the ratio of the
    two scales of exponents; others are looked up, in twice the time. NumPy takes four times as
    long, and twenty times where they are subnormal, as most noise is.
    """
    if values.dtype != np.float16 or not values.dtype.isnative:
        into[...] = values
        return
    bits = np.ascontiguousarray(values).view(np.uint16)
    if bits.size < _FEW_NUMBERS or not into.flags.c_contiguous or _flushes_subnormals():
        np.take(_singles(), bits, out=into, mode="clip")
        return
    bits, flat = bits.reshape(-1), into.reshape(-1)
    for start in range(0, bits.size, _NUMBERS_AT_A_TIME):
        part = slice(start, start + _NUMBERS_AT_A_TIME)
        if are_finite or _are_finite(bits[part]):
            _shift_to_singles(bits[part].view(np.int16), flat[part].view(np.int32), flat[part])
        else:
            np.take(_singles(), bits[part], out=flat[part], mode="clip")


def copy_rows_as_singles(
    rows: npt.NDArray[np.float16],
    into: npt.NDArray[np.float32],
    factors: npt.NDArray[np.float32],
    *,
    are_finite: bool,
) -> None:
    """Copy rows of half floats, (k, p), times factors, (k,), into an array of float32, (k, p).

    factors: powers of two. Many rows at a time, since each call of NumPy takes as long as a
    thousand numbers. Neither array need be contiguous. are_finite: as in `copy_as_singles`.
    """
    if not are_finite or not rows.dtype.isnative or _flushes_subnormals():
        for row, one in zip(rows, into, strict=True):
            copy_as_singles(row, one, are_finite=are_finite)
        into *= factors[:, None]
        return
    bits, digits = rows.view(np.int16), into.view(np.int32)
    # Beyond 1, the product of both might be too large.
    both = np.minimum(factors, 1) * _RAISED_EXPONENT
    is_larger = factors > 1
    step = max(1, _NUMBERS_AT_A_TIME // max(rows.shape[1], 1))
    for first in range(0, len(rows), step):
        some = slice(first, first + step)
        _shift_to_singles(bits[some], digits[some], into[some], both[some, None])
        if is_larger[some].any():
            into[some] *= np.maximum(factors[some, None], 1)


def _are_finite(bits: npt.NDArray[np.uint16]) -> bool:
    """Return whether half floats, given as their bits, are finite: positive ones, and others."""
    largest_positive, largest_negative = bits.view(np.int16).max(), bits.max() & ~_HALF_SIGN
    return bool(max(largest_positive, largest_negative) < _HALF_INFINITY)


def _shift_to_singles(
    bits: npt.NDArray[np.int16],
    digits: npt.NDArray[np.int32],
    into: npt.NDArray[np.float32],
    factors: np.float32 | npt.NDArray[np.float32] = _RAISED_EXPONENT,
) -> None:
    """Convert finite half floats, given as their bits, to float32. digits: the bits of `into`.

    factors: the ratio of the two scales of exponents, times what numbers are multiplied by.
    """
    digits[...] = bits  # the sign is repeated to the left
    digits <<= np.int32(13)
    digits &= _SIGN_AND_DIGITS
    into *= factors


def _flushes_subnormals() -> bool:
    """Return whether this thread takes subnormal numbers for 0, as libraries may make it do."""
    return not (_SUBNORMAL * _RAISED_EXPONENT).item()


def is_finite(values: npt.NDArray[Any]) -> bool:
    """Return whether all numbers are finite: of half floats from their bits, which is faster."""
    if values.dtype != np.float16 or not values.dtype.isnative:
        return bool(np.isfinite(values).all())
    bits = np.ascontiguousarray(values).view(np.uint16)
    return not bool(((bits & _HALF_INFINITY) == _HALF_INFINITY).any())


def round_to_halves(values: Floats) -> npt.NDArray[np.float16]:
    """Return float32 numbers rounded to half floats, as `astype` does.

    From the bits: NumPy takes up to forty times as long where these are subnormal, as most noise
    is.
    """
    flat = np.ascontiguousarray(values, np.float32).reshape(-1)
    rounded = np.empty(flat.shape, np.float16)
    for start in range(0, flat.size, _CACHED_NUMBERS):
        part = slice(start, start + _CACHED_NUMBERS)
        size = flat[part].view(np.uint32) & _MAGNITUDE
        bits = np.where(size > _INFINITY, _HALF_NAN, _half_bits(size))
        rounded[part].view(np.uint16)[...] = bits | _half_signs(flat[part])
    return rounded.reshape(values.shape)


def _half_bits(size: npt.NDArray[np.uint32]) -> npt.NDArray[np.uint32]:
    """Return the bits of half floats nearest to magnitudes, which are given as bits of float32."""
    normal = np.maximum(size, _LEAST_NORMAL)
    # 13 digits are dropped, a tie goes to the even number, and the exponent's bias falls by 112.
    normal += np.uint32(0xFFF) + ((normal >> np.uint32(13)) & np.uint32(1))
    normal >>= np.uint32(13)
    normal -= np.uint32(112 << 10)
    np.minimum(normal, np.uint32(31 << 10), out=normal)  # infinity
    # Half floats below the least normal one are multiples of 2⁻²⁴, the last digit of 1/2 and more.
    subnormal = np.minimum(size, _LEAST_NORMAL).view(np.float32) + np.float32(0.5)
    # Where one of both counts, the other is 2⁻¹⁴.
    return normal + subnormal.view(np.uint32) - np.uint32((126 << 23) + (1 << 10))


def _half_signs(values: npt.NDArray[np.float32]) -> npt.NDArray[np.uint32]:
    return (values.view(np.uint32) >> np.uint32(16)) & np.uint32(0x8000)


@cache
def _singles() -> npt.NDArray[np.float32]:
    """Return all half floats as float32, by their bits."""
    return read_only(np.arange(2**16, dtype=np.uint16).view(np.float16).astype(np.float32))
