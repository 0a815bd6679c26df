"""Lights whose pictures are mostly stray bright pixels, and lower limits on their power.

In a picture that is all fireflies, power cannot be told from noise, and the light comes out too
dim. At most half of M is removed as noise, since the rest would
be noise itself. So this module estimates the least power of a light in a render without noise; the
answer with that power tells how far the true one may be (docs/method.md, "How sure").
"""

import math

import numpy as np

from lightpaint.arrays import Doubles, Floats
from lightpaint.basis.planes import BLOCK_PIXELS
from lightpaint.lighting.analysis.noise.noise import pseudo_inverse
from lightpaint.lighting.solution import Solution

#: Shares of noise in the part of a light that no other can replace, between which doubt rises from
#: 0 to 1.
DOUBT_RANGE = 0.6, 0.8

#: Standard errors on the safe side of a sum, and the least share of M that remains of a light.
SAFE_ERRORS, MIN_LEFT = 1.0, 1e-3


def noise_doubts(solution: Solution, power: Doubles) -> Doubles:
    """Return the doubt in each light, (n, 3), 0 to 1: whether it may be noise alone.

    It follows from the share of noise in the part of a light that no other can replace. power:
    (3, n, n), the noise in M.
    """
    shares = np.zeros(solution.weights.shape)
    for c, M in enumerate(solution.equations.M):
        shares[:, c] = np.diag(power[c]) * np.diag(pseudo_inverse(M))
    low, high = DOUBT_RANGE
    is_determined = solution.reached & ~solution.basis.is_fixed[:, None]
    return np.where(is_determined, np.clip((shares - low) / (high - low), 0, 1), 0)


def weakest_matrix(
    solution: Solution, power: Doubles, doubts: Doubles, corrected: Doubles
) -> Doubles:
    """Return M without noise, as weak as it may be for lights in doubt, (n, 3).

    power: (3, n, n), the noise in M. corrected: (3, n, n), M without as much of it as is safe to
    remove. Returns (3, n, n), positive semidefinite.
    """
    basis, M = solution.basis, solution.equations.M
    weight = solution.problem.squares.weight
    weakest = corrected.copy()
    for k in np.flatnonzero((doubts > 0).any(axis=1)).tolist():
        image, half = (planes.plane(k) for planes in (basis.planes, basis.noise))
        for c in np.flatnonzero(doubts[k] > 0):
            D = weight[..., c % weight.shape[2]].ravel()
            smooth, error = _least_power(image[..., c].ravel(), half[..., c].ravel(), D)
            # Only the part that no other light can replace may shrink.
            noisy, alone = (1 / float(pseudo_inverse(x[c])[k, k]) for x in (M, weakest))
            least = max(
                noisy - float(power[c, k, k]) - SAFE_ERRORS * error,
                alone - float(weakest[c, k, k]) + smooth,
                MIN_LEFT * float(M[c, k, k]),
            )
            weakest[c, k, k] -= doubts[k, c] * max(alone - least, 0)
    return weakest


def _least_power(image: Floats, half: Floats, D: Floats) -> tuple[float, float]:
    """Return the least ‖Φ‖² that a light may have without noise, by its light alone.

    That is ‖Φ‖² ≥ (Σ D Φ)² / Σ D. Also returns the standard error of Σ D h². All (pixels,).
    """
    squares = light = lights = total = 0.0
    for start in range(0, image.size, BLOCK_PIXELS):
        pixels = slice(start, start + BLOCK_PIXELS)
        d, f, h = (x[pixels].astype(np.float64) for x in (D, image, half))
        squares += float(np.square(d * h * h).sum())
        light, lights = light + float(d @ f), lights + float(np.square(d * f).sum())
        total += float(d.sum())
    smooth = (light * _poisson_lower_limit(light**2 / lights)) ** 2 / total if lights > 0 else 0.0
    return smooth, math.sqrt(squares)


def _poisson_lower_limit(paths: float) -> float:
    """Return the least ratio of the true to a measured sum of a number of paths.

    It is Wilson and Hilferty's Poisson limit.
    """
    return max(1 - 1 / (9 * paths) - 1.96 / (3 * math.sqrt(paths)), 0.1) ** 3
