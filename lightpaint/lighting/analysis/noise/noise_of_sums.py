"""The covariance of sums over pixels by the noise of a painting, where few pixels may have most of
it, as a highlight has that tells where a lamp is.

A sum Σ f τ over pixels has the variance Σ f² v by noise τ of the variance v. The mean of v over
neighbours, which `channel_grain` gives, does not know that the pixels with a large f may have a
large v. So the second differences a = N r of the residual r stand for the noise of each pixel:

    Σ (Σ f a)² / 36

over pixels, and over channels inside: a path carries all channels, so their noise is correlated. As
in residuals.py, products at a distance are subtracted, which edges and strokes have and noise does
not; and the same of the half differences of the prediction, for its own noise.

A filter wider than a pixel correlates neighbours along an axis by ρ. That makes sums over many
pixels (1 + 2 ρ)² times as variable, and leaves (1 − 4/3 ρ)² of the variance of N r with taps beside
each other. Two pixels apart, taps are independent. The means of |N r| give the ratio of both, which
a few noisy pixels do not decide.
"""

import math

import numpy as np

from lightpaint.arrays import Bools, Doubles
from lightpaint.lighting.analysis.noise.painting_noise import CORRELATION
from lightpaint.lighting.analysis.noise.residuals import (
    MAX_BLOCK_RATIO,
    POWER,
    distant_windows,
    second_difference,
)


def covariance_of_sums(
    residual: Doubles, half: Doubles, factors: Doubles, counted: Bools
) -> Doubles:
    """Return the covariance of Σ f τ over pixels and channels, (q, q); 0 without noise.

    residual, half: (c, h, w), of the goal, and the half difference of the prediction. factors:
    (q, c, h, w), f of several sums. counted: (h, w), the pixels that count.
    """
    step, inflation = _taps_of(residual, half, counted)
    if min(counted.shape) <= 2 * step:
        return np.zeros((len(factors), len(factors)))
    of_residual, of_half = (_products(x, factors, counted, step) for x in (residual, half))
    # Pixels that lack a tap have as much noise as the others.
    _, whole = second_difference(residual[0], counted, step)
    powers = np.square(factors * counted).sum(axis=1)
    measured = powers[:, step:-step, step:-step][:, whole].sum(axis=1)
    scale = np.divide(
        powers.sum(axis=(1, 2)), measured, out=np.zeros(len(powers)), where=measured > 0
    )
    covariance = inflation * np.sqrt(np.outer(scale, scale)) * (of_residual - of_half)
    variances, axes = np.linalg.eigh(covariance)
    return np.asarray((axes * np.maximum(variances, 0)) @ axes.T)


def _products(image: Doubles, factors: Doubles, counted: Bools, step: int) -> Doubles:
    """Return the covariance of Σ f times the noise of an image, (q, q)."""
    inside = factors[..., step:-step, step:-step]
    a = np.stack([second_difference(x, counted, step)[0] for x in image])
    sums = np.einsum("qchw,chw->qhw", inside, a)
    covariance = np.einsum("qhw,rhw->qr", sums, sums)
    for pair in distant_windows(3 * step):
        for window, other in (pair, pair[::-1]):
            here, there = (..., *window), (..., *other)
            beside = np.einsum("qchw,chw->qhw", inside[here], a[there])
            crossed = np.einsum("qhw,rhw->qr", sums[here], beside)
            covariance -= (crossed + crossed.T) / 4
    return np.asarray(covariance / POWER)


def _taps_of(residual: Doubles, half: Doubles, counted: Bools) -> tuple[int, float]:
    """Return the distance of taps that measures the noise of a painting, and the factor by which
    its filter makes sums over many pixels more variable.

    Where taps two pixels apart measure wider edges of paint, these are one pixel apart.
    """
    at_one, at_two = (
        sum(
            _mean_size(x, counted, step) ** 2 - _mean_size(y, counted, step) ** 2
            for x, y in zip(residual, half, strict=True)
        )
        for step in (1, 2)
    )
    if at_one <= 0 or at_two > MAX_BLOCK_RATIO * at_one:
        return 1, 1.0
    correlation = 0.75 * (1 - 1 / math.sqrt(max(at_two / at_one, 1.0)))
    # No renderer's default filter is wider than Mitsuba's.
    return 2, min((1 + 2 * correlation) ** 2, CORRELATION)


def _mean_size(image: Doubles, counted: Bools, step: int) -> float:
    """Return the mean of |N r| of a channel, (h, w); 0 of a film of too few pixels."""
    if min(counted.shape) <= 2 * step:
        return 0.0
    a, whole = second_difference(image, counted, step)
    return float(np.abs(a).sum() / max(int(whole.sum()), 1))
