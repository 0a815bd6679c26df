"""`clipped_newton` under caps: Newton's step on the free unknowns, with held caps as equations.

Each step guesses anew which caps hold, as it does for bounds: it holds a cap that is exceeded and
releases one that would have to push outwards. The steps may cycle or violate caps on their way. The
caller certifies the result, so a failure costs nothing but time.
"""

import numpy as np

from lightpaint.arrays import Bools, Doubles, Indices
from lightpaint.lighting.algebra.clipped_newton import RIDGE, solve_ridged
from lightpaint.lighting.algebra.interior_point import NearOptimum
from lightpaint.lighting.algebra.quadratic import EPSILON, Quadratic, kkt_residual
from lightpaint.progress import cancellation_check

#: Steps after which methods take over that cannot cycle.
MAX_STEPS = 20


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
    for step in range(MAX_STEPS + 1):
        check()
        gradient = q.gradient(x)
        free_gradient = gradient - multipliers @ q.A
        value = q.A @ x
        excess = np.maximum(value - q.cap_upper, q.cap_lower - value).max()
        residual = max(
            kkt_residual(free_gradient, x, q.size, q.lower, q.upper), float(excess) / q.size
        )
        if residual <= tolerance or step == MAX_STEPS:
            break
        free = ~(((x <= q.lower) & (free_gradient > 0)) | ((x >= q.upper) & (free_gradient < 0)))
        held_caps = np.flatnonzero((at_lower | at_upper) & (q.A[:, free] > 0).any(axis=1))
        goal = np.where(at_lower, q.cap_lower, q.cap_upper)[held_caps]
        move, pushes = _newton(
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


def _newton(
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
