"""From basis and painting to lighting, in one call."""

from dataclasses import replace

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.basis.basis import Basis
from lightpaint.colour.view import View
from lightpaint.errors import ConstraintError, TargetError
from lightpaint.lighting.algebra.optimum import Method
from lightpaint.lighting.constraints.constrained import preferring
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.constraints.reduction import Reduction
from lightpaint.lighting.lighting import Lighting
from lightpaint.lighting.linear import chosen_reduction, linear_solution, with_objective
from lightpaint.lighting.loss import Loss
from lightpaint.lighting.normal_equations import NormalEquations, weighted_problem
from lightpaint.lighting.reweighted import descend
from lightpaint.lighting.solution import Refinement, Solution, Space
from lightpaint.target.target import Target

__all__ = [
    "Refinement",
    "Solution",
    "Space",
    "chosen_reduction",
    "problem_of",
    "solution_of",
    "solve",
    "with_objective",
]


def solve(
    basis: Basis,
    target: Target,
    *,
    constraints: Constraints | None = None,
    unpainted: float = 0.0,
    start: Lighting | None = None,
    method: Method = "polished",
    view: View | None = None,
) -> Solution:
    """Find the non-negative light colours whose image comes closest to `target`.

    constraints: what else is asked of the lights.
    unpainted: weight of what is not painted, against the current look.
    start: lighting to begin with (the present one by default): a good guess saves sweeps, the
    answer is the same, but for what no painted pixel tells: lights that reach none keep the start.
    method: `gauss-seidel` is the paper's iteration alone, which may run out of sweeps; the
    quality of the answer then says that it has not converged.
    view: for an answer that comes closest in what this view shows, instead of in linear light.

    Lights that are kept have weight 1; the others make up what they leave of the target.

    Raises SizeError if basis and target differ in size, TargetError if nothing counts,
    ConstraintError if a constraint does not fit the lights.
    """
    problem = problem_of(
        basis, target, constraints=constraints, unpainted=unpainted, method=method, view=view
    )
    begin = basis.present_weights if start is None else start.weights_for(basis)
    return solution_of(basis, problem, start=begin)


def problem_of(
    basis: Basis,
    target: Target,
    *,
    constraints: Constraints | None = None,
    unpainted: float = 0.0,
    method: Method = "polished",
    view: View | None = None,
) -> Solution:
    """What is to be solved, with the present lighting for an answer. As of `solve`."""
    if not isinstance(target, Target):
        raise TargetError(f"the target is a {type(target).__name__}: give what read_target returns")
    if not (constraints is None or isinstance(constraints, Constraints)):
        raise ConstraintError(
            f"the constraints are a {type(constraints).__name__}: give Constraints.of(...)"
        )
    target = target.fitted_to(basis.size, resize=False)
    image, importance = weighted_problem(basis, target, unpainted=unpainted)
    counted = np.where(importance > 0, importance, 1)
    equations = NormalEquations.of(basis, image, importance)
    problem = Solution(
        lighting=Lighting.of_weights(basis, basis.present_weights, target=target.name),
        image=image,
        importance=importance,
        equations=equations,
        solved=equations,
        current_share=np.where(importance > 0, 1 - target.importance / counted, 0),
        constraints=constraints,
        method=method,
    )
    if view is None and (target.at_least is None or not target.at_least[importance > 0].any()):
        return problem
    return _with_loss(basis, target, problem, view)


def _with_loss(basis: Basis, target: Target, problem: Solution, view: View | None) -> Solution:
    asked = problem.constraints
    if view is not None and asked is not None:
        # The pull to the present is of squared light: of light as bright as the view makes it.
        pull = asked.prefer_current * 4.0**view.stops
        asked = replace(asked, prefer_current=pull)
    loss = Loss(
        painted=target.image.astype(np.float64),
        importance=problem.importance,
        share=problem.current_share,
        current=basis.mix(basis.present_weights),
        at_least=target.at_least,
        view=view,
    )
    return replace(problem, constraints=asked, loss=loss)


def solution_of(basis: Basis, problem: Solution, *, start: Doubles) -> Solution:
    """`problem` with the weights that solve `problem.solved`. start: (n, 3), where to begin.

    Where the problem has a loss that no linear problem stands for yet, one is found first.
    """
    if problem.loss is not None and problem.reweighting is None:
        return _reweighted(basis, problem, problem.loss, start)
    if problem.reweighting is None:
        return linear_solution(basis, problem, start=start)
    # One more step of the last linear problem, in which lights may reach less than they do, and
    # which says nothing of other lights than those that were chosen.
    asked = problem.constraints
    reduction = chosen_reduction(basis, problem) if asked and asked.sparse is not None else None
    solution = linear_solution(basis, problem, start=start, reduction=reduction)
    quality = replace(
        solution.quality,
        unreached=problem.quality.unreached,
        curve=problem.quality.curve,
        converged=solution.quality.converged and problem.reweighting.converged,
    )
    lighting = replace(solution.lighting, quality=quality)
    return replace(solution, lighting=lighting, tried=problem.tried)


def _reweighted(basis: Basis, problem: Solution, loss: Loss, start: Doubles) -> Solution:
    """The solution that minimises `loss`, of the linear problem that stands for it there.

    With `sparse` the lights are chosen where all of them would lead.
    """
    asked = problem.constraints
    sparse = asked is not None and asked.sparse is not None
    every = asked
    if asked is not None and sparse:
        every = replace(asked, sparse=None)
    # Where the painting says "at least" it is first taken by its word, which also tells which
    # lights reach something that counts.
    first = linear_solution(basis, replace(problem, constraints=every), start=start)
    weights = first.lighting.weights_for(basis)
    solution = _descended(basis, replace(problem, constraints=every), loss, weights)
    if sparse:
        weights = solution.lighting.weights_for(basis)
        chosen = linear_solution(basis, replace(solution, constraints=asked), start=weights)
        reduction = chosen_reduction(basis, chosen)
        weights = chosen.lighting.weights_for(basis)
        solution = _descended(
            basis, replace(problem, constraints=asked), loss, weights, reduction=reduction
        )
        solution = replace(solution, tried=chosen.tried)
        first = replace(first, lighting=chosen.lighting)
    quality = replace(
        solution.quality, unreached=first.quality.unreached, curve=first.quality.curve
    )
    return replace(solution, lighting=replace(solution.lighting, quality=quality))


def _descended(
    basis: Basis,
    problem: Solution,
    loss: Loss,
    start: Doubles,
    *,
    reduction: Reduction | None = None,
) -> Solution:
    """From weights (n, 3) within what is asked to the least of `loss`."""

    def linear(equations: NormalEquations, begin: Doubles) -> Solution:
        one = replace(problem, loss=None, equations=equations, solved=equations)
        return linear_solution(basis, one, start=begin, reduction=reduction)

    def weights_of(equations: NormalEquations, begin: Doubles) -> Doubles:
        return linear(equations, begin).lighting.weights_for(basis)

    found = descend(basis, loss, start, weights_of, pull=_pull(basis, problem))
    its = linear(found.equations, found.reweighting.at)
    solution = replace(
        problem,
        image=found.squares.image,
        current_share=found.squares.share,
        equations=found.equations,
        solved=found.equations,
        reweighting=found.reweighting,
    )
    quality = with_objective(basis, solution, its.quality, found.weights)
    quality = replace(quality, converged=quality.converged and found.reweighting.converged)
    lighting = its.lighting
    if (found.weights != lighting.weights_for(basis)).any():
        asked = [(light.constraint, light.is_active) for light in lighting.lights]
        lighting = Lighting.of_weights(basis, found.weights, asked=asked, target=lighting.target)
    return replace(solution, lighting=replace(lighting, quality=quality))


def _pull(basis: Basis, problem: Solution) -> NormalEquations | None:
    """What the pull to the present adds to the objective, if it is asked for."""
    if problem.constraints is None or not problem.constraints.prefer_current:
        return None
    e = problem.equations
    nothing = NormalEquations(0 * e.M, 0 * e.b, 0 * e.target_norm2)
    return preferring(nothing, basis, basis.present_weights, problem.constraints.prefer_current)
