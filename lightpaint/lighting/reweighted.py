"""Linear solves one after the other, each of squares that stand for the loss where the last led.

The squares have the loss's own gradient, so the way to their optimum is downhill; how far to go
is decided on the loss itself, which therefore never rises. Where it does not fall any more, the
answer is stationary under all that is asked of the lights: of a convex loss the optimum.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.basis.basis import Basis
from lightpaint.lighting.loss import Loss, Squares
from lightpaint.lighting.normal_equations import BLOCK, NormalEquations

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


@dataclass(frozen=True)
class Descent:
    """Where the rounds led: weights, and the last linear problem.

    They solve it, unless its own solution is worse than where it starts; then they lie between.
    """

    weights: Doubles
    squares: Squares
    equations: NormalEquations
    reweighting: Reweighting


def descend(
    basis: Basis,
    loss: Loss,
    start: Doubles,
    solve: Callable[[NormalEquations, Doubles], Doubles],
    *,
    pull: NormalEquations | None = None,
) -> Descent:
    """Minimise `loss` over what `solve` keeps to, from the weights `start`, (n, 3).

    solve: (equations, weights to begin with) → the weights (n, 3) that are best for them; the
    set of those it may return is convex. pull: of the weights, added to the loss; `solve` adds
    it by itself.
    """
    w, x = start, predicted(basis, start)
    value = _value(loss, pull, w, x)
    # First with what is drawn back from clipping, then with the loss's own slope.
    from_clipping = loss.transform is not None
    count = 0
    while True:
        squares = loss.squares(x, from_clipping=from_clipping)
        equations = NormalEquations.of(basis, squares.image, squares.weight)
        best = solve(equations, w)
        count += 1
        ahead = predicted(basis, best)
        step = _change(equations, w, best)
        fall = _fall(squares, pull, x, ahead, w, best)
        # A problem that is exact all the way has its optimum where the true one has it.
        is_exact = loss.same_squares(x, ahead)
        done = is_exact if loss.transform is None else step <= STEP or fall <= FALL * value
        part, reached = _part_of_step(loss, pull, (w, best), (x, ahead), value, fall)
        if from_clipping and (done or part == 0):
            from_clipping = False
            if part == 0:
                continue
            done = False
        if done or part == 0 or count >= ROUNDS:
            is_worse = _value(loss, pull, best, ahead) > value * (1 + ROUND_OFF)
            small = done or (part == 0 and fall <= FLAT * value)
            weights = w + part * (best - w) if is_worse else best
            return Descent(weights, squares, equations, Reweighting(w, count, step, small))
        w, x, value = w + part * (best - w), x + part * (ahead - x), reached


def predicted(basis: Basis, weights: Doubles) -> Doubles:
    """Σ w_i Φ_i, (h, w, 3), in float64: a float32's round-off would hide the last steps."""
    n, height, width, _ = basis.images.shape
    rows = basis.images.reshape(n, -1, 3)
    mixed = np.empty((height * width, 3))
    for start in range(0, height * width, BLOCK):
        where = slice(start, start + BLOCK)
        for c in range(3):
            mixed[where, c] = weights[:, c] @ rows[:, where, c].astype(np.float64)
    return mixed.reshape(height, width, 3)


def _value(loss: Loss, pull: NormalEquations | None, w: Doubles, x: Doubles) -> float:
    value = float(loss.objective(x).sum())
    return value if pull is None else value + float(pull.objective(w).sum())


def _fall(
    squares: Squares,
    pull: NormalEquations | None,
    x: Doubles,
    ahead: Doubles,
    w: Doubles,
    best: Doubles,
) -> float:
    """By how much the loss falls per step, at its beginning."""
    slope = squares.weight * (squares.image - x)
    fall = 2 * float((slope * (ahead - x)).sum())
    if pull is not None:
        gradient = pull.gradient(w)
        fall -= 2 * float((gradient * (best - w)).sum())
    return fall


def _part_of_step(
    loss: Loss,
    pull: NormalEquations | None,
    weights: tuple[Doubles, Doubles],
    pictures: tuple[Doubles, Doubles],
    value: float,
    fall: float,
) -> tuple[float, float]:
    """How much of a step to take, and the loss there: half of it until the loss falls enough.

    0 if it never does.
    """
    (w, best), (x, ahead) = weights, pictures
    part = 1.0
    while part >= SHORTEST:
        reached = _value(loss, pull, w + part * (best - w), x + part * (ahead - x))
        if reached <= value - KEPT * part * max(fall, 0):
            return (part, reached) if reached < value else (0.0, value)
        part /= 2
    return 0.0, value


def _change(equations: NormalEquations, w: Doubles, best: Doubles) -> float:
    """Largest change of a light's picture beside the brightest one of its channel."""
    size = np.sqrt(np.einsum("cii->ic", equations.M))
    largest = (size * np.maximum(w, best)).max(axis=0, initial=0)
    change = (size * np.abs(best - w)).max(axis=0, initial=0)
    return float((change / np.where(largest > 0, largest, 1)).max())
