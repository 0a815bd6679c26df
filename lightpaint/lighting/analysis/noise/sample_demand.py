"""Density of samples: where more of them reduce the error of an answer most.

The variance of a weight is a sum over pixels, and a pixel with n samples has 1/n of the variance of
one. For a given number of samples in all, Σ q/n is least with n in proportion to √q (Neyman
allocation). √q of a pixel is the mean over its neighbours, never itself: so how many samples it
gets does not depend on those that it has, and their mean stays unbiased (docs/method.md). A mean of
roots, since few samples show the variance of a pixel by a number that is often far too large.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np

from lightpaint.arrays import Bools, Doubles, Indices
from lightpaint.basis import walked_blocks
from lightpaint.lighting.analysis.noise.basis_noise import NoisyPixels
from lightpaint.lighting.analysis.noise.weight_directions import gradient_response
from lightpaint.lighting.solution import Solution
from lightpaint.threads import parallel_map

#: Pixels on either side whose mean estimates the variance of a pixel.
AROUND = 2

#: Least density of a pixel that counts, in parts of the mean (docs/benchmarks.md).
FLOOR = 0.3


@dataclass(frozen=True)
class SampleDemand:
    """The worth of further samples in each pixel of a view.

    variance: (h, w) float64, contribution of a pixel with its current samples to the squared error,
    averaged over neighbours. density: (h, w), ideal number of samples, up to a factor.
    """

    variance: Doubles
    density: Doubles


def pixel_variances(solution: Solution, aims: Doubles) -> Doubles:
    """Return each pixel's part of Σ_k Var(aims_k · w), (h, w) float64, as its noise shows it.

    aims: (k, 3 n), directions of the weights, channel by channel.
    """
    pixels = NoisyPixels.of(solution)
    push = aims @ gradient_response(solution)
    variances = np.zeros(solution.importance.size)

    def fill(part: Indices) -> None:
        rows = pixels.gradient_noise(part).reshape(push.shape[1], -1)
        variances[part] = np.square(push @ rows).sum(axis=0)

    counted = pixels.counted
    blocks = [counted[block] for block in walked_blocks(solution.basis.planes, counted.size)]
    parallel_map(fill, blocks, unit="blocks")
    return variances.reshape(solution.importance.shape)


def sample_demand(variances: Doubles, counted: Bools, have: Doubles) -> SampleDemand:
    """Return the demand of a view.

    variances: (h, w), its part of `pixel_variances`. counted: (h, w), pixels that count. have: (h,
    w), samples that pixels have.
    """
    # The variance of a single sample, since neighbours may have other numbers of samples.
    of_one = np.where(counted, variances * have, 0)
    count = np.maximum(_sum_around(counted.astype(np.float64)), 1)
    mean, density = (
        np.where(counted, _sum_around(x) / count, 0) for x in (of_one, np.sqrt(of_one))
    )
    floor = FLOOR * density.sum() / max(np.count_nonzero(counted), 1)
    density = np.where(counted, np.maximum(density, floor), 0)
    return SampleDemand(mean / np.maximum(have, 1), density)


def _sum_around(image: Doubles) -> Doubles:
    """Return the sum over the neighbours of each pixel, without itself, (h, w)."""
    height, width = image.shape
    padded, total = np.pad(image, AROUND), np.zeros_like(image)
    for down, right in product(range(2 * AROUND + 1), repeat=2):
        if (down, right) != (AROUND, AROUND):
            total += padded[down : down + height, right : right + width]
    return total


def top_up_counts(density: Doubles, have: Doubles, budget: float) -> Indices:
    """Return whole numbers of samples to add to each pixel, (h, w), `budget` of them in all.

    Afterwards the numbers are as nearly in proportion to `density` as possible.
    """
    return np.rint(np.maximum(_level(density, have, budget) * density - have, 0)).astype(np.intp)


def _level(density: Doubles, have: Doubles, budget: float) -> float:
    """Return the level at which Σ max(level · density − have, 0) is the budget."""
    counted = density > 0
    if not counted.any():
        return 0.0
    demand, existing = density[counted], have[counted]
    order = np.argsort(existing / demand)
    demand, existing = demand[order], existing[order]
    # For the k pixels that need most, the level is (budget + Σ have) / Σ density.
    levels = (budget + np.cumsum(existing)) / np.cumsum(demand)
    reached = levels >= existing / demand
    return float(levels[np.flatnonzero(reached)[-1]])
