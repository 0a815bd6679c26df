"""The noise of the normal equations and of a prediction, from the half differences of a basis.

The two halves of the samples give two gradients of the objective at the solved weights. Half
their difference, pixel by pixel, has the covariance of the gradient's noise, once no noise is
multiplied by itself (docs/method.md, "How sure").

The noise of the gradient is a sum of products: a pixel's half difference times its residual or its
light. These have the same noise, so a stray bright path that one half alone has met would be in
both factors. The variance of the product then counts it four times, where the gradient has it once,
or not at all if the noise correction takes it out of M. So a factor is taken, in part or as a
whole, from the pixel beside, which shows nearly the same by other samples (docs/method.md, "How
sure").
"""

from contextlib import nullcontext
from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import Bools, Doubles, Floats, Indices
from lightpaint.basis import BLOCK_PIXELS, FEW_LIGHTS, Planes, as_slice, block_of
from lightpaint.lighting.algebra.symmetric_matrices import (
    SMALL_MATRIX,
    eigenvectors,
    excess_above,
    large_libraries,
)
from lightpaint.lighting.analysis.noise.dominant_pixels import Peaks, t_ratios
from lightpaint.lighting.analysis.noise.residuals import PixelGradients, Residuals, channel_grain
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.problem import Problem
from lightpaint.lighting.solution import Solution
from lightpaint.progress import with_progress
from lightpaint.threads import one_thread, parallel_map

#: Half differences by which the pixel beside may differ. Beyond, it shows something else: an edge,
#: or a highlight that both halves have met.
MAX_HALVES_APART = 1.5

#: Share of a pixel's own value in a factor where all of the noise power is in the equations.
UNCORRECTED = 0.5

#: The largest share of M, in any direction of the weights, that may be removed as noise. Beyond,
#: the estimate is itself noise, and the rest of M would soon be indefinite.
MAX_NOISE_SHARE = 0.5

#: Least noise of a painting that counts, relative to the noise of the prediction.
MIN_PAINTING_NOISE = 0.02

#: Parts of the pixels that are summed in parallel.
PARTS = 4

#: Numbers of some lights for which the steps to their rows stay in the processor's cache.
CACHED_NUMBERS = 2**16

#: Eigenvalues of M, scaled to a unit diagonal, below which a direction changes no pixel.
NULL_EIGENVALUE = 1e-12

#: Least eigenvalue of M, scaled so, with which an inverse needs no eigenvectors: its error is then
#: 10⁻⁶ at most.
REGULAR_EIGENVALUE = 1e-7


def own_share(problem: Problem, removed: float | None) -> float:
    """Return the share of a pixel's own value in the factors of a problem, 0 to UNCORRECTED.

    It is in proportion to the noise power that the equations contain. removed: the share of it that
    they do not, by default the share in the solved ones. A render of the mix has noise of its own,
    independent of the basis.
    """
    refinement = problem.refinement
    of_basis = 1.0 if refinement is None else 1 - refinement.share
    return UNCORRECTED * of_basis * (1 - (problem.noise_removed if removed is None else removed))


def factor(values: Doubles, halves: Doubles, own_share: float) -> Doubles:
    """Return values, of which a share is a pixel's own, and the rest the value of the pixel beside.

    values, halves: (…, pixels), of pixels in the order of the picture, and their half differences.
    """
    if own_share == 1:
        return values
    beside = values_beside(values)
    is_alike = np.abs(beside - values) <= MAX_HALVES_APART * np.abs(halves)
    return np.where(is_alike, own_share * values + (1 - own_share) * beside, values)


def values_beside(values: Doubles) -> Doubles:
    """Return for each pixel the value of the other one of its pair, (…, pixels).

    The last of an odd number takes the pixel before it, and a single one itself.
    """
    beside, count = np.empty_like(values), values.shape[-1]
    even = count // 2 * 2
    beside[..., :even:2], beside[..., 1:even:2] = values[..., 1:even:2], values[..., :even:2]
    if count % 2:
        beside[..., -1] = values[..., max(count - 2, 0)]
    return beside


@dataclass(frozen=True)
class Noise:
    """Sums over pixels of products of half differences, per channel.

    power: (3, n, n), N_ij = Σ D h_i h_j, the part of M that is noise. target_noise: (3, n), the
    mean error of b: noise of the current look, where this is a goal, and the noise of squares which
    follow from noisy light (residuals.py).
    doubt: (3, n), an estimate of the error that may be left in target_noise.
    gradient: (3, n, 3, n), covariance of the gradient. objective_error, objective_noise: as in
    `Uncertainty`.
    hidden: (3, n), variance of a light that a few pixels may hide (dominant_pixels.py).
    freedom: (3, n), degrees of freedom of the variance of a light's gradient: the number of pixels
    of equal noise that would determine it as well.
    """

    power: Doubles
    target_noise: Doubles
    doubt: Doubles
    gradient: Doubles
    objective_error: Doubles
    objective_noise: Doubles
    hidden: Doubles
    freedom: Doubles

    @property
    def widening(self) -> Doubles:
        """(n, 3), ratios of an interval to the interval of a variance which is known.

        1 where `hidden` includes that already.
        """
        return np.where(self.hidden > 0, 1, t_ratios(self.freedom)).T

    @property
    def is_hidden(self) -> Bools:
        """(n, 3), whether a few pixels may hide most of the noise on a light."""
        return np.asarray(self.hidden > np.einsum("cici->ci", self.gradient)).T

    @property
    def full_covariance(self) -> Doubles:
        """(3, n, 3, n), covariance of the gradient including the hidden part."""
        covariance, lights = self.gradient.copy(), np.arange(self.hidden.shape[1])
        deviation = np.sqrt(self.hidden)
        # A path carries all three channels, so coupled channels share its noise.
        coupled = covariance.any(axis=(1, 3))
        for c, d in zip(*np.nonzero(coupled), strict=True):
            covariance[c, lights, d, lights] += deviation[c] * deviation[d]
        return covariance


def noise_sums(solution: Solution, *, removed: float | None = None) -> Noise:
    """Sum over the pixels that count in one pass, by parts in parallel.

    removed: the share of the noise's power that the equations whose gradient it is do not have; by
    default the share in the solution.
    """
    weights, pixels = solution.weights, NoisyPixels.of(solution, removed=removed)
    counted, weight, residuals = pixels.counted, pixels.weight, pixels.residuals
    is_coupled = _is_coupled(solution)
    # The same parts on every machine, added in order, give the same bits.
    length = BLOCK_PIXELS * max(1, -(-counted.size // (BLOCK_PIXELS * PARTS)))
    parts = [counted[k : k + length] for k in range(0, counted.size, length)]
    sums = _Sums.zeros(len(weights))
    for of_part in (
        parallel_map(lambda x: pixels.sums(x, is_coupled=is_coupled), parts, unit="parts")
        if len(weights) <= FEW_LIGHTS
        else (pixels.sums(x, is_coupled=is_coupled) for x in with_progress(parts, "parts"))
    ):
        sums.add(of_part)
        del of_part  # of many lights, the next one needs its room
    error, noise = np.zeros((2, 3))
    for start in with_progress(range(0, len(weight), BLOCK_PIXELS)):
        part = slice(start, start + BLOCK_PIXELS)
        mixed = residuals.noise(part)
        error += np.square(weight[part] * residuals.residual(part) * mixed).sum(axis=0)
        noise += (weight[part] * np.square(mixed)).sum(axis=0)
    second = np.einsum("cici->ci", sums.gradient)
    return Noise(
        power=sums.power,
        target_noise=sums.target_noise,
        doubt=sums.doubt,
        gradient=sums.gradient,
        objective_error=2 * np.sqrt(error),
        objective_noise=noise,
        hidden=np.array([peaks.hidden() for peaks in sums.peaks]),
        freedom=np.square(second) / np.where(sums.fourth > 0, sums.fourth, np.nan),
    )


def _is_coupled(solution: Solution) -> bool:
    """Return whether a dimmer, a tie, a limit on luminance, or the one weight of a scalar light
    couples channels.
    """
    return len(solution.problem.full.channel_groups) < 3


def painting_covariance(solution: Solution) -> Doubles | None:
    """Return the covariance of the gradient by noise of the painting, (3, n, 3, n); None where it
    has next to none.

    A render that serves as a painting has noise τ, which makes δg = Σ D Φ τ. Its variance is the
    variance of the residual from pixel to pixel, less the variance of the prediction
    (residuals.py).
    """
    pixels, is_coupled = NoisyPixels.of(solution), _is_coupled(solution)
    size, n = solution.basis.size, len(solution.weights)
    counted, everything = solution.importance > 0, slice(0, pixels.unseen.size)
    residual, mixed = pixels.residuals.residual(everything), pixels.residuals.noise(everything)
    roots = np.zeros(residual.shape)
    for c in range(3):
        D = pixels.weight[:, c % pixels.weight.shape[1]].astype(np.float64)
        of_both, of_prediction = (
            channel_grain((np.sqrt(D) * x[:, c]).reshape(size), counted).ravel()
            for x in (residual, mixed)
        )
        roots[:, c] = np.sqrt(D * np.maximum(of_both - of_prediction, 0))
    if np.square(roots).sum() <= MIN_PAINTING_NOISE * (pixels.weight * np.square(mixed)).sum():
        return None
    covariance = np.zeros((3, n, 3, n))
    step, kind = block_of(pixels.planes)
    for start in with_progress(range(0, pixels.counted.size, step)):
        part = as_slice(pixels.counted[start : start + step])
        lit = pixels.planes.pixels(part)
        rows = [lit[..., c] * roots[part, c].astype(kind) for c in range(3)]
        for c, d in [(k, k) for k in range(3)] + [(0, 1), (0, 2), (1, 2)] * is_coupled:
            # Its noise, too, is the noise of paths, which carry all channels.
            product = rows[c] @ rows[d].T
            covariance[c, :, d] += product
            if c != d:
                covariance[d, :, c] += product.T
    return covariance


@dataclass(frozen=True)
class _Sums:
    """Sums over some pixels, as in `Noise`.

    fourth: (3, n), fourth powers of the half differences of the gradient. peaks: of each channel.
    """

    power: Doubles
    target_noise: Doubles
    doubt: Doubles
    gradient: Doubles
    fourth: Doubles
    peaks: tuple[Peaks, ...]

    @classmethod
    def zeros(cls, n: int) -> "_Sums":
        """Return sums over no pixels."""
        peaks = tuple(Peaks.empty(n) for _ in range(3))
        gradient, fourth = np.zeros((3, n, 3, n)), np.zeros((3, n))
        power, (target_noise, doubt) = np.zeros((3, n, n)), np.zeros((2, 3, n))
        return cls(power, target_noise, doubt, gradient, fourth, peaks)

    def add(self, part: "_Sums") -> None:
        """Add the sums over other pixels."""
        for name in ("power", "target_noise", "doubt", "gradient", "fourth"):
            total = getattr(self, name)
            total += getattr(part, name)
        for peaks, more in zip(self.peaks, part.peaks, strict=True):
            peaks.merge(more)


@dataclass(frozen=True)
class NoisyPixels:
    """Data of all pixels of a solution, from which the noise in its gradient follows.

    planes, noise: of the basis. weights: (n, 3). weight, share: (p, 1) or (p, 3). unseen: (p,),
    where no emitter is. counted: the pixels that count. pulled: (n, 3), by how much noise moves the
    pull on the weights. gradients: of the loss by the light of each pixel. own_share: as
    the function of this name returns it.
    """

    planes: Planes
    noise: Planes
    weights: Doubles
    weight: Floats
    share: Floats
    residuals: Residuals
    unseen: Bools
    counted: Indices
    pulled: Doubles
    gradients: PixelGradients
    own_share: float

    @classmethod
    def of(cls, solution: Solution, *, removed: float | None = None) -> "NoisyPixels":
        """Return the noisy pixels of a solution. removed: see `noise_sums`."""
        basis, problem, weights = solution.basis, solution.problem, solution.weights
        # (pixels, 1), or (pixels, 3) where channels differ.
        squares = problem.squares
        weight, share = (x.reshape(-1, x.shape[2]) for x in (squares.weight, squares.share))
        # The pull, λ ‖Φᵢ‖² (presentᵢ − wᵢ), is as noisy as the images that it is measured by: of a
        # pixel it adds Φᵢ hᵢ times this.
        pulled = 2 * problem.pull_strength * (basis.current_weights - weights)
        unseen = ~basis.emitters_seen.ravel()
        counted = np.flatnonzero((solution.importance.ravel() > 0) | (unseen & pulled.any()))
        residuals = Residuals.of(solution)
        of_pixels = PixelGradients.of(solution, residuals), own_share(problem, removed)
        planes = basis.planes, basis.noise
        return cls(*planes, weights, weight, share, residuals, unseen, counted, pulled, *of_pixels)

    def gradient_noise(self, pixels: slice | Indices) -> Doubles:
        """Return the half differences of the gradient that some pixels make by their own samples
        alone, (3, n, pixels).
        """
        arrays = self.noise.pixels(pixels), self.planes.pixels(pixels)
        missed = self.residuals.residual(pixels)
        return np.stack([self._rows(None, pixels, arrays, missed, c) for c in range(3)])

    def sums(self, counted: Indices, *, is_coupled: bool) -> _Sums:
        """Sum over some pixels."""
        sums = _Sums.zeros(len(self.weights))
        step, _ = block_of(self.planes)
        for start in with_progress(range(0, counted.size, step)):
            pixels = as_slice(counted[start : start + step])
            arrays = self.noise.pixels(pixels), self.planes.pixels(pixels)
            missed = self.residuals.residual(pixels)
            rows = [self._rows(sums, pixels, arrays, missed, c) for c in with_progress(range(3))]
            for c in with_progress(range(3)):
                sums.gradient[c, :, c] += rows[c] @ rows[c].T
                squares = np.square(rows[c])
                sums.fourth[c] += np.einsum("ip,ip->i", squares, squares)
            if is_coupled:
                # One path carries all three channels, so their noise goes together.
                for c, d in with_progress(((0, 1), (0, 2), (1, 2))):
                    product = rows[c] @ rows[d].T
                    sums.gradient[c, :, d] += product
                    sums.gradient[d, :, c] += product.T
        return sums

    def _rows(
        self,
        sums: _Sums | None,
        pixels: slice | Indices,
        arrays: tuple[Floats, Floats],
        missed: Doubles,
        c: int,
    ) -> Doubles:
        """Return the noise in the gradient of a channel, (n, pixels); add all else to `sums`.

        arrays: (n, pixels, 3), noise and planes there. missed: (pixels, 3), the residual.
        """
        _, kind = block_of(self.planes)
        D = self.weight[pixels, c % self.weight.shape[1]].astype(kind)
        h, lit = (x[..., c].astype(kind, copy=False) for x in arrays)
        of_pixels = self.gradients
        mean, half = (x[pixels, c].astype(kind) for x in (of_pixels.mean, of_pixels.half))
        # One by one, pixels show their own noise; in sums none is multiplied by itself.
        own = 1.0 if sums is None else self.own_share
        missing, of_mean = np.abs(missed[:, c].astype(kind)), factor(mean, half, own)
        weights, pulled = (x[:, c, None].astype(kind) for x in (self.weights, self.pulled))
        rows = np.empty_like(h)
        step = max(1, CACHED_NUMBERS // max(h.shape[1], 1))
        for first in range(0, len(h), step):
            some = slice(first, first + step)
            noise, light, row = h[some], lit[some], rows[some]
            row[...] = noise * of_mean + factor(light, noise, own) * half
            if sums is not None:
                size = missing + weights[some] * light
                sums.peaks[c].add(D * light * size, row, first=first)
            if self.pulled.any():
                # The noise correction leaves the pull as it is.
                power = factor(light, noise, max(own, UNCORRECTED)) * noise
                row += pulled[some] * np.where(self.unseen[pixels], power, 0)
        if sums is None:
            return rows
        weighted = np.sqrt(D) * h
        sums.power[c] += weighted @ weighted.T
        if of_pixels.bend is not None and of_pixels.doubt is not None:
            mixed = self.residuals.half[pixels, c].astype(kind)
            bend, doubt = (x[pixels, c].astype(kind) for x in (of_pixels.bend, of_pixels.doubt))
            sums.target_noise[c] += h @ (D * mixed + half) + lit @ bend
            sums.doubt[c] += lit @ doubt
        elif self.residuals.current is not None:
            shared = D * self.share[pixels, c % self.share.shape[1]]
            sums.target_noise[c] += h @ (shared * self.residuals.current[pixels, c]).astype(kind)
        return rows


def gradient_bias(solution: Solution, noise: Noise) -> tuple[Doubles, Doubles]:
    """Return some weights, (n, 3), and the mean error of b − M w there by noise, (3, n)."""
    removed, r = solution.problem.noise_removed, solution.problem.refinement
    if r is not None:
        return r.before, r.gradient_error
    n = noise.power.shape[1]
    # Without any light, the noise in M has no effect yet.
    nothing = np.zeros((n, 3))
    if removed == 0:
        return nothing, -noise.target_noise
    weights = solution.weights
    lack = np.einsum("cij,jc->ci", noise.power, weights) - noise.target_noise
    return weights, (1 - removed) * lack


def denoised_matrix(equations: NormalEquations, power: Doubles) -> Doubles:
    """Return M without its noise, (3, n, n), positive semidefinite.

    power: (3, n, n), N. The result is M − N, but in no direction less than 1 − MAX_NOISE_SHARE of
    M.
    """
    denoised = np.empty_like(equations.M)
    for c, M in enumerate(equations.M):
        root, inverse = _roots(M)
        noise = inverse @ power[c] @ inverse.T
        with one_thread() if len(M) <= SMALL_MATRIX else nullcontext():
            excess = excess_above(noise, MAX_NOISE_SHARE)
        denoised[c] = M - root @ (noise if excess is None else noise - excess) @ root.T
    return denoised


def eigh(M: Doubles) -> tuple[Doubles, Doubles]:
    """Return eigenvalues and vectors; small matrices on one thread, which is faster."""
    with one_thread() if len(M) <= SMALL_MATRIX else nullcontext():
        return eigenvectors(M)


def pseudo_inverse(M: Doubles) -> Doubles:
    """Return the pseudo-inverse of a positive semidefinite matrix, whatever the scales of its
    unknowns.
    """
    _, inverse = _roots(M)
    return np.asarray(inverse.T @ inverse)


def _roots(M: Doubles) -> tuple[Doubles, Doubles]:
    """Return R with R Rᵀ = M and its pseudo-inverse, without the directions that change nothing."""
    # Less the power of its noise, the power of a very dim light may be negative.
    scale = np.sqrt(np.maximum(np.diag(M), 0))
    safe = np.where(scale > 0, scale, 1)
    scaled = M / safe[:, None] / safe
    if len(M) > SMALL_MATRIX and (factor := _regular_factor(scaled)) is not None:
        root, inverse = factor
        return safe[:, None] * root, inverse / safe
    values, vectors = eigh(scaled)
    is_regular = values > NULL_EIGENVALUE * values.max(initial=0)
    root = np.sqrt(values[is_regular])
    inverse = (vectors[:, is_regular] / root).T / safe
    return np.asarray(safe[:, None] * vectors[:, is_regular] * root), np.asarray(inverse)


def _regular_factor(M: Doubles) -> tuple[Doubles, Doubles] | None:
    """Return the Cholesky factor of a matrix that is well regular, and its inverse, in a part of
    the time of eigenvectors; else None.
    """
    lapack, _ = large_libraries()
    # The transpose is the same matrix in the order of LAPACK.
    factor, failed = lapack.dpotrf(M.T, lower=1, clean=1)
    if failed:
        return None
    inverse, failed = lapack.dtrtri(factor, lower=1)
    # The sum of squares is at least 1 over the least eigenvalue.
    if failed or np.vdot(inverse, inverse) > 1 / REGULAR_EIGENVALUE:
        return None
    return np.asarray(factor), np.asarray(inverse)
