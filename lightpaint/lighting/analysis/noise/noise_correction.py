"""Solves without a share of the basis's noise power in the normal equations."""

from dataclasses import replace

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.errors import BasisError
from lightpaint.keywords import keywords
from lightpaint.lighting.analysis.noise.directions import (
    free_directions,
    solve_for,
)
from lightpaint.lighting.analysis.noise.noise import (
    Noise,
    denoised_matrix,
    noise_sums,
    pseudo_inverse,
)
from lightpaint.lighting.normal_equations import NormalEquations, block_diagonal
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.solve import solve_again

#: Share of the error that the prediction's own noise makes against any other picture. With less,
#: the target is a sum of the basis itself, whose noise is the same and cancels.
SAME_NOISE_SHARE = 1e-4

#: Steps of the share of noise to remove from M.
SHARE_STEPS = 8


@keywords()
def correct_noise(solution: Solution, *, share: float | None = None) -> Solution:
    """Solve the equations without a share of the noise power in M and b.

    A fit of blocks of pixels has averaged most of the noise already, and its solution stays as it
    is.
    If squares stand for another loss, the share is lowered until this loss falls, too: far from the
    answer the squares do not represent it.

    Args:
        solution: The solution to correct, where the solve starts.
        share: 0 to 1; the most promising one by default (see `_best_share`). docs/method.md has
            measurements.

    Raises:
        BasisError: If the noise is unknown.

    Examples:
        >>> corrected = lp.correct_noise(lp.solve(basis, target))
        >>> 0 <= corrected.problem.noise_removed <= 1
        True
    """
    basis = solution.basis
    if not basis.knows_noise:
        raise BasisError(
            f"{basis.origin.scene} says nothing of its noise, so that none can be corrected: "
            "use noise_correction=False, and denoise the layers or render them with more samples"
        )
    if solution.problem.block_side > 1:
        return solution
    noise = noise_sums(solution)
    e = solution.equations
    least = denoised_matrix(e, noise.power)
    if share is None:
        share = _best_share(solution, noise, least)
    while True:
        equations = NormalEquations(
            (1 - share) * e.M + share * least, e.b - share * noise.target_noise, e.target_norm2
        )
        problem = replace(solution.problem, corrected=equations, noise_removed=share)
        corrected = solve_again(solution, problem)
        removed = NormalEquations(share * (e.M - least), share * noise.target_noise, np.zeros(3))
        if problem.is_linear or share == 0 or _loss(corrected, removed) <= _loss(solution, removed):
            return corrected
        share = share / 2 if share > 1 / SHARE_STEPS else 0.0


def _loss(solution: Solution, removed: NormalEquations) -> float:
    """Return the error of a solution with its pull, less the removed noise."""
    pull, weights = solution.problem.pull, solution.weights
    pulled = 0.0 if pull is None else float(pull.objective(weights).sum())
    # As `NormalEquations.objective`, which does not allow squares below zero.
    noise = (
        np.einsum("ic,cij,jc->", weights, removed.M, weights) - 2 * (removed.b.T * weights).sum()
    )
    return sum(solution.certificate.objective) + pulled - float(noise)


def _best_share(solution: Solution, noise: Noise, least: Doubles) -> float:
    """Return the share s with the least expected excess of the objective, in steps of SHARES.

    The remaining bias costs (1 − s)² δᵀMδ, and the scatter costs tr(M Cov(w)), which grows as
    M_s = M − s N becomes smaller. 0 for a target that is a sum of this basis, as a template is.
    least: M without all noise.
    """
    e, n = solution.equations, len(solution.weights)
    if e.objective(solution.weights).sum() < SAME_NOISE_SHARE * noise.objective_noise.sum():
        return 0.0
    unbiased = NormalEquations(least, e.b - noise.target_noise, noise.objective_noise)
    bias = solve_for(solution, unbiased) - solution.weights
    shares = np.linspace(0, 1, SHARE_STEPS + 1)
    cost = np.square(1 - shares) * np.einsum("ic,cij,jc->", bias, e.M, bias)
    # A pull keeps the weights from moving, and is no part of the error.
    pull = solution.problem.pull
    stiffness = np.zeros((3 * n, 3 * n)) if pull is None else pull.full_matrix
    for directions in free_directions(solution):
        M, left, stiff = (
            directions.T @ x @ directions for x in (e.full_matrix, block_diagonal(least), stiffness)
        )
        C = directions.T @ noise.gradient.reshape(3 * n, 3 * n) @ directions
        for k, s in enumerate(shares):
            inverse = pseudo_inverse((1 - s) * M + s * left + stiff)
            cost[k] += np.einsum("ij,ji->", M, inverse @ C @ inverse)
    return float(shares[np.argmin(cost)])
