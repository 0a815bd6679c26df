"""The answers with each choice of `colors`, for comparison with the current one.

In linear light they have the answer's own equations. For a loss that is not linear all choices,
also the answer's, are solved over a sample of its pixels, so that errors of the sample cancel.
"""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import get_args

import numpy as np

from lightpaint.arrays import RGB, Doubles, as_rgb
from lightpaint.colour import luminance
from lightpaint.display_text import short_repr
from lightpaint.errors import ConstraintError
from lightpaint.lighting.analysis.appearance.display_difference import PaintComparison
from lightpaint.lighting.fit import Colors
from lightpaint.lighting.linear_problem import reduce_lights, whites_for
from lightpaint.lighting.loss import reweighting
from lightpaint.lighting.loss.expected_lights import Wash
from lightpaint.lighting.loss.lit_pixels import LitPixels
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.problem import Problem, ViewsReading, around_of, wash_of
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.unknowns.reduced_problem import solve_reduced
from lightpaint.lighting.unknowns.reduction import only_knobs
from lightpaint.lighting.unknowns.white_mixes import next_whites, solve_on_locus

#: The least number of pixels in a sample, the pixels for each light, and compared painted pixels.
MIN_SAMPLE, PIXELS_PER_LIGHT, COMPARED_PIXELS = 2**12, 2**6, 2**12

#: Number of lights free to change their colour beyond which no other choice is solved: kept to
#: gamuts, a thousand of them have six thousand unknowns, and take longer than the answer.
MAX_LIGHTS = 128

#: Change of a light's picture, relative to the brightest light's, that ends the rounds.
LAST_STEP = 1e-3

#: Maximum number of steps of lights to other whites, or into their gamuts.
MAX_WHITE_STEPS = 5

#: Share of all light that a change of hue has to affect to be mentioned.
MIN_HUE_CHANGE = 0.03


@dataclass(frozen=True)
class ColorChoice:
    """The best lighting with one choice of `colors`.

    Attributes:
        colors: The choice.
        is_chosen: Whether it is the answer's own choice.
        delta_e: Mean CIEDE2000 over the paint, as in `Appearance`, with noise.
        light: The light whose hue differs most from the answer's, as far as the picture shows it;
            "" if none does, and for the answer itself.
        before, color: The emission of that light in the answer, or in the scene if it is off, and
            with this choice, at luminance 1; its weights, if only these are known.
        weights: (n, 3), in the order of the basis, from a sample of the pixels.

    Examples:
        >>> [analysis] = lp.analyse(lp.solve(basis, target, colors="gentle"))
        >>> [choice.colors for choice in analysis.color_choices]
        ['free', 'gentle', 'white', 'own']
    """

    colors: Colors
    is_chosen: bool
    delta_e: float
    light: str
    before: RGB
    color: RGB
    weights: Doubles

    __repr__ = short_repr


#: For one view.
Choices = tuple[ColorChoice, ...]


def color_choices(
    solution: Solution, delta_e: Sequence[float], best: Mapping[Colors, Doubles] | None = None
) -> tuple[Choices, ...]:
    """Return, for each view, the answers of `free`, `gentle`, `white` and `own`.

    delta_e: of the answer, for each view. best: the result of `best_by_colors`, if known. Empty if
    no light may change its colour, for pictures without colour, and for many lights.
    """
    best = best_by_colors(solution) if best is None else best
    if not best:
        return tuple(() for _ in solution.views)
    return tuple(
        _view_choices(view, error, best)
        for view, error in zip(solution.views, delta_e, strict=True)
    )


def can_change_colors(solution: Solution) -> bool:
    """Return whether any light may change its colour, and the pictures show colour."""
    problem = solution.problem
    is_grey = problem.equations.reached.any(axis=0).sum() < 2
    return bool(not is_grey and _with_colors(problem, "free").keeps_color.any())


def best_by_colors(solution: Solution) -> dict[Colors, Doubles]:
    """Solve with each choice of `colors`; return weights, (n, 3), none if there is no choice, or
    if there are more than `MAX_LIGHTS`.
    """
    problem = solution.problem
    best: dict[Colors, Doubles] = {}
    if not can_change_colors(solution) or problem.full.is_free.sum() > MAX_LIGHTS:
        return best
    solve_problem = _solver(solution)
    wash = cache(lambda: wash_of(problem.views))  # several choices ask for it, or none
    for colors in get_args(Colors):
        with suppress(ConstraintError):  # another constraint may exclude white
            best[colors] = solve_problem(_with_colors(problem, colors, wash))
    return best


def _solver(solution: Solution) -> Callable[[Problem], Doubles]:
    """Return a function that solves the problem with other colours for its weights (n, 3)."""
    loss, weights, solved = solution.problem.loss, solution.weights, solution.problem.solved

    def squares(problem: Problem) -> tuple[Problem, Doubles]:
        equations = problem.with_pull(solved)
        reduction, optimum = solve_on_locus(equations, problem.reduction, weights)
        return problem.with_whites(reduction), optimum.weights

    if solution.problem.is_linear:
        return lambda problem: squares(problem)[1]
    lit = LitPixels.of(solution.basis, loss)
    size = max(MIN_SAMPLE, PIXELS_PER_LIGHT * len(weights))
    part = lit
    if np.count_nonzero(loss.importance) > size:
        part = reweighting.sample_pixels(lit, np.einsum("cii->ic", solution.equations.M), size)

    def descend(problem: Problem, begin: Doubles) -> reweighting.RoundsResult:
        def solve(equations: NormalEquations, begin: Doubles) -> Doubles:
            return solve_reduced(problem.with_pull(equations), problem.reduction, begin).weights

        terms = reweighting.WeightTerms(problem.pull)
        return reweighting.run_rounds(
            part, terms, begin, solve, from_clipping=False, until=LAST_STEP
        )

    def best(problem: Problem) -> Doubles:
        problem, begin = squares(problem)
        descent = descend(problem, begin)
        for _ in range(MAX_WHITE_STEPS if problem.reduction.has_choices else 0):
            equations = problem.with_pull(descent.equations)
            reduction, optimum = next_whites(equations, problem.reduction, descent.weights)
            if (
                reweighting.relative_change(descent.equations, descent.weights, optimum.weights)
                <= LAST_STEP
            ):
                break
            problem = problem.with_whites(reduction)
            descent = descend(problem, optimum.weights)
        return descent.weights

    return best


def _with_colors(
    problem: Problem, colors: Colors, wash: Callable[[], Wash] | None = None
) -> Problem:
    """Return the problem with that choice, for the lights that `sparse` has chosen.

    wash: as of `ViewsReading`. Raises ConstraintError if a light cannot have it.
    """
    fit = replace(problem.fit, colors=colors)
    reading = ViewsReading(
        problem.views, problem.power, problem.reference, fit, problem.constraints, wash
    )
    reads_wishes = fit.reads_wishes(is_sketch=reading.is_sketch)
    if problem.fit.reads_wishes(is_sketch=reading.is_sketch) != reads_wishes:
        problem = replace(problem, **vars(reading.terms()))
    expected = problem.expected or reading.expected()
    gamuts = reading.gamuts(around_of(expected if reads_wishes else None))
    full = reduce_lights(
        problem.constraints, problem.lights, fit, gamuts, whites_for(expected, fit)
    )
    reduction = full
    if problem.reduction is not problem.full:
        knobs = enumerate(problem.reduction.knobs)
        reduction = only_knobs(full, [k for k, x in knobs if any(u.upper > 0 for u in x.unknowns)])
    return replace(problem, fit=fit, full=full, reduction=reduction, expected=expected)


def _view_choices(view: Solution, delta_e: float, answers: Mapping[Colors, Doubles]) -> Choices:
    look = PaintComparison.of_problem(view.problem, max_pixels=COMPARED_PIXELS)
    rows = look.rows(view.basis.planes)
    missed = partial(look.missed, rows)
    chosen, choices = answers[view.problem.fit.colors or "free"], []
    own = missed(chosen)
    for colors, weights in answers.items():
        # Both use the same sample, so that they differ only by the effect of colours.
        distance = delta_e if weights is chosen else max(delta_e + missed(weights) - own, 0.0)
        turned = _largest_hue_change(view, chosen, weights)
        choices.append(ColorChoice(colors, weights is chosen, distance, *turned, weights))
    return tuple(choices)


def _largest_hue_change(view: Solution, hue: Doubles, weights: Doubles) -> tuple[str, RGB, RGB]:
    """Return the light whose change of hue changes the picture most, and its colours; "" for
    none.
    """
    # A light that was off gets its current hue, or white.
    for other in (view.basis.current_weights, np.ones_like(hue)):
        hue = np.where(luminance(hue)[:, None] > 0, hue, other)
    hue = hue / luminance(hue)[:, None]
    size, bright = np.sqrt(view.basis.power), luminance(weights)
    changes = np.linalg.norm(size * (weights - bright[:, None] * hue), axis=1)
    k = int(np.argmax(changes))
    if changes[k] <= MIN_HUE_CHANGE * np.linalg.norm(size * weights):
        return "", (1, 1, 1), (1, 1, 1)
    return view.basis.names[k], as_rgb(hue[k]), as_rgb(weights[k] / bright[k])
