"""The freedom around an answer: directions of the weights, and answers to other equations.

Weights (n, 3) lie flat in a direction, (3 n), channel by channel.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import Bools, Doubles, Indices
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.unknowns.reduced_problem import solve_reduced
from lightpaint.lighting.unknowns.reduction import Reduction

#: Relative distance at which a sum counts as at its limit.
AT_LIMIT = 1e-9


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
    x = solve_reduced(equations, reduction, solution.weights).x
    rows, distances = _active_caps(reduction, x)
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
