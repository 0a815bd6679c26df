"""The freedom around an answer: directions and spread of the weights, answers to other equations.

Weights (n, 3) lie flat in a direction, (3 n), channel by channel.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from lightpaint.arrays import Bools, Doubles, Indices
from lightpaint.lighting.algebra.eigenvectors import eigenvectors
from lightpaint.lighting.analysis.noise.dominant_pixels import NORMAL_95
from lightpaint.lighting.analysis.noise.noise import (
    NULL_EIGENVALUE,
    Noise,
    noise_sums,
    pseudo_inverse,
)
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.unknowns.reduced_problem import ReducedOptimum, solve_reduced
from lightpaint.lighting.unknowns.reduction import Reduction

#: Relative distance at which a sum counts as at its limit.
AT_LIMIT = 1e-9

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
class ActiveLimits:
    """The active bounds of a block's unknowns, then its active caps.

    exits: (k, h), for each a direction that leaves it, and no other, by one unit. distances: (h,),
    the largest step along it. bound_unknowns: (b,), the unknowns of the first b. sums: (h - b, k),
    coefficients of the others.
    """

    exits: Doubles
    distances: Doubles
    bound_unknowns: Indices
    sums: Doubles

    @property
    def own_exits(self) -> Doubles:
        """(k, h), the effects of the directions on their own unknowns."""
        is_own = np.zeros(self.exits.shape, dtype=bool)
        is_own[self.bound_unknowns, np.arange(self.bound_unknowns.size)] = True
        is_own[:, self.bound_unknowns.size :] = self.sums.T != 0
        return np.where(is_own, self.exits, 0)

    def constrained(self, covariance: Doubles) -> Doubles:
        """Return a covariance of the unknowns, (k, k), under the active bounds and caps."""
        constrained = covariance.copy()
        constrained[self.bound_unknowns], constrained[:, self.bound_unknowns] = 0, 0
        for row in self.sums:
            members = np.flatnonzero(row)
            along = constrained[np.ix_(members, members)] @ row[members]
            if (variance := float(row[members] @ along)) > 0:
                constrained[np.ix_(members, members)] -= np.outer(along, along) / variance
        return constrained


@dataclass(frozen=True)
class BlockFreedom:
    """The freedom of the unknowns of one block around an answer.

    columns: (3 n, k), the effect of each on the weights, 0 where a light reaches nothing. emitted:
    the same including such lights. free: (k, m), directions without active bounds and caps.
    """

    columns: Doubles
    emitted: Doubles
    free: Doubles
    active: ActiveLimits


def block_freedoms(solution: Solution, equations: NormalEquations) -> Iterator[BlockFreedom]:
    """Yield the freedom of each set of channels that the unknowns couple.

    equations: of the solve.
    """
    reduction, lit = solution.problem.local_reduction, solution.equations.reached
    optimum = solve_reduced(equations, reduction, solution.weights)
    x, (rows, distances) = optimum.x, _active_sums(reduction, optimum)
    for block in reduction.blocks:
        unknowns = block.unknowns
        columns = _columns(reduction, unknowns, lit)
        lower, upper = reduction.lower[unknowns], reduction.upper[unknowns]
        is_movable = (lower < upper) & columns.any(axis=0)
        side = np.where(x[unknowns] <= lower, 1, np.where(x[unknowns] >= upper, -1, 0)) * is_movable
        inside, bound = np.flatnonzero(is_movable & (side == 0)), np.flatnonzero(side)
        caps_here = rows[:, unknowns].any(axis=1)
        sums = rows[caps_here][:, unknowns]
        free, lowering = _keep_sums(sums, inside)
        limits = _active_limits(
            sums,
            lowering,
            bound,
            side,
            np.concatenate([(upper - lower)[bound], distances[caps_here]]),
        )
        yield BlockFreedom(columns, _columns(reduction, unknowns, np.ones_like(lit)), free, limits)


def free_directions(solution: Solution) -> list[Doubles]:
    """Return the free directions around the answer, (3 n, k), for each independent problem."""
    solved = solution.problem.with_pull(solution.problem.solved)
    return [freedom.columns @ freedom.free for freedom in block_freedoms(solution, solved)]


def solve_for(solution: Solution, equations: NormalEquations) -> Doubles:
    """Solve `equations` for weights (n, 3) under the same constraints as the answer."""
    problem = solution.problem
    pulled = problem.with_pull(equations)
    return solve_reduced(pulled, problem.local_reduction, solution.weights).weights


def all_columns(solution: Solution) -> Iterator[Doubles]:
    """Yield the effect of every unknown on the weights, (3 n, k), for each independent problem.

    Without constraints: only fixed lights stay.
    """
    lights = np.flatnonzero(~solution.basis.is_fixed)
    scalar = np.array([light.is_scalar for light in solution.basis.lights], dtype=bool)
    lit = solution.equations.reached
    columns = np.zeros((3, len(scalar), 3, lights.size))
    for k, light in enumerate(lights):
        for c in range(3):
            # With one weight for all channels, the unknown is that of the first channel.
            columns[c, light, 0 if scalar[light] else c, k] = lit[light, c]
    flat = columns.reshape(3 * len(scalar), 3, lights.size)
    if scalar.any():
        yield flat.reshape(len(flat), -1)
    else:
        yield from (flat[:, c] for c in range(3))


def _columns(reduction: Reduction, unknowns: Indices, lit: Bools) -> Doubles:
    """Return C of these unknowns, (3 n, k), 0 where a light reaches nothing."""
    place = np.full(len(reduction.unknowns), -1)
    place[unknowns] = np.arange(unknowns.size)
    unknown, light, rgb = reduction.columns
    is_chosen = place[unknown] >= 0
    columns = np.zeros((3, len(lit), unknowns.size))
    for c in range(3):
        columns[c, light[is_chosen], place[unknown[is_chosen]]] = rgb[is_chosen, c]
    return (columns * lit.T[:, :, None]).reshape(3 * len(lit), unknowns.size)


def _active_sums(reduction: Reduction, optimum: ReducedOptimum) -> tuple[Doubles, Doubles]:
    """Return coefficients of active caps and requirements; for the result see `_active_caps`."""
    rows, room = _active_caps(reduction, optimum.x)
    held = np.flatnonzero(optimum.required > 0)
    if not held.size:
        return rows, room
    required = reduction.required[0][held]
    required = -required / np.linalg.norm(required, axis=1, keepdims=True)
    return np.vstack([rows, required]), np.append(room, np.full(held.size, np.inf))


def _active_caps(reduction: Reduction, x: Doubles) -> tuple[Doubles, Doubles]:
    """Return coefficients of active caps, and the distances to their other limits.

    Returns (j, unknowns), negative where the sum may only rise, and (j,).
    """
    rows, room = [], []
    for cap in reduction.caps:
        members, coefficients = list(cap.unknowns), np.asarray(cap.coefficients)
        total = coefficients @ x[members]
        if not cap.lower * (1 + AT_LIMIT) < total < cap.upper * (1 - AT_LIMIT):
            row = np.zeros(x.size)
            row[members] = coefficients if total >= cap.upper * (1 - AT_LIMIT) else -coefficients
            rows.append(row)
            room.append(cap.upper - cap.lower)
    return np.array(rows).reshape(len(rows), x.size), np.array(room)


def _keep_sums(rows: Doubles, inside: Indices) -> tuple[Doubles, Doubles]:
    """Return the effects of unknowns inside their bounds on the sums `rows`, (j, k).

    Returns (k, m), directions that keep the sums, and (k, j), for each sum a direction that lowers
    it by one and keeps the others; NaN if there is none.
    """
    free = np.eye(rows.shape[1])[:, inside]
    if not len(rows):
        return free, np.zeros((rows.shape[1], 0))
    left, sizes, right = np.linalg.svd(rows[:, inside])
    rank = int((sizes > AT_LIMIT * sizes.max(initial=0)).sum())
    inverse = right[:rank].T @ (left[:, :rank] / sizes[:rank]).T
    lost = np.abs(rows[:, inside] @ inverse - np.eye(len(rows))).max(axis=0) > AT_LIMIT
    lowering = np.where(lost, np.nan, -free @ inverse)
    return np.asarray(free @ right[rank:].T), np.asarray(lowering)


def _active_limits(
    rows: Doubles, lowering: Doubles, bound: Indices, side: Indices, room: Doubles
) -> ActiveLimits:
    """Return the bounds and caps of a block that can be left one by one.

    rows, lowering: of the sums, (j, k) and (k, j), see `_keep_sums`. bound: (b,), unknowns at a
    bound. side: (k,), 1 at the lower, -1 at the upper one. room: (b + j,).
    """
    exits = np.eye(len(side))[:, bound] * side[bound]
    pushes = rows @ exits
    for j, b in np.argwhere(pushes != 0):
        # Unknowns inside their bounds compensate the effect on the sum.
        exits[:, b] += lowering[:, j] * pushes[j, b]
    can_leave = np.isfinite(exits).all(axis=0), np.isfinite(lowering).all(axis=0)
    return ActiveLimits(
        np.hstack([exits[:, can_leave[0]], lowering[:, can_leave[1]]]),
        room[np.concatenate(can_leave)],
        bound[can_leave[0]],
        rows[can_leave[1]],
    )


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
        # Unknowns of one channel move a third of the weights.
        moved = np.flatnonzero(room.emitted.any(axis=1))
        columns, emitted, active = room.columns[moved], room.emitted[moved], room.active
        of_moved = np.ix_(moved, moved)
        steps, covariance = _propagate(
            columns.T @ M[of_moved] @ columns,
            columns.T @ C[of_moved] @ columns,
            room,
            columns.T @ gradient[moved],
        )
        sizes = np.abs(emitted / levels[moved, None]).max(axis=0, initial=0)
        covariance, own = limit_deviations(covariance, np.where(sizes > 0, sizes, 1))
        excess[moved] += np.einsum("pq,qp->p", missed[of_moved], columns @ covariance @ columns.T)
        limited, whole = (
            ((emitted @ active.constrained(x)) * emitted).sum(axis=1) for x in (covariance, own)
        )
        free[moved] += np.maximum(limited, whole)
        is_far[moved] |= whole > 0
        own_steps = emitted @ (active.own_exits * steps)
        below[moved] += np.square(np.minimum(own_steps, 0)).sum(axis=1)
        above[moved] += np.square(np.maximum(own_steps, 0)).sum(axis=1)
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
    squares, axes = eigenvectors(covariance * scale)
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
