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

from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass
from typing import Any

import numpy as np

from lightpaint.arrays import Bools, Doubles, Floats, Indices
from lightpaint.basis import BLOCK_PIXELS, FEW_LIGHTS, Planes, Rooms, as_slice, blocks_of
from lightpaint.lighting.algebra.symmetric_matrices import (
    SMALL_MATRIX,
    eigenvectors,
    excess_above,
    large_libraries,
)
from lightpaint.lighting.analysis.noise.dominant_pixels import t_ratios
from lightpaint.lighting.analysis.noise.noise_rows import (
    UNCORRECTED,
    ChannelPixels,
    LitPairs,
    NoiseSums,
    RowsOf,
    dense_rows,
    factor,
    folded,
)
from lightpaint.lighting.analysis.noise.residuals import PixelGradients, Residuals
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.problem import Problem
from lightpaint.lighting.solution import Solution
from lightpaint.progress import counting, with_progress
from lightpaint.threads import one_thread, parallel_map

#: The largest share of M, in any direction of the weights, that may be removed as noise. Beyond,
#: the estimate is itself noise, and the rest of M would soon be indefinite.
MAX_NOISE_SHARE = 0.5

#: Fewest lights whose noise is summed in float32.
MIN_SINGLE_LIGHTS = 32

#: Unit of weights that are the radiance of an emitter of one colour.
RADIANCE_UNIT = "W/(m² sr)"

#: Parts of the pixels that are summed in parallel.
PARTS = 4

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


@dataclass(frozen=True)
class Noise:
    """Sums over pixels of products of half differences, per channel.

    power: (3, n, n), N_ij = Σ D h_i h_j, the part of M that is noise. target_noise: (3, n), the
    mean error of b: noise of the current look, where this is a goal, and the noise of squares which
    follow from noisy light (residuals.py).
    doubt: (3, n), an estimate of the error that may be left in target_noise.
    gradient: (3, n, 3, n), covariance of the gradient. objective_error, objective_noise: as in
    `Uncertainty`.
    power_error, least_power: (3, n), standard errors of Σ D h², and the least ‖Φ‖² without noise
    that the light of each alone allows.
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
    power_error: Doubles
    least_power: Doubles
    hidden: Doubles
    freedom: Doubles

    @property
    def widening(self) -> Doubles:
        """(n, 3), ratios of an interval to the interval of a variance which is known.

        1 where `hidden` includes that already.
        """
        return np.where(self.hidden > 0, 1, t_ratios(self.freedom)).T

    @property
    def steady_power(self) -> Doubles:
        """`power` without lights whose noise a few pixels may hide, (3, n, n): there it is known by
        the squares of few half differences.
        """
        steady = self.hidden == 0
        return np.asarray(self.power * steady[:, :, None] * steady[:, None, :])

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
    is_coupled = couples_channels(solution)
    sums = NoiseSums.zeros(len(weights))
    if len(weights) > FEW_LIGHTS:  # channels are summed in parallel, and sums need much room
        pixels.add(counted, sums, is_coupled=is_coupled)
    else:
        # The same parts on every machine, added in order, give the same bits.
        length = BLOCK_PIXELS * max(1, -(-counted.size // (BLOCK_PIXELS * PARTS)))
        parts = [counted[k : k + length] for k in range(0, counted.size, length)]
        blocks = sum(len(blocks_of(pixels.planes, part)) for part in parts)
        with counting(blocks, "blocks") as advance:
            for of_part in parallel_map(
                lambda x: pixels.sums(x, is_coupled=is_coupled, advance=advance), parts
            ):
                sums.add(of_part)
    error, noise, total = np.zeros((3, 3))
    for start in with_progress(range(0, len(weight), BLOCK_PIXELS)):
        part = slice(start, start + BLOCK_PIXELS)
        mixed = residuals.noise(part)
        error += np.square(weight[part] * residuals.residual(part) * mixed).sum(axis=0)
        noise += (weight[part] * np.square(mixed)).sum(axis=0)
        total += weight[part].sum(axis=0, dtype=np.float64)
    second = np.einsum("cici->ci", sums.gradient)
    return Noise(
        power=sums.power,
        target_noise=sums.target_noise,
        doubt=sums.doubt,
        gradient=sums.gradient,
        objective_error=2 * np.sqrt(error),
        objective_noise=noise,
        power_error=sums.power_error,
        least_power=sums.least_power(total),
        hidden=np.array([peaks.hidden() for peaks in sums.peaks]),
        freedom=np.square(second) / np.where(sums.fourth > 0, sums.fourth, np.nan),
    )


def couples_channels(solution: Solution) -> bool:
    """Return whether a dimmer, a tie, a limit on luminance, or the one weight of a scalar light
    couples channels.
    """
    return len(solution.problem.full.channel_groups) < 3


@dataclass(frozen=True)
class NoisyPixels:
    """Data of all pixels of a solution, from which the noise in its gradient follows.

    planes, noise: of the basis. is_radiance: (n,), whether weights are radiances. samples: per
    pixel. weights: (n, 3). weight, share: (p, 1) or (p, 3). unseen: (p,),
    where no emitter is. counted: the pixels that count. pulled: (n, 3), by how much noise moves the
    pull on the weights. gradients: of the loss by the light of each pixel. own_share: as
    the function of this name returns it.
    """

    planes: Planes
    noise: Planes
    is_radiance: Bools
    samples: float
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
        of_lights = np.array([light.unit == RADIANCE_UNIT for light in basis.lights])
        planes = basis.planes, basis.noise, of_lights, basis.origin.spp
        return cls(*planes, weights, weight, share, residuals, unseen, counted, pulled, *of_pixels)

    def gradient_noise(self, pixels: slice | Indices) -> Doubles:
        """Return the half differences of the gradient that some pixels make by their own samples
        alone, (3, n, pixels).
        """
        missed, rows_of = self.residuals.residual(pixels), self._rows_of(pixels)
        # One by one, pixels show their own noise; in sums none is multiplied by itself.
        channels = [self._channel(pixels, missed, c, own_share=1.0) for c in range(3)]
        shape = len(self.weights), len(missed)
        return np.stack([rows_of(x, None, np.empty(shape, x.D.dtype)) for x in channels])

    @property
    def _kind(self) -> Any:
        """Type of the noise of pixels: of some lights in half floats float32, in half the time. The
        round-off of its sums is far below what half differences determine.
        """
        is_exact = len(self.weights) < MIN_SINGLE_LIGHTS or not self.planes.is_noisy
        return np.float64 if is_exact else np.float32

    def sums(self, counted: Indices, *, is_coupled: bool, advance: Callable[[], None]) -> NoiseSums:
        """Sum over some pixels. advance: called after each block of them."""
        sums = NoiseSums.zeros(len(self.weights))
        self.add(counted, sums, is_coupled=is_coupled, advance=advance)
        return sums

    def add(
        self,
        counted: Indices,
        sums: NoiseSums,
        *,
        is_coupled: bool,
        advance: Callable[[], None] = lambda: None,
    ) -> None:
        """Add some pixels to sums. advance: see `sums`."""
        n, blocks = len(self.weights), blocks_of(self.planes, counted)
        length = max((block.size for block in blocks), default=0)
        rooms = Rooms(n, n * length, self._kind, are_kept=is_coupled)
        with one_thread():
            for block in with_progress(blocks):
                self._add_block(as_slice(block), sums, rooms, is_coupled=is_coupled)
                advance()

    def _add_block(
        self, pixels: slice | Indices, sums: NoiseSums, rooms: Rooms, *, is_coupled: bool
    ) -> None:
        """Add some pixels to sums."""
        rows_of, missed = self._rows_of(pixels), self.residuals.residual(pixels)
        rows = [np.empty((0, 0))] * 3

        def add(c: int) -> None:
            room = rooms.array(c, (len(self.weights), len(missed)))
            rows[c] = folded(rows_of(self._channel(pixels, missed, c), sums, room))
            sums.gradient[c, :, c] += rows[c] @ rows[c].T

        rooms.each_channel(add)
        if is_coupled:
            # One path carries all three channels, so their noise goes together.
            for c, d in with_progress(((0, 1), (0, 2), (1, 2))):
                product = rows[c] @ rows[d].T
                sums.gradient[c, :, d] += product
                sums.gradient[d, :, c] += product.T

    def _channel(
        self, pixels: slice | Indices, missed: Doubles, c: int, *, own_share: float | None = None
    ) -> ChannelPixels:
        """Return what some pixels of a channel share for all lights.

        missed: (pixels, 3), the residual. own_share: as of the pixels, by default.
        """
        kind = self._kind
        own, of_pixels = self.own_share if own_share is None else own_share, self.gradients
        D = self.weight[pixels, c % self.weight.shape[1]].astype(kind)
        mean, half = (x[pixels, c].astype(kind) for x in (of_pixels.mean, of_pixels.half))
        of_noise, of_light, doubt = None, None, np.zeros_like(D)
        if of_pixels.bend is not None and of_pixels.doubt is not None:
            mixed = self.residuals.half[pixels, c].astype(kind)
            of_noise = D * mixed + half
            of_light, doubt = (x[pixels, c].astype(kind) for x in (of_pixels.bend, of_pixels.doubt))
        else:
            of_target = self._target_noise(pixels, c)
            of_noise = None if of_target is None else (D * of_target).astype(kind)
        return ChannelPixels(
            c=c,
            D=D,
            half=half,
            mean=factor(mean, half, own),
            missing=np.abs(missed[:, c].astype(kind)),
            unseen=self.unseen[pixels],
            weights=self.weights[:, c].astype(kind),
            pulled=self.pulled[:, c].astype(kind),
            is_radiance=self.is_radiance,
            samples=self.samples,
            has_pull=bool(self.pulled.any()),
            own_share=own,
            of_noise=of_noise,
            of_light=of_light,
            doubt=doubt,
        )

    def _target_noise(self, pixels: slice | Indices, c: int) -> Doubles | None:
        """Return the half differences of a channel of Ψ at some pixels, (p,); None without any."""
        residuals, noise = self.residuals, None
        if residuals.current is not None:
            noise = self.share[pixels, c % self.share.shape[1]] * residuals.current[pixels, c]
        if residuals.unfiltered is not None:
            unfiltered = residuals.unfiltered[pixels, c]
            noise = unfiltered if noise is None else noise + unfiltered
        return None if noise is None else np.asarray(noise, np.float64)

    def _rows_of(self, pixels: slice | Indices) -> RowsOf:
        """Return the function for the rows of a channel of some pixels: of their lit ones alone,
        where the planes know these.
        """
        noise, light = (x.lit_entries(pixels) for x in (self.noise, self.planes))
        if noise is not None and light is not None:
            return LitPairs.of(noise, light).rows
        halves, images = self.noise.pixels(pixels), self.planes.pixels(pixels)

        def rows(pixels: ChannelPixels, sums: NoiseSums | None, room: Doubles) -> Doubles:
            return dense_rows(pixels, halves[..., pixels.c], images[..., pixels.c], sums, room)

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
    for c in with_progress(range(3), "channels"):
        M = equations.M[c]
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
