"""From basis and painting to lighting, in one call."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from lightpaint.basis.basis import Basis
from lightpaint.images.exr import Floats
from lightpaint.images.view import View
from lightpaint.solve.constrained import preferring, pulled, solve_constrained, solve_sparse
from lightpaint.solve.constraints import Constraints
from lightpaint.solve.lighting import Lighting, Quality
from lightpaint.solve.loss import Loss
from lightpaint.solve.normal_equations import Doubles, NormalEquations, weighted_problem
from lightpaint.solve.optimum import Method
from lightpaint.solve.reduction import Reduction, reduce_to
from lightpaint.solve.reweighted import Reweighting, descend, predicted
from lightpaint.solve.selection import only
from lightpaint.solve.solver import SolverResult, solve_normal_equations
from lightpaint.target.target import Target

#: What is compared with the painting: light, or what a display shows of it.
Space = Literal["linear", "display"]


@dataclass(frozen=True)
class Refinement:
    """What is known of the noise in the last step to an answer (see refine.py).

    before: (n, 3), the weights that it went from.
    noise: (h, w, 3), half difference of the prediction there, as far as it decided the step.
    lacking: (3, n), what is still to be expected to lack in the gradient.
    share: of the step that the render of the mix decided, 0 to 1; the basis did the rest.
    """

    before: Doubles
    noise: Floats
    lacking: Doubles
    share: float


@dataclass(frozen=True)
class Solution:
    """The lighting that comes closest to a target, and the problem it solves.

    image: (h, w, 3), what was solved for; importance: (h, w), its weights. They differ from
    the target's where unpainted pixels count or emitters are seen.
    equations: of the basis as it is; solved: those that the weights solve, which differ where
    noise was taken out of them.
    current_share: (h, w), or (h, w, 3) after reweighting, how much of `image` is the current
    look, as the basis has it.
    constraints: what was asked of the lights beside being not negative.
    noise_removed: the part of the noise in `equations` that is not in `solved`.
    refinement: the last step by which the answer was improved, if it was.
    is_one_of_several: whether the lighting answers other views too, so that it need not be the
    best for this one.
    method: what it was solved with (see `minimise`), and is again where it is improved.
    tried: with `sparse`, numbers of lights and the weights (n, 3) of the best such.
    loss: what a pixel costs, where that is not one square for each channel: where the painting
    says "at least", or the fit is of what a display shows. reweighting: of the last linear problem
    that stood for it (reweighted.py); image, equations and solved then are of that one.
    """

    lighting: Lighting
    image: Floats
    importance: Floats
    equations: NormalEquations
    solved: NormalEquations
    current_share: Floats
    constraints: Constraints | None = None
    noise_removed: float = 0.0
    refinement: Refinement | None = None
    is_one_of_several: bool = False
    method: Method = "polished"
    tried: tuple[tuple[int, Doubles], ...] = ()
    loss: Loss | None = None
    reweighting: Reweighting | None = None

    @property
    def weight(self) -> Floats:
        """Of a pixel's squared residual, (h, w, 1), or (h, w, 3) where channels differ."""
        D = self.importance[..., None]
        return D if self.reweighting is None else D * self.reweighting.factor

    @property
    def current_shares(self) -> Floats:
        """`current_share` per channel, (h, w, 1) or (h, w, 3)."""
        share = self.current_share
        return share if share.ndim == 3 else share[..., None]

    def meant(self, predicted: Floats) -> Floats:
        """What was to be there, (h, w, 3) linear; `predicted` itself where brighter will do."""
        return self.image if self.loss is None else self.loss.meant(predicted)

    @property
    def norm2(self) -> Doubles:
        """(3,), what a black picture would miss, to hold the objective against."""
        return self.equations.target_norm2 if self.loss is None else self.loss.norm2

    @property
    def space(self) -> Space:
        """In which the prediction was brought close to the painting."""
        return "linear" if self.loss is None or self.loss.view is None else "display"

    @property
    def quality(self) -> Quality:
        """How good the solve is."""
        assert self.lighting.quality is not None
        return self.lighting.quality


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
    start: lighting to begin with (the present one by default): a good guess saves sweeps,
    the answer is the same.
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
    return _linear_solution(basis, problem, start=start)


def _linear_solution(
    basis: Basis, problem: Solution, *, start: Doubles, reduction: Reduction | None = None
) -> Solution:
    """As `solution_of`, of the linear problem. reduction: with `sparse`, of the lights to use."""
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
    return replace(quality, objective=_rgb(missed), relative_objective=_rgb(missed / norm))


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
    first = _linear_solution(basis, replace(problem, constraints=every), start=start)
    weights = first.lighting.weights_for(basis)
    solution = _descended(basis, replace(problem, constraints=every), loss, weights)
    if sparse:
        weights = solution.lighting.weights_for(basis)
        chosen = _linear_solution(basis, replace(solution, constraints=asked), start=weights)
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
        return _linear_solution(basis, one, start=begin, reduction=reduction)

    def weights_of(equations: NormalEquations, begin: Doubles) -> Doubles:
        return linear(equations, begin).lighting.weights_for(basis)

    found = descend(basis, loss, start, weights_of, pull=_pull(basis, problem))
    its = linear(found.equations, found.reweighting.at)
    converged = its.quality.converged and found.reweighting.converged
    quality = with_objective(basis, problem, its.quality, found.weights)
    quality = replace(
        quality,
        converged=converged,
        display="" if loss.view is None else loss.view.spoken,
        rounds=1 + found.reweighting.rounds,
    )
    lighting = its.lighting
    if (found.weights != lighting.weights_for(basis)).any():
        lighting = Lighting.of_weights(basis, found.weights, target=lighting.target)
    return replace(
        problem,
        lighting=replace(lighting, quality=quality),
        image=found.squares.image,
        current_share=found.squares.share,
        equations=found.equations,
        solved=found.equations,
        reweighting=found.reweighting,
    )


def _pull(basis: Basis, problem: Solution) -> NormalEquations | None:
    """What the pull to the present adds to the objective, if it is asked for."""
    if problem.constraints is None or not problem.constraints.prefer_current:
        return None
    e = problem.equations
    nothing = NormalEquations(0 * e.M, 0 * e.b, 0 * e.target_norm2)
    return preferring(nothing, basis, basis.present_weights, problem.constraints.prefer_current)


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


def chosen_reduction(basis: Basis, solution: Solution) -> Reduction:
    """What constraints leave to solve for, with the lights that `sparse` has chosen."""
    assert solution.constraints is not None
    reduction = reduce_to(solution.constraints, basis.lights)
    if solution.constraints.sparse is None:
        return reduction
    weights = solution.lighting.weights_for(basis)
    on = [k for k, (lights, _) in enumerate(reduction.knobs) if weights[list(lights)].any()]
    return only(reduction, on)


def _rgb(values: Floats) -> tuple[float, float, float]:
    r, g, b = (float(v) for v in values)
    return r, g, b
