"""Lights of which little but stray bright pixels is seen: how weak their pictures may truly be.

Of a picture that is nothing but fireflies no part is known to be light: its power is that of its
noise, and the light comes out too dim by as much. Beyond a half no noise is taken out of M, as what
is left would be noise itself. So it is asked what a light may have at least, were it rendered
without noise; the answer to that is how far the true one may be (docs/method.md, "How sure").
"""

import math

import numpy as np

from lightpaint.arrays import Doubles, Floats
from lightpaint.basis.planes import BLOCK
from lightpaint.lighting.analysis.noise.noise import pseudo_inverse
from lightpaint.lighting.solution import Solution

#: Parts of what a light does and no other can, that are noise, from which on and up to which it is
#: doubted more and more.
DOUBTED = 0.6, 0.8

#: Standard errors on the safe side of a sum, and the least that is left of what M holds of a light.
SAFE, LEAST = 1.0, 1e-3


def doubt(solution: Solution, power: Doubles) -> Doubles:
    """(n, 3), how much to doubt each light, 0 to 1: whether it may be noise alone.

    By the part that noise has in what it does and no other light can. power: (3, n, n), what noise
    adds to M.
    """
    shares = np.zeros(solution.weights.shape)
    for c, M in enumerate(solution.equations.M):
        shares[:, c] = np.diag(power[c]) * np.diag(pseudo_inverse(M))
    low, high = DOUBTED
    told = solution.reached & ~solution.basis.is_fixed[:, None]
    return np.where(told, np.clip((shares - low) / (high - low), 0, 1), 0)


def weakest(solution: Solution, power: Doubles, doubts: Doubles, corrected: Doubles) -> Doubles:
    """M without noise, as weak as it may be in lights as far as they are doubted, (n, 3).

    power: (3, n, n), what noise adds to M. corrected: (3, n, n), M without as much of it as is safe
    to take. Returns (3, n, n), positive semidefinite.
    """
    basis, M = solution.basis, solution.equations.M
    weight = solution.problem.squares.weight.astype(np.float64)
    made = corrected.copy()
    for k, c in np.argwhere(doubts > 0):
        D = weight[..., c % weight.shape[2]].ravel()
        image, half = (x.plane(k)[..., c].ravel() for x in (basis.planes, basis.noise))
        smooth, error = _least_power(image, half, D)
        # What no other light can do: of that alone anything may be taken away.
        noisy, alone = (1 / float(pseudo_inverse(x[c])[k, k]) for x in (M, made))
        least = max(
            noisy - float(power[c, k, k]) - SAFE * error,
            alone - float(made[c, k, k]) + smooth,
            LEAST * float(M[c, k, k]),
        )
        made[c, k, k] -= doubts[k, c] * max(alone - least, 0)
    return made


def _least_power(image: Floats, half: Floats, D: Doubles) -> tuple[float, float]:
    """What ‖Φ‖² of a light may be at least, were it rendered without noise, by its light alone:
    ‖Φ‖² ≥ (Σ D Φ)² / Σ D; and the standard error of Σ D h². All (pixels,).
    """
    squares = light = lights = total = 0.0
    for start in range(0, image.size, BLOCK):
        its = slice(start, start + BLOCK)
        d, f, h = (x[its].astype(np.float64) for x in (D, image, half))
        squares += float(np.square(d * h * h).sum())
        light, lights = light + float(d @ f), lights + float(np.square(d * f).sum())
        total += float(d.sum())
    smooth = (light * _at_least(light**2 / lights)) ** 2 / total if lights > 0 else 0.0
    return smooth, math.sqrt(squares)


def _at_least(paths: float) -> float:
    """By how much a sum of so many paths may be too high (Wilson and Hilferty's Poisson limit)."""
    return max(1 - 1 / (9 * paths) - 1.96 / (3 * math.sqrt(paths)), 0.1) ** 3
