"""The spread of weights by noise of the gradient, along the freedom that bounds and caps leave."""

import math
from statistics import NormalDist

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.lighting.analysis.noise.dominant_pixels import NORMAL_95
from lightpaint.lighting.analysis.noise.noise import (
    NULL_EIGENVALUE,
    Noise,
    noise_sums,
    pseudo_inverse,
)
from lightpaint.lighting.analysis.noise.weight_directions import BlockFreedom, block_freedoms
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.solution import Solution

#: Share of all cases outside of a 95 % interval.
OUTSIDE_SHARE = 0.05

NORMAL = NormalDist()

#: Standard deviations beyond a bound from which a normal tail is approximated by an exponential.
FAR_DEVIATIONS = 30.0


def weight_spread(
    solution: Solution,
    noise: Noise,
    scatters: NormalEquations,
    unbiased: NormalEquations,
    weights: Doubles,
) -> tuple[Doubles, list[Doubles], Doubles]:
    """Return standard deviations of the weights within bounds, and their excess beyond, (3 n,).

    The second is their spread below and above when they leave a bound or cap, also in standard
    deviations; (n, 3) each.

    scatters: the equations by which the noise of the gradient moves the weights. unbiased,
    weights: the equations and weights, (n, 3), whose gradient tells how firmly bounds hold.
    """
    problem = solution.problem
    gradient = problem.with_pull(unbiased).gradient(weights).T.ravel()
    pulled, missed = problem.with_pull(scatters), problem.equations.full_matrix
    M, C = pulled.full_matrix, noise.full_covariance.reshape(gradient.size, -1)
    free, below, above, excess = (np.zeros(gradient.size) for _ in range(4))
    for room in block_freedoms(solution, pulled):
        columns, active = room.columns, room.active
        steps, covariance = _propagate(
            columns.T @ M @ columns, columns.T @ C @ columns, room, columns.T @ gradient
        )
        excess += np.einsum("pq,qp->p", missed, columns @ covariance @ columns.T)
        free += ((room.emitted @ active.constrained(covariance)) * room.emitted).sum(axis=1)
        own_steps = room.emitted @ (active.own_exits * steps)
        below += np.square(np.minimum(own_steps, 0)).sum(axis=1)
        above += np.square(np.maximum(own_steps, 0)).sum(axis=1)
    inside, down, up = (np.sqrt(np.maximum(x, 0)).reshape(3, -1).T for x in (free, below, above))
    return inside, [down, up], excess


def gradient_response(solution: Solution) -> Doubles:
    """Return the response of the weights to noise of the gradient, (3 n, 3 n), channel by channel.

    It is the matrix whose product with the covariance of the gradient on both sides makes the
    scatter of `error_bars`, but for bounds that hold.
    """
    noise = noise_sums(solution)
    pulled = solution.problem.with_pull(solution.problem.solved)
    gradient = pulled.gradient(solution.weights).T.ravel()
    M, C = pulled.full_matrix, noise.full_covariance.reshape(gradient.size, -1)
    response = np.zeros_like(M)
    for room in block_freedoms(solution, pulled):
        to = room.columns
        _, free = _movable(to.T @ M @ to, to.T @ C @ to, room, to.T @ gradient)
        along = to @ free
        response += along @ pseudo_inverse(along.T @ M @ along) @ along.T
    return response


def _propagate(
    M: Doubles, C: Doubles, room: BlockFreedom, gradient: Doubles
) -> tuple[Doubles, Doubles]:
    """Return how far the active bounds may be left, (h,), and the covariance of all unknowns, (k,
    k).

    M: (k, k); C: (k, k), covariance of the noise of the gradient, (k,). Cov(x) = M⁻¹ C M⁻¹ over
    the directions of `_movable`.
    """
    ends, free = _movable(M, C, room, gradient)
    inverse = free @ pseudo_inverse(free.T @ M @ free) @ free.T
    return ends, inverse @ C @ inverse


def _movable(
    M: Doubles, C: Doubles, room: BlockFreedom, gradient: Doubles
) -> tuple[Doubles, Doubles]:
    """Return how far the active bounds may be left, (h,), and what noise may move, (k, m).

    These are the free directions, and those of bounds that noise alone may have activated.
    Arguments: as of `_propagate`.
    """
    free = room.free
    # Directions that leave a bound while the free unknowns adapt.
    ways = room.active.exits - free @ (
        pseudo_inverse(free.T @ M @ free) @ (free.T @ M @ room.active.exits)
    )
    stiffness, alone = (((M @ w) * w).sum(axis=0) for w in (ways, room.active.exits))
    # Other lights can replace those without stiffness.
    counts = stiffness > NULL_EIGENVALUE * alone
    safe = np.where(counts, stiffness, 1)
    pushed = np.where(counts, np.maximum(ways.T @ gradient, 0), 0) / safe
    noise = np.maximum(((C @ ways) * ways).sum(axis=0), 0)
    spread = np.where(counts, np.sqrt(noise), 0) / safe
    ends = [_one_sided(u, s) for u, s in zip(pushed.tolist(), spread.tolist(), strict=True)]
    free = np.hstack([free, ways[:, pushed < NORMAL_95 * spread]])
    return np.minimum(ends, room.active.distances) / NORMAL_95, free


def _one_sided(pushed: float, spread: float) -> float:
    """Return the end of the 95 % interval of a value at a bound, from there on.

    Without the bound it would be beyond it by `pushed`, u, with the standard deviation s of
    `spread`. Since it cannot be beyond, the end is U with

        P(X > U) = 0.05 P(X > 0),   X ~ N(-u, s²),

    which is 1.96 s at u = 0, about 3 s²/u far beyond, and never 0: whatever the true value is, it
    is below U in 95 % of all cases or more.
    """
    if spread <= 0:
        return 0.0
    u = pushed / spread
    if u > FAR_DEVIATIONS:
        # The tail of a normal distribution is nearly exp(-u t - t²/2) there.
        return spread * (math.hypot(u, math.sqrt(-2 * math.log(OUTSIDE_SHARE))) - u)
    beyond = math.erfc(u / math.sqrt(2)) / 2
    return spread * (-NORMAL.inv_cdf(OUTSIDE_SHARE * beyond) - u)
