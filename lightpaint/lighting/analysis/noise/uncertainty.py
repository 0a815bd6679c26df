"""Error bars: the effect on the answer of the basis's noise, from half differences, and of noise in
what its painting is read to ask for.

The two halves of the samples give two gradients of the objective at the solved weights. Half
their difference, pixel by pixel, gives the covariance of the gradient's noise, and the inverse
of M turns that into the covariance of the weights (docs/method.md, "How sure").

In a picture that is all fireflies, power cannot be separated from noise, and the light comes out
too dim. At most half of M is removed as noise, since the rest would be noise itself. So the least
power of a light in a render without noise is estimated; the answer with that power tells how far
the true one may be (docs/method.md, "How sure").

A sketch is read before it is fitted: the ratio of painting and current look shows its wishes, whose
contrasts count, and how clearly it asks each light for another colour. The look is noisy, so two
bases of one scene may find other wishes in one painting: where a place asks for about as much as it
takes to be a wish, two become one, or one more is found. The noise of M does not show that.

So the painting is read again and again with noise added, the half difference of each block of
pixels with either sign (a wild bootstrap, Wu 1986), and the last linear problem is solved with what
each reading asks for. Each reading has a twin with all signs reversed, so that both show what noise
does in the mean of all readings. That is no scatter; what is left of their changes is.

More noise also makes more and larger wishes: a place where the ratio is near the least that is one
becomes one. How much of that the noise of the basis itself did, readings with more noise do not
show, once all such places have become wishes. So the painting is also read with the wishes that it
has against a steadier look, and intervals reach farther on that side (docs/method.md, "How sure").
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from lightpaint.arrays import RGB, Bools, Doubles, as_rgb, release_freed_memory
from lightpaint.basis import FEW_LIGHTS
from lightpaint.colour import LUMINANCE
from lightpaint.display_text import short_repr
from lightpaint.keywords import keywords
from lightpaint.lighting.algebra.symmetric_matrices import QUICK_MATRIX, product_s
from lightpaint.lighting.analysis.noise.basis_noise import (
    Noise,
    denoised_matrix,
    gradient_bias,
    noise_sums,
    pseudo_inverse,
)
from lightpaint.lighting.analysis.noise.dominant_pixels import NORMAL_95, t_ratios
from lightpaint.lighting.analysis.noise.painting_noise import CORRELATION, PaintingNoise
from lightpaint.lighting.analysis.noise.residuals import steadier_light
from lightpaint.lighting.analysis.noise.weight_directions import (
    NORMAL,
    WeightResponse,
    WeightSpread,
    solve_for,
)
from lightpaint.lighting.answer.lighting import LightSetting
from lightpaint.lighting.loss.expected_lights import NoisyBlocks, Wash
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.problem import ViewsReading, are_sketches
from lightpaint.lighting.solution import Solution
from lightpaint.progress import announce, with_progress
from lightpaint.sentences import Hint, Sentence

#: Time of error bars of many lights, in products of two matrices of as many rows as lights, by
#: measurement: in a hall of 1000 lights 175.
MATRIX_PRODUCTS = 175

#: How to leave out error bars.
SKIPPING = Sentence(" (", Hint("error_bars", False), " skips them)")

#: Pairs of readings of a painting, and of one for many lights, whose solves take long.
PAIRS, FEW_PAIRS = 4, 2

#: Fewest lights that count as many.
MANY_LIGHTS = 64

#: Ratio of all scatter to a part of it beyond which that part's degrees of freedom do not matter.
MAX_RATIO = 100.0

#: Seed of the signs of the noise that is added.
SEED = 1

#: Shares of noise in the part of a light that no other can replace, between which doubt rises from
#: 0 to 1.
DOUBT_RANGE = 0.6, 0.8

#: Standard errors on the safe side of a sum, and the least share of M that remains of a light.
SAFE_ERRORS, MIN_LEFT = 1.0, 1e-3

#: Times its level, solved or current, that a light in doubt may have where others make up for it.
MAX_LEVEL = 10.0

#: Changes of an inverse that are collected: one by one each takes a walk over the matrix.
COLUMNS_AT_A_TIME = 32

#: Standard deviations to the end of one side of a 95 % interval, and of its other side.
FAR_SIDES = np.linspace(NORMAL_95, 6, 50)
NEAR_SIDES = [
    NORMAL.inv_cdf(NORMAL.cdf(NORMAL_95) - (NORMAL.cdf(-NORMAL_95) - NORMAL.cdf(-x)))
    for x in FAR_SIDES
]

#: Share of the noise from which an answer without it scatters as one without any.
NEARLY_ALL = 7 / 8

#: The least share of a light within what M determines, if no other lights replace it exactly.
OWN = 1 - 1e-6


@dataclass(frozen=True)
class ReadingNoise:
    """The noise in the reading of a painting.

    scatter: (n, 3), standard deviation of the weights by it. below, above: (n, 3), by how much they
    may be lower and higher beyond it, since a steadier look shows other wishes. pairs: the number
    of pairs of readings that determine the scatter.
    """

    scatter: Doubles
    below: Doubles
    above: Doubles
    pairs: int

    @classmethod
    def of(cls, solution: Solution) -> Self:
        """Read the painting of an answer several times; a literal one has no such noise, and a
        render no wishes.
        """
        problem, nothing = solution.problem, np.zeros_like(solution.weights)
        count = PAIRS if len(solution.weights) < MANY_LIGHTS else FEW_PAIRS
        reads_wishes = problem.fit.reads_wishes(is_sketch=are_sketches(problem.views))
        if not reads_wishes or problem.is_render:
            return cls(nothing, nothing, nothing, count)
        views = problem.views
        blocks = [NoisyBlocks.of(*view) for view in zip(views.bases, views.targets, strict=True)]
        as_read = solve_for(solution, problem.solved)
        pairs = np.array(
            [
                [_answer_to_reading(solution, wash) - as_read for wash in pair]
                for pair in _disturbed_washes(blocks, count)
            ]
        )
        # Of twins, one part has opposite signs, and the other part is the same.
        opposite, same = (pairs[:, 0] - pairs[:, 1]) / 2, (pairs[:, 0] + pairs[:, 1]) / 2
        squares = np.square(opposite).mean(axis=0) + same.var(axis=0, ddof=1)
        shift = _answer_to_reading(solution, _steady_wash(blocks)) - as_read
        # Half of the square is the steadier look's own.
        more = np.sqrt(np.maximum(np.square(shift) / 2 - squares, 0))
        below, above = np.where(shift < 0, more, 0), np.where(shift > 0, more, 0)
        return cls(np.sqrt(squares), below, above, count)

    def widened(self, known: Doubles) -> Doubles:
        """Return the root of the sum of squares of known standard deviations, (n, 3), and of the
        scatter, wider where that is most of it: a few pairs determine it (Welch 1947).
        """
        total = _root(known, self.scatter)
        ratio = np.divide(
            total, self.scatter, out=np.full_like(total, np.nan), where=self.scatter > 0
        )
        return np.asarray(total * t_ratios(self.pairs * np.minimum(ratio, MAX_RATIO) ** 4))


def _disturbed_washes(blocks: Sequence[NoisyBlocks], count: int) -> Iterator[list[Wash]]:
    """Yield pairs of washes of views: with more noise, and with its opposite."""
    rng = np.random.default_rng(SEED)
    for _ in with_progress(range(count), "readings"):
        disturbed = [view.disturbed(rng) for view in blocks]
        yield [Wash.joined(washes) for washes in zip(*disturbed, strict=True)]


def _steady_wash(blocks: Sequence[NoisyBlocks]) -> Wash:
    """Return the wash of views with the wishes that they show against a steadier look."""
    washes = []
    for view in blocks:
        look, noise = (x.astype(np.float64) for x in (view.blocks.read_look, view.read_noise))
        steady, _ = steadier_light(look, noise, (view.blocks.counts > 0)[..., None].astype(float))
        washes.append(view.blocks.wash_in(steady.astype(np.float32)))
    return Wash.joined(washes)


def _answer_to_reading(solution: Solution, wash: Wash) -> Doubles:
    """Return the weights, (n, 3), of the last linear problem with what a wash asks for."""
    problem = solution.problem
    own, fit = problem.reference, problem.fit
    constraints = problem.constraints
    reading = ViewsReading(problem.views, problem.power, own, fit, constraints, lambda: wash)
    terms = reading.terms()
    return solve_for(replace(solution, problem=replace(problem, **vars(terms))), problem.solved)


def noise_doubts(solution: Solution, power: Doubles, own_inverse: Doubles) -> Doubles:
    """Return the doubt in each light, (n, 3), 0 to 1: whether it may be noise alone.

    It follows from the share of noise in the part of a light that no other can replace. power:
    (3, n, n), the noise in M. own_inverse: (3, n), the diagonals of the inverse of M.
    """
    shares = np.zeros(solution.weights.shape)
    for c, of_channel in enumerate(own_inverse):
        shares[:, c] = np.diag(power[c]) * of_channel
    low, high = DOUBT_RANGE
    is_determined = solution.reached & ~solution.basis.is_fixed[:, None]
    return np.where(is_determined, np.clip((shares - low) / (high - low), 0, 1), 0)


def weakest_matrix(
    M: Doubles,
    own_inverse: Doubles,
    noise: Noise,
    doubts: Doubles,
    corrected: Doubles,
) -> Doubles:
    """Return M, (3, n, n), without noise, as weak as it may be for lights in doubt, (n, 3).

    own_inverse: as of `noise_doubts`. corrected: (3, n, n), M without as much of it as is safe to
    remove. Returns (3, n, n), positive semidefinite.
    """
    weakest = corrected.copy()
    in_doubt = np.flatnonzero((doubts > 0).any(axis=1)).tolist()
    if not in_doubt:
        return weakest
    # The power that no other light can replace is 1 over the diagonal of the inverse.
    inverse = [_GrowingInverse(pseudo_inverse(x)) for x in weakest]
    # A light that others replace exactly has no part of its own which could be weaker.
    is_own = [
        np.einsum("ij,ji->i", x.matrix, y) > OWN for x, y in zip(inverse, weakest, strict=True)
    ]
    for k in with_progress(in_doubt, "lights"):
        for c in (c for c in np.flatnonzero(doubts[k] > 0) if is_own[c][k]):
            # Only the part that no other light can replace may shrink.
            column = inverse[c].column(k)
            noisy, alone = 1 / float(own_inverse[c][k]), 1 / float(column[k])
            least = max(
                noisy - float(noise.power[c, k, k]) - SAFE_ERRORS * float(noise.power_error[c, k]),
                alone - float(weakest[c, k, k]) + float(noise.least_power[c, k]),
                MIN_LEFT * float(M[c, k, k]),
            )
            less = doubts[k, c] * max(alone - least, 0)
            if not less:
                continue
            weakest[c, k, k] -= less
            # Sherman and Morrison: the part alone is less by as much.
            inverse[c].add(column, less / (1 - less / alone))
    return weakest


class _GrowingInverse:
    """A matrix, (n, n), to which products x xᵀ are added, several at a time."""

    def __init__(self, matrix: Doubles) -> None:
        self.matrix = matrix
        self._columns = np.empty((len(matrix), COLUMNS_AT_A_TIME))
        self._factors = np.empty(COLUMNS_AT_A_TIME)
        self._count = 0

    def column(self, k: int) -> Doubles:
        """Return a column, (n,)."""
        added = self._columns[:, : self._count]
        return np.asarray(self.matrix[:, k] + added @ (self._factors[: self._count] * added[k]))

    def add(self, column: Doubles, factor: float) -> None:
        """Add factor · x xᵀ of a column x, (n,)."""
        self._columns[:, self._count], self._factors[self._count] = column, factor
        self._count += 1
        if self._count == COLUMNS_AT_A_TIME:
            self.matrix += (self._columns * self._factors) @ self._columns.T
            self._count = 0


@keywords()
@dataclass(frozen=True)
class Uncertainty:
    """The effect of noise on a solve. All values are estimates, good to a third or so.

    A channel in which a light reaches nothing that counts is undetermined: NaN.

    Attributes:
        weights: (n, 3), as solved.
        scatter: (n, 3), standard deviation of the weights between seeds, that by errors of poses
            and by noise in the reading of a painting's wishes included. For a light that is off or
            at a limit, the part on the side where it may go.
        bias: (n, 3), the rise of the weights without the noise power in M.
        painting_scatter: (n, 3), standard deviation by noise of the painting, where that is a
            render or a photograph; more samples of the basis do not lower it.
        interval: The 95 % interval of each weight, lower and upper ends, (n, 3) each. At 0 or at a
            limit it has one side, which is never empty.
        objective_error: (3,), standard deviation of the objective.
        objective_noise: (3,), the part of the prediction's own noise in it.
        excess: (3,), the expected excess of the objective over the least possible, for these
            weights rendered without noise.
        target_norm2: (3,), ‖Ψ‖², as a scale.
        untold: (n,), the lights that these samples do not determine: little of their light stands
            out from noise in what is painted, and their interval is wider than they are bright.
        is_filtered: Whether the painting seems to be rendered with a wider reconstruction filter
            than the box of a basis, whose effect was taken out of it.

    Examples:
        >>> bars = lp.error_bars(lp.solve(basis, target))
        >>> low, high = bars.interval
        >>> bool((low <= bars.weights).all() and (bars.weights <= high).all())
        True
    """

    weights: Doubles
    scatter: Doubles
    bias: Doubles
    painting_scatter: Doubles
    interval: tuple[Doubles, Doubles]
    objective_error: Doubles
    objective_noise: Doubles
    excess: Doubles
    target_norm2: Doubles
    untold: Bools
    is_filtered: bool = False

    __repr__ = short_repr

    @property
    def relative_excess(self) -> float:
        """The error that these errors make in the picture, relative to the painting, root mean
        square.
        """
        norm2 = float(self.target_norm2.sum())
        # An estimate, which may be below zero where hardly any gain remains.
        return float(np.sqrt(max(self.excess.sum(), 0) / norm2)) if norm2 > 0 else 0.0

    @property
    def standard_error(self) -> Doubles:
        """Root of the sum of squares of scatter, bias and painting_scatter, (n, 3): the error of
        the answer.
        """
        return _root(self.scatter, self.bias, self.painting_scatter)


@keywords()
def error_bars(
    solution: Solution,
    *,
    with_painting: bool = True,
    level_errors: Sequence[tuple[str, RGB]] = (),
) -> Uncertainty | None:
    """Estimate standard error and bias of every weight of a solve or `refine`.

    None if the noise of the basis is unknown, which is not the same as none. After reweighting they
    are of the last linear problem.

    Fixed or locked lights have an error of 0; the error of lights which reach nothing is unknown.
    Noise may have pushed a weight to 0 or to a limit: it has an interval on one side.

    Args:
        solution: From `solve`, `refine` or `correct_noise`.
        with_painting: Whether noise of the painting counts, which no samples of the basis lower.
        level_errors: Names of lights and relative standard deviations of their weights by errors of
            poses, as in `Placement`. Without them error bars hold for the poses as they are.

    Examples:
        >>> bars = lp.error_bars(lp.solve(basis, target))
        >>> bars.standard_error.shape
        (2, 3)
    """
    problem, weights = solution.problem, solution.weights
    if not problem.basis.knows_noise:
        return None
    if len(weights) > QUICK_MATRIX:
        announce(MATRIX_PRODUCTS * product_s(problem.equations.M[0]), SKIPPING)
    noise = noise_sums(solution, removed=1.0)
    if len(weights) > FEW_LIGHTS:
        release_freed_memory()
    step = _GradientStep.of(solution, noise)
    unbiased = step.equations(denoised_matrix(problem.equations, noise.power))
    bias = np.asarray(solve_for(solution, unbiased) - weights)
    center = weights + bias
    painted = _painting_covariance(solution) if with_painting else None
    (spread, by_painting), (of_interval, wide_by_painting) = _spreads(
        solution, noise, step, unbiased, center, painted
    )
    unsteady = np.zeros_like(weights)
    if noise.doubt.any():
        bent = replace(unbiased, b=unbiased.b - noise.doubt)
        unsteady = solve_for(solution, bent) - weights - bias
    doubts, weak = _where_lights_are_noise(solution, noise, step, unbiased)
    moved = np.zeros_like(weights)
    if weak is not None:
        spread, of_interval = (x.mixed_with(weak[0], doubts) for x in (spread, of_interval))
        moved = _moved_by_doubt(solution, doubts, weak[1] - center)
    by_poses, reading = _scatter_by_poses(solution, level_errors), ReadingNoise.of(solution)
    sides, wide = [], []
    beyond = reading.below, reading.above
    for exit_, far_exit, more in zip(spread.exits, of_interval.exits, beyond, strict=True):
        common = more, unsteady, moved, by_poses
        sides.append(_root(spread.inside, reading.scatter, exit_, *common))
        known = _root(of_interval.inside * noise.widening, wide_by_painting, far_exit, *common)
        wide.append(reading.widened(known))
    is_determined = np.where(solution.reached, 1, np.nan)
    interval = _interval(solution, bias * is_determined, wide)
    return Uncertainty(
        weights,
        np.maximum(*sides) * is_determined,
        bias * is_determined,
        by_painting * is_determined,
        interval,
        noise.objective_error,
        noise.objective_noise,
        _excess_by_channel(spread.excess, bias, problem.equations.M),
        solution.norm2,
        (((doubts >= 0.5) | noise.is_hidden).any(axis=1) | of_interval.is_far)
        & _is_wide(weights, interval),
        problem.filter_share > 0,
    )


#: A spread by noise of the basis, and deviations by noise of the painting, (n, 3).
_Spreads = tuple[WeightSpread, Doubles]


def _spreads(
    solution: Solution,
    noise: Noise,
    step: "_GradientStep",
    unbiased: NormalEquations,
    center: Doubles,
    painted: tuple[Doubles, Doubles] | None,
) -> tuple[_Spreads, _Spreads]:
    """Return the spread of the answer, and of the interval: around the answer without bias, which
    scatters by its own M.

    unbiased: the equations without noise. center: (n, 3), their answer. painted: see
    `_painting_covariance`.
    """
    problem, covariance, steady = solution.problem, noise.full_covariance, unbiased
    # A step from a render of the mix has the unbiased M.
    is_unbiased = problem.refinement is not None or problem.noise_removed >= NEARLY_ALL
    if noise.hidden.any():
        steady = step.equations(denoised_matrix(problem.equations, noise.steady_power))
    spreads = []
    for scatters in [steady] if is_unbiased else [problem.solved, steady]:
        response = WeightResponse(solution, scatters, unbiased, center)
        painting = np.zeros_like(center) if painted is None else response.spread(painted[0]).inside
        spreads.append((response.spread(covariance), painting))
        del response  # of many lights it is large
    of_interval, by_painting = spreads[-1]
    if painted is not None:
        by_painting = by_painting * t_ratios(painted[1])
    return spreads[0], (of_interval, by_painting)


def _where_lights_are_noise(
    solution: Solution, noise: Noise, step: "_GradientStep", unbiased: NormalEquations
) -> tuple[Doubles, tuple[WeightSpread, Doubles] | None]:
    """Return how likely the power of each light is noise, (n, 3), from 0 to 1; and the spread of
    the weights, and these, (n, 3), where such lights have as little power as they may; None if no
    light's is. unbiased: the equations without noise.
    """
    matrices = solution.equations.M
    channels = with_progress(list(matrices), "channels")
    own_inverse = np.array([np.diag(pseudo_inverse(x)) for x in channels])
    doubts = noise_doubts(solution, noise.power, own_inverse)
    if not doubts.any():
        return doubts, None
    weak = weakest_matrix(matrices, own_inverse, noise, doubts, unbiased.M)
    # A step from a render of the mix depends on M alone.
    is_refined = solution.problem.refinement is not None
    equations = step.equations(weak) if is_refined else replace(unbiased, M=weak)
    far = solve_for(solution, equations)
    response = WeightResponse(solution, equations, equations, far)
    return doubts, (response.spread(noise.full_covariance), far)


def _moved_by_doubt(solution: Solution, doubts: Doubles, moved: Doubles) -> Doubles:
    """Return how far weights move, (n, 3), if the lights in doubt have as little power as they may.

    A light that hardly reaches the paint could be thousands of times as bright then, and others
    would make up for it. They move as far as it takes to bring every light in doubt to MAX_LEVEL
    times its solved or current level, at most. moved: (n, 3), of the answer with so little power.
    """
    levels = np.maximum(solution.weights, solution.basis.current_weights).max(axis=1, keepdims=True)
    is_moved = (doubts > 0) & (moved != 0)
    room = np.divide(MAX_LEVEL * levels, np.abs(moved), out=np.ones_like(moved), where=is_moved)
    share = np.minimum(room, 1).min(axis=0)
    return np.asarray(moved * (doubts + (1 - doubts) * share))


def _painting_covariance(solution: Solution) -> tuple[Doubles, Doubles] | None:
    """Return the covariance of the gradient by noise of the painting, (3, n, 3, n), and its degrees
    of freedom, (n, 3); None where there is next to none.
    """
    found = PaintingNoise.of(solution).covariance()
    if found is not None:
        found[0][...] *= 1 + solution.problem.filter_share * (CORRELATION - 1)
    return found


def _scatter_by_poses(solution: Solution, level_errors: Sequence[tuple[str, RGB]]) -> Doubles:
    """Return the standard deviations of the weights by errors of poses, (n, 3)."""
    relative = dict(level_errors)
    none = (0.0, 0.0, 0.0)
    return solution.weights * [relative.get(x.name, none) for x in solution.basis.lights]


@dataclass(frozen=True)
class _GradientStep:
    """The gradient at some weights without its error by noise, and the equations that have it.

    before: those weights, (n, 3). step: (3, n), b − M w there. target_norm2: (3,).
    """

    before: Doubles
    step: Doubles
    target_norm2: Doubles

    @classmethod
    def of(cls, solution: Solution, noise: Noise) -> "_GradientStep":
        """Return the step that the solve of `solution` takes without noise."""
        problem = solution.problem
        weights, lacking = gradient_bias(solution, noise)
        step = problem.solved.b - np.einsum("cij,jc->ci", problem.solved.M, weights) + lacking
        return cls(weights, step, problem.equations.target_norm2)

    def equations(self, M: Doubles) -> NormalEquations:
        """Return the equations that take this step with another M, (3, n, n)."""
        b = np.einsum("cij,jc->ci", M, self.before) + self.step
        return NormalEquations(M, b, self.target_norm2)


def _excess_by_channel(excess: Doubles, bias: Doubles, M: Doubles) -> Doubles:
    """Return the expected excess of the objective by scatter and bias, (3,)."""
    return np.asarray(excess + np.einsum("ic,cij,jc->c", bias, M, bias))


def _root(*parts: Doubles) -> Doubles:
    """Return the root of the sum of squares of independent parts."""
    return np.asarray(np.sqrt(sum(np.square(part) for part in parts)))


def _interval(solution: Solution, bias: Doubles, sides: list[Doubles]) -> tuple[Doubles, Doubles]:
    """Return lower and upper ends, (n, 3) each, within the constraints.

    They lie around the weights without bias, and include the weights as solved. sides: standard
    deviations below and above, wider where few pixels tell them.
    """
    weights, center = solution.weights, solution.weights + bias
    low, high = solution.problem.local_reduction.weight_ranges
    below, above = sides
    lower = center - _reach(-bias, above) * below
    upper = center + _reach(bias, below) * above
    return (
        np.minimum(np.maximum(lower, low), weights),
        np.maximum(np.minimum(upper, high), weights),
    )


def _reach(beyond: Doubles, deviation: Doubles) -> Doubles:
    """Return the standard deviations that an interval of 95 % reaches on one side.

    beyond: distance to the value that it has to include on its other side; deviation: the standard
    deviation there. Where that is t of these away, and t is more than 1.96, this side ends where Φ
    is .95 + Φ(−t).
    """
    far = np.divide(beyond, deviation, out=np.zeros_like(deviation), where=deviation > 0)
    return np.interp(far, FAR_SIDES, NEAR_SIDES)


def _is_wide(weights: Doubles, interval: tuple[Doubles, Doubles]) -> Bools:
    """Return, (n,), whether the interval of a light's luminance reaches farther than the luminance
    itself.
    """
    is_known = np.isfinite(interval[0])
    solved, low, high = (np.where(is_known, x, 0) @ LUMINANCE for x in (weights, *interval))
    return np.asarray(np.maximum(solved - low, high - solved) > solved)


@keywords()
def with_error_bars(solution: Solution, uncertainty: Uncertainty | None) -> Solution:
    """Return `solution` with the standard errors of lights and objective, if known.

    Args:
        solution: The answer.
        uncertainty: Its `error_bars`; None if the noise of the basis is unknown.

    Examples:
        >>> solution = lp.solve(basis, target)
        >>> table = lp.with_error_bars(solution, lp.error_bars(solution)).to_dataframe()
        >>> bool(table.error_red.notna().all())
        True
    """
    if uncertainty is None:
        return solution
    ends = np.stack(uncertainty.interval, axis=-1)
    lights = tuple(
        light
        if light.is_fixed or not any(light.reached)
        else replace(_with_errors(light, error, interval), untold=bool(untold))
        for light, error, interval, untold in zip(
            solution.lighting.lights,
            uncertainty.standard_error,
            ends,
            uncertainty.untold,
            strict=True,
        )
    )
    lighting = replace(solution.lighting, lights=lights)
    error = as_rgb(uncertainty.objective_error)
    return replace(solution, lighting=lighting).with_certificate_fields(objective_error=error)


def _with_errors(light: LightSetting, error: Doubles, interval: Doubles) -> LightSetting:
    """Return a light with its standard error, (3,), and its interval, (3, 2); NaN if
    undetermined."""
    r, g, b = (None if np.isnan(e) else float(e) for e in error)
    ends = ((float(low), float(high)) for low, high in interval)
    red, green, blue = (None if np.isnan(low) else (low, high) for low, high in ends)
    return replace(light, standard_error=(r, g, b), interval=(red, green, blue))
