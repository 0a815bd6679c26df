"""Errors of weights by a painting that is a render: by its noise, and by its filter.

A render has noise τ, which makes δg = Σ D Φ τ. Its variance is the variance of the residual from
pixel to pixel, less the variance of the prediction (residuals.py).

A basis has a box filter; Mitsuba's default is a Gaussian. It makes halos around lamps in view and
softens all edges of light: it adds h = (F − 1) p to the prediction p = Σ w Φ. No lights make that,
but each takes a part of it for its own light. So with

    a = Σ D (Φ h − Φ′ h′),  δ = M⁻¹ a

lights of a painting Ψ = p + α h are off by α δ. Least squares beside all lights give

    α = Σ D (h r − h′ r′) / (Σ D (h² − h′²) − a · δ).

Both h and the residual r = Ψ − p have the noise of the prediction; products of half differences,
with a prime, take it out. A brush, too, may leave residuals that resemble h, but h explains only a
small part of them.
"""

import math
from dataclasses import dataclass
from typing import Self

import numpy as np

from lightpaint.arrays import Doubles, Floats, Indices
from lightpaint.basis import as_slice, block_of
from lightpaint.lighting.analysis.noise.basis_noise import couples_channels
from lightpaint.lighting.analysis.noise.residuals import Residuals, channel_grain
from lightpaint.lighting.analysis.noise.weight_directions import solve_for
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.solution import Solution
from lightpaint.progress import with_progress

#: Least noise of a painting that counts, relative to the noise of the prediction.
MIN_PAINTING_NOISE = 0.02

#: Share of Mitsuba's Gaussian, whose standard deviation is half a pixel, that lies in each of both
#: neighbours along an axis: beyond one standard deviation.
TAP = (1 - math.erf(math.sqrt(0.5))) / 2

#: Variance of a sum of pixels of a Gaussian filter over the sum of their variances. A sample counts
#: in several, so the noise of neighbours has a correlation of .31 along an axis.
CORRELATION = (1 + 2 * 0.31) ** 2

#: Least share of the residual beside noise that the filter of a render explains.
MIN_EXPLAINED = 0.5

#: Standard errors beyond which noise does not make Σ D h r.
SURE = 4.0

#: Largest α of a filter. Flat paint over a texture lacks more of it than any filter takes: α is 1.6
#: and more.
MAX_SHARE = 1.3

#: Least part of ‖h‖² that no lights make.
MIN_OWN = 0.05


@dataclass(frozen=True)
class PaintingNoise:
    """The noise of a painting, and what its filter may have changed.

    D: (p, 3), weights of pixels. residuals: r and the half differences of the prediction. painted:
    the pixels that count. variance: (p, 3), of τ, times D.
    """

    solution: Solution
    D: Doubles
    residuals: Residuals
    painted: Indices
    variance: Doubles

    @classmethod
    def of(cls, solution: Solution) -> Self:
        """Measure the noise of an answer's painting."""
        weight, residuals = solution.problem.squares.weight, Residuals.of(solution)
        D = weight.reshape(-1, weight.shape[2]).astype(np.float64)
        size, counted = solution.basis.size, solution.importance > 0
        everything = slice(0, len(D))
        residual, mixed = residuals.residual(everything), residuals.noise(everything)
        D = np.broadcast_to(D, residual.shape)
        variance = np.zeros(residual.shape)
        for c in range(3):
            of_both, of_prediction = (
                channel_grain((np.sqrt(D[:, c]) * x[:, c]).reshape(size), counted).ravel()
                for x in (residual, mixed)
            )
            variance[:, c] = np.maximum(of_both - of_prediction, 0)
        return cls(solution, D, residuals, np.flatnonzero(counted), variance)

    def covariance(self) -> Doubles | None:
        """Return the covariance of the gradient by this noise, (3, n, 3, n); None where there is
        next to none.
        """
        roots = np.sqrt(self.D * self.variance)
        noise = self.residuals.noise(slice(0, len(roots)))
        if np.square(roots).sum() <= MIN_PAINTING_NOISE * (self.D * np.square(noise)).sum():
            return None
        n, planes = len(self.solution.weights), self.solution.basis.planes
        covariance = np.zeros((3, n, 3, n))
        pairs = [(k, k) for k in range(3)]
        pairs += [(0, 1), (0, 2), (1, 2)] * couples_channels(self.solution)
        step, kind = block_of(planes)
        for start in with_progress(range(0, self.painted.size, step)):
            part = as_slice(self.painted[start : start + step])
            lit = planes.pixels(part)
            rows = [lit[..., c] * roots[part, c].astype(kind) for c in range(3)]
            for c, d in pairs:
                # Its noise, too, is the noise of paths, which carry all channels.
                product = rows[c] @ rows[d].T
                covariance[c, :, d] += product
                if c != d:
                    covariance[d, :, c] += product.T
        return covariance

    def filter_error(self, unbiased: NormalEquations, weights: Doubles) -> tuple[float, Doubles]:
        """Return α, from 0 where the painting seems to have a box filter to 1, and the error of
        weights by it, (n, 3).

        unbiased: the equations without noise, whose solution these weights are.
        """
        nothing = 0.0, np.zeros(weights.shape)
        product, power, lacking, spread = np.sum([self._sums(c) for c in range(3)], axis=0).tolist()
        # A share of at most 1 explains at most this much.
        if product <= max(MIN_EXPLAINED * lacking, SURE * math.sqrt(spread)):
            return nothing
        a = self._products()
        b = unbiased.b + a
        whole = solve_for(self.solution, NormalEquations(unbiased.M, b, unbiased.target_norm2))
        error = np.asarray(whole - weights)
        own = power - float((a * error.T).sum())
        if own <= MIN_OWN * power or product > MAX_SHARE * own:
            return nothing
        share = min(product / own, 1.0)
        return (share, share * error) if share * product > MIN_EXPLAINED * lacking else nothing

    def _sums(self, c: int) -> tuple[float, float, float, float]:
        """Return sums over the pixels of a channel, less noise: Σ D h r, Σ D h², Σ D r², and the
        variance of the first.
        """
        everything, D, variance = slice(0, len(self.D)), self.D[:, c], self.variance[:, c]
        r, r_half = (
            self.residuals.residual(everything)[:, c],
            -self.residuals.noise(everything)[:, c],
        )
        h, h_half = self._changes(c)
        return (
            float(D @ (h * r - h_half * r_half)),
            float(D @ (np.square(h) - np.square(h_half))),
            float(D @ (np.square(r) - np.square(r_half)) - variance.sum()),
            float((D * np.square(h)) @ (variance + D * np.square(r_half))),
        )

    def _changes(self, c: int) -> tuple[Doubles, Doubles]:
        """Return h and h′ of a channel, (p,)."""
        views, size = self.solution.problem.views, self.solution.importance.shape

        def change(image: Floats) -> Doubles:
            whole = image[:, c].reshape(size)
            parts = [views.part(whole, k).astype(np.float64) for k in range(len(views))]
            return np.asarray(views.join([filtered(x) - x for x in parts]).ravel())

        return change(self.residuals.predicted), change(self.residuals.half)

    def _products(self) -> Doubles:
        """Return Σ D (Φ h − Φ′ h′), (3, n)."""
        basis = self.solution.basis
        sums, (step, _) = np.zeros((3, len(basis.lights))), block_of(basis.planes)
        changes = [[self.D[:, c] * x for x in self._changes(c)] for c in range(3)]
        for start in with_progress(range(0, self.painted.size, step)):
            part = as_slice(self.painted[start : start + step])
            light, noise = basis.planes.pixels(part), basis.noise.pixels(part)
            for c, (h, h_half) in enumerate(changes):
                sums[c] += light[..., c] @ h[part] - noise[..., c] @ h_half[part]
        return sums


def filtered(image: Doubles) -> Doubles:
    """Return a picture of a channel with a box filter, (h, w), with a Gaussian one."""
    for axis in (0, 1):
        lines = np.moveaxis(np.pad(image, 1, mode="edge"), axis, 0)
        beside = np.moveaxis(lines[:-2] + lines[2:], 0, axis)
        beside = beside[:, 1:-1] if axis == 0 else beside[1:-1]
        image = (1 - 2 * TAP) * image + TAP * beside
    return image
