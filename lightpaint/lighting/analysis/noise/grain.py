"""Noise of a painting: what of a residual differs from pixel to pixel and has no shape.

A render that is given as a painting brings its noise along, which no lights make and no brush
paints. A second difference along both axes,

    a = N r,  N = [1 −2 1]ᵀ [1 −2 1],

passes by what is smooth, and straight edges along an axis. Of noise that is unrelated from pixel to
pixel it has the variance 36 σ², and is unrelated to itself farther away: E[a(x) a(x + d)] = 0. An
edge or a stroke goes on there, so that these products are taken off.
"""

from collections.abc import Iterator
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Bools, Doubles, Floats
from lightpaint.images.estimate import box_mean
from lightpaint.images.pixel_blocks import enlarged

_Kind = TypeVar("_Kind", bound=np.generic)

#: Σ N², what it makes of a variance of 1.
POWER = 36.0

#: Pixels along the sides of blocks, and blocks on either side, over which products are averaged.
BLOCK, AROUND = 8, 2

#: Most that a ⟨a²⟩ / ⟨|a|⟩² of noise comes to: π/2 if it is normal, more with fireflies. A painted
#: lamp of a few pixels, alone on dark ground, is far beyond.
LARGEST_PEAK = 12.0

#: Most by which taps two pixels apart find more noise than neighbours do, in all of the picture and
#: in a block. Mitsuba's Gaussian filter relates neighbours: 2.3 to 3.7 times, and 5 in blocks. What
#: is painted has wider edges: 4.3 times and more.
MOST_RELATED, MOST_IN_A_BLOCK = 4.0, 6.0


def grain(residual: Floats, counted: Bools) -> Doubles:
    """The variance of a residual's noise, (h, w, 3) float64; 0 where there is none.

    residual: (h, w, 3). counted: (h, w), the pixels to look at.
    """
    return np.stack([_variance(residual[..., c], counted) for c in range(3)], axis=-1)


def _variance(residual: Floats, counted: Bools) -> Doubles:
    """Of one channel, (h, w)."""
    near, far = (_seen_by_taps(residual, counted, step) for step in (1, 2))
    if far[counted].sum() > MOST_RELATED * near[counted].sum():
        return near
    return np.where(far <= MOST_IN_A_BLOCK * near, far, near)


def _seen_by_taps(residual: Floats, counted: Bools, step: int) -> Doubles:
    """The variance that N finds with taps `step` pixels apart, (h, w)."""
    if min(counted.shape) <= 2 * step:
        return np.zeros(counted.shape)
    a, whole = residual.astype(np.float64), counted
    for axis in (0, 1):
        first, middle, last = _taps(a, step, axis)
        a = first - 2 * middle + last
        whole = np.logical_and.reduce(_taps(whole, step, axis))
    a *= whole
    products = np.square(a)
    for here, there in _apart(3 * step):
        pairs = a[here] * a[there] / 2
        products[here] -= pairs
        products[there] -= pairs
    seen = np.maximum(_around(whole.astype(np.float64)), 1e-12)
    power, size = _around(products) / seen, _around(np.abs(a)) / seen
    variance = np.clip(power, 0, LARGEST_PEAK * np.square(size)) / POWER
    variance = enlarged(variance, BLOCK)[: a.shape[0], : a.shape[1]]
    # The border is taken to be like what is beside it.
    return np.pad(variance, step, mode="edge")


def _taps(image: npt.NDArray[_Kind], step: int, axis: int) -> list[npt.NDArray[_Kind]]:
    """`image` three times, `step` pixels apart along an axis."""
    lines = np.moveaxis(image, axis, 0)
    length = len(lines) - 2 * step
    return [np.moveaxis(lines[k * step :][:length], 0, axis) for k in range(3)]


def _apart(distance: int) -> Iterator[tuple[tuple[slice, slice], tuple[slice, slice]]]:
    """Windows of which one lies so far from the other: across, down and along both diagonals."""
    first, last, whole = slice(None, -distance), slice(distance, None), slice(None)
    yield (whole, first), (whole, last)
    yield (first, whole), (last, whole)
    yield (first, first), (last, last)
    yield (first, last), (last, first)


def _around(image: Doubles) -> Doubles:
    """The mean over a block and those around it, of each block, the last of which may be cut."""
    rows, columns = (np.arange(0, length, BLOCK) for length in image.shape)
    sums = np.add.reduceat(np.add.reduceat(image, rows, axis=0), columns, axis=1)
    return np.asarray(box_mean(sums, AROUND), np.float64)
