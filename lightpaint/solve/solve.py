"""From basis and painting to lighting, in one call."""

from dataclasses import dataclass, replace

import numpy as np

from lightpaint.basis.basis import Basis
from lightpaint.images.exr import Floats
from lightpaint.solve.constrained import preferring, pulled, solve_constrained, solve_sparse
from lightpaint.solve.constraints import Constraints
from lightpaint.solve.lighting import Lighting, Quality
from lightpaint.solve.normal_equations import Doubles, NormalEquations, weighted_problem
from lightpaint.solve.optimum import Method
from lightpaint.solve.reduction import Reduction, reduce_to
from lightpaint.solve.selection import only
from lightpaint.solve.solver import SolverResult, solve_normal_equations
from lightpaint.target.target import Target


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
    current_share: (h, w), how much of `image` is the current look, as the basis has it.
    constraints: what was asked of the lights beside being not negative.
    noise_removed: the part of the noise in `equations` that is not in `solved`.
    refinement: the last step by which the answer was improved, if it was.
    is_one_of_several: whether the lighting answers other views too, so that it need not be the
    best for this one.
    method: what it was solved with (see `minimise`), and is again where it is improved.
    tried: with `sparse`, numbers of lights and the weights (n, 3) of the best such.
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
) -> Solution:
    """Find the non-negative light colours whose image comes closest to `target`.

    constraints: what else is asked of the lights.
    unpainted: weight of what is not painted, against the current look.
    start: lighting to begin with (the present one by default): a good guess saves sweeps,
    the answer is the same.
    method: `gauss-seidel` is the paper's iteration alone, which may run out of sweeps; the
    quality of the answer then says that it has not converged.

    Lights that are kept have weight 1; the others make up what they leave of the target.

    Raises SizeError if basis and target differ in size, TargetError if nothing counts,
    ConstraintError if a constraint does not fit the lights.
    """
    problem = problem_of(basis, target, constraints=constraints, unpainted=unpainted, method=method)
    begin = basis.present_weights if start is None else start.weights_for(basis)
    return solution_of(basis, problem, start=begin)


def problem_of(
    basis: Basis,
    target: Target,
    *,
    constraints: Constraints | None = None,
    unpainted: float = 0.0,
    method: Method = "polished",
) -> Solution:
    """What is to be solved, with the present lighting for an answer. As of `solve`."""
    target = target.fitted_to(basis.size, resize=False)
    image, importance = weighted_problem(basis, target, unpainted=unpainted)
    counted = np.where(importance > 0, importance, 1)
    equations = NormalEquations.of(basis, image, importance)
    return Solution(
        lighting=Lighting.of_weights(basis, basis.present_weights, target=target.name),
        image=image,
        importance=importance,
        equations=equations,
        solved=equations,
        current_share=np.where(importance > 0, 1 - target.importance / counted, 0),
        constraints=constraints,
        method=method,
    )


def solution_of(basis: Basis, problem: Solution, *, start: Doubles) -> Solution:
    """`problem` with the weights that solve `problem.solved`. start: (n, 3), where to begin."""
    equations = problem.equations
    asked = None
    tried: list[tuple[int, Doubles]] = []
    if problem.constraints:
        result, asked, tried = _solve_asked(problem, basis, problem.constraints, start)
    else:
        result = _solve_free(problem, basis, start)
    weights = result.weights

    norm = np.where(equations.target_norm2 > 0, equations.target_norm2, 1)
    unreached = tuple(name for name, ok in zip(basis.names, result.reached, strict=True) if not ok)
    quality = Quality(
        kkt_residual=_rgb(result.kkt_residual),
        objective=(0, 0, 0),
        relative_objective=(0, 0, 0),
        sweeps=result.sweeps,
        converged=result.converged,
        unreached=unreached,
        curve=tuple(
            (count, float(np.sqrt(equations.objective(w).sum() / norm.sum()))) for count, w in tried
        ),
    ).of(equations, weights)
    target = problem.lighting.target
    lighting = Lighting.of_weights(basis, weights, asked=asked, target=target, quality=quality)
    return replace(problem, lighting=lighting, tried=tuple(tried))


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
    problem: Solution, basis: Basis, constraints: Constraints, start: Doubles
) -> tuple[SolverResult, list[tuple[str, bool]], list[tuple[int, Doubles]]]:
    """Under constraints; with it, of each light, what is asked and whether that holds it.

    Last, where only some lights may be on: numbers of lights and weights of the best such.
    """
    equations, reduction = problem.solved, reduce_to(constraints, basis.lights)
    if constraints.prefer_current:
        present = basis.present_weights
        equations = preferring(equations, basis, present, constraints.prefer_current)
    tried: list[tuple[int, Doubles]] = []
    if constraints.sparse is not None:
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
