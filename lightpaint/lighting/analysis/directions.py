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
class Room:
    """What the unknowns of one block may do about an answer.

    columns: (3 n, k), what each changes of the weights, 0 where a light reaches nothing.
    x: (k,), where they are. free: (k, m), directions in which no bound and no cap holds them.
    off: (o,), those that are at 0 and may be more, each by itself.
    """

    columns: Doubles
    x: Doubles
    free: Doubles
    off: Indices


def rooms(solution: Solution, equations: NormalEquations) -> Iterator[Room]:
    """One for every set of channels that the unknowns couple. equations: what is solved."""
    reduction, lit = solution.problem.reduction, solution.equations.reached
    x = solve_reduced(equations, reduction, solution.weights).x
    at_cap = _at_caps(reduction, x)
    for block in reduction.blocks:
        its = block.its
        columns = _columns(reduction, its, lit)
        reaches = columns.any(axis=0)
        inside = (reduction.lower[its] < x[its]) & (x[its] < reduction.upper[its]) & reaches
        rows = at_cap[:, its]
        rows = rows[rows.any(axis=1)]
        off = (x[its] == 0) & (reduction.lower[its] == 0) & (reduction.upper[its] > 0) & reaches
        off &= ~rows.any(axis=0)
        yield Room(columns, x[its], _keeping(rows, np.flatnonzero(inside)), np.flatnonzero(off))


def moving(solution: Solution) -> list[Doubles]:
    """(3 n, k), directions in which nothing holds the answer, for each independent problem."""
    solved = solution.problem.pulled(solution.problem.solved)
    return [room.columns @ room.free for room in rooms(solution, solved)]


def answer_to(solution: Solution, equations: NormalEquations) -> Doubles:
    """The weights (n, 3) that solve `equations` under the same bounds as the answer."""
    problem = solution.problem
    asked = problem.pulled(equations)
    return solve_reduced(asked, problem.reduction, solution.weights).weights


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


def _at_caps(reduction: Reduction, x: Doubles) -> Doubles:
    """(j, unknowns), coefficients of the caps whose sums are at a limit."""
    rows = []
    for cap in reduction.caps:
        its, coefficients = list(cap.unknowns), np.asarray(cap.coefficients)
        if not cap.lower * (1 + AT_LIMIT) < coefficients @ x[its] < cap.upper * (1 - AT_LIMIT):
            row = np.zeros(x.size)
            row[its] = coefficients
            rows.append(row)
    return np.array(rows).reshape(-1, x.size)


def _keeping(rows: Doubles, inside: Indices) -> Doubles:
    """(k, m), directions of the unknowns inside their bounds that keep the sums `rows`, (j, k)."""
    free = np.eye(rows.shape[1])[:, inside]
    if not len(rows):
        return free
    _, sizes, right = np.linalg.svd(rows[:, inside])
    rank = int((sizes > AT_LIMIT * sizes.max(initial=0)).sum())
    return np.asarray(free @ right[rank:].T)
