"""A painting that is a render: its noise, and the filter that it was reconstructed with.

A sketch is read for wishes: how bright and warm a place is against the rest counts by itself, since
lights bring but a part of most paint. In a render nothing is meant so. Its noise makes wishes that
nobody painted, and lights that follow these are wrong.

A render of the scene is what its lights make, but for noise that is independent from pixel to
pixel. So without any contrast between wishes, what is missed has no shape: with q = √D r of a pixel
and sums over squares of s x s pixels,

    T_s = Σ_squares (Σ q)² / Σ q²

is about 1 for every s. Paint that lights do not make fills squares with residuals of one sign: T_s
is then up to s². JPEG leaves differences two pixels wide and more, and so does a filter of the
film. Noise of few samples makes weights wrong, too, which all pixels show alike. So r is what is
missed at the weights near the answer that leave least in squares. What the lights make exactly has
its contrasts, too, so nothing is lost where it was a painting after all.

The filter of a basis is a box; Mitsuba's default is a Gaussian. It makes halos around lamps in view
and softens all edges of light: it adds h = (F − 1) p to the prediction p = Σ w Φ. No lights make
that, but each takes a part of it for its own light. So with

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
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from lightpaint.arrays import Doubles, Floats
from lightpaint.basis import as_slice, block_of
from lightpaint.images import block_sums
from lightpaint.lighting.analysis.noise.painting_noise import painting_grain
from lightpaint.lighting.analysis.noise.residuals import Residuals, added_by_filter
from lightpaint.lighting.analysis.noise.weight_directions import solve_for
from lightpaint.lighting.problem import Problem, ViewsReading, are_sketches
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.solver import solution_of
from lightpaint.progress import with_progress

#: Sides of squares over which residuals are summed, in pixels.
SIDES = 2, 4, 8

#: Largest T of a render in many squares, and what few add to it: T of n squares scatters by
#: √(2 / n), and by more where single pixels decide.
WHITE, OF_FEW = 1.2, 2.5

#: Factor of that beyond which no weights nearby change it.
FAR = 4.0

#: Factor within which it cannot be told.
UNSURE = 1.25

#: Standard deviation of weights around the answer, relative to a light's level, for all channels
#: alike, as paths carry all, and of each.
LEVEL_ERROR, COLOR_ERROR = 0.25, 0.05

#: Side of squares to which weights are fitted, in pixels, and their largest number; then twice.
FIT_SIDE, MAX_SQUARES = 4, 2**14

#: Least share of the mean variance of squares in the variance of each that counts.
MIN_VARIANCE = 0.3

#: Fewest squares of the largest side for each light with which T says anything.
SQUARES_PER_LIGHT = 2

#: Change of light of a square which is none, relative to its light, and standard errors of it.
SMALL_CHANGE, SURE = 0.07, 3.0

#: Largest share of squares that change.
MAX_CHANGED = 0.01

#: Light of a square to which changes are relative at least, as a share of the mean.
DARK = 0.05

#: What is added to variances of squares, which may be black.
TINY = 1e-30

#: Least share of grain in what is missed beside the noise of the prediction. Paint has less in most
#: cases, and a render with far more samples than the basis may.
MIN_GRAIN = 0.25

#: Least share of the residual beside noise that the filter of a render explains.
MIN_EXPLAINED = 0.8

#: Least correlation of h with the residual, whose grain counts: a painting in 8 bits is rounded. A
#: brush may leave as much beside grain, in light that changes from pixel to pixel, but not this.
MIN_CORRELATION = 0.5

#: Standard errors beyond which noise does not make Σ D h r.
SURE_OF_FILTER = 8.0

#: Largest α of a filter. Flat paint over a texture lacks more of it than any filter takes: α is 1.6
#: and more.
MAX_SHARE = 1.3

#: Least part of ‖h‖² that no lights make.
MIN_OWN = 0.05

#: Answers in which the filter is taken out; α of the last two differ by a hundredth.
ROUNDS = 4


def answer_to_render(
    solution: Solution, finish: Callable[[Solution], Solution] = lambda x: x
) -> Solution:
    """Return the answer to a painting as a render, if it seems to be one: without the filter of its
    film, and without contrasts between wishes; else the solution.

    finish: what is done to each answer once it is solved, as the correction of its noise.
    """
    problem = solution.problem
    if not may_be_render(problem):
        return answer_without_filter(solution, finish)
    plain = solution
    if problem.contrast is not None:
        plain = finish(solution_of(problem.unsolved(contrast=None)))
    found = answer_without_filter(plain, finish)
    if found is not plain:
        return found
    verdict = is_made_by_lights(plain)
    answer = plain if verdict else solution
    return replace(answer, problem=replace(answer.problem, is_render=verdict))


def may_be_render(problem: Problem) -> bool:
    """Return whether a problem reads wishes in paintings that may be renders: with known noise, and
    not painted over a part of the look.
    """
    return (
        problem.basis.knows_noise
        and problem.block_side == 1
        and problem.fit.reads_wishes(is_sketch=are_sketches(problem.views))
        and all(target.is_whole or not target.over_look for target in problem.views.targets)
    )


def is_made_by_lights(solution: Solution) -> bool | None:
    """Return whether an answer misses nothing of its paintings but noise; None if that cannot be
    told.
    """
    missed = _MissedLight.of(solution)
    if not missed.squares:  # no residual counts in a picture that is white, as it was painted
        return False
    if not (missed.has_grain() and missed.is_white(FAR)):
        return False
    if missed.squares < SQUARES_PER_LIGHT * (~solution.basis.is_fixed).sum():
        return None if missed.is_white() else False
    nearest = missed.at_nearest_weights()
    if nearest.changed_share() > MAX_CHANGED:
        return False
    if nearest.is_white():
        return True
    return None if nearest.is_white(UNSURE) else False


@dataclass(frozen=True)
class _MissedLight:
    """The light that an answer misses of its paintings.

    D: (p, 3), weights of pixels. residual, noise, light: (p, 3), r, half differences of the
    prediction, and the prediction.
    """

    solution: Solution
    D: Doubles
    residual: Doubles
    noise: Doubles
    light: Floats

    @classmethod
    def of(cls, solution: Solution) -> Self:
        """Return what an answer misses."""
        weight, residuals, everything = (
            solution.problem.squares.weight,
            Residuals.of(solution),
            slice(None),
        )
        r, r_half = residuals.residual(everything), residuals.noise(everything)
        D = np.broadcast_to(weight.reshape(len(r), -1).astype(np.float64), r.shape)
        return cls(solution, D, r, r_half, residuals.predicted)

    @property
    def squares(self) -> float:
        """Number of squares of the largest side that count."""
        return float((self.D > 0).any(axis=1).sum()) / SIDES[-1] ** 2

    def has_grain(self) -> bool:
        """Return whether enough of what is missed beside noise of the prediction is grain."""
        left = (self.D * (np.square(self.residual) - np.square(self.noise))).sum()
        grain = painting_grain(self.solution, self.D, self.residual, self.noise)
        return float(grain.sum()) >= MIN_GRAIN * float(left)

    def is_white(self, factor: float = 1.0) -> bool:
        """Return whether T of each side is at most `factor` times as large as noise makes it."""
        shown = np.sqrt(self.D) * self.residual
        power = max(float(np.square(shown).sum()), np.finfo(float).tiny)
        for side in SIDES:
            ratio = sum(float(np.square(x).sum()) for x in self._sums(shown, side)) / power
            few = OF_FEW / math.sqrt(self.squares * (SIDES[-1] / side) ** 2)
            if ratio > factor * (WHITE + few):
                return False
        return True

    def at_nearest_weights(self) -> Self:
        """Return what is missed at the weights near the answer that leave least in squares.

        They minimise Σ_squares (Σ √D r)² / Σ D r², with a normal prior around the answer.
        """
        solution, (rows, goal) = self.solution, self._squares_of_lights()
        levels = np.maximum(solution.weights, solution.basis.current_weights)
        levels[solution.basis.is_fixed] = 0
        n = len(levels)
        matrix, wanted = _prior(n), np.zeros((3, n))
        for c in range(3):
            scaled = rows[:, c] * levels[:, c]
            matrix[c, :, c] += scaled.T @ scaled
            wanted[c] = scaled.T @ goal[:, c]
        moved = np.linalg.solve(matrix.reshape(3 * n, 3 * n), wanted.ravel()).reshape(3, n).T
        change = solution.basis.planes.mix(np.asarray(moved * levels)).reshape(-1, 3)
        return replace(self, residual=self.residual - change, light=self.light + change)

    def _squares_of_lights(self) -> tuple[Doubles, Doubles]:
        """Return sums over squares of the light of each light, (k, 3, n), and of the residual, (k,
        3), in units of the standard deviation of each.
        """
        planes, root, side = self.solution.basis.planes, np.sqrt(self.D), FIT_SIDE
        while self.squares * (SIDES[-1] / side) ** 2 > MAX_SQUARES:
            side *= 2
        shown = root * self.residual
        goal, variance = (self._square_sums(x, side) for x in (shown, np.square(shown)))
        unit = 1 / np.sqrt(np.maximum(variance, MIN_VARIANCE * variance.mean(axis=0)) + TINY)
        rows = [
            self._square_sums(root * planes.plane(i).reshape(-1, 3), side) * unit
            for i in range(planes.count)
        ]
        return np.stack(rows, axis=-1), goal * unit

    def changed_share(self) -> float:
        """Return the share of squares and channels whose light surely changes."""
        side, counts = SIDES[-1], self.D > 0
        sums, squares, lit = (
            self._square_sums(np.where(counts, x, 0), side)
            for x in (self.residual, np.square(self.residual), np.abs(self.light))
        )
        dark = DARK * float(np.abs(self.light).mean(dtype=np.float64)) * side**2
        is_sure = np.square(sums) > SURE**2 * squares
        return float((is_sure & (np.abs(sums) > SMALL_CHANGE * (lit + dark))).mean())

    def _sums(self, picture: Doubles, side: int) -> Iterator[Doubles]:
        """Yield sums over squares of each view, (h', w', 3). picture: (p, 3)."""
        views, joint = self.solution.problem.views, (*self.solution.importance.shape, 3)
        for k in range(len(views)):
            yield block_sums(views.part(picture.reshape(joint), k), side)

    def _square_sums(self, picture: Doubles, side: int) -> Doubles:
        """Return sums over the squares of all views, (k, 3). picture: (p, 3)."""
        return np.concatenate([x.reshape(-1, 3) for x in self._sums(picture, side)])


def _prior(n: int) -> Doubles:
    """Return the inverse of the covariance of relative weights, (3, n, 3, n): of three channels of
    a light LEVEL_ERROR² 1 1ᵀ + COLOR_ERROR² I.
    """
    common = LEVEL_ERROR**2 / (COLOR_ERROR**2 + 3 * LEVEL_ERROR**2)
    of_channels = (np.eye(3) - common) / COLOR_ERROR**2
    return np.asarray(np.einsum("cd,ij->cidj", of_channels, np.eye(n)))


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
    reading = ViewsReading(other.views, other.power, other.reference, other.fit, other.constraints)
    own_terms = vars(replace(reading.terms(), contrast=None))
    return other.unsolved(filter_share=share, is_render=True, **own_terms)


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
    if product <= max(MIN_EXPLAINED * lacking, SURE_OF_FILTER * math.sqrt(spread)):
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
