"""Newton's step on the free unknowns, clipped to the bounds: finds the optimum in a few steps, or
fails; and the optimum nearest to the start, where several are equally good.

Unlike `active_set.polish` it lets the objective rise on its way, and holds and releases as many
unknowns at a time as the gradient suggests. So it is fast, also from an answer to another target,
and may cycle. The caller certifies the result, so a failure costs nothing but time.
It solves several problems together: for few lights numpy's calls cost more than the arithmetic in
them, and three channels in one call cost hardly more than one.

Under caps (upper limits of sums) each step also guesses anew which caps hold: it holds a cap that
is exceeded and releases one that would have to push outwards. The steps may violate caps on their
way.

Two lights at one place make M singular: light moved from one to the other changes no picture. A
solver's steps in such a direction are round-off divided by round-off, which differs between
processors.
"""

from collections.abc import Callable

import numpy as np

from lightpaint.arrays import Bools, Doubles, Indices
from lightpaint.lighting.algebra.interior_point import NearOptimum
from lightpaint.lighting.algebra.quadratic import EPSILON, Quadratic, kkt_residual, kkt_step
from lightpaint.lighting.algebra.symmetric_matrices import eigenvectors
from lightpaint.progress import cancellation_check

#: The eigenvalue of M, of unit diagonal, below which a step along its vector changes nothing that
#: counts; and the squared pivot of a Cholesky factor below which such vectors are worth a search.
NULL_EIGENVALUE, SUSPECT_PIVOT = 1e-13, 1e-10

#: Ridge per √n on the unit diagonal of M, so that no set of lights is singular, not even of
#: coincident ones. Each step is then one of the proximal-point method, whose repetition converges
#: to an optimum without the ridge.
RIDGE = 8 * EPSILON

#: Ridge to use instead where that one is lost in rounding.
FIRM_RIDGE = 1e-12

#: Steps after which methods take over that cannot cycle.
MAX_STEPS = 10

#: Number of unknowns that are many.
MANY_UNKNOWNS = 512

#: Steps after which methods take over that cannot cycle.
MAX_CAPPED_STEPS = 20

#: A function from the unknowns that are free, (n,), and the gradient, (n,), to the step to their
#: optimum, (n,).
NewtonStep = Callable[[Bools, Doubles], Doubles]


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


def clipped_newton(
    M: Doubles,
    b: Doubles,
    lower: Doubles | float,
    upper: Doubles | float,
    x: Doubles,
    size: Doubles,
    *,
    tolerance: float,
    newton_step: NewtonStep | None = None,
) -> tuple[Doubles, Doubles, int, bool]:
    """Minimise ½ xᵀM x − bᵀx, lower <= x <= upper, for each of c problems.

    M: (c, n, n), scaled to a unit diagonal, with rows of 0 where an unknown changes nothing;
    b, lower, upper: (c, n), or one bound for all. x: (c, n), between the bounds, to begin with.
    size: (c,), scale of the KKT residuals. newton_step: of one problem, a quicker way to steps.
    Returns x, which equals the bounds that hold it to the last bit, the KKT residuals, (c,), the
    number of steps, and whether the matrix of the last step may be singular: other x are then as
    good (see `nearest_equal`); not known with `newton_step`. If a residual is above `tolerance`,
    x is useless.
    """
    matrix, counts = np.eye(0), np.einsum("cii->ci", M) > 0
    check = cancellation_check()
    for step in range(MAX_STEPS + 1):
        check()
        gradient = np.matmul(M, x[:, :, None])[:, :, 0] - b
        residual = np.abs(kkt_step(gradient, x, lower, upper)).max(axis=1, initial=0) / size
        is_open = residual > tolerance
        if step == MAX_STEPS or not is_open.any():
            break
        stays = ((x <= lower) & (gradient > 0)) | ((x >= upper) & (gradient < 0))
        # Solved problems do not change while others still need steps.
        free = counts & ~stays & is_open[:, None]
        if newton_step is not None:
            move = newton_step(free[0], gradient[0])[None]
        else:
            move, matrix = _newton(M, gradient, free)
        x = np.minimum(np.maximum(x + move, lower), upper)
    return x, residual, step, is_suspect(matrix)


def _newton(M: Doubles, gradient: Doubles, free: Bools) -> tuple[Doubles, Doubles]:
    """Return steps to the optima of the free unknowns, (c, n), 0 for the others, and the matrices
    solved.
    """
    # All matrices have the unknowns that are free in any problem. An unknown that is not free in
    # one has a row of the identity there, which moves nothing.
    rows = np.flatnonzero(free.any(axis=0))
    is_free = free[:, rows]
    matrix = M.copy() if rows.size == M.shape[1] else M[:, rows][:, :, rows]
    diagonal = np.einsum("cii->ci", matrix)  # which looks at its memory
    right = -gradient[:, rows]
    if not is_free.all():
        matrix *= is_free[:, :, None]
        matrix *= is_free[:, None, :]
        diagonal += ~is_free
        right *= is_free
    diagonal += RIDGE * rows.size**0.5
    move = np.zeros_like(gradient)
    move[:, rows] = solve_ridged(matrix, right[:, :, None], rows.size)[:, :, 0]
    return move, matrix


def solve_ridged(matrix: Doubles, right: Doubles, unknowns: int) -> Doubles:
    """Return `matrix`⁻¹ `right`, as numpy.linalg.solve does.

    One large matrix that is positive definite is factored by Cholesky, in half the time. Where the
    ridge is lost in rounding, as with unknowns that are alike to the last bit, a firmer
    one takes its place, in the first `unknowns` rows.
    """
    if len(matrix) == 1 and right.ndim == 3 and unknowns > MANY_UNKNOWNS:
        return solve_ridged(matrix[0], right[0], unknowns)[None]
    if matrix.ndim == 2 and len(matrix) == unknowns > MANY_UNKNOWNS:
        from scipy.linalg.lapack import dposv

        _, solved, failed = dposv(matrix, right)
        if not failed:
            return np.asarray(solved)
    try:
        return np.asarray(np.linalg.solve(matrix, right), np.float64)
    except np.linalg.LinAlgError:
        ridge = np.zeros(matrix.shape[-1])
        ridge[:unknowns] = FIRM_RIDGE
        return np.asarray(np.linalg.solve(matrix + np.diag(ridge), right), np.float64)


def capped_newton(
    q: Quadratic, x: Doubles, *, tolerance: float, near: NearOptimum | None = None
) -> tuple[Doubles, float, int]:
    """Find the optimum from x, (n,), and return (x, KKT residual, steps). The result is of no use
    if its residual is above `tolerance`.

    near: a point near the optimum, from which it starts instead, and the caps that hold there.
    """
    if near is not None:
        x, multipliers, at_lower, at_upper = near.x, near.multipliers, near.at_lower, near.at_upper
    else:
        multipliers = q.cap_multipliers(x, q.gradient(x))
        at_lower, at_upper = q.active_caps(x)
        at_lower, at_upper = at_lower & (multipliers > 0), at_upper & (multipliers < 0)
    check = cancellation_check()
    for step in range(MAX_CAPPED_STEPS + 1):
        check()
        gradient = q.gradient(x)
        free_gradient = gradient - multipliers @ q.A
        value = q.A @ x
        excess = np.maximum(value - q.cap_upper, q.cap_lower - value).max()
        residual = max(
            kkt_residual(free_gradient, x, q.size, q.lower, q.upper), float(excess) / q.size
        )
        if residual <= tolerance or step == MAX_CAPPED_STEPS:
            break
        free = ~(((x <= q.lower) & (free_gradient > 0)) | ((x >= q.upper) & (free_gradient < 0)))
        held_caps = np.flatnonzero((at_lower | at_upper) & (q.A[:, free] > 0).any(axis=1))
        goal = np.where(at_lower, q.cap_lower, q.cap_upper)[held_caps]
        move, pushes = _capped_step(
            q, gradient, np.flatnonzero(free), held_caps, goal - value[held_caps]
        )
        x = np.clip(x + move, q.lower, q.upper)
        multipliers = np.zeros(len(q.groups))
        multipliers[held_caps] = pushes
        # A cap stays active only if it pushes inwards; one that is exceeded becomes active.
        at_lower, at_upper = at_lower & (multipliers > 0), at_upper & (multipliers < 0)
        value, room = q.A @ x, 64 * EPSILON * (q.A @ np.abs(x))
        at_lower |= value < q.cap_lower - room
        at_upper |= (value > q.cap_upper + room) & ~at_lower
        multipliers = np.where(at_lower | at_upper, multipliers, 0)
    return _on_caps(q, x, at_lower, at_upper), residual, step


def _on_caps(q: Quadratic, x: Doubles, at_lower: Bools, at_upper: Bools) -> Doubles:
    """Return x, (n,), without the round-off of a step in the sums under held caps.

    Otherwise a cap that x misses by round-off would count as having slack.
    """
    between = q.A * ((x > q.lower) & (x < q.upper))
    power = np.square(between).sum(axis=1)
    goal = np.where(at_lower, q.cap_lower, np.where(at_upper, q.cap_upper, 0.0))
    off = np.where((at_lower | at_upper) & (power > 0), goal - q.A @ x, 0.0)
    return np.asarray(x + (off / np.where(power > 0, power, 1.0)) @ between)


def _capped_step(
    q: Quadratic, gradient: Doubles, free: Indices, held_caps: Indices, shortfall: Doubles
) -> tuple[Doubles, Doubles]:
    """Return the step to the optimum of the free unknowns, (n,), and the multipliers of held caps,
    (h,).

    shortfall: (h,), the changes that the sums under these caps need.
    """
    f, k = free.size, held_caps.size
    move = np.zeros(q.n)
    matrix, right = np.zeros((f + k, f + k)), np.zeros(f + k)
    matrix[:f, :f] = q.M[free][:, free]
    matrix.flat[: f * (f + k) : f + k + 1] += RIDGE * np.sqrt(f)
    A = q.A[held_caps][:, free]
    matrix[f:, :f], matrix[:f, f:] = A, -A.T
    right[:f], right[f:] = -gradient[free], shortfall
    solved = solve_ridged(matrix, right, f) if f else right
    move[free] = solved[:f]
    return move, np.asarray(solved[f:])
