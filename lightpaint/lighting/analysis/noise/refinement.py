"""A better answer from an independent render of the current one: a Newton step.

The noise of the basis biases M and with it the weights. A render V of the mix at the current
weights has noise of its own, which is independent of the basis, so ⟨Φ, Ψ − V⟩ is the gradient
without that bias; the noisy M only determines the length of the step. V may be noisier than the
basis, which is rendered with more care than a plain picture: the half differences of both determine
the weight of V.
"""

from dataclasses import replace

import numpy as np

from lightpaint.arrays import Doubles, Floats
from lightpaint.basis import BLOCK_PIXELS
from lightpaint.errors import BasisError, SizeError
from lightpaint.images import Estimate
from lightpaint.keywords import keywords
from lightpaint.lighting.analysis.noise.noise import (
    gradient_bias,
    noise_sums,
    pseudo_inverse,
)
from lightpaint.lighting.analysis.noise.residuals import Residuals
from lightpaint.lighting.analysis.noise.weight_directions import free_directions
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.problem import Refinement
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.solver import solve_again
from lightpaint.progress import with_progress
from lightpaint.sentences import Hint


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

    sums = noise_sums(solution)
    noisy_weights, lacking = gradient_bias(solution, sums)
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
        inverse = pseudo_inverse(directions.T @ M @ directions)
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
    for start in with_progress(range(0, counted.size, BLOCK_PIXELS)):
        pixels = counted[start : start + BLOCK_PIXELS]
        lit, push = basis.planes.pixels(pixels), np.zeros((directions.shape[1], pixels.size))
        for c in np.flatnonzero(along.any(axis=(1, 2))):
            pulls = weight[pixels, c % weight.shape[1]] * noise[pixels, c]
            push += along[c].T @ (lit[..., c] * pulls)
        covariance += push @ push.T
    return covariance
