"""The reconstruction filter of a painting that is a render.

A basis has a box filter; Mitsuba's default is a Gaussian. It makes halos around lamps in view and
softens all edges of light: it adds h = (F − 1) p to the prediction p = Σ w Φ. No lights make that,
but each takes a part of it for its own light. So with

    a = Σ D (Φ h − Φ′ h′),  δ = M⁻¹ a

lights of a painting Ψ = p + α h are off by α δ. Least squares beside all lights give

    α = (Σ D (h r − h′ r′) − a · δ_r) / (Σ D (h² − h′²) − a · δ),   δ_r = M⁻¹ Σ D (Φ r − Φ′ r′)

Both h and the residual r = Ψ − p have the noise of the prediction; products of half differences,
with a prime, take it out. A brush, too, may leave residuals that resemble h, but h explains only a
small part of them.

Where h explains most, the painting is replaced by Ψ − α h, which is what a box filter would show,
and the answer to that is found. It has another h, so this is done a few times. Mitsuba's other
filters are narrower, and nearly a part α of the Gaussian: tent and Mitchell about half of it. So no
kernel has to be known, and a painting says nothing of the film of the scene that it is used with.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.basis import as_slice, block_of
from lightpaint.lighting.analysis.noise.painting_noise import painting_grain
from lightpaint.lighting.analysis.noise.residuals import Residuals, added_by_filter
from lightpaint.lighting.analysis.noise.weight_directions import solve_for
from lightpaint.lighting.problem import Problem, ViewsReading
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.solver import solution_of
from lightpaint.progress import with_progress

#: Least share of the residual beside noise that the filter of a render explains.
MIN_EXPLAINED = 0.8

#: Least correlation of h with the residual, whose grain counts: a painting in 8 bits is rounded. A
#: brush may leave as much beside grain, in light that changes from pixel to pixel, but not this.
MIN_CORRELATION = 0.5

#: Standard errors beyond which noise does not make Σ D h r.
SURE = 8.0

#: Largest α of a filter. Flat paint over a texture lacks more of it than any filter takes: α is 1.6
#: and more.
MAX_SHARE = 1.3

#: Least part of ‖h‖² that no lights make.
MIN_OWN = 0.05

#: Answers in which the filter is taken out; α of the last two differ by a hundredth.
ROUNDS = 4


@dataclass(frozen=True)
class FilterEffect:
    """The change of a picture by a filter. image: (p, 3); half: (p, 3), its half differences."""

    image: Doubles
    half: Doubles

    def scaled(self, share: float) -> "FilterEffect":
        """Return a share of it."""
        return FilterEffect(share * self.image, share * self.half)


def answer_without_filter(
    solution: Solution, finish: Callable[[Solution], Solution] = lambda x: x
) -> Solution:
    """Return the answer to a painting as a box filter would show it, if it seems to be a render
    with a wider one; else the solution.

    finish: what is done to each answer once it is solved, as the correction of its noise.
    """
    painted, taken = solution.problem, None
    if not painted.basis.knows_noise or painted.block_side > 1:
        return solution
    for _ in range(ROUNDS):
        found = _filter_of(solution, taken)
        if found is None:
            break
        share, effect = found
        taken = effect.scaled(share)
        solution = finish(solution_of(_without(painted, taken.image, share)))
    return solution


def _without(problem: Problem, change: Doubles, share: float) -> Problem:
    """Return the problem of the paintings less a change, (p, 3), before it is solved.

    What they ask for is read anew, but no contrast counts by itself: nobody painted a render, and
    what is left of its filter would be taken for wishes.
    """
    views, joint = problem.views, change.reshape(*problem.loss.importance.shape, 3)
    images = [
        np.maximum(target.image - views.part(joint, k), 0).astype(np.float32)
        for k, target in enumerate(views.targets)
    ]
    other = problem.with_paintings(images)
    terms = ViewsReading(other.views, other.power, other.reference, other.fit).terms()
    return replace(
        other,
        reduction=problem.full,
        corrected=None,
        noise_removed=0.0,
        filter_share=share,
        is_render=True,
        **vars(replace(terms, contrast=None)),
    )


def _filter_of(solution: Solution, taken: FilterEffect | None) -> tuple[float, FilterEffect] | None:
    """Return α and h of an answer; None where the painting seems to have a box filter.

    taken: what the painting lacks already.
    """
    weight = solution.problem.squares.weight
    D = weight.reshape(-1, weight.shape[2]).astype(np.float64, copy=False)
    residuals, everything = Residuals.of(solution), slice(None)
    missed = FilterEffect(residuals.residual(everything), -residuals.noise(everything))
    D = np.broadcast_to(D, missed.image.shape)
    grain = painting_grain(solution, D, missed.image, missed.half)
    h = FilterEffect(*(added_by_filter(solution, x) for x in (residuals.predicted, residuals.half)))
    if taken is not None:
        missed = FilterEffect(missed.image + taken.image, missed.half + taken.half)
    product, power = _dot(D, h, missed), _dot(D, h, h)
    squares = _dot(D, missed, missed)
    lacking = squares - float(grain.sum())
    if product < MIN_CORRELATION * math.sqrt(max(power * squares, 0)):
        return None
    spread = float((D * np.square(h.image) * (grain + D * np.square(missed.half))).sum())
    # A share of at most 1 explains at most this much.
    if product <= max(MIN_EXPLAINED * lacking, SURE * math.sqrt(spread)):
        return None
    of_filter, of_missed = _light_sums(solution, D, (h, missed))
    error = _error_by(solution, of_filter)
    own = power - float((of_filter.T * error).sum())
    by_filter = product - float((of_missed.T * error).sum())
    if own <= MIN_OWN * power or by_filter > MAX_SHARE * own:
        return None
    share = min(by_filter / own, 1.0)
    return (share, h) if share * product > MIN_EXPLAINED * lacking else None


def _dot(D: Doubles, x: FilterEffect, y: FilterEffect) -> float:
    """Return Σ D (x y − x′ y′), an estimate of Σ D x y without the noise of both.

    x′, y′: their half differences. D: (p, 3), weights.
    """
    return float((D * (x.image * y.image - x.half * y.half)).sum())


def _light_sums(solution: Solution, D: Doubles, pictures: Sequence[FilterEffect]) -> list[Doubles]:
    """Return Σ D (Φ x − Φ′ x′) of pictures x, (3, n) each: `_dot` with each light's image Φ."""
    basis, counted = solution.basis, np.flatnonzero(solution.importance > 0)
    sums = [np.zeros((3, len(basis.lights))) for _ in pictures]
    step, _ = block_of(basis.planes)
    for start in with_progress(range(0, counted.size, step)):
        part = as_slice(counted[start : start + step])
        light, noise = basis.planes.pixels(part), basis.noise.pixels(part)
        for of_picture, x in zip(sums, pictures, strict=True):
            image, half = D[part] * x.image[part], D[part] * x.half[part]
            for c in range(3):
                of_picture[c] += light[..., c] @ image[:, c] - noise[..., c] @ half[:, c]
    return sums


def _error_by(solution: Solution, gradient: Doubles) -> Doubles:
    """Return by how much a gradient, (3, n), moves the weights, (n, 3)."""
    solved = solution.problem.solved
    moved = replace(solved, b=solved.b + gradient)
    return np.asarray(solve_for(solution, moved) - solve_for(solution, solved))
