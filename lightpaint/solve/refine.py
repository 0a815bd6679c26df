"""A better answer from an independent render of the present one: a Newton step.

The noise of the basis biases M and with it the weights. A render V of the mix at the present
weights has noise of its own, which is independent of the basis, so ⟨Φ, Ψ − V⟩ is the gradient
without that bias; the noisy M only decides how far to go.
"""

from dataclasses import replace

import numpy as np

from lightpaint.basis.basis import Basis
from lightpaint.errors import SizeError
from lightpaint.images.estimate import Estimate
from lightpaint.solve.normal_equations import inner_products
from lightpaint.solve.solve import Refinement, Solution, solution_of


def refine(basis: Basis, solution: Solution, mixed: Estimate) -> Solution:
    """One step from `solution`: minimise (w' − w)ᵀM(w' − w) − 2 ⟨Φ, Ψ − V⟩ᵀ(w' − w), w' >= 0.

    mixed: V, a render of the scene under solution.lighting, of the size of the basis, with
    random numbers that the basis does not use. Raises SizeError if it has another size.
    """
    if mixed.size != basis.size:
        raise SizeError(
            f"the render of the mix is {mixed.size[1]}x{mixed.size[0]} but the basis is "
            f"{basis.size[1]}x{basis.size[0]}: render it on the film of the basis"
        )
    before = solution.lighting.weights_for(basis)
    missed = solution.image.astype(np.float64) - mixed.image
    _, gradient, _ = inner_products(basis.images, missed, solution.importance)
    refinement = Refinement(mixed, before, gradient)
    return solution_of(basis, replace(solution, refinement=refinement), start=before)
