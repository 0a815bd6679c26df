"""Symmetric matrices: eigenvectors and products, which an interrupt need not wait for; and SciPy's
LAPACK and BLAS, where unknowns are many.
"""

from functools import cache
from typing import Any

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.threads import find_loaded_libraries, run_apart

#: Maximum number of rows of a matrix that takes less than a second.
QUICK_MATRIX = 1024

#: Maximum number of rows of a matrix for which several threads only wait for each other, and some
#: eigenvectors take as long as all.
SMALL_MATRIX = 256


@cache
def large_libraries() -> tuple[Any, Any]:
    """Return SciPy's LAPACK and BLAS, loaded where unknowns are many; `one_thread` limits them
    from then on.
    """
    from scipy.linalg import blas, lapack

    find_loaded_libraries()
    return lapack, blas


def eigenvectors(M: Doubles) -> tuple[Doubles, Doubles]:
    """Return eigenvalues (n,), in ascending order, and vectors (n, n) of a symmetric matrix M."""
    values, vectors = np.linalg.eigh(M) if len(M) <= QUICK_MATRIX else run_apart(np.linalg.eigh, M)
    return values, vectors


def excess_above(M: Doubles, limit: float) -> Doubles | None:
    """Return Σ (λ − limit) v vᵀ, (n, n), over the eigenvalues λ of a symmetric matrix M that are
    above a limit; None if there is none.
    """
    if _is_below(M, limit):
        return None
    if len(M) <= SMALL_MATRIX:
        values, vectors = eigenvectors(M)
        is_above = values > limit
        values, vectors = values[is_above], vectors[:, is_above]
    else:
        values, vectors = run_apart(_eigenvectors_above, M, limit)
    return np.asarray((vectors * (values - limit)) @ vectors.T) if values.size else None


def _eigenvectors_above(M: Doubles, limit: float) -> tuple[Doubles, Doubles]:
    large_libraries()
    from scipy.linalg import eigh

    values, vectors = eigh(M, subset_by_value=(limit, np.inf), check_finite=False)
    return values, vectors


def sandwich(A: Doubles, B: Doubles) -> Doubles:
    """Return A B A, of matrices (n, n)."""
    return _sandwich(A, B) if len(A) <= QUICK_MATRIX else run_apart(_sandwich, A, B)


def _sandwich(A: Doubles, B: Doubles) -> Doubles:
    return np.asarray(A @ B @ A)


def _is_below(M: Doubles, limit: float) -> bool:
    """Return whether all eigenvalues are below a limit, in a small part of the time."""
    try:
        np.linalg.cholesky(limit * np.eye(len(M)) - M)
    except np.linalg.LinAlgError:
        return False
    return True
