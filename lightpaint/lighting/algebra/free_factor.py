"""Newton's method for many unknowns, by one Cholesky factor while few become free or held.

From step to step, and from one problem to the next with the same matrix, the unknowns between their
bounds are nearly the same. A factor of those that were free serves the others by a small system: a
held unknown is a constraint on the step, and a released one a further row.
"""

import numpy as np

from lightpaint.arrays import Bools, Doubles, Indices
from lightpaint.lighting.algebra.bordered_factor import Border
from lightpaint.lighting.algebra.clipped_newton import RIDGE, SUSPECT_PIVOT, solve_ridged
from lightpaint.lighting.algebra.quadratic import Quadratic, kkt_residual
from lightpaint.lighting.algebra.symmetric_matrices import large_libraries
from lightpaint.progress import cancellation_check

#: Unknowns that may differ from the unknowns of the factor, as a share of these: with more, a new
#: factor is as quick.
MAX_CHANGED_SHARE = 1 / 6

#: Columns to keep beside a factor, as a share of its unknowns.
MAX_KEPT_SHARE = 1 / 3

#: Most steps, least fall of the objective by one of them, relative to what its slope promises, and
#: the shortest part of a step.
MAX_STEPS, KEPT_PROMISE, SHORTEST_PART = 100, 1e-4, 2.0**-12


class FreeFactor:
    """The steps of problems with one M, scaled to a unit diagonal, (n, n)."""

    def __init__(self, M: Doubles) -> None:
        large_libraries()
        self._M, self._counts = M, M.diagonal() > 0
        self._rows = np.zeros(0, np.intp)  # the unknowns of the factor
        self._factor: Doubles | None = None  # None if it is singular, or nearly so
        self._regular = np.zeros(len(M), bool)
        self._border = Border(0, 0)

    def newton_step(self, free: Bools, gradient: Doubles) -> Doubles:
        """Return the step, (n,), to the optimum of the free unknowns; the others do not move.

        free: (n,). gradient: M x − b. Unknowns that change nothing do not move either.
        """
        move, free = np.zeros(gradient.size), free & self._counts
        if not free.any():
            return move
        if self._factor is not None:
            is_held = ~free[self._rows]
            is_added = free.copy()
            is_added[self._rows] = False
            held, added = np.flatnonzero(is_held), np.flatnonzero(is_added)
            is_near = held.size + added.size <= MAX_CHANGED_SHARE * self._rows.size
            if is_near and self._move_beside(move, held, added, gradient):
                return move
        rows = np.flatnonzero(free)
        move[rows] = self._factored(rows, -gradient[rows])
        return move

    def knows_regular(self, free: Bools) -> bool:
        """Return whether the matrix of these unknowns, (n,), is known not to be nearly
        singular."""
        return bool(self._regular[free].all())

    def _factored(self, rows: Indices, right: Doubles) -> Doubles:
        """Factor the matrix of some unknowns, and solve it."""
        lapack, _ = large_libraries()
        matrix = self._M[np.ix_(rows, rows)]
        matrix.flat[:: rows.size + 1] += RIDGE * rows.size**0.5
        # The transpose is the same matrix in the order of LAPACK, which needs no copy of it.
        factor, failed = lapack.dpotrf(matrix.T, lower=1, clean=0, overwrite_a=1)
        pivots = np.square(factor.diagonal())
        is_regular = not failed and pivots.min() >= SUSPECT_PIVOT
        self._rows, self._factor = rows, factor if is_regular else None
        self._border = Border(rows.size, int(MAX_KEPT_SHARE * rows.size))
        self._regular[:] = False
        self._regular[rows] = is_regular
        if not failed:
            return np.asarray(lapack.dpotrs(factor, right, lower=1)[0])
        matrix = self._M[np.ix_(rows, rows)]
        matrix.flat[:: rows.size + 1] += RIDGE * rows.size**0.5
        return solve_ridged(matrix, right, rows.size)

    def _move_beside(self, move: Doubles, held: Indices, added: Indices, gradient: Doubles) -> bool:
        """Fill a step of the factor's unknowns but some, and of added ones; return whether it is
        exact.

        held: places among the factor's unknowns; added: unknowns.
        """
        (_, blas), rows, factor = large_libraries(), self._rows, self._factor
        assert factor is not None
        half = blas.dtrsv(factor, -gradient[rows], lower=1)
        if held.size or added.size:
            k, unknowns = added.size, np.concatenate([added, rows[held]])
            which = self._places(unknowns)
            columns = self._border.columns[:, : len(self._border.places)]
            small = -self._border.products[np.ix_(which, which)]
            small[:k, :k] += self._M[np.ix_(added, added)] + RIDGE * rows.size**0.5 * np.eye(k)
            if not _is_regular(small[:k, :k]):
                return False
            right = -(columns.T @ half)[which]
            right[:k] -= gradient[added]
            pushes = np.zeros(columns.shape[1])
            pushes[which] = np.linalg.solve(small, right)
            half -= columns @ pushes
            move[added] = pushes[which[:k]]
            self._regular[added] = True
        move[rows] = blas.dtrsv(factor, half, lower=1, trans=1)
        move[rows[held]] = 0
        return True

    def _places(self, unknowns: Indices) -> Indices:
        """Return the columns of held and added unknowns beside the factor, made where they are new.

        A held one has a unit vector, an added one the elements of M that join it to the factor's.
        From step to step nearly the same unknowns differ from these, so that few columns are new.
        """
        kept = self._border
        new = [x for x in unknowns.tolist() if x not in kept.places]
        if len(kept.places) + len(new) > kept.room:
            self._border = kept = Border(self._rows.size, max(kept.room, unknowns.size))
            new = unknowns.tolist()
        if new:
            _, blas = large_libraries()
            place = np.searchsorted(self._rows, new)
            is_held = self._rows[np.minimum(place, self._rows.size - 1)] == new
            columns = np.zeros((self._rows.size, len(new)), order="F")
            columns[place[is_held], np.flatnonzero(is_held)] = 1
            added = np.array(new, np.intp)[~is_held]
            columns[:, ~is_held] = self._M[np.ix_(added, self._rows)].T
            kept.join(new, blas.dtrsm(1.0, self._factor, columns, lower=1, overwrite_b=1))
        return np.array([kept.places[x] for x in unknowns.tolist()], np.intp)


def projected_newton(
    q: Quadratic, x: Doubles, factor: FreeFactor, *, tolerance: float
) -> tuple[Doubles, int]:
    """Take clipped steps that lower the objective, from x, (n,); return the last point, and
    their number.

    A step that does not lower it enough is shortened before it is clipped, so these steps cannot
    cycle; they end at the tolerance, where none lowers the objective, or at `MAX_STEPS`.
    """
    check = cancellation_check()
    for step in range(MAX_STEPS):
        check()
        gradient = q.gradient(x)
        if kkt_residual(gradient, x, q.size, q.lower, q.upper) <= tolerance:
            return x, step
        free = ~(((x <= q.lower) & (gradient > 0)) | ((x >= q.upper) & (gradient < 0)))
        lower = None
        while lower is None:
            move = factor.newton_step(free, gradient)
            lower = _lower_point(q, x, move, gradient)
            # Unknowns that would go out with the others do not move, but spoil the step of these.
            shortest = x + SHORTEST_PART * move
            is_stuck = free & ((shortest < q.lower) | (shortest > q.upper))
            if lower is None:
                if not is_stuck.any():
                    return x, step
                x = np.where(is_stuck, np.clip(shortest, q.lower, q.upper), x)
                gradient, free = q.gradient(x), free & ~is_stuck
        x = lower
    return x, MAX_STEPS


def _lower_point(q: Quadratic, x: Doubles, move: Doubles, gradient: Doubles) -> Doubles | None:
    """Return a point on the way from x, clipped to the bounds, where the objective is lower; None
    if there is none.
    """
    part = 1.0
    while part >= SHORTEST_PART:
        point = np.clip(x + part * move, q.lower, q.upper)
        change = point - x
        slope = float(gradient @ change)
        if slope + 0.5 * float(change @ (q.M @ change)) <= KEPT_PROMISE * slope < 0:
            return point
        part /= 4
    return None


def _is_regular(matrix: Doubles) -> bool:
    try:
        pivots = np.linalg.cholesky(matrix).diagonal()
    except np.linalg.LinAlgError:
        return False
    return bool(np.square(pivots).min(initial=1.0) >= SUSPECT_PIVOT)
