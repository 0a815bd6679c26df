"""The spread of weights by noise of the gradient, along the freedom that bounds and caps leave."""

import math
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from lightpaint.arrays import Bools, Doubles
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

#: Largest standard deviation of a light, relative to its own level, that other lights answer to.
#: One that the paint hardly shows may scatter by thousands of its levels; where its equations say
#: that another light would have to make up for that, no answer under w >= 0 does.
MAX_DEVIATION = 1.0

#: Level of a light that is off, relative to the mean light of the whole picture.
FAINT = 0.01

NORMAL = NormalDist()

#: Standard deviations beyond a bound from which a normal tail is approximated by an exponential.
FAR_DEVIATIONS = 30.0


@dataclass(frozen=True)
class WeightSpread:
    """The standard deviations of weights, (n, 3) each.

    inside: within bounds. exits: below and above, when they leave a bound or cap. excess: (3 n,),
    of the objective. is_far: (n,), lights that scatter further than their own level.
    """

    inside: Doubles
    exits: tuple[Doubles, Doubles]
    excess: Doubles
    is_far: Bools

    def mixed_with(self, weak: "WeightSpread", doubts: Doubles) -> "WeightSpread":
        """Return the spread of lights that may be noise alone, and of others.

        weak: the spread where such lights have as little power as they may. doubts: (n, 3), 0 to 1.
        The expected excess is that of these equations.
        """
        inside, below, above = (
            np.sqrt((1 - doubts) * np.square(x) + doubts * np.square(y))
            for x, y in zip((self.inside, *self.exits), (weak.inside, *weak.exits), strict=True)
        )
        return WeightSpread(inside, (below, above), self.excess, self.is_far | weak.is_far)


def weight_spread(
    solution: Solution,
    noise: Noise,
    scatters: NormalEquations,
    unbiased: NormalEquations,
    weights: Doubles,
) -> WeightSpread:
    """Return the spread of the weights.

    scatters: the equations by which the noise of the gradient moves the weights. unbiased,
    weights: the equations and weights, (n, 3), whose gradient tells how firmly bounds hold.
    """
    problem = solution.problem
    gradient = problem.with_pull(unbiased).gradient(weights).T.ravel()
    pulled, missed = problem.with_pull(scatters), problem.equations.full_matrix
    M, C = pulled.full_matrix, noise.full_covariance.reshape(gradient.size, -1)
    free, below, above, excess = (np.zeros(gradient.size) for _ in range(4))
    levels, is_far = _levels(solution), np.zeros(gradient.size, bool)
    for room in block_freedoms(solution, pulled):
        columns, active = room.columns, room.active
        steps, covariance = _propagate(
            columns.T @ M @ columns, columns.T @ C @ columns, room, columns.T @ gradient
        )
        sizes = np.abs(room.emitted / levels[:, None]).max(axis=0)
        covariance, own = limit_deviations(covariance, np.where(sizes > 0, sizes, 1))
        excess += np.einsum("pq,qp->p", missed, columns @ covariance @ columns.T)
        limited, whole = (
            ((room.emitted @ active.constrained(x)) * room.emitted).sum(axis=1)
            for x in (covariance, own)
        )
        free += np.maximum(limited, whole)
        is_far |= whole > 0
        own_steps = room.emitted @ (active.own_exits * steps)
        below += np.square(np.minimum(own_steps, 0)).sum(axis=1)
        above += np.square(np.maximum(own_steps, 0)).sum(axis=1)
    inside, down, up = (np.sqrt(np.maximum(x, 0)).reshape(3, -1).T for x in (free, below, above))
    lights_far = np.asarray(is_far.reshape(3, -1).any(axis=0))
    return WeightSpread(inside, (down, up), excess, lights_far)


def limit_deviations(covariance: Doubles, sizes: Doubles) -> tuple[Doubles, Doubles]:
    """Return the covariance (k, k) of unknowns with no light deviating further than its own level,
    and the whole one of those that do.

    sizes: (k,), the change of a light, relative to its level, with each unknown. Axes of the
    covariance longer than MAX_DEVIATION are shortened to that: a light that is hardly seen is then
    undetermined alone, and lights that look alike are so together.
    """
    scale = np.outer(sizes, sizes)
    squares, axes = np.linalg.eigh(covariance * scale)
    if squares.max(initial=0) <= MAX_DEVIATION**2:
        return covariance, np.zeros_like(covariance)
    relative = (axes * np.minimum(squares, MAX_DEVIATION**2)) @ axes.T
    is_far = np.diag(relative) >= (MAX_DEVIATION / 2) ** 2
    return relative / scale, np.where(np.outer(is_far, is_far), covariance, 0)


def _levels(solution: Solution) -> Doubles:
    """Return the levels of lights to which deviations are relative, (3 n,), channel by channel."""
    basis = solution.basis
    sizes = np.sqrt(basis.power.sum(axis=1))
    levels = np.maximum(solution.weights, basis.current_weights).max(axis=1)
    brightness = levels * sizes
    faint = FAINT * brightness.mean() / np.where(sizes > 0, sizes, np.inf)
    return np.tile(np.where(levels > faint, levels, np.where(faint > 0, faint, 1)), 3)


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
