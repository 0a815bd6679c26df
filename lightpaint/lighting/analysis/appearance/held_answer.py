"""The answer that is held to the current lights where changing them brings nothing.

The least sum of squares may be farther from the paint in its mean ΔE, which reports give: where a
part of the paint is out of reach, all lights change a little for its large errors, and leave what
was as painted. An answer that is farther than the current lights are, and does not bring what was
painted either, is solved again with pulls to these lights, and the closest of the answers counts.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

from lightpaint.arrays import Floats
from lightpaint.lighting.analysis.appearance.delivery import have_wishes_come, painted_views
from lightpaint.lighting.analysis.appearance.display_difference import PaintComparison
from lightpaint.lighting.linear_problem import LinearProblem
from lightpaint.lighting.loss.weight_penalty import pull_to_current
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.problem import (
    Problem,
    are_sketches,
    display_transform,
    problem_as_given,
)
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.solver import solution_of

_Answer = TypeVar("_Answer")

#: Strengths of the pulls that are tried, relative to the loss of a painted picture. The last leaves
#: every light as it is, as far as constraints allow that.
PULLS = (1.0, 10.0, 100.0, 1e6)


def closest_to_paint(
    answer: _Answer,
    pulled: Callable[[float], _Answer],
    *,
    difference: Callable[[_Answer], float],
    difference_now: float,
    have_come: Callable[[_Answer], bool],
) -> tuple[_Answer, float]:
    """Return the answer to a sketch, or one nearer to the current lights if that is closer to the
    paint, and the strength of its pull; 0 without one.

    pulled: returns the answer with a pull of a strength. difference, difference_now: the mean ΔE
    from the paint, of an answer and of the current lights. have_come: returns whether the wishes
    came in an answer.
    """
    nearest, least, strength_of_nearest = answer, difference(answer), 0.0
    if least <= difference_now or have_come(answer):
        return answer, 0.0
    for strength in PULLS:
        held = pulled(strength)
        if (reached := difference(held)) < least:
            nearest, least, strength_of_nearest = held, reached, strength
    return nearest, strength_of_nearest


def hold_to_current(
    solution: Solution, finish: Callable[[Solution], Solution] = lambda x: x
) -> Solution:
    """Return the answer to a sketch, or one nearer to the current lights if that is closer to the
    paint.

    finish: what is done to each answer once it is solved, as the correction of its noise.
    """
    problem = problem_as_given(solution.problem)
    is_sketch = are_sketches(problem.views)
    if not problem.fit.reads_wishes(is_sketch=is_sketch) or problem.constraints.sparse is not None:
        return solution
    look, now = PaintComparison.of_problem(problem), problem.basis.current_look

    def difference_of(picture: Floats) -> float:
        return look.mean(look.difference(look.pixels(picture)))

    def picture_of(answer: Solution) -> Floats:
        return problem.basis.mix(answer.weights)

    def answer_held(strength: float) -> Solution:
        return finish(solution_of(problem.unsolved(holding=holding_pull(problem, strength))))

    held, _ = closest_to_paint(
        solution,
        answer_held,
        difference=lambda answer: difference_of(picture_of(answer)),
        difference_now=difference_of(now),
        have_come=lambda answer: have_wishes_come(
            painted_views(answer, now, picture_of(answer)), display_transform(problem)
        ),
    )
    return held


def holding_pull(problem: LinearProblem, strength: float) -> NormalEquations:
    """Return the pull to the current lights of a strength of `PULLS`."""
    power = strength * problem.fit.brightness * problem.painted_share * problem.power
    return pull_to_current(power, problem.reference)


def answer_released(problem: Problem, holding: NormalEquations | None) -> Solution:
    """Return the answer to a problem that has other constraints than one whose answer is held.

    It is held alike where it leads away from the paint as well. holding: of the other problem.
    """
    free = solution_of(problem)
    if holding is None:
        return free
    look = PaintComparison.of_problem(problem)
    missed, missed_now = (
        look.mean(look.difference(look.pixels(picture)))
        for picture in (problem.basis.mix(free.weights), problem.basis.current_look)
    )
    return free if missed < missed_now else solution_of(replace(problem, holding=holding))
