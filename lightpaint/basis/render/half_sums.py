"""What two halves of the samples have come to, kept on the device that renders.

Import it once a variant is set and not a scalar one: its arrays do not exist before.
"""

import drjit as dr
import mitsuba as mi
import numpy as np

from lightpaint.arrays import Bools, Floats
from lightpaint.basis.basis import Basis


class HalfSums:
    """What two independent halves of the samples have come to, undivided, on the device.

    planes: per half, n·h·w·3 values laid out (n, h, w, 3). seen: h·w counts of camera rays
    that saw an emitter. spp, passes: per half, samples per pixel and passes so far.
    """

    def __init__(self, lights: int, size: tuple[int, int]) -> None:
        self.shape = (lights, *size, 3)
        count = lights * size[0] * size[1] * 3
        self.planes = [dr.zeros(mi.Float, count) for _ in range(2)]
        self.seen = dr.zeros(mi.Float, size[0] * size[1])
        self.spp, self.passes = [0, 0], [0, 0]

    @classmethod
    def of(cls, basis: Basis) -> "HalfSums":
        """The sums that made `basis`, up to round-off."""
        sums = cls(len(basis.lights), basis.size)
        a, b = sums.spp = list(basis.origin.halves)
        sums.passes = list(basis.origin.passes)
        # The mean is (a A + b B) / (a + b), half the difference (A − B) / 2.
        half_a = basis.images + basis.half_differences * (2 * b / (a + b))
        half_b = basis.images - basis.half_differences * (2 * a / (a + b))
        sums.planes = [mi.Float((half_a * a).ravel()), mi.Float((half_b * b).ravel())]
        sums.seen = mi.Float(basis.emitters_seen.ravel().astype(np.float32))
        return sums

    def mean_and_half_difference(self, *, is_last: bool) -> tuple[Floats, Floats]:
        """Of all samples, and between the halves, as arrays of `shape`.

        is_last: the sums are given up meanwhile, which saves as much memory again.
        """
        halves = []
        for half in range(2):
            halves.append(np.array(self.planes[half]).reshape(self.shape))
            if is_last:
                self.planes[half] = None
        (a, b), (mean, half_difference) = self.spp, halves
        # In place, one light at a time: these are the largest arrays there are.
        for plane_a, plane_b in zip(mean, half_difference, strict=True):
            plane_a /= a
            plane_b /= -b
            plane_b += plane_a
            plane_b /= 2
            # A is the mean of all plus the share of B in them times the difference.
            plane_a -= plane_b * np.float32(2 * b / (a + b))
        return mean, half_difference

    def emitters_seen(self) -> Bools:
        """(h, w), pixels in which any camera ray saw an emitter."""
        return np.array(self.seen).reshape(self.shape[1:3]) > 0
