"""The sums of two halves of the samples, on the device that renders.

Import it once a variant is set and not a scalar one: its arrays do not exist before.
"""

import drjit as dr
import mitsuba as mi
import numpy as np

from lightpaint.arrays import Bools, Floats
from lightpaint.basis.basis import Basis
from lightpaint.basis.render.sums import halves_of, mean_and_half_difference


class HalfSums:
    """The undivided sums of two independent halves of the samples, on the device.

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
        """Return the sums that made `basis`, up to round-off."""
        sums = cls(len(basis.lights), basis.size)
        sums.spp, sums.passes = list(basis.origin.halves), list(basis.origin.passes)
        sums.planes = [mi.Float(half.ravel()) for half in halves_of(basis)]
        sums.seen = mi.Float(basis.emitters_seen.ravel().astype(np.float32))
        return sums

    def mean_and_half_difference(self, *, is_last: bool) -> tuple[Floats, Floats]:
        """Return the mean of all samples, and half the halves' difference, as arrays of `shape`.

        is_last: the sums are given up meanwhile, which saves as much memory again.
        """
        halves = []
        for half in range(2):
            halves.append(np.array(self.planes[half]).reshape(self.shape))
            if is_last:
                self.planes[half] = None
        return mean_and_half_difference(halves, self.spp)

    def emitters_seen(self) -> Bools:
        """Return (h, w), pixels in which any camera ray saw an emitter."""
        return np.array(self.seen).reshape(self.shape[1:3]) > 0
