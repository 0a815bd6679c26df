"""Factors of half differences whose own noise is independent of them.

The noise of the gradient is a sum of products: a pixel's half difference times its residual or its
light. These have the same noise, so a stray bright path that one half alone has met would be in
both factors. The variance of the product then counts it four times, where the gradient has it once,
or not at all if the noise correction takes it out of M. So a factor is taken, in part or as a
whole, from the pixel beside, which shows nearly the same by other samples (docs/method.md, "How
sure").
"""

import numpy as np

from lightpaint.arrays import Doubles, Indices
from lightpaint.lighting.problem import Problem

#: Half differences by which the pixel beside may differ. Beyond, it shows something else: an edge,
#: or a highlight that both halves have met.
MAX_HALVES_APART = 1.5

#: Share of a pixel's own value in a factor where all of the noise power is in the equations.
UNCORRECTED = 0.5


def own_share(problem: Problem, removed: float | None) -> float:
    """Return the share of a pixel's own value in the factors of a problem, 0 to UNCORRECTED.

    It is in proportion to the noise power that the equations contain. removed: the share of it that
    they do not, by default that of the solved ones. A render of the mix has noise of its own,
    independent of the basis.
    """
    refinement = problem.refinement
    of_basis = 1.0 if refinement is None else 1 - refinement.share
    return UNCORRECTED * of_basis * (1 - (problem.noise_removed if removed is None else removed))


def factor(values: Doubles, halves: Doubles, own_share: float) -> Doubles:
    """Return values, of which a share is a pixel's own, and the rest that of the pixel beside.

    values, halves: (…, pixels), of pixels in the order of the picture, and their half differences.
    """
    if own_share == 1:
        return values
    beside = values[..., pixels_beside(values.shape[-1])]
    is_alike = np.abs(beside - values) <= MAX_HALVES_APART * np.abs(halves)
    return np.where(is_alike, own_share * values + (1 - own_share) * beside, values)


def pixels_beside(count: int) -> Indices:
    """Return the index of the other pixel of each one's pair, (count,).

    The last of an odd number takes the pixel before it, and a single one itself.
    """
    beside = np.arange(count) ^ 1
    if count % 2:
        beside[-1] = max(count - 2, 0)
    return beside
