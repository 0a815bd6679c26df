"""The default answer: a basis and a painting become a lighting that is no farther from the painting
than the current lights.

Everything that answers by default calls `default_answer`, or `hold_to_current` on a solution.

The answer of a renderer that multiplies lights in other primaries than Rec.709 is found with the
solve of one that does not. A problem adds planes channel by channel. Such a renderer shows N w (see
`Basis.mix`), in which all channels depend on each other. So a problem is solved with the diagonal D
of N, what each channel alone changes, and with (N − D) w of the last answer as light that stays,
until its prediction is what the renderer shows. This Jacobi iteration of a fixed point w = G(w)
converges where N is more diagonal than not, and Anderson's method (Anderson 1965; Walker and Ni
2011) makes it several times as fast.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.basis import Basis, can_be_multiplied, channel_responses
from lightpaint.keywords import keywords
from lightpaint.lighting.analysis.appearance.held_answer import hold_to_current
from lightpaint.lighting.analysis.noise.rendered_painting import answer_to_render
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.lighting.constraints.absolute_scale import with_sure_scale
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.constraints.constraints_file import constraints_of
from lightpaint.lighting.fit import Fit
from lightpaint.lighting.problem import Problem, problem_as_multiplied
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.solver import choose_mixes, solution_of
from lightpaint.target import Target

#: Largest number of solves, and the RMS difference of prediction and render, relative to the
#: picture, at which they end.
MAX_SOLVES, SMALL = 24, 5e-5

#: Number of earlier solves of which the next one makes use.
DEPTH = 4

#: Share of the largest change of steps below which a combination of steps is round-off.
ROUND_OFF = 1e-6


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
    """Solve a problem, read a painting that is a render as one, and hold the answer to the current
    lights where changes bring nothing.

    finish: what is done to each answer once it is solved, as the correction of its noise.
    """

    def finish_multiplied(solution: Solution) -> Solution:
        return answer_as_multiplied(finish(solution), finish)

    solution = answer_to_render(finish_multiplied(solution_of(problem)), finish)
    return hold_to_current(solution, finish_multiplied)


def answer_as_multiplied(
    solution: Solution, finish: Callable[[Solution], Solution] = lambda x: x
) -> Solution:
    """Return the answer whose prediction is what the renderer shows that multiplies these lights.

    It is the solution itself, unless its basis names other primaries than Rec.709.
    finish: what is done to each answer once it is solved.
    """
    problem, w = solution.problem, solution.weights
    if not all(can_be_multiplied(basis) for basis in problem.views.bases):
        return solution
    planes = [channel_responses(basis) for basis in problem.views.bases]
    iteration = _Anderson(np.sqrt(problem.power))
    best, least = solution, np.inf
    for _ in range(MAX_SOLVES):
        solution = finish(
            solution_of(problem_as_multiplied(problem, w, planes), start=solution.weights)
        )
        found = solution.weights
        rendered = problem.basis.mix(found).astype(np.float64)
        # Where colours clip, views that mix channels have several valleys.
        if (loss := float(problem.loss.pixels.objective(_by_channel(rendered)).sum())) <= least:
            best, least = solution, loss
        if _rms(rendered - solution.basis.mix(found)) <= SMALL * _rms(rendered):
            best = solution
            break
        w = np.maximum(iteration.next(w, found), 0)
    shown = problem_as_multiplied(problem, best.weights)
    return replace(
        best, problem=replace(best.problem, basis=shown.basis, views=shown.views, given=shown.given)
    )


@dataclass
class _Anderson:
    """Anderson's method for w = G(w). scale: (n, 3), the picture that a weight of 1 is worth."""

    scale: Doubles
    steps: list[Doubles] = field(default_factory=list)
    found: list[Doubles] = field(default_factory=list)

    def next(self, w: Doubles, found: Doubles) -> Doubles:
        """Return where to evaluate G next. found: G(w), (n, 3)."""
        self.steps.append(((found - w) * self.scale).ravel())
        self.found.append(found)
        del self.steps[: -DEPTH - 1], self.found[: -DEPTH - 1]
        if len(self.steps) == 1:
            return found
        changes = np.diff(np.stack(self.steps, axis=1))
        shares = np.linalg.lstsq(changes, self.steps[-1], rcond=ROUND_OFF)[0]
        moves = np.diff(np.stack(self.found, axis=-1))
        return np.asarray(found - moves @ shares)


def _by_channel(picture: Doubles) -> Doubles:
    """Return a picture (h, w, 3) as (3, p)."""
    return np.ascontiguousarray(picture.reshape(-1, 3).T)


def _rms(picture: Doubles) -> float:
    return float(np.sqrt(np.square(picture).mean()))
