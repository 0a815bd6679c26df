"""Eigenvectors of symmetric matrices; an interrupt need not wait for those of large ones."""

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.threads import run_apart

#: Maximum number of rows of a matrix that takes less than a second.
QUICK_MATRIX = 1024


def eigenvectors(M: Doubles) -> tuple[Doubles, Doubles]:
    """Return eigenvalues (n,), in ascending order, and vectors (n, n) of a symmetric matrix M."""
    values, vectors = np.linalg.eigh(M) if len(M) <= QUICK_MATRIX else run_apart(np.linalg.eigh, M)
    return values, vectors
