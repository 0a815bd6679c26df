"""Solves with few pixels that lead near the optimum, after which one or two exact rounds suffice.

A sample of the pixels stands for all, preferring those that determine a light. Its optimum is near
that of all pixels. A tilt then corrects its gradient: the tilted sample has the true gradient where
this was measured, and its optimum is closer the more its curvature resembles the true one.
"""

from typing import Any

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.basis import Basis, MemoryPlanes
from lightpaint.lighting.loss.lit_pixels import LitPixels
from lightpaint.lighting.loss.loss import Loss, PixelLoss
from lightpaint.lighting.loss.reweighting import (
    MIN_STEP,
    Solver,
    WeightTerms,
    relative_change,
    run_rounds,
    total_loss,
)
from lightpaint.lighting.normal_equations import NormalEquations

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

    def strip_information(strip: slice, pixels: PixelLoss) -> Doubles:
        squares = np.square(lit.planes.pixels(strip))
        information = sum(part[:, c] @ squares[..., c] for c in range(3))
        return np.asarray(information * pixels.importance)

    return np.concatenate(lit.pixels.map_strips(strip_information))
