"""Better answers in spite of the noise of the basis, which biases M and with it the weights: a
Newton step by an independent render, and a solve without a share of that noise.

A render V of the mix at the current weights has noise of its own, which is independent of the
basis, so ⟨Φ, Ψ − V⟩ is the gradient without that bias; the noisy M only determines the length of
the step. V may be noisier than the basis, which is rendered with more care than a plain picture:
the half differences of both determine the weight of V.

The more lights share the samples, the noisier each plane is, and the more of M is noise, whose bias
and variance then decide the answer. On smooth indirect light, an average over 5 x 5 pixels
(`SurfaceFilter`) removes most of both and changes the sums little. It is linear and the same for
both halves, so the noise left in M is the sum of averaged half differences.

The weight of the average in a pixel follows from the noise of all lights together and from the
change beyond it: t = V / (V + B), as for pictures. So with more samples the sums converge to the
sums of the basis, and reflections or caustics are kept once they are clean.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self
from weakref import WeakKeyDictionary

import numpy as np

from lightpaint.arrays import Doubles, Floats, mean_square
from lightpaint.basis import Basis, Planes, as_planes, walked_blocks
from lightpaint.errors import BasisError, LightpaintError, SizeError
from lightpaint.images import Estimate, SurfaceFilter, box_mean
from lightpaint.keywords import keywords
from lightpaint.lighting.analysis.noise import basis_noise
from lightpaint.lighting.analysis.noise.residuals import Residuals
from lightpaint.lighting.analysis.noise.weight_directions import free_directions, solve_for
from lightpaint.lighting.joined_views import joint_basis
from lightpaint.lighting.loss.lit_pixels import LitPixels
from lightpaint.lighting.normal_equations import NormalEquations, block_diagonal
from lightpaint.lighting.problem import Refinement
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.solver import solve_again
from lightpaint.progress import with_progress
from lightpaint.sentences import Hint

#: Fewest lights for which sums use averaged light: with a dozen, the basis itself is as good.
MIN_LIGHTS = 64

#: Pixels on either side that light is averaged over.
FILTER_RADIUS = 2

#: Pixels on either side over which noise and change are compared.
WINDOW_RADIUS = 3

#: Maximum number of bytes of the averaged planes and of their noise.
MAX_BYTES = 2**29

#: Error, as a share of what the prediction's noise alone adds, below which a target counts as a sum
#: of the basis itself: the noise of both is then the same, and cancels.
SAME_NOISE_SHARE = 1e-4

#: Steps of the share of noise to remove from M.
SHARE_STEPS = 8

#: Largest number of pixels over which the loss without noise is compared.
MAX_PIXELS = 2**16


@keywords()
def refine(solution: Solution, mixed: Estimate) -> Solution:
    """Improve a solution by one step from its weights w.

    It minimises (w' − w)ᵀM(w' − w) − 2 gᵀ(w' − w) over w' >= 0, with
    g = t ⟨Φ, Ψ − V⟩ + (1 − t)(b − M w), of the render of the mix and of the solved equations.

    Args:
        solution: Of one view or of several.
        mixed: V, a render of the scene under solution.lighting, of the size of the basis, with
            random numbers that the basis does not use.

    Raises:
        SizeError: If it has another size.
        BasisError: If the noise of the basis is unknown, and with it the weight of the render.

    Examples:
        >>> scene = lp.load_scene("room.xml")
        >>> solution = lp.solve(basis, target)
        >>> relit = lp.relight(scene, solution.lighting, "relit.xml")
        >>> mixed = lp.verify(lp.combine(basis, solution.lighting), relit, spp=4).verified
        >>> 0 <= lp.refine(solution, mixed).problem.refinement.share <= 1
        True
    """
    basis, problem, w = solution.basis, solution.problem, solution.weights
    if not basis.knows_noise:
        raise BasisError(
            f"the noise of {basis.origin.scene} is unknown, so a render of the mix cannot be "
            "weighed against it: use ",
            Hint("refine", 0),
        )
    if mixed.size != basis.size:
        raise SizeError(
            f"the render of the mix is {mixed.size[1]}x{mixed.size[0]} but the basis is "
            f"{basis.size[1]}x{basis.size[0]}: render it on the film of the basis"
        )
    missed = solution.image.astype(np.float64) - mixed.image
    _, rendered, _ = basis.planes.sums(solution.weight, missed)
    M = problem.solved.M
    basis_residual = problem.solved.b - np.einsum("cij,jc->ci", M, w)

    sums = basis_noise.noise_sums(solution)
    noisy_weights, lacking = basis_noise.gradient_bias(solution, sums)
    # The error of the gradient there, and the error by the noise in M on the way here.
    remains = 1 - problem.noise_removed
    lacking = lacking + remains * np.einsum("cij,jc->ci", sums.power, w - noisy_weights)
    noise = Residuals.of(solution).noise(slice(None)).reshape(mixed.image.shape)
    # The render does not change the noise of a painting that is the current look.
    t = _render_share(solution, lacking, noise, mixed.half_difference.astype(np.float64))

    gradient = t * rendered + (1 - t) * basis_residual
    refinement = Refinement(
        before=w,
        noise=t * mixed.half_difference + (1 - t) * noise,
        gradient_error=(1 - t) * lacking,
        share=t,
    )
    right = np.einsum("cij,jc->ci", M, w) + gradient
    corrected = NormalEquations(M, right, problem.equations.target_norm2)
    return solve_again(solution, replace(problem, corrected=corrected, refinement=refinement))


def _render_share(
    solution: Solution, lacking: Doubles, from_basis: Floats, rendered: Floats
) -> float:
    """Return the t that minimises the expected excess (1 − t)² (B + K) + t² R: (B + K) / (B + K +
    R).

    B: excess by the error of the known gradient; K, R: by the noise of the prediction, as known so
    far and as rendered. All are measured by M⁻¹ along free directions.
    """
    bias, spread = 0.0, np.zeros(2)
    M = solution.problem.with_pull(solution.problem.solved).full_matrix
    for directions in free_directions(solution):
        inverse = basis_noise.pseudo_inverse(directions.T @ M @ directions)
        lacks = directions.T @ lacking.ravel()
        bias += float(lacks @ inverse @ lacks)
        for k, noise in enumerate((from_basis, rendered)):
            C = _push_covariance(solution, noise, directions)
            spread[k] += np.einsum("ij,ij->", inverse, C)
    total = bias + spread.sum()
    return float((bias + spread[0]) / total) if total > 0 else 1.0


def _push_covariance(solution: Solution, noise: Floats, directions: Doubles) -> Doubles:
    """Return the covariance (k, k) of the push by a prediction's noise.

    directions: (3 n, k), along which it pushes.
    """
    basis = solution.basis
    n = len(basis.lights)
    along = directions.reshape(3, n, -1)
    noise = noise.reshape(-1, 3)
    weight = solution.weight.reshape(len(noise), -1)
    covariance = np.zeros((directions.shape[1], directions.shape[1]))
    counted = np.flatnonzero(solution.importance)
    for block in with_progress(walked_blocks(basis.planes, counted.size)):
        pixels = counted[block]
        lit, push = basis.planes.pixels(pixels), np.zeros((directions.shape[1], pixels.size))
        for c in np.flatnonzero(along.any(axis=(1, 2))):
            pulls = weight[pixels, c % weight.shape[1]] * noise[pixels, c]
            push += along[c].T @ (lit[..., c] * pulls)
        covariance += push @ push.T
    return covariance


def can_smooth(views: Sequence[Basis]) -> bool:
    """Return True for many lights whose indirect light and surfaces are known, in all views."""
    lights, pixels = len(views[0].lights), sum(basis.emitters_seen.size for basis in views)
    is_known = all(x.indirect is not None and x.surface_filter is not None for x in views)
    return lights >= MIN_LIGHTS and is_known and 2 * 12 * lights * pixels <= MAX_BYTES


def on_smooth_light(solution: Solution) -> Solution:
    """Return the solution with equations and noise of averaged planes, and the same weights."""
    basis, problem = solution.basis, solution.problem
    smooth, _ = joint_basis([_smooth(view) for view in problem.views.bases])
    # A goal that is the current look is averaged alike.
    moved = problem.squares.share * (smooth.current_look - basis.current_look)
    squares = replace(problem.squares, image=problem.squares.image + moved)
    equations = NormalEquations.of(smooth, squares.image, squares.weight)
    return replace(
        solution, problem=replace(problem, basis=smooth, squares=squares, equations=equations)
    )


def _smooth(basis: Basis) -> Basis:
    """Return the basis of a view with averaged planes."""
    if basis.planes not in _averaged:
        _averaged[basis.planes] = _average(basis)
    planes, noise = _averaged[basis.planes]
    return replace(basis, planes=planes, noise=noise, indirect=None)


#: Averaged planes and their noise, by the planes of a basis, as long as these are there.
_averaged: WeakKeyDictionary[Planes, tuple[Planes, Planes]] = WeakKeyDictionary()


def _average(basis: Basis) -> tuple[Planes, Planes]:
    """Return averaged planes and their half differences."""
    assert basis.features is not None
    assert basis.indirect is not None
    along = SurfaceFilter(basis.features, FILTER_RADIUS)
    # The arrays hold the change by the average first, and the averaged planes later.
    changed = [
        np.stack([along(x) - x for x in planes])
        for planes in (basis.indirect.planes, basis.indirect.noise)
    ]
    share = _share(basis.indirect.noise, *changed)
    for values, planes in zip(changed, (basis.planes, basis.noise), strict=True):
        for value, plane in zip(values, planes, strict=True):
            value *= share
            value += plane
    return as_planes(changed[0]), as_planes(changed[1])


def _share(noise: Planes, of_planes: Floats, of_noise: Floats) -> Floats:
    """Return how far each pixel is averaged, (h, w, 1).

    of_planes, of_noise: (n, h, w, 3), by how much the average changes either.
    """
    variance, remainder, change = np.zeros((3, *noise.size))
    for half, of_plane, of_half in zip(noise, of_planes, of_noise, strict=True):
        squares = mean_square(half)
        # Each light counts alike, by its noise.
        unit = 1 / max(float(squares.mean()), np.finfo(np.float64).tiny)
        variance += unit * squares
        remainder += unit * mean_square(of_half)
        change += unit * mean_square(of_plane)
    V, B = (box_mean(x, WINDOW_RADIUS) for x in (variance, change - remainder))
    total = V + np.maximum(B, 0)
    share = np.divide(V, total, out=np.zeros_like(total), where=total > 0)
    return share[..., None].astype(np.float32)


@keywords()
def correct_noise(solution: Solution, *, share: float | None = None) -> Solution:
    """Solve the equations without a share of the noise power in M and b.

    With many lights, the equations use light averaged along surfaces.
    A fit of blocks of pixels has already averaged most of the noise; its solution stays as it is.
    If squares stand for another loss, the share is halved as long as this loss falls, and is 0 if
    it is least without correction: far from the answer the squares do not represent it.

    Args:
        solution: The solution to correct, where the solve starts.
        share: 0 to 1; by default the one with the least expected error of bias and scatter
            together. docs/benchmarks.md has measurements.

    Raises:
        BasisError: If the noise is unknown.

    Examples:
        >>> corrected = lp.correct_noise(lp.solve(basis, target))
        >>> 0 <= corrected.problem.noise_removed <= 1
        True
    """
    if share is not None and not 0 <= share <= 1:
        raise LightpaintError(f"share is {share}: expected a share of the noise, 0 to 1")
    basis = solution.basis
    if not basis.knows_noise:
        raise BasisError(
            f"the noise of {basis.origin.scene} is unknown, so it cannot be corrected: use ",
            Hint("noise_correction", False),
            ", and denoise the layers or render them with more samples",
        )
    if solution.problem.block_side > 1:
        return solution
    noise, e = basis_noise.noise_sums(solution, removed=1), solution.equations
    if share is None and _has_noise_of_target(solution, noise):
        return _solved(solution, e, 0.0)
    base = e
    if can_smooth(solution.problem.views.bases):
        smooth = on_smooth_light(solution)
        base, noise = smooth.equations, basis_noise.noise_sums(smooth, removed=1)
    least = basis_noise.denoised_matrix(base, noise.power)
    if share is None:
        share = _best_share(solution, base, noise, least)

    def corrected_by(share: float) -> Solution:
        M, b = (1 - share) * base.M + share * least, base.b - share * noise.target_noise
        return _solved(solution, NormalEquations(M, b, e.target_norm2), share)

    if solution.problem.is_linear and share > 0:
        return corrected_by(share)
    nearest = _solved(solution, e, 0.0)
    if share == 0:
        return nearest
    loss = NoiselessLoss.of(solution)
    least_loss, last_loss = loss.at(solution.weights), np.inf
    for halvings in range(SHARE_STEPS.bit_length()):
        corrected = corrected_by(share / 2**halvings)
        if (reached := loss.at(corrected.weights)) > last_loss:
            break
        if reached <= least_loss:
            nearest, least_loss = corrected, reached
        last_loss = reached
    return nearest


def _solved(solution: Solution, corrected: NormalEquations, share: float) -> Solution:
    """Return the solution of equations without a share of the noise."""
    problem = replace(solution.problem, corrected=corrected, noise_removed=share)
    return solve_again(solution, problem)


def _has_noise_of_target(solution: Solution, noise: basis_noise.Noise) -> bool:
    """Return True for a target that is a sum of this basis, as a template is."""
    objective = solution.equations.objective(solution.weights).sum()
    return bool(objective < SAME_NOISE_SHARE * noise.objective_noise.sum())


@dataclass(frozen=True)
class NoiselessLoss:
    """The loss of a problem and its pull, without what the noise of the basis adds to it.

    Noise of the light x and of the look C adds to a bent loss what as much noise again would: the
    extrapolation of Cook and Stefanski (1994). With the half differences ν of both,

        F(x, C) − (½ Σ± F(x ± ν_x, C ± ν_C) − F(x, C)).

    lit: of the compared pixels; noise: of these, the half differences of the lights. look,
    look_noise: (3, p). pull: of the weights; None without any.
    """

    lit: LitPixels
    noise: LitPixels
    look: Doubles
    look_noise: Doubles
    pull: NormalEquations | None

    @classmethod
    def of(cls, solution: Solution) -> Self:
        """Choose the pixels of a problem whose loss is not linear, `MAX_PIXELS` or fewer."""
        basis, problem = solution.basis, solution.problem
        counted = np.flatnonzero(problem.loss.importance)
        chosen = counted[:: -(-counted.size // MAX_PIXELS)]
        scale = np.full(chosen.size, counted.size / chosen.size)
        pixels = problem.loss.pixels.subset(chosen).scaled(scale)
        look, look_noise = (
            x.reshape(-1, 3)[chosen].T.astype(np.float64)
            for x in (basis.current_look, basis.current_noise)
        )
        lit, noise = (LitPixels(x.picked(chosen), pixels) for x in (basis.planes, basis.noise))
        return cls(lit, noise, look, look_noise, problem.pull)

    def at(self, weights: Doubles) -> float:
        """Return the loss of weights (n, 3)."""
        light, noise = self.lit.predicted(weights), self.noise.predicted(weights)
        plain, *noisy = (
            float(
                self.lit.pixels.over_look(np.maximum(self.look + sign * self.look_noise, 0))
                .objective(np.maximum(light + sign * noise, 0))
                .sum()
            )
            for sign in (0, 1, -1)
        )
        pulled = 0.0 if self.pull is None else float(self.pull.objective(weights).sum())
        return 2 * plain - sum(noisy) / 2 + pulled


def _best_share(
    solution: Solution, equations: NormalEquations, noise: basis_noise.Noise, least: Doubles
) -> float:
    """Return the share s with the least expected excess of the objective, of SHARE_STEPS steps.

    The remaining bias costs (1 − s)² δᵀMδ, and the scatter costs tr(M Cov(w)), which grows as
    M_s = M − s N becomes smaller. equations: M and b with all noise, least: M without it.
    """
    e, n = equations, len(solution.weights)
    unbiased = NormalEquations(least, e.b - noise.target_noise, noise.objective_noise)
    biased = solution.weights if e is solution.equations else solve_for(solution, e)
    bias = solve_for(solution, unbiased) - biased
    shares = np.linspace(0, 1, SHARE_STEPS + 1)
    cost = np.square(1 - shares) * np.einsum("ic,cij,jc->", bias, e.M, bias)
    # A pull keeps the weights from moving, and is not part of the error.
    pull = solution.problem.pull
    stiffness = np.zeros((3 * n, 3 * n)) if pull is None else pull.full_matrix
    for directions in free_directions(solution):
        M, noiseless, stiff = (
            directions.T @ x @ directions for x in (e.full_matrix, block_diagonal(least), stiffness)
        )
        C = directions.T @ noise.gradient.reshape(3 * n, 3 * n) @ directions
        for k, s in enumerate(shares):
            inverse = basis_noise.pseudo_inverse((1 - s) * M + s * noiseless + stiff)
            cost[k] += np.einsum("ij,ji->", M, inverse @ C @ inverse)
    return float(shares[np.argmin(cost)])
