"""A solve written out as rows of a matrix, for other solvers to answer."""

from typing import Any

import numpy as np

from lightpaint.target.target import Target


def stacked(basis: Any, target: Target) -> tuple[Any, Any]:
    """(pixels · 3, n · 3) matrix A and vector y with the objective ‖A w − y‖²."""
    n = len(basis.lights)
    root = np.sqrt(target.importance.astype(np.float64)).ravel()
    A = np.zeros((3, root.size, n, 3))
    for c in range(3):
        A[c, :, :, c] = (basis.images[..., c].reshape(n, -1).astype(np.float64) * root).T
    y = np.stack([target.image[..., c].ravel() * root for c in range(3)])
    return A.reshape(3 * root.size, 3 * n), y.ravel()
