"""Solves without a share of the basis's noise power, of many lights on smooth indirect light.

The more lights share the samples, the noisier each plane is, and the more of M is noise, whose bias
and variance then decide the answer. An average over 5 x 5 pixels (`SurfaceFilter`) removes most of
both and changes the sums little. It is linear and the same for both halves, so the noise left in M
is the sum of averaged half differences.

The weight of the average in a pixel follows from the noise of all lights together and from the
change beyond it: t = V / (V + B), as for pictures. So with more samples the sums converge to the
sums of the basis, and reflections or caustics are kept once they are clean.
"""

from collections.abc import Sequence
from dataclasses import replace
from weakref import WeakKeyDictionary

import numpy as np

from lightpaint.arrays import Doubles, Floats
from lightpaint.basis import Basis, Planes, as_planes
from lightpaint.errors import BasisError, LightpaintError
from lightpaint.images import SurfaceFilter, box_mean
from lightpaint.keywords import keywords
from lightpaint.lighting.analysis.noise.noise import (
    Noise,
    denoised_matrix,
    noise_sums,
    pseudo_inverse,
)
from lightpaint.lighting.analysis.noise.weight_directions import (
    free_directions,
    solve_for,
)
from lightpaint.lighting.joined_views import joint_basis
from lightpaint.lighting.normal_equations import NormalEquations, block_diagonal
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.solver import solve_again
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
        squares = np.square(half, dtype=np.float64).mean(axis=-1)
        # Each light counts alike, by its noise.
        unit = 1 / max(float(squares.mean()), np.finfo(np.float64).tiny)
        variance += unit * squares
        remainder += unit * np.square(of_half, dtype=np.float64).mean(axis=-1)
        change += unit * np.square(of_plane, dtype=np.float64).mean(axis=-1)
    V, B = (box_mean(x, WINDOW_RADIUS) for x in (variance, change - remainder))
    total = V + np.maximum(B, 0)
    share = np.divide(V, total, out=np.zeros_like(total), where=total > 0)
    return share[..., None].astype(np.float32)


@keywords()
def correct_noise(solution: Solution, *, share: float | None = None) -> Solution:
    """Solve the equations without a share of the noise power in M and b.

    With many lights, the equations use light averaged along surfaces.
    A fit of blocks of pixels has already averaged most of the noise; its solution stays as it is.
    If squares stand for another loss, the share is lowered until this loss falls, too: far from the
    answer the squares do not represent it.

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
    noise, e = noise_sums(solution, removed=1), solution.equations
    if share is None and _has_noise_of_target(solution, noise):
        return _solved(solution, e, 0.0)
    base = e
    if can_smooth(solution.problem.views.bases):
        smooth = on_smooth_light(solution)
        base, noise = smooth.equations, noise_sums(smooth, removed=1)
    least = denoised_matrix(base, noise.power)
    if share is None:
        share = _best_share(solution, base, noise, least)
    while share > 0:
        M, b = (1 - share) * base.M + share * least, base.b - share * noise.target_noise
        corrected = _solved(solution, NormalEquations(M, b, e.target_norm2), share)
        subtracted = NormalEquations(e.M - M, e.b - b, np.zeros(3))
        if solution.problem.is_linear or _loss(corrected, subtracted) <= _loss(
            solution, subtracted
        ):
            return corrected
        share = share / 2 if share > 1 / SHARE_STEPS else 0.0
    return _solved(solution, e, 0.0)


def _solved(solution: Solution, corrected: NormalEquations, share: float) -> Solution:
    """Return the solution of equations without a share of the noise."""
    problem = replace(solution.problem, corrected=corrected, noise_removed=share)
    return solve_again(solution, problem)


def _has_noise_of_target(solution: Solution, noise: Noise) -> bool:
    """Return True for a target that is a sum of this basis, as a template is."""
    objective = solution.equations.objective(solution.weights).sum()
    return bool(objective < SAME_NOISE_SHARE * noise.objective_noise.sum())


def _loss(solution: Solution, removed: NormalEquations) -> float:
    """Return the error of a solution with its pull, less the removed noise."""
    pull, weights = solution.problem.pull, solution.weights
    pulled = 0.0 if pull is None else float(pull.objective(weights).sum())
    # As `NormalEquations.objective`, which would not allow a negative result.
    noise = (
        np.einsum("ic,cij,jc->", weights, removed.M, weights) - 2 * (removed.b.T * weights).sum()
    )
    return sum(solution.certificate.objective) + pulled - float(noise)


def _best_share(
    solution: Solution, equations: NormalEquations, noise: Noise, least: Doubles
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
            inverse = pseudo_inverse((1 - s) * M + s * noiseless + stiff)
            cost[k] += np.einsum("ij,ji->", M, inverse @ C @ inverse)
    return float(shares[np.argmin(cost)])
