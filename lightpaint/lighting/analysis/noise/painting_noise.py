"""Errors of weights by the noise of a painting that is a render.

A render has noise τ, which makes δg = Σ D Φ τ. Its amount is the variance of the residual from
pixel to pixel, less the variance of the prediction (residuals.py): its *grain*. A brush leaves
residuals with hardly any grain. Where most of the squared residual is grain, relative to the light,
all of it is noise. Renders are noisier where they are bright, so then the variance of a pixel is
its own squared residual (White 1980), over (1 − ℓ)² with its leverage ℓ = D Φᵀ M⁻¹ Φ (MacKinnon and
White 1985).
"""

from dataclasses import dataclass
from typing import Self

import numpy as np

from lightpaint.arrays import Doubles, Floats, Indices
from lightpaint.basis import as_slice, block_of
from lightpaint.images import box_mean
from lightpaint.lighting.analysis.noise.basis_noise import (
    couples_channels,
    pseudo_inverse,
)
from lightpaint.lighting.analysis.noise.residuals import WINDOW, Residuals, channel_grain
from lightpaint.lighting.solution import Solution
from lightpaint.progress import with_progress

#: Least noise of a painting that counts, relative to the noise of the prediction.
MIN_PAINTING_NOISE = 0.02

#: Variance of a sum of pixels of a Gaussian filter over the sum of their variances. A sample counts
#: in several, so the noise of neighbours has a correlation of .31 along an axis.
CORRELATION = (1 + 2 * 0.31) ** 2

#: Shares of grain in the squared residual, relative to the light, from and to which a painting
#: counts as a render: paint in 8 bits has up to .3.
RENDERED = 0.25, 0.5

#: Largest share of a pixel in its own prediction by the fit.
MAX_LEVERAGE = 0.75

#: Light below which a residual is not relative to it, as a share of its mean.
DARK = 0.01


@dataclass(frozen=True)
class PaintingNoise:
    """The noise of a painting.

    D: (p, 3), weights of pixels. residuals: r and the half differences of the prediction. painted:
    the pixels that count. variance: (p, 3), of τ, times D. is_render: whether pixels have
    variances of their own.
    """

    solution: Solution
    D: Doubles
    residuals: Residuals
    painted: Indices
    variance: Doubles
    is_render: bool

    @classmethod
    def of(cls, solution: Solution) -> Self:
        """Measure the noise of an answer's painting."""
        weight, residuals = solution.problem.squares.weight, Residuals.of(solution)
        counted, everything = solution.importance > 0, slice(None)
        r, r_half = residuals.residual(everything), residuals.noise(everything)
        D = np.broadcast_to(weight.reshape(len(r), -1).astype(np.float64), r.shape)
        variance = painting_grain(solution, D, r, r_half)
        share = _rendered_share(solution, residuals.predicted, r, r_half)
        if share:
            variance = (1 - share) * variance + share * _own_variance(solution, D, r, r_half)
        return cls(solution, D, residuals, np.flatnonzero(counted), variance, share > 0)

    def covariance(self) -> tuple[Doubles, Doubles] | None:
        """Return the covariance of the gradient by this noise, (3, n, 3, n), and its degrees of
        freedom for each light, (n, 3), NaN if these are many; None where there is next to none.
        """
        roots = np.sqrt(self.D * self.variance)
        noise = self.residuals.noise(slice(0, len(roots)))
        if np.square(roots).sum() <= MIN_PAINTING_NOISE * (self.D * np.square(noise)).sum():
            return None
        n, planes = len(self.solution.weights), self.solution.basis.planes
        covariance, fourth = np.zeros((3, n, 3, n)), np.zeros((3, n))
        pairs = [(k, k) for k in range(3)]
        pairs += [(0, 1), (0, 2), (1, 2)] * couples_channels(self.solution)
        step, kind = block_of(planes)
        inverse = [pseudo_inverse(M) for M in self.solution.equations.M] if self.is_render else []
        for start in with_progress(range(0, self.painted.size, step)):
            part = as_slice(self.painted[start : start + step])
            lit = planes.pixels(part)
            rows = [lit[..., c] * roots[part, c].astype(kind) for c in range(3)]
            for c, of_channel in enumerate(inverse):
                # An answer follows the noise of pixels that decide it, and leaves less of it.
                pull = self.D[part, c] * (lit[..., c] * (of_channel @ lit[..., c])).sum(axis=0)
                rows[c] /= 1 - np.minimum(pull, MAX_LEVERAGE)
                fourth[c] += np.square(np.square(rows[c], dtype=np.float64)).sum(axis=1)
            for c, d in pairs:
                # Its noise, too, is the noise of paths, which carry all channels.
                product = rows[c] @ rows[d].T
                covariance[c, :, d] += product
                if c != d:
                    covariance[d, :, c] += product.T
        second = np.einsum("cici->ci", covariance)
        return covariance, (np.square(second) / np.where(fourth > 0, fourth, np.nan)).T


def _own_variance(solution: Solution, D: Doubles, r: Doubles, r_half: Doubles) -> Doubles:
    """Return D times the squared residual of each pixel, less the share of it that is noise of the
    prediction around the pixel, (p, 3).
    """
    size = *solution.importance.shape, 3
    squares, of_noise = (D * np.square(x) for x in (r, r_half))
    around, noise_around = (box_mean(x.reshape(size), WINDOW) for x in (squares, of_noise))
    share = 1 - noise_around / np.where(around > 0, around, 1)
    return np.asarray(np.maximum(share, 0).reshape(-1, 3) * squares)


def painting_grain(solution: Solution, D: Doubles, r: Doubles, r_half: Doubles) -> Doubles:
    """Return D times the variance of a painting's noise by its grain, (p, 3).

    D: (p, 3), weights of pixels. r, r_half: (p, 3), the residual and the half difference of the
    prediction.
    """
    size, counted = solution.importance.shape, solution.importance > 0
    variance = np.zeros(r.shape)
    for c in range(3):
        of_both, of_prediction = (
            channel_grain((np.sqrt(D[:, c]) * x[:, c]).reshape(size), counted).ravel()
            for x in (r, r_half)
        )
        variance[:, c] = np.maximum(of_both - of_prediction, 0)
    return variance


def _rendered_share(solution: Solution, light: Floats, r: Doubles, r_half: Doubles) -> float:
    """Return how far a painting counts as a render, 0 to 1. light: (p, 3), the prediction."""
    if solution.problem.is_render:
        return 1.0
    unit = np.abs(light) + DARK * float(np.abs(light).mean(dtype=np.float64))
    D = (solution.importance.reshape(-1, 1) > 0) / np.square(np.where(unit > 0, unit, 1))
    left = float((D * (np.square(r) - np.square(r_half))).sum())
    if left <= 0:
        return 0.0
    low, high = RENDERED
    share = float(painting_grain(solution, D, r, r_half).sum()) / left
    return min(max((share - low) / (high - low), 0.0), 1.0)
