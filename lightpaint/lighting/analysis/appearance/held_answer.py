"""The answer that is held to the current lights where changing them brings nothing.

The least sum of squares may be farther from the paint in its mean ΔE, which reports give: where a
part of the paint is out of reach, all lights change a little for its large errors, and leave what
was as painted. An answer that is farther than the current lights are, and does not bring what was
painted either, is solved again with pulls to these lights, and the closest of the answers counts.
"""

from collections.abc import Callable
from dataclasses import replace

from lightpaint.arrays import Floats
from lightpaint.lighting.analysis.appearance.delivery import has_come, measure_deliveries
from lightpaint.lighting.analysis.appearance.display_difference import PaintComparison
from lightpaint.lighting.loss.weight_penalty import pull_to_current
from lightpaint.lighting.problem import Problem, are_sketches
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.solver import solution_of

#: Strengths of the pulls that are tried, relative to the loss of a painted picture. The last leaves
#: every light as it is, as far as constraints allow that.
PULLS = (1.0, 10.0, 100.0, 1e6)


def hold_to_current(
    solution: Solution, finish: Callable[[Solution], Solution] = lambda x: x
) -> Solution:
    """Return the answer to a sketch, or one nearer to the current lights if that is closer to the
    paint.

    finish: what is done to each answer once it is solved, as the correction of its noise.
    """
    problem = solution.problem
    is_sketch = are_sketches(problem.views)
    if not problem.fit.reads_wishes(is_sketch=is_sketch) or problem.constraints.sparse is not None:
        return solution
    look = PaintComparison.of_problem(problem)

    def distance(picture: Floats) -> float:
        return look.mean(look.difference(look.pixels(picture)))

    predicted = problem.basis.mix(solution.weights)
    missed, missed_now = distance(predicted), distance(problem.basis.current_look)
    if missed <= missed_now or has_come(measure_deliveries(solution, predicted).deliveries):
        return solution
    nearest = solution
    for strength in PULLS:
        held = finish(solution_of(_pulled(problem, strength)))
        held_miss = distance(problem.basis.mix(held.weights))
        if held_miss < missed:
            nearest, missed = held, held_miss
    return nearest


def _pulled(problem: Problem, strength: float) -> Problem:
    """Return a problem with a pull to the current lights, before it is solved."""
    power = strength * problem.fit.brightness * problem.painted_share * problem.power
    pull = pull_to_current(power, problem.reference)
    tether = pull if problem.tether is None else problem.tether + pull
    return replace(
        problem, reduction=problem.full, tether=tether, corrected=None, noise_removed=0.0
    )
