"""What each choice of `colors` would come to, beside the one that was made.

In linear light they have the answer's own equations. Where the loss is no linear problem all are
found over a sample of its pixels, that of the answer too, so that what the sample gets wrong is in
both, and cancels.
"""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import get_args

import numpy as np

from lightpaint.arrays import RGB, Doubles, as_rgb
from lightpaint.colour.color import luminance
from lightpaint.errors import ConstraintError
from lightpaint.lighting.analysis.appearance.display_difference import Looking
from lightpaint.lighting.constraints.reduced_problem import solve_reduced
from lightpaint.lighting.constraints.reduction import only_knobs
from lightpaint.lighting.constraints.white_neighbours import next_whites, solve_on_locus
from lightpaint.lighting.fit import Colors
from lightpaint.lighting.linear_problem import reduced_by
from lightpaint.lighting.loss.lit_pixels import LitPixels
from lightpaint.lighting.loss.reweighting import Asked, Led, change, rounds
from lightpaint.lighting.loss.warm_start import sample
from lightpaint.lighting.loss.weight_penalty import dimming_of
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.problem import Problem, gamuts_for
from lightpaint.lighting.solution import Solution
from lightpaint.screen import shortly

#: Pixels in a sample, or more, for each light; painted pixels that are looked at.
SAMPLE, EACH, LOOKED_AT = 2**12, 2**6, 2**12

#: Change of a light's picture in a round, beside the brightest light's, that ends the rounds.
ENOUGH = 1e-3

#: Times that lights go on to other whites, or are kept within their gamuts, at most.
WHITES_TRIED = 5

#: Part of all light that the hue of one must change to be spoken of.
NOTABLE = 0.03


@dataclass(frozen=True)
class ColorChoice:
    """The best lighting with one choice of `colors`.

    Attributes:
        colors: The choice.
        is_chosen: Whether it is that of the answer.
        delta_e: Mean CIEDE2000 over what was painted, as of `Seen`, with noise.
        light: The light whose hue would differ most from that of the answer, as far as the
            picture shows it; "" where none does, and of the answer itself.
        before, color: What that light emits in the answer, or at present where it is off, and what
            it would emit, at luminance 1; its weights, where these are all there is.
        weights: (n, 3), in the order of the basis, as a sample of the pixels has it.

    Examples:
        >>> [analysis] = lp.analyse(lp.solve(basis, target, colors="gentle"))
        >>> [choice.colors for choice in analysis.color_choices]
        ['free', 'gentle', 'white']
    """

    colors: Colors
    is_chosen: bool
    delta_e: float
    light: str
    before: RGB
    color: RGB
    weights: Doubles

    __repr__ = shortly


#: Of one view.
Choices = tuple[ColorChoice, ...]


def color_choices(
    solution: Solution, delta_e: Sequence[float], best: Mapping[Colors, Doubles] | None = None
) -> tuple[Choices, ...]:
    """Of each view, what `free`, `gentle` and `white` come to.

    delta_e: of the answer, of each view. best: what `best_of_each` found, where somebody has asked
    it. Nothing where no light may have another colour than it has, and of pictures without colour.
    """
    best = best_of_each(solution) if best is None else best
    if not best:
        return tuple(() for _ in solution.views)
    return tuple(
        _seen_in(view, its, best) for view, its in zip(solution.views, delta_e, strict=True)
    )


def best_of_each(solution: Solution) -> dict[Colors, Doubles]:
    """The best weights, (n, 3), with each choice of `colors`; none where there is no choice."""
    problem = solution.problem
    is_grey = problem.equations.reached.any(axis=0).sum() < 2
    found: dict[Colors, Doubles] = {}
    if is_grey or not _with_colors(problem, "free").keeps_color.any():
        return found
    best = _finder(solution)
    for colors in get_args(Colors):
        with suppress(ConstraintError):  # what else is asked of a light may be no white
            found[colors] = best(_with_colors(problem, colors))
    return found


def _finder(solution: Solution) -> Callable[[Problem], Doubles]:
    """What finds the weights (n, 3) that are best for the same with other colours."""
    once = _finder_once(solution)

    def best(problem: Problem) -> Doubles:
        weights = once(problem)
        if problem.fit.colors != "gentle" or problem.dimming is not None:
            return weights
        dimming = dimming_of(problem.basis.present_weights, weights)
        return once(replace(problem, dimming=dimming))

    return best


def _finder_once(solution: Solution) -> Callable[[Problem], Doubles]:
    """The same with the pull to colours that a problem has."""
    loss, at, solved = solution.problem.loss, solution.weights, solution.problem.solved

    def squares(problem: Problem) -> tuple[Problem, Doubles]:
        asked = problem.pulled(solved)
        reduction, found = solve_on_locus(asked, problem.reduction, at)
        return problem.reduced(reduction), found.weights

    if solution.problem.is_linear:
        return lambda problem: squares(problem)[1]
    lit = LitPixels.of(solution.basis, loss)
    size = max(SAMPLE, EACH * len(at))
    part = lit
    if np.count_nonzero(loss.importance) > size:
        part = sample(lit, np.einsum("cii->ic", solution.equations.M), size)

    def led(problem: Problem, begin: Doubles) -> Led:
        def solve(equations: NormalEquations, begin: Doubles) -> Doubles:
            return solve_reduced(problem.pulled(equations), problem.reduction, begin).weights

        asked = Asked(problem.pull)
        return rounds(part, asked, begin, solve, from_clipping=False, until=ENOUGH)

    def best(problem: Problem) -> Doubles:
        problem, begin = squares(problem)
        found = led(problem, begin)
        its = problem.reduction
        for _ in range(WHITES_TRIED if its.white_knobs or its.gamut_knobs else 0):
            asked = problem.pulled(found.equations)
            reduction, near = next_whites(asked, problem.reduction, found.weights)
            if change(found.equations, found.weights, near.weights) <= ENOUGH:
                break
            problem = problem.reduced(reduction)
            found = led(problem, near.weights)
        return found.weights

    return best


def _with_colors(problem: Problem, colors: Colors) -> Problem:
    """The problem with that choice, of the lights that `sparse` has chosen.

    Raises ConstraintError where a light cannot have it.
    """
    fit = replace(problem.fit, colors=colors)
    gamuts = gamuts_for(problem.basis, problem.views, fit)
    full = reduced_by(problem.constraints, problem.lights, fit, gamuts)
    reduction = full
    if problem.reduction is not problem.full:
        knobs = enumerate(problem.reduction.knobs)
        reduction = only_knobs(full, [k for k, x in knobs if any(u.upper > 0 for u in x.unknowns)])
    return replace(problem, fit=fit, full=full, reduction=reduction)


def _seen_in(view: Solution, delta_e: float, found: Mapping[Colors, Doubles]) -> Choices:
    look = Looking.at(view.problem, most=LOOKED_AT)
    rows = look.rows(view.basis.planes)

    def missed(weights: Doubles) -> float:
        return look.mean(look.missed(np.einsum("npc,nc->pc", rows, weights)))

    chosen, told = found[view.problem.fit.colors or "free"], []
    own = missed(chosen)
    for colors, weights in found.items():
        # Both by the same few pixels, so that they differ by what the colours do.
        its = delta_e if weights is chosen else max(delta_e + missed(weights) - own, 0.0)
        turned = _recoloured(view, chosen, weights)
        told.append(ColorChoice(colors, weights is chosen, its, *turned, weights))
    return tuple(told)


def _recoloured(view: Solution, hue: Doubles, weights: Doubles) -> tuple[str, RGB, RGB]:
    """The light whose change of hue changes the picture most, and its colours; "" for none."""
    # What was off would have its present hue, or be white.
    for other in (view.basis.present_weights, np.ones_like(hue)):
        hue = np.where(luminance(hue)[:, None] > 0, hue, other)
    hue = hue / luminance(hue)[:, None]
    size, bright = np.sqrt(view.basis.power), luminance(weights)
    changes = np.linalg.norm(size * (weights - bright[:, None] * hue), axis=1)
    k = int(np.argmax(changes))
    if changes[k] <= NOTABLE * np.linalg.norm(size * weights):
        return "", (1, 1, 1), (1, 1, 1)
    return view.basis.names[k], as_rgb(hue[k]), as_rgb(weights[k] / bright[k])
