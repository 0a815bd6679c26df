"""Near the optimum by few pixels: where exact rounds begin, so that one or two are enough.

A sample of the pixels stands for all, those that say much about a light rather than others. Its
own optimum is near that of all. By how much its gradient is wrong there is then taken off, as a
tilt: the tilted sample has the true gradient where that was found, and its optimum is nearer by
as much as its curvature is like the true one.
"""

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.basis.basis import Basis
from lightpaint.basis.planes import MemoryPlanes
from lightpaint.lighting.loss.lit_pixels import LitPixels
from lightpaint.lighting.loss.loss import Loss, PixelLoss
from lightpaint.lighting.loss.reweighting import STEP, Asked, Solve, change, rounds, value_of
from lightpaint.lighting.normal_equations import NormalEquations

#: Pixels in a sample, or more, for each light.
SAMPLE, EACH = 2**13, 2**6

#: Larger parts of the pixels are no sample: all of them are as quick.
PART = 0.5

#: Part of a sample that is drawn without asking what a pixel says about a light.
EVENLY = 0.5

#: Change of a light's picture that ends the rounds over a sample, at first as much as a sample is
#: wrong, later beside the change that the correction before has made.
FIRST, LEFT = 1e-4, 1e-3

#: Part of the loss by which it fell last where exact rounds are as good.
NEARLY = 1e-9

#: Corrections at most, and the part of the one before that one may be and worth another.
CORRECTIONS, SHRUNK = 8, 0.7


def near_optimum(
    basis: Basis,
    loss: Loss,
    equations: NormalEquations,
    start: Doubles,
    solve: Solve,
    *,
    pull: NormalEquations | None = None,
) -> Doubles | None:
    """Weights (n, 3) near those where rounds over all pixels end; None where that is not quicker.

    equations: of the pixels, as important as in `loss`. Others as of `descend`.
    """
    size = max(SAMPLE, EACH * len(start))
    if loss.pixels.has_pieces or np.count_nonzero(loss.importance) * PART < size:
        return None
    lit = LitPixels.of(basis, loss)
    part = sample(lit, np.einsum("cii->ic", equations.M), size)
    asked = Asked(pull)
    near, least = None, value_of(lit.pixels, asked, start, lit.predicted(start))
    w = rounds(part, asked, start, solve, from_clipping=True, until=FIRST).weights
    before, until = np.inf, LEFT * FIRST
    for _ in range(CORRECTIONS):
        value, slope = lit.objective_and_gradient(w)
        value += asked.value(w)
        if value > least:
            return near
        near, fell, least = w, least - value, value
        if fell <= NEARLY * value:
            return near
        tilted = Asked(pull, part.objective_and_gradient(w)[1] - slope, w)
        led = rounds(part, tilted, w, solve, from_clipping=False, until=until)
        step, w = change(led.equations, w, led.weights), led.weights
        if step > SHRUNK * before:
            return near
        if step <= STEP:
            return w
        before, until = step, LEFT * min(step, FIRST)
    return w


def sample(lit: LitPixels, power: Doubles, size: int) -> LitPixels:
    """About that many of the pixels, each as important as all that it stands for.

    power: (n, 3), Σ D Φ², of the lights. One pixel is drawn for each `size`-th part of the sum of
    what they say about the lights, in the order they have; those that say more are in it anyway.
    """
    said = _said(lit, power)
    chance = size * ((1 - EVENLY) * said / max(said.sum(), 1e-300) + EVENLY / said.size)
    # What the certain ones do not need is for the others.
    for _ in range(4):
        certain = chance >= 1
        left = size - np.count_nonzero(certain)
        rest = float(chance[~certain].sum())
        chance = np.where(certain, 1, chance * (left / rest if rest > 0 else 1))
    chance = np.minimum(chance, 1)
    drawn = np.flatnonzero(np.diff(np.floor(np.cumsum(chance) + 0.5), prepend=0))
    pixels = lit.pixels.at(drawn).weighed(1 / chance[drawn])
    # In the order in which they are walked, again and again.
    rows = np.ascontiguousarray(lit.planes.pixels(drawn))
    return LitPixels(MemoryPlanes(rows[:, None]), pixels)


def _said(lit: LitPixels, power: Doubles) -> Doubles:
    """(p,), how much of what is known of the lights is in a pixel: Σ D Φ² / power over them."""
    part = np.where(power > 0, 1 / np.where(power > 0, power, 1), 0).astype(np.float32)

    def its(where: slice, pixels: PixelLoss) -> Doubles:
        squares = np.square(lit.planes.pixels(where))
        said = sum(part[:, c] @ squares[..., c] for c in range(3))
        return np.asarray(said * pixels.importance)

    return np.concatenate(lit.pixels.each(its))
