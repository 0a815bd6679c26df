"""Sums of two halves of the samples, and the means and half differences made of them."""

from collections.abc import Sequence

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.basis.planes import Planes

#: Samples per pixel of half A and of half B: numbers, or (h, w, 1) float32 where pixels differ.
HalfCounts = Sequence[int] | Sequence[Floats]


def add_halves(halves: Sequence[Floats], planes: Planes, noise: Planes, spp: HalfCounts) -> None:
    """Add the undivided sums of both halves that made `planes`, up to round-off, to `halves`.

    halves: (n, h, w, 3) each. noise: half the differences of the halves. spp: samples per pixel of
    each half.
    """
    a, b = spp
    # The mean is (a A + b B) / (a + b), half the difference (A − B) / 2.
    to_a, to_b = (np.asarray(2 * x / (a + b), np.float32) for x in (b, a))
    for k, (image, half_difference) in enumerate(zip(planes, noise, strict=True)):
        halves[0][k] += a * (image + half_difference * to_a)
        halves[1][k] += b * (image - half_difference * to_b)


def mean_and_half_difference(halves: Sequence[Floats], spp: HalfCounts) -> tuple[Floats, Floats]:
    """Return mean and half difference of undivided sums, which it overwrites.

    halves: two undivided sums, (n, h, w, 3). spp: samples per pixel of each.
    """
    (a, b), (mean, half_difference) = spp, halves
    # In place, one light at a time: these are the largest arrays there are.
    for plane_a, plane_b in zip(mean, half_difference, strict=True):
        plane_a /= a
        plane_b /= -b
        plane_b += plane_a
        plane_b /= 2
        # A is the mean of all plus the share of B in them times the difference.
        plane_a -= plane_b * np.asarray(2 * b / (a + b), np.float32)
    return mean, half_difference
