"""What the half differences of a basis say of its normal equations, and of a prediction.

The two halves of the samples give two gradients of the objective at the solved weights. Half
their difference, pixel by pixel, has the covariance of the gradient's noise (docs/method.md,
"How sure").
"""

from contextlib import nullcontext
from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import Bools, Doubles
from lightpaint.basis.basis import mix
from lightpaint.lighting.analysis.peaks import Peaks
from lightpaint.lighting.normal_equations import BLOCK, FEW_LIGHTS, NormalEquations
from lightpaint.lighting.solution import Solution
from lightpaint.threads import one_thread

#: The largest part of M, in any direction of the weights, that is taken to be noise. Beyond,
#: the estimate of it is itself noise, and what is left of M would soon be indefinite.
LARGEST_NOISE = 0.5

#: Rows of matrices that several threads only wait for.
SMALL = 256

#: Eigenvalues of M, scaled to a unit diagonal, below which a direction changes no pixel.
SINGULAR = 1e-12


@dataclass(frozen=True)
class Noise:
    """Sums over pixels of products of half differences, per channel.

    power: (3, n, n), N_ij = Σ D h_i h_j, what the noise adds to M. drawn: (3, n), what the
    noise of the current look, where that is solved for, adds to b.
    gradient: (3, n, 3, n), covariance of the gradient. objective: as in `Uncertainty`.
    hidden: (3, n), what few pixels may add to a light's own, that they do not show (peaks.py).
    """

    power: Doubles
    drawn: Doubles
    gradient: Doubles
    objective_error: Doubles
    objective_noise: Doubles
    hidden: Doubles

    @property
    def is_hidden(self) -> Bools:
        """(n, 3), whether most of what pushes a light is what few pixels may hide."""
        return np.asarray(self.hidden > np.einsum("cici->ci", self.gradient)).T

    @property
    def whole(self) -> Doubles:
        """(3, n, 3, n), covariance of the gradient with what is hidden."""
        made, lights = self.gradient.copy(), np.arange(self.hidden.shape[1])
        deviation = np.sqrt(self.hidden)
        # Where channels are coupled, one path carries all three.
        coupled = made.any(axis=(1, 3))
        for c, d in zip(*np.nonzero(coupled), strict=True):
            made[c, lights, d, lights] += deviation[c] * deviation[d]
        return made


def noise_sums(solution: Solution) -> Noise:
    """One pass over the pixels that count."""
    basis, problem, weights = solution.basis, solution.problem, solution.weights
    n = len(weights)
    importance = solution.importance.ravel()
    # (pixels, 1), or (pixels, 3) where channels differ.
    squares = problem.squares
    weight, share = (x.reshape(-1, x.shape[2]) for x in (squares.weight, squares.share))
    residual, mixed = residual_and_noise(solution)
    present = mix(basis.half_differences, basis.present_weights).reshape(-1, 3)
    images, halves = (x.reshape(n, -1, 3) for x in (basis.images, basis.half_differences))
    # A dimmer, a tie or a limit on luminance spans channels, as the one weight of a scalar light.
    is_coupled = len(problem.full.channel_groups) < 3
    power, drawn = np.zeros((3, n, n)), np.zeros((3, n))
    gradient = np.zeros((3, n, 3, n))
    peaks = [Peaks.none(n) for _ in range(3)]
    # The pull, λ ‖Φᵢ‖² (presentᵢ − wᵢ), is as noisy as the images that it is measured by: of a
    # pixel it adds Φᵢ hᵢ times this.
    pulled = 2 * problem.pull_strength * (basis.present_weights - weights)
    unseen = ~basis.emitters_seen.ravel()
    counted = np.flatnonzero((importance > 0) | (unseen & pulled.any()))
    # Threads would wait for each other at small blocks, longer than they work.
    with one_thread() if n <= FEW_LIGHTS else nullcontext():
        for start in range(0, counted.size, BLOCK):
            its = counted[start : start + BLOCK]
            # Pixels in one run are looked at where they are; others have to be gathered.
            in_one_run = its[-1] - its[0] + 1 == its.size
            pixels = slice(int(its[0]), int(its[-1]) + 1) if in_one_run else its
            rows = []
            for c in range(3):
                D = weight[pixels, c % weight.shape[1]].astype(np.float64)
                h = halves[:, pixels, c].astype(np.float64)
                lit = images[:, pixels, c].astype(np.float64)
                rows.append(D * (h * residual[pixels, c] - lit * mixed[pixels, c]))
                size = np.abs(residual[pixels, c]) + weights[:, c, None] * lit
                peaks[c].see(D * lit * size, rows[c])
                if pulled.any():
                    rows[c] += pulled[:, c, None] * np.where(unseen[pixels], lit, 0) * h
                power[c] += (D * h) @ h.T
                shared = D * share[pixels, c % share.shape[1]]
                drawn[c] += h @ (shared * present[pixels, c])
                gradient[c, :, c] += rows[c] @ rows[c].T
            if is_coupled:
                # One path carries all three channels, so their noise goes together.
                for c, d in ((0, 1), (0, 2), (1, 2)):
                    product = rows[c] @ rows[d].T
                    gradient[c, :, d] += product
                    gradient[d, :, c] += product.T
    return Noise(
        power,
        drawn,
        gradient,
        objective_error=2 * np.sqrt(np.square(weight * residual * mixed).sum(axis=0)),
        objective_noise=(weight * np.square(mixed)).sum(axis=0),
        hidden=np.array([its.hidden() for its in peaks]),
    )


def residual_and_noise(solution: Solution) -> tuple[Doubles, Doubles]:
    """What the answer misses, and half the difference of what its two halves predict.

    Returns two (pixels, 3): Ψ − Σ w_i Φ_i and Σ w_i h_i, less the noise that Ψ shares where
    it holds the current look.
    """
    basis, weights, r = solution.basis, solution.weights, solution.problem.refinement
    residual = solution.image.astype(np.float64) - basis.mix(weights)
    if r is not None:
        noise = r.noise + mix(basis.half_differences, weights - r.before)
    else:
        noise = mix(basis.half_differences, weights).astype(np.float64)
        present = mix(basis.half_differences, basis.present_weights)
        noise = noise - solution.problem.squares.share * present
    return residual.reshape(-1, 3), np.asarray(noise, np.float64).reshape(-1, 3)


def lacking_gradient(solution: Solution, noise: Noise) -> tuple[Doubles, Doubles]:
    """Some weights, (n, 3), and what noise made b − M w lack there on average, (3, n)."""
    removed, r = solution.problem.noise_removed, solution.problem.refinement
    if r is not None:
        return r.before, r.lacking
    n = noise.power.shape[1]
    # At no light at all the noise of the basis lacks nothing in M: all of it is still to come.
    nothing = np.zeros((n, 3))
    if removed == 0:
        return nothing, -noise.drawn
    weights = solution.weights
    lack = np.einsum("cij,jc->ci", noise.power, weights) - noise.drawn
    return weights, (1 - removed) * lack


def without_noise(
    equations: NormalEquations, power: Doubles, *, most: float = LARGEST_NOISE
) -> Doubles:
    """M without the noise in it, (3, n, n), positive semidefinite.

    power: (3, n, n), N. M − N, but in no direction less than 1 − `most` of M.
    """
    made = np.empty_like(equations.M)
    for c in range(3):
        root, inverse = _roots(equations.M[c])
        values, vectors = eigh(inverse @ power[c] @ inverse.T)
        values = np.clip(values, 0, most)
        made[c] = equations.M[c] - root @ ((vectors * values) @ vectors.T) @ root.T
    return made


def eigh(M: Doubles) -> tuple[Doubles, Doubles]:
    """Eigenvalues and vectors; of small matrices by one thread, which is done before two meet."""
    with one_thread() if len(M) <= SMALL else nullcontext():
        values, vectors = np.linalg.eigh(M)
    return values, vectors


def pseudo_inverse(M: Doubles) -> Doubles:
    """Of a positive semidefinite matrix, whatever the sizes of its unknowns."""
    _, inverse = _roots(M)
    return np.asarray(inverse.T @ inverse)


def _roots(M: Doubles) -> tuple[Doubles, Doubles]:
    """R with R Rᵀ = M and its pseudo-inverse, without the directions that change nothing."""
    scale = np.sqrt(np.diag(M))
    safe = np.where(scale > 0, scale, 1)
    values, vectors = eigh(M / safe[:, None] / safe)
    seen = values > SINGULAR * values.max(initial=0)
    root = np.sqrt(values[seen])
    inverse = (vectors[:, seen] / root).T / safe
    return np.asarray(safe[:, None] * vectors[:, seen] * root), np.asarray(inverse)
