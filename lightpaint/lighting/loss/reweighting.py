"""Linear solves one after the other, each of squares that stand for the loss where the last led.

The squares have the loss's own gradient, so the way to their optimum is downhill; how far to go
is decided on the loss itself, which therefore never rises. Where it does not fall any more, the
answer is stationary under all that is asked of the lights: of a convex loss the optimum.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.basis.basis import Basis
from lightpaint.lighting.loss.lit_pixels import LitPixels
from lightpaint.lighting.loss.loss import Loss, PixelLoss, Squares, image_of
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.threads import side_by_side

#: Rounds at most.
ROUNDS = 100

#: Change of a light's picture in a round, beside the brightest light's, that ends them, and part of
#: the loss that a whole step promises. Problems that become exact go on until they are.
STEP, FALL = 1e-6, 1e-11

#: Part of what the gradient promises that a step has to keep, and the shortest step.
KEPT, SHORTEST = 1e-4, 2.0**-20

#: Part of the loss that is round-off of its sums.
ROUND_OFF = 1e-12

#: Part of the loss that a whole step would promise at most where no step falls any more: views of
#: OpenColorIO are float32, and their slopes quotients of differences.
FLAT = 1e-5


@dataclass(frozen=True)
class Reweighting:
    """How the linear problem came about that a solution solves.

    at: (n, 3), the weights that its squares were made for. rounds: linear problems solved to get
    there. step: the change of a light's picture in the last, beside the brightest light's.
    converged: whether that was small.
    """

    at: Doubles
    rounds: int
    step: float
    converged: bool


#: The weights (n, 3) that are best for equations, and for what is asked of the weights, from those
#: to begin with; the set of those it may return is convex.
Solve = Callable[[NormalEquations, Doubles], Doubles]


@dataclass(frozen=True)
class Descent:
    """Where the rounds led: weights, and the last linear problem.

    They solve it, unless its own solution is worse than where it starts; then they lie between.
    """

    weights: Doubles
    squares: Squares
    equations: NormalEquations
    reweighting: Reweighting


@dataclass(frozen=True)
class Asked:
    """What is added to the loss of the pixels: pull(w) − 2 tilt · (w − origin).

    pull: of the weights; None for none. tilt, origin: (n, 3).
    """

    pull: NormalEquations | None = None
    tilt: Doubles | None = None
    origin: Doubles | None = None

    def value(self, w: Doubles) -> float:
        value = 0.0 if self.pull is None else float(self.pull.objective(w).sum())
        if self.tilt is not None and self.origin is not None:
            value -= 2 * float((self.tilt * (w - self.origin)).sum())
        return value

    def fall(self, w: Doubles, best: Doubles) -> float:
        """By how much it falls per step from w to `best`, at its beginning."""
        way, fall = best - w, 0.0
        if self.pull is not None:
            fall -= 2 * float((self.pull.gradient(w) * way).sum())
        return fall if self.tilt is None else fall + 2 * float((self.tilt * way).sum())

    def tilted(self, equations: NormalEquations) -> NormalEquations:
        """`equations` with the tilt; whoever solves them knows of the pull."""
        return equations if self.tilt is None else replace(equations, b=equations.b + self.tilt.T)


@dataclass(frozen=True)
class Led:
    """Where rounds over some pixels led.

    weights: (n, 3). at: (n, 3), the weights that the last squares were made for; x: (3, p), their
    picture. from_clipping: how these squares were made. image, weight: (3, p), what they are.
    count, step, converged: as of `Reweighting`.
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
    solve: Solve,
    *,
    pull: NormalEquations | None = None,
    from_clipping: bool = True,
) -> Descent:
    """Minimise `loss` over what `solve` keeps to, from the weights `start`, (n, 3).

    pull: of the weights, added to the loss; `solve` adds it by itself. from_clipping: as of
    `rounds`.
    """
    lit = LitPixels.of(basis, loss)
    led = rounds(lit, Asked(pull), start, solve, from_clipping=from_clipping)
    x, image, weight = led.x, led.image, led.weight
    if lit.which is not None:
        x = LitPixels.whole(basis, loss).predicted(led.at)
        image, weight = loss.pixels.squares(x, from_clipping=led.from_clipping)
    share = loss.pixels.shares(x, weight)
    squares = Squares(*side_by_side(lambda x: image_of(x, basis.size), (image, weight, share)))
    told = Reweighting(led.at, led.count, led.step, led.converged)
    return Descent(led.weights, squares, led.equations, told)


def rounds(
    lit: LitPixels,
    asked: Asked,
    start: Doubles,
    solve: Solve,
    *,
    from_clipping: bool,
    until: float = STEP,
) -> Led:
    """Minimise the loss of some pixels and what is asked beside it, from weights (n, 3).

    from_clipping: first with what is drawn back from clipping, then with the loss's own slope.
    until: the change of a light's picture that ends them.
    """
    pixels = lit.pixels
    from_clipping = from_clipping and pixels.clips
    w, x = start, lit.predicted(start)
    value = value_of(pixels, asked, w, x)
    count = 0
    while True:
        image, weight = pixels.squares(x, from_clipping=from_clipping)
        equations = lit.equations(image, weight)
        best = solve(asked.tilted(equations), w)
        count += 1
        ahead = lit.predicted(best)
        step = change(equations, w, best)
        fall = 2 * lit.slope(image, weight, x, ahead) + asked.fall(w, best)
        if pixels.has_pieces:
            # A problem that is exact all the way has its optimum where the true one has it.
            done = pixels.same_squares(x, ahead)
        else:
            done = step <= until or fall <= FALL * value
        part, reached = 1.0, value_of(pixels, asked, best, ahead)
        is_worse = reached > value * (1 + ROUND_OFF)
        if is_worse or from_clipping or not done:
            steps = (w, best), (x, ahead)
            part, reached = _part_of_step(pixels, asked, *steps, value, reached, fall)
        if from_clipping and (done or part == 0):
            from_clipping = False
            if part == 0:
                continue
            done = False
        if done or part == 0 or count >= ROUNDS:
            small = done or (part == 0 and fall <= FLAT * value)
            weights = between(w, best, part) if is_worse else best
            return Led(weights, w, x, from_clipping, image, weight, equations, count, step, small)
        w, x, value = between(w, best, part), between(x, ahead, part), reached


def change(equations: NormalEquations, w: Doubles, best: Doubles) -> float:
    """Largest change of a light's picture beside the brightest one of its channel."""
    size = np.sqrt(np.einsum("cii->ic", equations.M))
    largest = (size * np.maximum(w, best)).max(axis=0, initial=0)
    moved = (size * np.abs(best - w)).max(axis=0, initial=0)
    return float((moved / np.where(largest > 0, largest, 1)).max())


def value_of(pixels: PixelLoss, asked: Asked, w: Doubles, x: Doubles) -> float:
    """The loss of a picture x, (3, p), and what is asked of its weights, (n, 3)."""
    return float(pixels.objective(x).sum()) + asked.value(w)


def _part_of_step(
    pixels: PixelLoss,
    asked: Asked,
    weights: tuple[Doubles, Doubles],
    pictures: tuple[Doubles, Doubles],
    value: float,
    whole: float,
    fall: float,
) -> tuple[float, float]:
    """How much of a step to take, and the loss there: half of it until the loss falls enough.

    0 if it never does. whole: the loss after all of the step.
    """
    part, reached = 1.0, whole
    while reached > value - KEPT * part * max(fall, 0):
        part /= 2
        if part < SHORTEST:
            return 0.0, value
        w, x = (between(*ends, part) for ends in (weights, pictures))
        reached = value_of(pixels, asked, w, x)
    return (part, reached) if reached < value else (0.0, value)


def between(a: Doubles, b: Doubles, part: float) -> Doubles:
    """From a by that part of the way to b."""
    return b if part == 1 else a + part * (b - a)
