"""Symmetric matrices: eigenvectors and products, which an interrupt need not wait for; matrices in
blocks; and SciPy's LAPACK and BLAS, where unknowns are many.
"""

import time
from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np

from lightpaint.arrays import Doubles, Indices
from lightpaint.threads import find_loaded_libraries, run_apart

#: Maximum number of rows of a matrix that takes less than a second.
QUICK_MATRIX = 1024

#: Maximum number of rows of a matrix for which several threads only wait for each other, and some
#: eigenvectors take as long as all.
SMALL_MATRIX = 256


@cache
def large_libraries() -> tuple[Any, Any]:
    """Return SciPy's LAPACK and BLAS, loaded where unknowns are many, on one thread."""
    from scipy.linalg import blas, lapack

    find_loaded_libraries()
    return lapack, blas


class BlockMatrix:
    """A symmetric matrix M, (k, k), that joins unknowns within each of some parts alone.

    parts: places of the unknowns of each part. blocks: the matrix of each.
    """

    def __init__(self, parts: Sequence[Indices], blocks: Sequence[Doubles]) -> None:
        self._parts, self._blocks = tuple(parts), tuple(blocks)
        self._k = sum(part.size for part in self._parts)

    @classmethod
    def of(cls, M: Doubles, parts: Sequence[Indices] = ()) -> "BlockMatrix":
        """Return the blocks of M. Without parts, M is one."""
        if len(parts) < 2:
            return cls([np.arange(len(M))], [M])
        return cls(parts, [M[np.ix_(part, part)] for part in parts])

    def __matmul__(self, x: Doubles) -> Doubles:
        """Return M x, of x (k,)."""
        product = np.empty(self._k)
        for part, block in zip(self._parts, self._blocks, strict=True):
            product[part] = block @ x[part]
        return product

    def absolute(self) -> "BlockMatrix":
        """Return the matrix of all |M_ij|."""
        return BlockMatrix(self._parts, [np.abs(block) for block in self._blocks])

    def factored(self, diagonal: Doubles) -> "BlockFactor":
        """Return the factor of M with more on its diagonal, (k,). Raises LinAlgError if this is not
        positive definite.
        """
        factors = []
        for part, block in zip(self._parts, self._blocks, strict=True):
            # The transpose is the same matrix in the order of LAPACK.
            matrix = block.T.copy(order="F")
            matrix.flat[:: part.size + 1] += diagonal[part]
            factors.append((part, cholesky(matrix)))
        return BlockFactor(self._k, factors)


class BlockFactor:
    """The Cholesky factor L of a block matrix (k, k). factors: the places and the factor of each
    part.
    """

    def __init__(self, k: int, factors: Sequence[tuple[slice | Indices, Doubles]]) -> None:
        self._k, self._factors = k, tuple(factors)

    def divide(self, right: Doubles, *, is_second: bool = False) -> Doubles:
        """Return L⁻¹ right, or with `is_second` L⁻ᵀ right, of right (k,) or (k, j)."""
        _, blas = large_libraries()
        divided = np.empty(right.shape, order="F")
        for part, factor in self._factors:
            if right.ndim == 1:
                divided[part] = blas.dtrsv(factor, right[part], lower=1, trans=int(is_second))
            else:
                divided[part] = blas.dtrsm(
                    1.0, factor, right[part], lower=1, trans_a=int(is_second)
                )
        return divided


def cholesky(matrix: Doubles) -> Doubles:
    """Return the lower Cholesky factor of a symmetric matrix in the order of LAPACK, which it
    overwrites; what is above the diagonal does not count. Raises LinAlgError if it is not positive
    definite.
    """
    lapack, _ = large_libraries()
    factor, failed = lapack.dpotrf(matrix, lower=1, clean=0, overwrite_a=1)
    if failed:
        raise np.linalg.LinAlgError("the matrix is not positive definite")
    return np.asarray(factor)


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


def product_s(M: Doubles) -> float:
    """Return the seconds that a product of a matrix with itself takes here and now."""
    begin_s = time.monotonic()
    np.matmul(M, M)
    return time.monotonic() - begin_s


def _is_below(M: Doubles, limit: float) -> bool:
    """Return whether all eigenvalues are below a limit, in a small part of the time."""
    try:
        np.linalg.cholesky(limit * np.eye(len(M)) - M)
    except np.linalg.LinAlgError:
        return False
    return True
