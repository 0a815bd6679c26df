"""`clipped_newton` under caps: Newton's step on the free unknowns, with held caps as equations.

Each step guesses anew which caps hold, as it does for bounds: it holds a cap that is exceeded and
releases one that would have to push outwards. The steps may cycle or violate caps on their way. The
caller certifies the result, so a failure costs nothing but time.
"""

import numpy as np

from lightpaint.arrays import Doubles, Indices
from lightpaint.lighting.algebra.clipped_newton import RIDGE
from lightpaint.lighting.algebra.quadratic import EPSILON, Quadratic, kkt_residual
from lightpaint.progress import cancellation_check

#: Steps after which methods take over that cannot cycle.
MAX_STEPS = 20


def capped_newton(q: Quadratic, x: Doubles, *, tolerance: float) -> tuple[Doubles, float, int]:
    """Find the optimum from x, (n,), and return (x, KKT residual, steps). The result is of no use
    if its residual is above `tolerance`.
    """
    multipliers = q.cap_multipliers(x, q.gradient(x))
    at_lower, at_upper = q.active_caps(x)
    at_lower, at_upper = at_lower & (multipliers > 0), at_upper & (multipliers < 0)
    check = cancellation_check()
    for step in range(MAX_STEPS + 1):
        check()
        gradient = q.gradient(x)
        left = gradient - multipliers @ q.A
        value = q.A @ x
        over = np.maximum(value - q.cap_upper, q.cap_lower - value).max()
        residual = max(kkt_residual(left, x, q.size, q.lower, q.upper), float(over) / q.size)
        if residual <= tolerance or step == MAX_STEPS:
            break
        free = ~(((x <= q.lower) & (left > 0)) | ((x >= q.upper) & (left < 0)))
        held = np.flatnonzero((at_lower | at_upper) & (q.A[:, free] > 0).any(axis=1))
        goal = np.where(at_lower, q.cap_lower, q.cap_upper)[held]
        move, pushes = _newton(q, gradient, np.flatnonzero(free), held, goal - value[held])
        x = np.clip(x + move, q.lower, q.upper)
        multipliers = np.zeros(len(q.groups))
        multipliers[held] = pushes
        # A cap goes on holding only if it pushes inwards; one that is exceeded begins to hold.
        at_lower, at_upper = at_lower & (multipliers > 0), at_upper & (multipliers < 0)
        value, room = q.A @ x, 64 * EPSILON * (q.A @ np.abs(x))
        at_lower |= value < q.cap_lower - room
        at_upper |= (value > q.cap_upper + room) & ~at_lower
        multipliers = np.where(at_lower | at_upper, multipliers, 0)
    return x, residual, step


def _newton(
    q: Quadratic, gradient: Doubles, free: Indices, held: Indices, short: Doubles
) -> tuple[Doubles, Doubles]:
    """Return the step to the optimum of the free unknowns, (n,), and the multipliers of held caps,
    (h,).

    short: (h,), the changes that the sums under these caps need.
    """
    f, k = free.size, held.size
    move = np.zeros(q.n)
    matrix, right = np.zeros((f + k, f + k)), np.zeros(f + k)
    matrix[:f, :f] = q.M[free][:, free]
    matrix.flat[: f * (f + k) : f + k + 1] += RIDGE * np.sqrt(f)
    A = q.A[held][:, free]
    matrix[f:, :f], matrix[:f, f:] = A, -A.T
    right[:f], right[f:] = -gradient[free], short
    solved = np.linalg.solve(matrix, right) if f else right
    move[free] = solved[:f]
    return move, np.asarray(solved[f:])
