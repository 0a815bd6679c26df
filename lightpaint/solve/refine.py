"""A better answer from an independent render of the present one: a Newton step.

The noise of the basis biases M and with it the weights. A render V of the mix at the present
weights has noise of its own, which is independent of the basis, so ⟨Φ, Ψ − V⟩ is the gradient
without that bias; the noisy M only decides how far to go. V may well be noisier than the basis,
which is rendered with more care than a plain picture: how much of it to believe is decided by
what the half differences of both say.
"""

from dataclasses import replace

import numpy as np

from lightpaint.basis.basis import Basis
from lightpaint.errors import BasisError, SizeError
from lightpaint.images.estimate import Estimate
from lightpaint.images.exr import Floats
from lightpaint.solve.normal_equations import Doubles, NormalEquations, inner_products
from lightpaint.solve.solve import Refinement, Solution, solution_of
from lightpaint.solve.uncertainty import (
    lacking_gradient,
    noise_sums,
    pseudo_inverse,
    residual_and_noise,
)


def refine(basis: Basis, solution: Solution, mixed: Estimate) -> Solution:
    """One step from the weights w: minimise (w' − w)ᵀM(w' − w) − 2 gᵀ(w' − w) over w' >= 0.

    g = t ⟨Φ, Ψ − V⟩ + (1 − t)(b − M w), of the render of the mix and of what was solved.
    mixed: V, a render of the scene under solution.lighting, of the size of the basis, with
    random numbers that the basis does not use.

    Raises SizeError if it has another size, BasisError where nothing is known of the basis' noise:
    then nothing says how much of the render to believe.
    """
    if not basis.knows_noise:
        raise BasisError(
            f"{basis.origin.scene} says nothing of its noise, so that a render of the mix cannot "
            "be weighed against it: leave --refine out"
        )
    if mixed.size != basis.size:
        raise SizeError(
            f"the render of the mix is {mixed.size[1]}x{mixed.size[0]} but the basis is "
            f"{basis.size[1]}x{basis.size[0]}: render it on the film of the basis"
        )
    w = solution.lighting.weights_for(basis)
    missed = solution.image.astype(np.float64) - mixed.image
    _, rendered, _ = inner_products(basis.images, missed, solution.weight)
    M = solution.solved.M
    known = solution.solved.b - np.einsum("cij,jc->ci", M, w)

    sums = noise_sums(basis, solution, w)
    before, lacking = lacking_gradient(solution, sums)
    # What the gradient lacked there, and what the noise in M makes it lack on the way here.
    remains = 1 - solution.noise_removed
    lacking = lacking + remains * np.einsum("cij,jc->ci", sums.power, w - before)
    _, noise = residual_and_noise(basis, solution, w)
    noise = noise.reshape(mixed.image.shape)
    # The painting's own noise, where it holds the current look, is not the render's to change.
    t = _share(basis, solution, lacking, noise, mixed.half_difference.astype(np.float64))

    gradient = t * rendered + (1 - t) * known
    refinement = Refinement(
        before=w,
        noise=t * mixed.half_difference + (1 - t) * noise,
        lacking=(1 - t) * lacking,
        share=t,
    )
    right = np.einsum("cij,jc->ci", M, w) + gradient
    problem = replace(
        solution,
        solved=NormalEquations(M, right, solution.equations.target_norm2),
        refinement=refinement,
    )
    return solution_of(basis, problem, start=w)


def _share(
    basis: Basis, solution: Solution, lacking: Doubles, known: Floats, rendered: Floats
) -> float:
    """The t that makes the expected excess (1 − t)² (B + K) + t² R least: (B + K) / (B + K + R).

    B: excess by what is lacking in the known gradient; K, R: by the noise of the prediction,
    as known so far and as rendered. All measured by M⁻¹ among the lights that are on.
    """
    weights = solution.lighting.weights_for(basis)
    squared = np.square(solution.weight, dtype=np.float64)
    bias, spread = 0.0, np.zeros(2)
    for c in range(3):
        on = np.flatnonzero((weights[:, c] > 0) & ~basis.is_fixed)
        inverse = pseudo_inverse(solution.solved.M[c][np.ix_(on, on)])
        bias += float(lacking[c, on] @ inverse @ lacking[c, on])
        for k, noise in enumerate((known, rendered)):
            weighted = squared[..., c % squared.shape[2]] * np.square(noise[..., c])
            gram, _, _ = inner_products(basis.images[on], solution.image, weighted)
            spread[k] += np.einsum("ij,ij->", inverse, gram[c])
    total = bias + spread.sum()
    return float((bias + spread[0]) / total) if total > 0 else 1.0
