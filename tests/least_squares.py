"""A solve written out as rows of a matrix, for other solvers to answer."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from lightpaint.basis.planes import MemoryPlanes
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.unknowns.knobs import Knob
from lightpaint.lighting.unknowns.reduced_problem import ReducedOptimum, solve_reduced
from lightpaint.lighting.unknowns.reduction import Reduction
from lightpaint.target.painted_target import Target


def inner_products(images: Any, target: Any, importance: Any) -> tuple[Any, Any, Any]:
    """M (3, n, n), b (3, n) and ‖Ψ‖² (3,) of images (n, h, w, 3) and a target (h, w, 3)."""
    return MemoryPlanes(images).sums(importance, target)


def stack_rows(basis: Any, target: Target) -> tuple[Any, Any]:
    """(pixels · 3, n · 3) matrix A and vector y with the objective ‖A w − y‖²."""
    n = len(basis.lights)
    root = np.sqrt(target.importance.astype(np.float64)).ravel()
    A = np.zeros((3, root.size, n, 3))
    for c in range(3):
        A[c, :, :, c] = (basis.images[..., c].reshape(n, -1).astype(np.float64) * root).T
    y = np.stack([target.image[..., c].ravel() * root for c in range(3)])
    return A.reshape(3 * root.size, 3 * n), y.ravel()


def solve_free(
    equations: NormalEquations, start: Any, *, is_scalar: Sequence[bool] = (), **options: Any
) -> ReducedOptimum:
    """The optimum of lights of which nothing is asked; some may have one weight for all channels.

    start: (n, 3). how: as `solve_reduced` takes it.
    """
    n = len(start)
    scalar = is_scalar or [False] * n
    knobs = tuple(Knob.of_any_colour(k, is_scalar=scalar[k]) for k in range(n))
    return solve_reduced(equations, Reduction(np.zeros((n, 3)), ("",) * n, knobs), start, **options)
