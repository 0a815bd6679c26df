"""Iteratively reweighted least squares; and solves with few pixels that lead near the optimum,
after which one or two exact rounds suffice.

Each linear solve minimises squares that approximate the loss at the last answer.

The squares have the loss's own gradient, so the way to their optimum is downhill; the loss itself
decides the length of each step, and therefore never rises. Once it stops falling, the answer is
stationary under the constraints, and for a convex loss it is the optimum.

A sample of the pixels stands for all, preferring those that determine a light. Its optimum is near
the optimum of all pixels. A tilt then corrects its gradient: the tilted sample has the true
gradient where this was measured, and its optimum is closer the more its curvature resembles the
true one.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from lightpaint.arrays import Doubles, release_freed_memory
from lightpaint.basis import Basis, MemoryPlanes, walked_blocks
from lightpaint.images import is_large
from lightpaint.lighting.loss.lit_pixels import DeferredSquares, LitPixels, SummedSquares
from lightpaint.lighting.loss.pixel_loss import Loss, PixelLoss, Squares, image_in_place
from lightpaint.lighting.normal_equations import NormalEquations

#: Maximum number of rounds.
MAX_ROUNDS = 100

#: Rounds end at this change of a light's picture, relative to the brightest light's, or when the
#: predicted decrease of a whole step is one of these shares of the loss, and of the loss in the
#: dark: where all paint is white, more light is always a little better. Problems that become exact
#: continue until they are.
MIN_STEP, MIN_FALL, MIN_FALL_OF_DARK = 1e-6, 1e-11, 1e-13

#: Number of lights from which the sums of a round take so long that rounds keep the matrix of the
#: last one where its step, as above, was at most this; and the step at which rounds that draw
#: clipped values back end then, since others follow.
MANY_LIGHTS, KEPT_STEP, CLIPPED_STEP = 200, 0.1, 1e-3

#: Least decrease of a step, relative to that predicted by the gradient, and the shortest step.
KEPT_PROMISE, SHORTEST_STEP = 1e-4, 2.0**-20

#: Share of the loss that is round-off of its sums.
ROUND_OFF = 1e-12

#: Largest predicted decrease, as a share of the loss and of the loss in the dark, at which a step
#: that fails to lower the loss counts as converged: views of OpenColorIO are float32, and their
#: slopes are finite differences; and a last pixel may be a trace below white, where others turn
#: less than white at once.
FLAT_FALL, FLAT_FALL_OF_DARK = 1e-5, 1e-11

#: The least number of pixels in a sample, and the pixels for each light.
MIN_SAMPLE, PIXELS_PER_LIGHT = 2**13, 2**6

#: Largest sample as a share of the pixels: with more, all pixels are as quick.
MAX_SAMPLE_SHARE = 0.5

#: Share of a sample that is drawn evenly, whatever lights a pixel shows.
EVEN_SHARE = 0.5

#: Change of a light's picture that ends the rounds over a sample: at first the error of a sample,
#: later a share of the change that the last correction made.
FIRST_STEP, STEP_RATIO = 1e-4, 1e-3

#: Relative fall of the loss in the last correction below which exact rounds are as good.
MIN_GAIN = 1e-9

#: Maximum number of corrections, and the largest ratio of one to the last at which another is worth
#: its time.
MAX_CORRECTIONS, MAX_STEP_RATIO = 8, 0.7

#: Shares of a step to try under the brush, where an answer is one step from the last one.
STEP_SHARES = (1.0, 0.5, 0.25)

#: Share of the fall that squares predict from which no shorter step is tried: half a step would
#: bring that much of it.
GOOD_FALL = 0.75


@dataclass(frozen=True)
class Reweighting:
    """The history of a solution's last linear problem.

    at: (n, 3), the weights at which its squares were made. rounds: linear problems solved before.
    step: the change of a light's picture in the last one, relative to the brightest light's.
    converged: whether this change was small.
    """

    at: Doubles
    rounds: int
    step: float
    converged: bool


#: A function from equations and weights to begin with to the best weights (n, 3) under constraints;
#: the set of weights that it may return is convex.
Solver = Callable[[NormalEquations, Doubles], Doubles]


@dataclass(frozen=True)
class Descent:
    """The end of the rounds: weights, and the last linear problem.

    The weights solve it, unless its solution is worse than its start; then they lie between.
    """

    weights: Doubles
    squares: Squares
    equations: NormalEquations
    reweighting: Reweighting


@dataclass(frozen=True)
class WeightTerms:
    """Terms in the weights that are added to the loss of pixels: pull(w) − 2 tilt · (w − origin).

    pull: of the weights; None for none. tilt, origin: (n, 3).
    """

    pull: NormalEquations | None = None
    tilt: Doubles | None = None
    origin: Doubles | None = None

    def value(self, w: Doubles) -> float:
        """Return the terms at weights w, (n, 3)."""
        value = 0.0 if self.pull is None else float(self.pull.objective(w).sum())
        if self.tilt is not None and self.origin is not None:
            value -= 2 * float((self.tilt * (w - self.origin)).sum())
        return value

    def fall(self, w: Doubles, best: Doubles) -> float:
        """Return the initial slope at which the terms fall on the way from w to `best`."""
        step, fall = best - w, 0.0
        if self.pull is not None:
            fall -= 2 * float((self.pull.gradient(w) * step).sum())
        return fall if self.tilt is None else fall + 2 * float((self.tilt * step).sum())

    def tilted(self, equations: NormalEquations) -> NormalEquations:
        """Return `equations` with the tilt; the solve adds the pull itself."""
        return equations if self.tilt is None else replace(equations, b=equations.b + self.tilt.T)


@dataclass(frozen=True)
class RoundsResult:
    """The end of rounds over some pixels.

    weights: (n, 3). at: (n, 3), the weights at which the last squares were made; x: (3, p), their
    picture. from_clipping, image, weight: the option and the arrays (3, p) of these squares.
    count, step, converged: see `Reweighting`.
    """

    weights: Doubles
    at: Doubles
    x: Doubles
    from_clipping: bool
    image: Doubles
    weight: Doubles
    equations: NormalEquations
    count: int
    step: float
    converged: bool


def descend(
    basis: Basis,
    loss: Loss,
    start: Doubles,
    solve: Solver,
    *,
    pull: NormalEquations | None = None,
    from_clipping: bool = True,
    until: float = MIN_STEP,
    known: tuple[Squares, NormalEquations] | None = None,
) -> Descent:
    """Minimise `loss` over the weights that `solve` may return, from `start`, (n, 3).

    pull: of the weights, added to the loss; `solve` adds it by itself. from_clipping, until: see
    `run_rounds`. known: squares whose problem is known.
    """
    lit = LitPixels.of(basis, loss)
    result = run_rounds(
        lit,
        WeightTerms(pull),
        start,
        solve,
        from_clipping=from_clipping,
        until=until,
        known=None if known is None else lit.summed(*known),
    )
    x, image, weight = result.x, result.image, result.weight
    if lit.which is not None:
        x = LitPixels.whole(basis, loss).predicted(result.at)
        image, weight = loss.pixels.squares(x, from_clipping=result.from_clipping)
    share = loss.pixels.shares(x, weight)
    squares = Squares(*(image_in_place(x, basis.size) for x in (image, weight, share)))
    if is_large(basis.size) and not result.from_clipping:
        squares = DeferredSquares(LitPixels.whole(basis, loss), result.at, squares)
    reweighting = Reweighting(result.at, result.count, result.step, result.converged)
    return Descent(result.weights, squares, result.equations, reweighting)


def run_rounds(
    lit: LitPixels,
    terms: WeightTerms,
    start: Doubles,
    solve: Solver,
    *,
    from_clipping: bool,
    until: float = MIN_STEP,
    known: SummedSquares | None = None,
    own_squares: bool = True,
) -> RoundsResult:
    """Minimise the loss of some pixels and the terms in the weights, from weights (n, 3).

    from_clipping: whether rounds first draw clipped values back, before they use the loss's own
    slope. until: the change of a light's picture at which they end. known: squares of these pixels
    whose problem is known. own_squares: whether the last round is of the loss's own squares, and
    not of curved ones, which lead there in fewer rounds. Unless `until` is small, the equations of
    the result may have the matrix of an earlier round.
    """
    pixels = lit.pixels
    from_clipping = from_clipping and pixels.has_clipping
    is_curved = pixels.has_curvature and (from_clipping or not own_squares)
    w, x = start, lit.predicted(start)
    value = total_loss(pixels, terms, w, x)
    in_the_dark = float(pixels.objective(np.zeros_like(x)).sum())
    count, matrix, keeps_matrix = 0, None, lit.planes.count >= MANY_LIGHTS
    while True:
        kind = {"from_clipping": from_clipping, "is_curved": is_curved}
        round_ = _Round.of(lit, terms, w, x, solve, known=known, matrix=matrix, **kind)
        if pixels.has_pieces:  # other squares change all pixels in each round
            known = SummedSquares(round_.image, round_.weight, round_.equations)
        count += 1
        is_first_part = keeps_matrix and from_clipping
        least_fall = max(MIN_FALL * value, MIN_FALL_OF_DARK * in_the_dark)
        least_step = max(until, CLIPPED_STEP * is_first_part)
        done = round_.has_converged(pixels, x, least_fall, least_step)
        if matrix is not None and done and not is_first_part and until <= MIN_STEP:
            matrix, is_curved = None, False  # the last round is of the squares themselves
            continue
        is_last_curved = is_curved and own_squares and done and not from_clipping
        done = done and not is_last_curved
        part, reached = 1.0, total_loss(pixels, terms, round_.best, round_.ahead)
        is_worse = reached > value * (1 + ROUND_OFF)
        if is_worse or from_clipping or not done:
            steps = (w, round_.best), (x, round_.ahead)
            part, reached = _line_search(pixels, terms, *steps, value, reached, round_.fall)
        if part == 0 and (matrix is not None or is_curved):
            matrix, is_curved = None, False
            continue
        is_near = part == 1 and round_.step <= KEPT_STEP and not (from_clipping and done)
        if from_clipping and (done or part == 0):
            from_clipping = False
            if part == 0:
                del round_
                continue
            done = False
        if done or part == 0 or count >= MAX_ROUNDS:
            least_fall = max(FLAT_FALL * value, FLAT_FALL_OF_DARK * in_the_dark)
            small = done or (part == 0 and round_.fall <= least_fall)
            weights = interpolate(w, round_.best, part) if is_worse else round_.best
            squares = round_.image, round_.weight, round_.equations
            return RoundsResult(weights, w, x, from_clipping, *squares, count, round_.step, small)
        w, x = interpolate(w, round_.best, part), interpolate(x, round_.ahead, part)
        value, is_curved = reached, pixels.has_curvature and not is_last_curved
        is_kept = keeps_matrix and is_near and not (pixels.has_pieces or is_last_curved)
        matrix = round_.equations if is_kept else None
        del round_  # else its pictures would coexist with the next ones
        if keeps_matrix:
            release_freed_memory()


@dataclass(frozen=True)
class _Round:
    """The squares at some weights w and their picture x, and the step to their optimum.

    image, weight: the squares, (3, p). best: (n, 3), the optimum; ahead: (3, p), its picture.
    step: see `Reweighting`. fall: the initial slope of the loss on the way there.
    """

    image: Doubles
    weight: Doubles
    equations: NormalEquations
    best: Doubles
    ahead: Doubles
    step: float
    fall: float

    @classmethod
    def of(
        cls,
        lit: LitPixels,
        terms: WeightTerms,
        w: Doubles,
        x: Doubles,
        solve: Solver,
        *,
        from_clipping: bool,
        is_curved: bool,
        known: SummedSquares | None,
        matrix: NormalEquations | None = None,
    ) -> "_Round":
        """Make the squares, and solve for their optimum.

        matrix: equations whose M stands for the matrix of the squares: a step along the same
        gradient.
        """
        make = lit.pixels.curved_squares if is_curved else lit.pixels.squares
        image, weight = make(x, from_clipping=from_clipping)
        if matrix is None:
            equations = lit.equations(image, weight, known)
        else:
            slope = lit.products(weight * (image - x))
            b = np.einsum("cij,jc->ci", matrix.M, w) + slope.T
            equations = replace(matrix, b=b)
        best = solve(terms.tilted(equations), w)
        ahead = lit.predicted(best)
        step = relative_change(equations, w, best)
        fall = 2 * lit.slope(image, weight, x, ahead) + terms.fall(w, best)
        return cls(image, weight, equations, best, ahead, step, fall)

    def has_converged(self, pixels: PixelLoss, x: Doubles, fall: float, until: float) -> bool:
        """Return whether its step from picture x ends the rounds: one of at most `until`, or that
        promises at most this fall.
        """
        if pixels.has_pieces:
            # A problem that is exact along the whole step has the same optimum as the true one.
            return pixels.has_same_squares(x, self.ahead)
        return self.step <= until or self.fall <= fall


def relative_change(equations: NormalEquations, w: Doubles, best: Doubles) -> float:
    """Return the largest change of a light's picture, relative to the brightest one of its
    channel.
    """
    size = np.sqrt(np.einsum("cii->ic", equations.M))
    largest = (size * np.maximum(w, best)).max(axis=0, initial=0)
    change = (size * np.abs(best - w)).max(axis=0, initial=0)
    return float((change / np.where(largest > 0, largest, 1)).max())


def total_loss(pixels: PixelLoss, terms: WeightTerms, w: Doubles, x: Doubles) -> float:
    """Return the loss of a picture x, (3, p), with the terms in its weights, (n, 3)."""
    return float(pixels.objective(x).sum()) + terms.value(w)


def _line_search(
    pixels: PixelLoss,
    terms: WeightTerms,
    weights: tuple[Doubles, Doubles],
    pictures: tuple[Doubles, Doubles],
    value: float,
    whole: float,
    fall: float,
) -> tuple[float, float]:
    """Halve a step until the loss falls enough; return its share, and the loss there.

    The share is 0 if the loss never falls. whole: the loss after the whole step.
    """
    part, reached = 1.0, whole
    while reached > value - KEPT_PROMISE * part * max(fall, 0):
        part /= 2
        if part < SHORTEST_STEP:
            return 0.0, value
        w, x = (interpolate(*ends, part) for ends in (weights, pictures))
        reached = total_loss(pixels, terms, w, x)
    return (part, reached) if reached < value else (0.0, value)


def interpolate(a: Doubles, b: Doubles, part: float) -> Doubles:
    """Return the point that is `part` of the way from a to b."""
    return b if part == 1 else a + part * (b - a)


def find_near_optimum(
    basis: Basis,
    loss: Loss,
    equations: NormalEquations,
    start: Doubles,
    solve: Solver,
    *,
    pull: NormalEquations | None = None,
) -> Doubles | None:
    """Return weights (n, 3) near the end of rounds over all pixels; None if a sample leads nowhere.

    equations: of the pixels with the importance of `loss`. For the others see `descend`.
    """
    size = _sample_size(len(start))
    lit = LitPixels.of(basis, loss)
    part = sample_pixels(lit, np.einsum("cii->ic", equations.M), size)
    terms = WeightTerms(pull)
    found_near, least = None, total_loss(lit.pixels, terms, start, lit.predicted(start))
    options: dict[str, Any] = {"solve": solve, "own_squares": False}
    w = run_rounds(part, terms, start, from_clipping=True, until=FIRST_STEP, **options).weights
    last_step, tolerance = np.inf, STEP_RATIO * FIRST_STEP
    for _ in range(MAX_CORRECTIONS):
        value, slope = lit.objective_and_gradient(w)
        value += terms.value(w)
        if value > least:
            return found_near
        found_near, fell, least = w, least - value, value
        if fell <= MIN_GAIN * value:
            return found_near
        tilted = WeightTerms(pull, part.objective_and_gradient(w)[1] - slope, w)
        result = run_rounds(part, tilted, w, from_clipping=False, until=tolerance, **options)
        step, w = relative_change(result.equations, w, result.weights), result.weights
        if step > MAX_STEP_RATIO * last_step:
            return found_near
        if step <= MIN_STEP:
            return w
        last_step, tolerance = step, STEP_RATIO * min(step, FIRST_STEP)
    return w


def is_sampled(loss: Loss, lights: int) -> bool:
    """Return whether a sample of the pixels is quicker than all of them."""
    counted = np.count_nonzero(loss.importance)
    return not loss.pixels.has_pieces and bool(counted * MAX_SAMPLE_SHARE >= _sample_size(lights))


def _sample_size(lights: int) -> int:
    return max(MIN_SAMPLE, PIXELS_PER_LIGHT * lights)


def sample_pixels(lit: LitPixels, power: Doubles, size: int) -> LitPixels:
    """Draw about `size` of the pixels, each as important as all those that it stands for.

    power: (n, 3), Σ D Φ², of the lights. One pixel is drawn, in order, for each `size`-th part of
    the total information on the lights; pixels with more than that are certain.
    """
    information = _information(lit, power)
    chance = size * (
        (1 - EVEN_SHARE) * information / max(information.sum(), 1e-300)
        + EVEN_SHARE / information.size
    )
    # The others share the size that certain pixels leave.
    for _ in range(4):
        certain = chance >= 1
        unclaimed = size - np.count_nonzero(certain)
        rest = float(chance[~certain].sum())
        chance = np.where(certain, 1, chance * (unclaimed / rest if rest > 0 else 1))
    chance = np.minimum(chance, 1)
    drawn = np.flatnonzero(np.diff(np.floor(np.cumsum(chance) + 0.5), prepend=0))
    pixels = lit.pixels.subset(drawn).scaled(1 / chance[drawn])
    # Memory in the order of the walks, of which there are many.
    rows = np.ascontiguousarray(lit.planes.pixels(drawn))
    return LitPixels(MemoryPlanes(rows[:, None]), pixels)


def _information(lit: LitPixels, power: Doubles) -> Doubles:
    """Return the information on lights in each pixel, (p,): Σ D Φ² / power over the lights."""
    part = np.where(power > 0, 1 / np.where(power > 0, power, 1), 0).astype(np.float32)

    def block_information(block: slice) -> Doubles:
        squares = np.square(lit.planes.pixels(block))
        return np.asarray(sum(part[:, c] @ squares[..., c] for c in range(3)))

    def strip_information(strip: slice, pixels: PixelLoss) -> Doubles:
        blocks = walked_blocks(lit.planes, strip.stop, strip.start)
        return np.concatenate([block_information(block) for block in blocks]) * pixels.importance

    return np.concatenate(lit.pixels.map_strips(strip_information))


def search_step(
    start: Doubles,
    value: float,
    step_of: Callable[[float], Doubles],
    loss: Callable[[Doubles], float],
    *,
    promised: float,
) -> Doubles:
    """Return the weights of the share of a step with the least loss; `start` if none lowers it.

    The step is halved a few times only, as long as a shorter one lowers the loss, unless the whole
    step brings most of what its squares promise.

    start: (n, 3), weights, and value: their loss. step_of: returns the weights (n, 3) after a share
    of the step. promised: the fall of the loss that squares predict for the whole step.
    """
    nearest = start
    for share in STEP_SHARES:
        step = step_of(share)
        reached = loss(step)
        if reached > value and nearest is not start:
            break
        is_good = share == 1 and value - reached >= GOOD_FALL * promised
        if reached <= value:
            nearest, value = step, reached
        if is_good:
            break
    return nearest
