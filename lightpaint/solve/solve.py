"""From basis and painting to lighting, in one call."""

from dataclasses import dataclass, replace

import numpy as np

from lightpaint.basis.basis import Basis
from lightpaint.images.exr import Floats
from lightpaint.solve.lighting import Lighting, Quality
from lightpaint.solve.normal_equations import Doubles, NormalEquations, weighted_problem
from lightpaint.solve.solver import solve_normal_equations
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
    noise_removed: the part of the noise in `equations` that is not in `solved`.
    refinement: the last step by which the answer was improved, if it was.
    """

    lighting: Lighting
    image: Floats
    importance: Floats
    equations: NormalEquations
    solved: NormalEquations
    current_share: Floats
    noise_removed: float = 0.0
    refinement: Refinement | None = None

    @property
    def quality(self) -> Quality:
        """How good the solve is."""
        assert self.lighting.quality is not None
        return self.lighting.quality


def solve(
    basis: Basis, target: Target, *, unpainted: float = 0.0, start: Lighting | None = None
) -> Solution:
    """Find the non-negative light colours whose image comes closest to `target`.

    unpainted: weight of what is not painted, against the current look.
    start: lighting to begin with (the present one by default): a good guess saves sweeps,
    the answer is the same.

    Lights that are kept have weight 1; the others make up what they leave of the target.

    Raises SizeError if basis and target differ in size, TargetError if nothing counts.
    """
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
    )
    return solution_of(
        basis, problem, start=basis.present_weights if start is None else start.weights_for(basis)
    )


def solution_of(basis: Basis, problem: Solution, *, start: Doubles) -> Solution:
    """`problem` with the weights that solve `problem.solved`. start: (n, 3), where to begin."""
    equations = problem.equations
    weights = np.array(start)
    free = [k for k, light in enumerate(basis.lights) if not light.is_fixed]
    result = solve_normal_equations(
        problem.solved.holding(basis.is_fixed),
        weights[free],
        is_scalar=[basis.lights[k].is_scalar for k in free],
    )
    weights[free] = result.weights

    objective = equations.objective(weights)
    norm = np.where(equations.target_norm2 > 0, equations.target_norm2, 1)
    unreached = tuple(basis.names[k] for k, ok in zip(free, result.reached, strict=True) if not ok)
    quality = Quality(
        kkt_residual=_rgb(result.kkt_residual),
        objective=_rgb(objective),
        relative_objective=_rgb(objective / norm),
        sweeps=result.sweeps,
        converged=result.converged,
        unreached=unreached,
    )
    target = problem.lighting.target
    lighting = Lighting.of_weights(basis, weights, target=target, quality=quality)
    return replace(problem, lighting=lighting)


def _rgb(values: Floats) -> tuple[float, float, float]:
    r, g, b = (float(v) for v in values)
    return r, g, b
