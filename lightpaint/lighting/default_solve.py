"""The default answer: a basis and a painting become a lighting that is no farther from the painting
than the current lights.

Everything that answers by default calls `default_answer`, or `hold_to_current` on a solution.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from lightpaint.basis import Basis
from lightpaint.keywords import keywords
from lightpaint.lighting.analysis.appearance.held_answer import hold_to_current
from lightpaint.lighting.analysis.noise.painting_filter import answer_without_filter
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.lighting.constraints.absolute_scale import with_sure_scale
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.constraints.constraints_file import constraints_of
from lightpaint.lighting.fit import Fit
from lightpaint.lighting.multiplied_answer import answer_as_multiplied
from lightpaint.lighting.problem import Problem
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.solver import choose_mixes, solution_of
from lightpaint.target import Target


@keywords(Fit)
def solve(
    basis: Basis | Sequence[Basis],
    target: Target | Sequence[Target],
    *,
    constraints: Constraints | None = None,
    start: Lighting | None = None,
    resize: bool = False,
    **fit: Any,
) -> Solution:
    """Find the non-negative light colours whose image comes closest to `target`.

    Fixed lights have weight 1; the others make up the rest of the target.

    Args:
        basis: Of one view; or of several, for one lighting closest to all: pixels of all views
            count the same, and `views` of the solution has the answer to each.
        target: Of one view; or of several, in the same order.
        constraints: Constraints on the lights; they override the constraints of the scene's lights
            file, which a rendered basis includes.
        start: Lighting to begin with (the current one by default). A good guess saves sweeps; the
            answer is the same, except for lights that reach no painted pixel, which keep the start.
        resize: Whether to resample a target of the same shape as the basis, but of another size.
        **fit: Any option of `Fit`, by name: `unpainted=0.1` also holds unpainted pixels to the
            current look, `transform=lp.ViewTransform("agx")` compares display values instead of
            linear light.

    Returns:
        The lighting, the problem it solves, and the certificate.

    Raises:
        SizeError: If basis and target differ in size, and not in whole blocks of pixels.
        KeywordError: For a name that neither this nor `Fit` has.
        TargetError: If no pixel counts.
        ConstraintError: If a constraint does not fit the lights.
        BasisError: If views differ in lights.

    Examples:
        >>> solution = lp.solve(basis, target)
        >>> np.round(solution.lighting.emission["panel"], 2).tolist()
        [2.0, 1.5, 1.0]
        >>> solution
        Solution(closest there is (KKT residual ...)...)
    """
    options = Fit(**fit)
    problem = Problem.of(basis, target, constraints=constraints, fit=options, resize=resize)
    given = constraints_of(problem.lights.requests).and_then(constraints or Constraints())
    with_sure_scale(given, problem.lights)
    begin = problem.start if start is None else start.weights_for(problem.basis)
    return choose_mixes(default_answer(replace(problem, start=begin)))


def default_answer(
    problem: Problem, finish: Callable[[Solution], Solution] = lambda x: x
) -> Solution:
    """Solve a problem, take the filter out of a painting that is a render, and hold the answer to
    the current lights where changes bring nothing.

    finish: what is done to each answer once it is solved, as the correction of its noise.
    """

    def finish_multiplied(solution: Solution) -> Solution:
        return answer_as_multiplied(finish(solution), finish)

    solution = answer_without_filter(finish_multiplied(solution_of(problem)), finish)
    return hold_to_current(solution, finish_multiplied)
