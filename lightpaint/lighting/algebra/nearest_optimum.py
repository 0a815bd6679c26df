"""The optimum nearest to the start, where several are equally good.

Two lights at one place make M singular: light moved from one to the other changes no picture. A
solver's steps in such a direction are round-off divided by round-off, which differs between
processors.
"""

from collections.abc import Callable

import numpy as np

from lightpaint.arrays import Bools, Doubles
from lightpaint.lighting.algebra.eigenvectors import eigenvectors
from lightpaint.lighting.algebra.quadratic import Quadratic

#: The eigenvalue of M, of unit diagonal, below which a step along its vector changes nothing that
#: counts; and the squared pivot of a Cholesky factor below which such vectors are worth a search.
NULL_EIGENVALUE, SUSPECT_PIVOT = 1e-13, 1e-10


def is_suspect(M: Doubles) -> bool:
    """Return whether any of these matrices, (…, n, n), is singular or nearly so."""
    try:
        pivots = np.linalg.cholesky(M).diagonal(axis1=-2, axis2=-1)
    except np.linalg.LinAlgError:
        return True
    return bool(np.square(pivots.min(initial=1.0)) < SUSPECT_PIVOT)


def nearest_equal(
    q: Quadratic,
    x: Doubles,
    begin: Doubles,
    *,
    knows_regular: Callable[[Bools], bool] = lambda free: False,
) -> Doubles:
    """Return the point nearest to `begin` among those as good as x, (n,), as far as bounds allow.

    Unknowns at bounds stay there, and the sums that caps limit keep their values. knows_regular:
    whether the matrix of some unknowns, (n,), is known not to be singular.
    """
    free: Bools = (x > q.lower) & (x < q.upper) & (np.diag(q.M) > 0)
    f = np.flatnonzero(free)
    if f.size < 2 or knows_regular(free):
        return x
    matrix = q.M[f][:, f]
    if q.groups:
        matrix = matrix + q.A[:, f].T @ q.A[:, f]
    if not is_suspect(matrix):
        return x
    values, vectors = eigenvectors(matrix)
    idle = vectors[:, values <= NULL_EIGENVALUE]
    away = idle @ (idle.T @ (x - begin)[f])
    # An unknown that has not moved limits nothing.
    f, away = f[away != 0], away[away != 0]
    # Straight back, up to the first bound.
    room = np.where(away > 0, x[f] - q.lower[f], q.upper[f] - x[f])
    part = float(np.min(room / np.abs(away), initial=1.0))
    nearest = x.copy()
    nearest[f] = np.clip(x[f] - part * away, q.lower[f], q.upper[f])
    return nearest if f.size else x
