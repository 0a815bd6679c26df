"""What may move about an answer: directions of the weights, and the answer to other equations.

Weights (n, 3) lie flat in a direction, (3 n), channel by channel.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import Bools, Doubles, Indices
from lightpaint.lighting.constraints.reduced_problem import solve_reduced
from lightpaint.lighting.constraints.reduction import Reduction
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.solution import Solution

#: Share by which a sum may be short of its limit and be said to be at it.
AT_LIMIT = 1e-9


@dataclass(frozen=True)
class Held:
    """What holds the unknowns of a block, bounds first, then the sums that are at a limit.

    ways: (k, h), for each a direction that leaves it, and nothing else that holds, by one unit.
    room: (h,), how far that may go. of_bounds: (b,), whose bounds they are, for the first b.
    sums: (h - b, k), coefficients of the others.
    """

    ways: Doubles
    room: Doubles
    of_bounds: Indices
    sums: Doubles

    @property
    def own(self) -> Doubles:
        """(k, h), of the ways what they do to the unknowns that are held there themselves."""
        its = np.zeros(self.ways.shape, dtype=bool)
        its[self.of_bounds, np.arange(self.of_bounds.size)] = True
        its[:, self.of_bounds.size :] = self.sums.T != 0
        return np.where(its, self.ways, 0)

    def kept(self, covariance: Doubles) -> Doubles:
        """A covariance of the unknowns, (k, k), where what holds them does hold."""
        kept = covariance.copy()
        kept[self.of_bounds], kept[:, self.of_bounds] = 0, 0
        for row in self.sums:
            its = np.flatnonzero(row)
            along = kept[np.ix_(its, its)] @ row[its]
            if (variance := float(row[its] @ along)) > 0:
                kept[np.ix_(its, its)] -= np.outer(along, along) / variance
        return kept


@dataclass(frozen=True)
class Room:
    """What the unknowns of one block may do about an answer.

    columns: (3 n, k), what each changes of the weights, 0 where a light reaches nothing. emitted:
    the same there, too. free: (k, m), directions in which no bound and no cap holds them.
    """

    columns: Doubles
    emitted: Doubles
    free: Doubles
    held: Held


def rooms(solution: Solution, equations: NormalEquations) -> Iterator[Room]:
    """One for every set of channels that the unknowns couple. equations: what is solved."""
    reduction, lit = solution.problem.about_answer, solution.equations.reached
    x = solve_reduced(equations, reduction, solution.weights).x
    rows, left = _at_caps(reduction, x)
    for block in reduction.blocks:
        its = block.unknowns
        columns = _columns(reduction, its, lit)
        lower, upper = reduction.lower[its], reduction.upper[its]
        may = (lower < upper) & columns.any(axis=0)
        at = np.where(x[its] <= lower, 1, np.where(x[its] >= upper, -1, 0)) * may
        inside, bound = np.flatnonzero(may & (at == 0)), np.flatnonzero(at)
        mine = rows[:, its].any(axis=1)
        sums = rows[mine][:, its]
        free, back = _keeping(sums, inside)
        held = _held(sums, back, bound, at, np.concatenate([(upper - lower)[bound], left[mine]]))
        yield Room(columns, _columns(reduction, its, np.ones_like(lit)), free, held)


def moving(solution: Solution) -> list[Doubles]:
    """(3 n, k), directions in which nothing holds the answer, for each independent problem."""
    solved = solution.problem.pulled(solution.problem.solved)
    return [room.columns @ room.free for room in rooms(solution, solved)]


def answer_to(solution: Solution, equations: NormalEquations) -> Doubles:
    """The weights (n, 3) that solve `equations` under the same bounds as the answer."""
    problem = solution.problem
    asked = problem.pulled(equations)
    return solve_reduced(asked, problem.about_answer, solution.weights).weights


def all_columns(solution: Solution) -> Iterator[Doubles]:
    """(3 n, k), what every unknown changes of the weights, for each independent problem.

    As if nothing were asked: kept lights alone stay.
    """
    lights = np.flatnonzero(~solution.basis.is_fixed)
    scalar = np.array([light.is_scalar for light in solution.basis.lights], dtype=bool)
    lit = solution.equations.reached
    columns = np.zeros((3, len(scalar), 3, lights.size))
    for k, light in enumerate(lights):
        for c in range(3):
            # One weight for all channels is the unknown of the first.
            columns[c, light, 0 if scalar[light] else c, k] = lit[light, c]
    flat = columns.reshape(3 * len(scalar), 3, lights.size)
    if scalar.any():
        yield flat.reshape(len(flat), -1)
    else:
        yield from (flat[:, c] for c in range(3))


def _columns(reduction: Reduction, its: Indices, lit: Bools) -> Doubles:
    """(3 n, k), C of these unknowns, 0 where a light reaches nothing."""
    place = np.full(len(reduction.unknowns), -1)
    place[its] = np.arange(its.size)
    unknown, light, rgb = reduction.columns
    within = place[unknown] >= 0
    made = np.zeros((3, len(lit), its.size))
    for c in range(3):
        made[c, light[within], place[unknown[within]]] = rgb[within, c]
    return (made * lit.T[:, :, None]).reshape(3 * len(lit), its.size)


def _at_caps(reduction: Reduction, x: Doubles) -> tuple[Doubles, Doubles]:
    """Of the caps whose sums are at a limit: coefficients, and how far they may go from there.

    Returns (j, unknowns), negative where the sum may only rise, and (j,).
    """
    rows, room = [], []
    for cap in reduction.caps:
        its, coefficients = list(cap.unknowns), np.asarray(cap.coefficients)
        total = coefficients @ x[its]
        if not cap.lower * (1 + AT_LIMIT) < total < cap.upper * (1 - AT_LIMIT):
            row = np.zeros(x.size)
            row[its] = coefficients if total >= cap.upper * (1 - AT_LIMIT) else -coefficients
            rows.append(row)
            room.append(cap.upper - cap.lower)
    return np.array(rows).reshape(len(rows), x.size), np.array(room)


def _keeping(rows: Doubles, inside: Indices) -> tuple[Doubles, Doubles]:
    """What the unknowns inside their bounds may do about the sums `rows`, (j, k).

    Returns (k, m), directions that keep them, and (k, j), for each one that lowers it by one and
    keeps the others; NaN where there is none.
    """
    free = np.eye(rows.shape[1])[:, inside]
    if not len(rows):
        return free, np.zeros((rows.shape[1], 0))
    left, sizes, right = np.linalg.svd(rows[:, inside])
    rank = int((sizes > AT_LIMIT * sizes.max(initial=0)).sum())
    inverse = right[:rank].T @ (left[:, :rank] / sizes[:rank]).T
    lost = np.abs(rows[:, inside] @ inverse - np.eye(len(rows))).max(axis=0) > AT_LIMIT
    back = np.where(lost, np.nan, -free @ inverse)
    return np.asarray(free @ right[rank:].T), np.asarray(back)


def _held(rows: Doubles, back: Doubles, bound: Indices, at: Indices, room: Doubles) -> Held:
    """What holds a block, as far as each thing can be left by itself.

    rows, back: of the sums, (j, k) and (k, j), as of `_keeping`. bound: (b,), unknowns at a bound.
    at: (k,), 1 at the lower, -1 at the upper one. room: (b + j,).
    """
    ways = np.eye(len(at))[:, bound] * at[bound]
    pushed = rows @ ways
    for j, b in np.argwhere(pushed != 0):
        # Those inside make up for what this does to the sum.
        ways[:, b] += back[:, j] * pushed[j, b]
    can_leave = np.isfinite(ways).all(axis=0), np.isfinite(back).all(axis=0)
    return Held(
        np.hstack([ways[:, can_leave[0]], back[:, can_leave[1]]]),
        room[np.concatenate(can_leave)],
        bound[can_leave[0]],
        rows[can_leave[1]],
    )
