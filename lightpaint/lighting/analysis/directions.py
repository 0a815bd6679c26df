"""What may move about an answer: directions of the weights, and the answer to other equations.

Weights (n, 3) lie flat in a direction, (3 n), channel by channel.
"""

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.basis.basis import Basis
from lightpaint.lighting.constraints.constrained import (
    free_directions,
    preferring,
    solve_constrained,
)
from lightpaint.lighting.constraints.reduction import channel_groups
from lightpaint.lighting.linear import chosen_reduction
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.solver import Unknowns, solve_normal_equations, unknowns_of


def unknown_groups(basis: Basis, equations: NormalEquations) -> list[Unknowns]:
    """(light, channels it moves together) of each unknown weight, by independent problem."""
    is_scalar = [light.is_scalar for light in basis.lights]
    unknowns = [x for x in unknowns_of(equations.reached, is_scalar) if not basis.is_fixed[x[0]]]
    if any(len(channels) > 1 for _, channels in unknowns):
        return [unknowns]
    return [[x for x in unknowns if x[1] == [c]] for c in range(3)]


def columns(unknowns: Unknowns, n: int) -> Doubles:
    """(3 n, unknowns): 1 where a weight is that unknown."""
    made = np.zeros((3, n, len(unknowns)))
    for k, (i, cs) in enumerate(unknowns):
        made[cs, i, k] = 1
    return made.reshape(3 * n, -1)


def moving(basis: Basis, solution: Solution) -> list[Doubles]:
    """(3 n, k), directions in which nothing holds the answer, for each independent problem."""
    weights = solution.lighting.weights_for(basis)
    if solution.constraints:
        solved = pulled_to_present(basis, solution, solution.solved)
        reduction = chosen_reduction(basis, solution)
        to = free_directions(solved, reduction, weights)
        touched = np.any(to.reshape(3, len(weights), -1), axis=1)
        return [to[:, touched[group].any(axis=0)] for group in channel_groups(reduction)]
    groups = unknown_groups(basis, solution.solved)
    return [
        columns([(i, cs) for i, cs in group if weights[i, cs[0]] > 0], len(weights))
        for group in groups
    ]


def answer_to(basis: Basis, solution: Solution, equations: NormalEquations) -> Doubles:
    """The weights (n, 3) that solve `equations` under the same bounds as the answer."""
    start = solution.lighting.weights_for(basis)
    if solution.constraints:
        asked = pulled_to_present(basis, solution, equations)
        return solve_constrained(asked, chosen_reduction(basis, solution), start).weights
    free = [k for k, light in enumerate(basis.lights) if not light.is_fixed]
    weights = start.copy()
    weights[free] = solve_normal_equations(
        equations.holding(basis.is_fixed),
        start[free],
        is_scalar=[basis.lights[k].is_scalar for k in free],
        # Far below the errors that are asked for.
        tolerance=1e-6,
        max_sweeps=2000,
    ).weights
    return weights


def pulled_to_present(
    basis: Basis, solution: Solution, equations: NormalEquations
) -> NormalEquations:
    """`equations` with the pull to the present that was asked for, if any was."""
    strength = solution.constraints.prefer_current if solution.constraints else 0.0
    if not strength:
        return equations
    return preferring(equations, basis, basis.present_weights, strength)


def block_diagonal(M: Doubles) -> Doubles:
    """(3 n, 3 n), M (3, n, n) for weights that lie flat."""
    n = M.shape[1]
    whole = np.zeros((3, n, 3, n))
    for c in range(3):
        whole[c, :, c] = M[c]
    return whole.reshape(3 * n, 3 * n)
