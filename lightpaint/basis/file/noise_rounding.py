"""Lights of a basis of many, rounded to the digits that noise leaves.

A light of many leaves most pixels dark, and a value of few samples is known to one or two binary
digits; the rest of a half float is noise. So a value keeps as many digits as hide their rounding
in the noise of its tile. Rounding is stochastic: up or down with probabilities that keep the mean,
because sums over a picture average noise, but not a bias.

A pixel that one half of the samples has lit has a half difference of plus or minus its image. The
ratio of both is rounded rather than the half difference, so they stay equal.
"""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles, Floats, Indices, as_singles, round_to_halves
from lightpaint.basis.file.half_floats import CLEAN, inner_pixels, scale_of, tiles_of
from lightpaint.basis.file.light_channels import noise_numbers
from lightpaint.basis.file.lit_planes import LitPlane

#: Number of lights from which planes are rounded so: with fewer it takes longer than it saves.
MANY_LIGHTS = 96

#: Ratio of rounding error to noise in a tile, root mean square over tiles, which adds 1/288 to the
#: standard deviation; and the largest in any tile, of few numbers.
HIDDEN_SHARE, LARGEST_SHARE = 1 / 12, 1 / 2

#: Mean squared error of rounding stochastically to no digits after the first, as a share of the
#: square of the number: the mean of 1 / (6 x²) over x in [1, 2), evenly spread in the logarithm.
ROUNDING_POWER = 1 / (16 * np.log(2))

#: Digits after the first of a half float, and of the ratio of a half difference to its image.
HALF_DIGITS, RATIO_DIGITS = 10, 2

#: Digits after the first of a float32, and their number of bits.
SINGLE_DIGITS = 23


def round_to_noise(planes: Sequence[Floats]) -> list[LitPlane] | None:
    """Return the lit pixels of a light, rounded; None if half floats do not hold them.

    planes: its image and half difference, and maybe the two of its indirect light, (h, w, 3) each.
    The returned planes have the same lit pixels. What was rounded before is not rounded again.
    """
    size = planes[0].shape[:2]
    flat = [np.ascontiguousarray(plane, np.float32).reshape(-1, 3) for plane in planes]
    # By their bits, all but the sign.
    bits = np.bitwise_or.reduce([plane.view(np.uint32) for plane in flat]) << np.uint32(1)
    lit = np.flatnonzero(bits[:, 0] | bits[:, 1] | bits[:, 2])
    rounded: list[LitPlane] = []
    for image, noise in zip(flat[::2], flat[1::2], strict=True):
        light, grain = (np.ascontiguousarray(plane[lit].T) for plane in (image, noise))
        pair = _rounded_pair(light, grain, lit, size)
        if pair is None:
            return None
        rounded += pair
    return rounded


def noise_ratios(
    light: npt.NDArray[np.float16], noise: npt.NDArray[np.float16]
) -> npt.NDArray[np.float16] | None:
    """Return ratios from which `noise_numbers` returns `noise`; None if there are none."""
    divisor, dividend = as_singles(light), as_singles(noise)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = round_to_halves(np.where(dividend == 0, np.float32(0), dividend / divisor))
    is_exact = np.isfinite(ratios).all() and (noise_numbers(light, ratios) == noise).all()
    return ratios if is_exact else None


def _rounded_pair(
    light: Floats, noise: Floats, lit: Indices, size: tuple[int, ...]
) -> tuple[LitPlane, LitPlane] | None:
    """Return the lit pixels of an image and its half difference, (3, m) each, rounded."""
    if (noise[light == 0] != 0).any():
        return None
    scale = scale_of(np.stack([light, noise]))
    tiles, dither = tiles_of(1, *size)[lit], _dither(light, lit)
    ratio = np.divide(noise, light, out=np.zeros_like(light), where=light != 0)
    hidden = HIDDEN_SHARE**2 * _power(noise, tiles)
    wanted = ROUNDING_POWER * np.maximum(_power(light, tiles), _power(noise, tiles))
    with np.errstate(divide="ignore", invalid="ignore"):
        digits = np.nan_to_num(np.ceil(np.log2(wanted / hidden) / 2), posinf=HALF_DIGITS)
    digits = np.clip(digits, RATIO_DIGITS, HALF_DIGITS).astype(np.uint32)
    exact = _exact_pixels(light, noise, lit, size)
    is_rounded = _has_half_digits(light) & _has_half_digits(noise)
    of_numbers = np.where(exact | is_rounded, np.uint32(HALF_DIGITS), digits[:, tiles])
    numbers = round_to_halves(_rounded(light, of_numbers, dither) / np.float32(scale))
    # The other bits of the same random number.
    ratios = round_to_halves(_rounded(ratio, np.uint32(RATIO_DIGITS), ~dither >> np.uint32(9)))
    of_noise = noise_numbers(numbers, ratios)
    if is_rounded.any():
        of_noise[is_rounded] = round_to_halves(noise[is_rounded] / np.float32(scale))
    error = np.abs(as_singles(numbers) * np.float32(scale) - light)
    error_of_noise = as_singles(of_noise) * np.float32(scale) - noise
    limit = (LARGEST_SHARE / HIDDEN_SHARE) ** 2 * hidden
    is_hidden = all((_power(x, tiles) <= limit).all() for x in (error, error_of_noise))
    if not is_hidden or (error > CLEAN * np.abs(light))[:, exact].any():
        return None
    pixels = lit.astype(np.uint32)
    return LitPlane(pixels, numbers, scale), LitPlane(pixels, of_noise, scale)


def _has_half_digits(values: Floats) -> npt.NDArray[np.bool_]:
    """Return which numbers have no more digits than half floats, as those that were rounded."""
    return np.asarray(values.view(np.uint32) << np.uint32(32 - SINGLE_DIGITS + HALF_DIGITS) == 0)


def _rounded(
    values: Floats, digits: npt.NDArray[np.uint32] | np.uint32, dither: npt.NDArray[np.uint32]
) -> Floats:
    """Return float32 numbers rounded to some binary digits after the first; those that keep all
    digits of a half float are unchanged. dither: random bits that decide whether up or down.
    """
    dropped = np.where(digits < HALF_DIGITS, np.uint32(SINGLE_DIGITS) - digits, np.uint32(0))
    below = (np.uint32(1) << dropped) - np.uint32(1)
    bits = values.view(np.uint32) + (dither & below)
    return (bits & ~below).view(np.float32)


def _dither(light: Floats, lit: Indices) -> npt.NDArray[np.uint32]:
    """Return random bits for each lit pixel, (m,), which follow from its place and its light."""
    bits = lit.astype(np.uint32) * np.uint32(0x9E3779B1)
    for channel, factor in zip(light, (0x85EBCA77, 0xC2B2AE3D, 0x27D4EB2F), strict=True):
        bits ^= channel.view(np.uint32) * np.uint32(factor)
    for shift, factor in ((16, 0x85EBCA6B), (13, 0xC2B2AE35), (16, 1)):
        bits = (bits ^ (bits >> np.uint32(shift))) * np.uint32(factor)
    return bits


def _exact_pixels(
    light: Floats, noise: Floats, lit: Indices, size: tuple[int, ...]
) -> npt.NDArray[np.bool_]:
    """Return which of the lit pixels, (m,), must keep their values (see half_floats.py)."""
    is_clean = (np.abs(noise) <= np.float32(CLEAN) * np.abs(light)).all(axis=0)
    is_clean &= (light != 0).any(axis=0)
    if not is_clean.any():
        return np.asarray(is_clean)
    picture = np.zeros(size, bool)
    picture.reshape(-1)[lit] = is_clean
    return inner_pixels(picture).reshape(-1)[lit]


def _power(values: Floats, tiles: npt.NDArray[np.int32]) -> Doubles:
    """Return Σ x² of each channel and tile, (3, tiles).

    tiles: (m,), the tile of each number of a channel.
    """
    count = int(tiles.max(initial=0)) + 1
    squares = np.square(values, dtype=np.float64)
    return np.stack([np.bincount(tiles, channel, count) for channel in squares])
