"""The answer to a linear problem, with all that is asked of the lights."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lightpaint.arrays import Doubles, Floats
from lightpaint.basis.basis import Basis
from lightpaint.lighting.constraints.constrained import (
    preferring,
    pulled,
    solve_constrained,
    solve_sparse,
)
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.constraints.reduction import Reduction, reduce_to
from lightpaint.lighting.constraints.sparse import only
from lightpaint.lighting.lighting import Lighting, Quality
from lightpaint.lighting.reweighted import predicted
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.solver import SolverResult, solve_normal_equations


def linear_solution(
    basis: Basis, problem: Solution, *, start: Doubles, reduction: Reduction | None = None
) -> Solution:
    """`problem` with the weights that solve `problem.solved`. start: (n, 3), where to begin.

    reduction: with `sparse`, of the lights to use.
    """
    asked = None
    tried: list[tuple[int, Doubles]] = []
    if problem.constraints:
        result, asked, tried = _solve_asked(problem, basis, problem.constraints, start, reduction)
    else:
        result = _solve_free(problem, basis, start)
    weights = result.weights
    unreached = tuple(name for name, ok in zip(basis.names, result.reached, strict=True) if not ok)
    quality = Quality(
        kkt_residual=_rgb(result.kkt_residual),
        objective=(0, 0, 0),
        relative_objective=(0, 0, 0),
        sweeps=result.sweeps,
        converged=result.converged,
        unreached=unreached,
        curve=_curve(basis, problem, tried),
    )
    quality = with_objective(basis, problem, quality, weights)
    target = problem.lighting.target
    lighting = Lighting.of_weights(basis, weights, asked=asked, target=target, quality=quality)
    return replace(problem, lighting=lighting, tried=tuple(tried))


def with_objective(basis: Basis, problem: Solution, quality: Quality, weights: Doubles) -> Quality:
    """`quality` with what `weights` (n, 3) miss in `problem`."""
    if problem.loss is None:
        return quality.of(problem.equations, weights)
    missed = problem.loss.objective(predicted(basis, weights))
    norm = np.where(problem.norm2 > 0, problem.norm2, 1)
    view, reweighting = problem.loss.view, problem.reweighting
    return replace(
        quality,
        objective=_rgb(missed),
        relative_objective=_rgb(missed / norm),
        display="" if view is None else view.spoken,
        rounds=1 if reweighting is None else 1 + reweighting.rounds,
    )


def chosen_reduction(basis: Basis, solution: Solution) -> Reduction:
    """What constraints leave to solve for, with the lights that `sparse` has chosen."""
    assert solution.constraints is not None
    reduction = reduce_to(solution.constraints, basis.lights)
    if solution.constraints.sparse is None:
        return reduction
    weights = solution.lighting.weights_for(basis)
    on = [k for k, (lights, _) in enumerate(reduction.knobs) if weights[list(lights)].any()]
    return only(reduction, on)


def _solve_free(problem: Solution, basis: Basis, start: Doubles) -> SolverResult:
    """Every light that is not kept may have any colour."""
    free = [k for k, light in enumerate(basis.lights) if not light.is_fixed]
    result = solve_normal_equations(
        problem.solved.holding(basis.is_fixed),
        start[free],
        is_scalar=[basis.lights[k].is_scalar for k in free],
        method=problem.method,
    )
    weights, reached = start.copy(), np.ones(len(start), dtype=bool)
    weights[free], reached[free] = result.weights, result.reached
    return replace(result, weights=weights, reached=tuple(reached.tolist()))


def _solve_asked(
    problem: Solution,
    basis: Basis,
    constraints: Constraints,
    start: Doubles,
    chosen: Reduction | None = None,
) -> tuple[SolverResult, list[tuple[str, bool]], list[tuple[int, Doubles]]]:
    """Under constraints; with it, of each light, what is asked and whether that holds it.

    Last, where only some lights may be on: numbers of lights and weights of the best such.
    chosen: what is left to solve for if these are known.
    """
    equations, reduction = problem.solved, chosen or reduce_to(constraints, basis.lights)
    if constraints.prefer_current:
        present = basis.present_weights
        equations = preferring(equations, basis, present, constraints.prefer_current)
    tried: list[tuple[int, Doubles]] = []
    if constraints.sparse is not None and chosen is None:
        reduction, tried = solve_sparse(equations, reduction, start, constraints.sparse)
    result = solve_constrained(equations, reduction, start, method=problem.method)
    active = pulled(equations, basis, result.weights)
    labels = zip(reduction.labels, active, strict=True)
    return result, [(label, bool(label) and holds) for label, holds in labels], tried


def _curve(
    basis: Basis, problem: Solution, tried: Sequence[tuple[int, Doubles]]
) -> tuple[tuple[int, float], ...]:
    """Numbers of lights, and what the best such miss, relative to the painting."""
    if not tried:
        return ()
    norm = np.where(problem.norm2 > 0, problem.norm2, 1).sum()
    missed = [
        problem.equations.objective(w)
        if problem.loss is None
        else problem.loss.objective(predicted(basis, w))
        for _, w in tried
    ]
    return tuple(
        (count, float(np.sqrt(value.sum() / norm)))
        for (count, _), value in zip(tried, missed, strict=True)
    )


def _rgb(values: Floats) -> tuple[float, float, float]:
    r, g, b = (float(v) for v in values)
    return r, g, b
