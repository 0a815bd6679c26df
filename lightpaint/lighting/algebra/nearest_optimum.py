"""Of equally good answers, the one nearest to where the solve began.

Two lights at one place make M singular: what one of them gains the other may lose. A solver moves
along such a direction by round-off over round-off, another way on every processor.
"""

import numpy as np

from lightpaint.arrays import Bools, Doubles
from lightpaint.lighting.algebra.quadratic import Quadratic

#: Eigenvalues of M, of unit diagonal, along which no step that is taken changes what counts; and
#: the pivot of a Cholesky factor, squared, below which it is worth while to look for such.
NULL, SUSPECT = 1e-13, 1e-10


def is_suspect(M: Doubles) -> bool:
    """Whether any of these matrices, (…, n, n), is singular or nearly so."""
    try:
        pivots = np.linalg.cholesky(M).diagonal(axis1=-2, axis2=-1)
    except np.linalg.LinAlgError:
        return True
    return bool(np.square(pivots.min(initial=1.0)) < SUSPECT)


def nearest_equal(q: Quadratic, x: Doubles, begin: Doubles) -> Doubles:
    """The point nearest to `begin` among those that are as good as x, (n,), as far as bounds allow.

    What is at a bound stays there, and so do the sums that caps limit.
    """
    free: Bools = (x > q.lower) & (x < q.upper) & (np.diag(q.M) > 0)
    f = np.flatnonzero(free)
    if f.size < 2:
        return x
    matrix = q.M[f][:, f]
    if q.groups:
        matrix = matrix + q.A[:, f].T @ q.A[:, f]
    if not is_suspect(matrix):
        return x
    values, vectors = np.linalg.eigh(matrix)
    idle = vectors[:, values <= NULL]
    away = idle @ (idle.T @ (x - begin)[f])
    # What is where it was has all the room there is.
    f, away = f[away != 0], away[away != 0]
    # Straight back, up to the first bound.
    room = np.where(away > 0, x[f] - q.lower[f], q.upper[f] - x[f])
    part = float(np.min(room / np.abs(away), initial=1.0))
    moved = x.copy()
    moved[f] = np.clip(x[f] - part * away, q.lower[f], q.upper[f])
    return moved if f.size else x
