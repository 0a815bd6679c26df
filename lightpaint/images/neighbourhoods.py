"""Pixels and their neighbours: soft averages, a film's filter, masks that grow, connected parts.

SciPy's `ndimage` has these, too, but takes a quarter of a second to import, and nothing else in an
ordinary solve needs SciPy.
"""

import math
from functools import lru_cache

import numpy as np

from lightpaint.arrays import Bools, Doubles, Floats, Indices

#: Standard deviations after which a Gaussian ends.
TRUNCATED = 4.0

#: Share of the reconstruction filter of Mitsuba's films, a Gaussian whose standard deviation is
#: half a pixel, that lies in each of both neighbours along an axis: beyond one standard
#: deviation.
TAP = (1 - math.erf(math.sqrt(0.5))) / 2


def gaussian_mean(values: Floats, radius: float) -> Floats:
    """Return means under a Gaussian over the last two axes, mirrored at the borders.

    values: (…, h, w). radius: the standard deviation in pixels.
    """
    reach = int(TRUNCATED * radius + 0.5)
    kernel = np.exp(-0.5 * np.square(np.arange(reach + 1) / radius))
    kernel /= 2 * kernel.sum() - 1
    result = values.astype(np.float64)
    for axis in (-2, -1):
        length = values.shape[axis]
        lines = np.moveaxis(result.take(_mirrored(length, reach), axis), axis, 0)
        mean = kernel[0] * lines[reach : reach + length]
        for k in range(1, reach + 1):
            before, after = (lines[reach + x :][:length] for x in (-k, k))
            mean += kernel[k] * (before + after)
        result = np.moveaxis(mean, 0, axis)
    return np.ascontiguousarray(result, values.dtype)


@lru_cache
def _mirrored(length: int, reach: int) -> Indices:
    """Return the places along an axis, with so many on both sides that mirror them."""
    return np.pad(np.arange(length), reach, mode="symmetric")


def film_filtered(image: Doubles) -> Doubles:
    """Return a picture that has a box filter, (h, w, …), with the Gaussian of Mitsuba's films."""
    for axis in (0, 1):
        lines = np.moveaxis(image, axis, 0)
        wide = np.concatenate([lines[:1], lines, lines[-1:]])
        image = np.moveaxis((1 - 2 * TAP) * lines + TAP * (wide[:-2] + wide[2:]), 0, axis)
    return image


def grown(mask: Bools) -> Bools:
    """Return whether each pixel or one of its eight neighbours is set. mask: (h, w, …)."""
    rows = mask.reshape(len(mask), -1)
    step = rows.shape[1] // mask.shape[1]
    tall = rows.copy()
    tall[1:] |= rows[:-1]
    tall[:-1] |= rows[1:]
    wide = tall.copy()
    wide[:, step:] |= tall[:, :-step]
    wide[:, :-step] |= tall[:, step:]
    return wide.reshape(mask.shape)


def dilated(mask: Bools, radius: int) -> Bools:
    """Return whether a pixel at most that many steps away, across or down, is set. mask: (h, w)."""
    for _ in range(radius):
        wide = mask.copy()
        wide[1:] |= mask[:-1]
        wide[:-1] |= mask[1:]
        wide[:, 1:] |= mask[:, :-1]
        wide[:, :-1] |= mask[:, 1:]
        mask = wide
    return mask


def number_parts(mask: Bools) -> tuple[Indices, int]:
    """Return the number of the connected part to which each pixel belongs, (h, w), 0 for none, and
    the number of parts, in the order of their first pixels. Pixels are connected by edges alone
    (4-connectivity): at corners, noise in one pixel would join two parts.

    Each pixel points to one before it, at last to the first of its part: parts that touch hook on
    to each other, and pointers jump to the end of their chains (Shiloach and Vishkin 1982).
    """
    height, width = mask.shape
    pixels = np.arange(mask.size).reshape(mask.shape)
    upper, lower, left, right = slice(height - 1), slice(1, None), slice(width - 1), slice(1, None)
    every = slice(None)
    beside = [((every, left), (every, right)), ((upper, every), (lower, every))]
    edges = [(pixels[a], pixels[b], mask[a] & mask[b]) for a, b in beside]
    first, second = (np.concatenate([x[k][x[2]] for x in edges]) for k in (0, 1))
    root = pixels.ravel().copy()
    while (is_apart := root[first] != root[second]).any():
        first, second = first[is_apart], second[is_apart]
        ends = root[first], root[second]
        np.minimum.at(root, np.maximum(*ends), np.minimum(*ends))
        while ((further := root[root]) != root).any():
            root = further
    firsts, numbers = np.unique(root[mask.ravel()], return_inverse=True)
    parts = np.zeros(mask.shape, np.intp)
    parts[mask] = numbers.ravel() + 1
    return parts, len(firsts)
