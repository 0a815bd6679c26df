"""Sums of the two halves of the samples, and the means and half differences computed from them."""

from collections.abc import Sequence

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.basis.planes import Planes

#: Samples per pixel of halves A and B: numbers, or (h, w, 1) float32 if pixels differ.
HalfCounts = Sequence[int] | Sequence[Floats]


def add_halves(halves: Sequence[Floats], planes: Planes, noise: Planes, spp: HalfCounts) -> None:
    """Add to `halves` the undivided sums from which `planes` and `noise` were computed, up to
    round-off.

    halves: (n, h, w, 3) each. noise: half the differences of the halves. spp: samples per pixel of
    each half.
    """
    a, b = spp
    # The mean is (a A + b B) / (a + b), the half difference (A − B) / 2.
    to_a, to_b = (np.asarray(2 * x / (a + b), np.float32) for x in (b, a))
    for k, (image, half_difference) in enumerate(zip(planes, noise, strict=True)):
        halves[0][k] += a * (image + half_difference * to_a)
        halves[1][k] += b * (image - half_difference * to_b)


def mean_and_half_difference(halves: Sequence[Floats], spp: HalfCounts) -> tuple[Floats, Floats]:
    """Return mean and half difference of undivided sums, computed in place.

    halves: two undivided sums, (n, h, w, 3). spp: samples per pixel of each.
    """
    (a, b), (mean, half_difference) = spp, halves
    # In place and one light at a time, since these are the largest arrays of all.
    for plane_a, plane_b in zip(mean, half_difference, strict=True):
        plane_a /= a
        plane_b /= -b
        plane_b += plane_a
        plane_b /= 2
        # A equals the overall mean plus B's share of the samples times the difference A − B.
        plane_a -= plane_b * np.asarray(2 * b / (a + b), np.float32)
    return mean, half_difference
