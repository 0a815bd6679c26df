"""Stray pixels: pixels of few samples that are bright by chance.

A light that one sample in ten finds is found by both samples of one pixel in a hundred. The two
halves of such a pixel agree, so its half difference shows no noise; those of its neighbours do.
"""

from itertools import product

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Floats
from lightpaint.images.estimate import shifted

#: Smallest ratio of a stray pixel to its surroundings.
OUTSTANDING = 1.25
#: Largest ratio of its excess to the difference between the halves of a pixel nearby.
LARGEST_CHANCE = 1.5
#: Four windows are searched for such pixels: half the side of each, and the distance of its center
#: from the pixel in x and in y. They leave out direct neighbours, which a highlight may cover.
WINDOW_RADIUS, WINDOW_DISTANCE = 3, 5

_NEIGHBORS = [offset for offset in product((-1, 0, 1), repeat=2) if offset != (0, 0)]


def stray_pixels(raw: Floats, half_difference: Floats, clean: Floats) -> npt.NDArray[np.bool_]:
    """Return where a picture is bright by chance, (h, w).

    raw: (h, w, 3) linear, the mean of two halves. half_difference: half of their difference. clean:
    the picture, denoised. A stray pixel is brighter than its denoised form and than all of its
    neighbours but one, which excludes lines. And in two of the four windows around it the halves of
    a pixel differ by about its excess, so single samples do have such values.
    """
    brightness, expected = raw.max(axis=-1), clean.max(axis=-1)
    neighbors = np.stack([shifted(brightness, *offset) for offset in _NEIGHBORS])
    second = np.partition(neighbors, -2, axis=0)[-2]
    is_outstanding = brightness > OUTSTANDING * np.maximum(second, expected)
    largest = _window_maximum(2 * np.abs(half_difference).max(axis=-1))
    corners = product((-WINDOW_DISTANCE, WINDOW_DISTANCE), repeat=2)
    neighbours = np.stack([shifted(largest, *corner) for corner in corners])
    by_chance = LARGEST_CHANCE * np.partition(neighbours, -2, axis=0)[-2]
    is_stray = is_outstanding & (brightness - expected <= by_chance)
    return np.asarray(is_stray, np.bool_)


def _window_maximum(values: Floats) -> Floats:
    """Return the largest value of the window around each pixel, (h, w)."""
    steps = range(-WINDOW_RADIUS, WINDOW_RADIUS + 1)
    along_rows = np.max([shifted(values, 0, step) for step in steps], axis=0)
    return np.asarray(np.max([shifted(along_rows, step, 0) for step in steps], axis=0), np.float32)
