"""The exact optimum by its active set: the bounds and caps (limits of sums) that hold it.

Newton's method finds the rest."""

from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import Bools, Doubles
from lightpaint.lighting.algebra.clipped_newton import RIDGE, solve_ridged
from lightpaint.lighting.algebra.free_factor import FreeFactor
from lightpaint.lighting.algebra.quadratic import EPSILON, Quadratic
from lightpaint.progress import cancellation_check


@dataclass
class _Working:
    """free: (n,), unknowns not held at a bound. capped: (k,), caps that are held."""

    free: Bools
    capped: Bools


def polish(
    q: Quadratic,
    x: Doubles,
    *,
    tolerance: float,
    max_steps: int,
    factor: FreeFactor | None = None,
) -> tuple[Doubles, int]:
    """Find the optimum from a feasible x by an active set; unknowns at bounds equal them exactly.

    factor: of a problem of many unknowns without caps. Returns (x, steps).

    Each step is Newton's on the free unknowns. If it leaves the box, it is clipped there and
    the bounds it hit are held; if that would not lower the objective, it ends at the first limit.
    At the optimum of a working set all limits that pull the wrong way are released, or, once
    that has failed to lower the objective, only the first of them (Bland's rule). The objective
    never rises. Stops at a KKT residual of `tolerance`, or where round-off allows no progress.
    """
    x = x.copy()
    working = _working_set(q, x)
    release_all, best, since_best = True, np.inf, 0
    progress = 0.0  # of the objective, since the last optimum of a working set
    check = cancellation_check()
    for step in range(max_steps):
        check()
        gradient = q.gradient(x)
        if factor is not None:
            move = factor.newton_step(working.free, gradient)
        else:
            move = _newton(q, x, gradient, working)
        target = x + move
        beyond = working.free & ((target < q.lower) | (target > q.upper))
        exceeded = _exceeded_caps(q, target, working)
        if not beyond.any() and not exceeded.any():
            progress += _objective_change(q, gradient, move)
            x = target
            reduced_gradient, multipliers, residual = q.violations(x)
            since_best = 0 if residual < 0.5 * best else since_best + 1
            best = min(best, residual)
            if residual <= tolerance or since_best > 20 + 2 * q.n:
                return x, step + 1
            if progress > -EPSILON * abs(float(q.b @ x)):
                release_all = False
            progress = 0.0
            _release(q, x, reduced_gradient, multipliers, working, release_all)
            continue
        if not q.groups:
            clipped = np.where(beyond, np.clip(target, q.lower, q.upper), target)
            rise = _objective_change(q, gradient, clipped - x)
            if rise < 0:
                x = clipped
                progress += rise
                working.free &= ~beyond
                continue
        share = _move_to_first_limit(q, x, move, target, beyond, exceeded, working)
        progress += _objective_change(q, gradient, share)
        x = x + share
        # An unknown that hit a bound equals it to the last bit.
        x = np.where(working.free, x, np.where(x - q.lower <= q.upper - x, q.lower, q.upper))
    return x, max_steps


def _working_set(q: Quadratic, x: Doubles) -> _Working:
    """Return the limits that hold x: bounds at which it is and whose gradient keeps it there, and
    caps.
    """
    gradient = q.gradient(x)
    at_lower, at_upper = q.active_caps(x)
    multipliers = q.cap_multipliers(x, gradient)
    gradient = gradient - multipliers @ q.A
    stays = ((x <= q.lower) & (gradient > 0)) | ((x >= q.upper) & (gradient < 0))
    free = ~stays & (q.lower < q.upper)
    capped = (at_lower | at_upper) & (q.A[:, free] > 0).any(axis=1)
    return _Working(free, capped & ((multipliers != 0) | (q.cap_lower == q.cap_upper)))


def _newton(q: Quadratic, x: Doubles, gradient: Doubles, working: _Working) -> Doubles:
    """Return the step (n,) to the optimum of the free unknowns; held caps do not change."""
    free = np.flatnonzero(working.free)
    held_caps = np.flatnonzero(working.capped & (q.A[:, working.free] > 0).any(axis=1))
    f, k = free.size, held_caps.size
    move = np.zeros(q.n)
    if f == 0:
        return move
    matrix = np.zeros((f + k, f + k))
    # Rows, then columns: many times faster than the two at once.
    matrix[:f, :f] = q.M[free][:, free]
    matrix.flat[: f * (f + k) : f + k + 1] += RIDGE * np.sqrt(f)
    rest = np.zeros(f + k)
    rest[:f] = -gradient[free]
    if k:
        A = q.A[np.ix_(held_caps, free)]
        matrix[f:, :f], matrix[:f, f:] = A, A.T
        value = q.A[held_caps] @ x
        # The same step corrects round-off in held caps.
        at_lower = np.abs(value - q.cap_lower[held_caps]) <= np.abs(value - q.cap_upper[held_caps])
        rest[f:] = np.where(at_lower, q.cap_lower[held_caps], q.cap_upper[held_caps]) - value
    move[free] = solve_ridged(matrix, rest, f)[:f]
    return move


def _exceeded_caps(q: Quadratic, target: Doubles, working: _Working) -> Bools:
    """Return which caps (k,), not held yet, the step to `target` would violate."""
    if not q.groups:
        return np.zeros(0, bool)
    value, room = q.A @ target, 64 * EPSILON * (q.A @ np.abs(target))
    exceeded = (value > q.cap_upper + room) | (value < q.cap_lower - room)
    return exceeded & ~working.capped


def _objective_change(q: Quadratic, gradient: Doubles, move: Doubles) -> float:
    """Return the change of ½ xᵀM x − bᵀx by a move from a point with this gradient."""
    return float(gradient @ move + 0.5 * (move @ (q.M @ move)))


def _move_to_first_limit(
    q: Quadratic,
    x: Doubles,
    move: Doubles,
    target: Doubles,
    beyond: Bools,
    exceeded: Bools,
    working: _Working,
) -> Doubles:
    """Return the part of the move that violates no limit, and add the limit that ends it to the
    working set.
    """
    hit = np.flatnonzero(beyond)
    limit = np.where(target[hit] < q.lower[hit], q.lower[hit], q.upper[hit])
    shares = (limit - x[hit]) / move[hit]
    share = float(np.clip(shares.min(initial=1.0), 0, 1))
    first_cap = -1
    for k in np.flatnonzero(exceeded):
        start_sum, target_sum = float(q.A[k] @ x), float(q.A[k] @ target)
        wall = q.cap_upper[k] if target_sum > q.cap_upper[k] else q.cap_lower[k]
        cap_share = (
            min(max((wall - start_sum) / (target_sum - start_sum), 0.0), 1.0)
            if target_sum != start_sum
            else 0.0
        )
        if cap_share < share or (first_cap < 0 and not hit.size):
            share, first_cap = cap_share, int(k)
    if first_cap >= 0:
        working.capped[first_cap] = True
    else:
        working.free[hit[shares <= share]] = False
    return share * move


def _release(
    q: Quadratic,
    x: Doubles,
    gradient: Doubles,
    multipliers: Doubles,
    working: _Working,
    release_all: bool,
) -> None:
    """Release limits that pull the wrong way: all of it, or the first."""
    movable = ~working.free & (q.lower < q.upper)
    wrong = movable & np.where(x <= q.lower, gradient < 0, gradient > 0)
    # A cap whose unknowns are all at bounds has no part in the gradient.
    idle = working.capped & (multipliers == 0) & (q.cap_lower < q.cap_upper)
    if release_all:
        working.free |= wrong
        working.capped &= ~idle
    elif wrong.any():
        working.free[np.flatnonzero(wrong)[0]] = True
    elif idle.any():
        working.capped[np.flatnonzero(idle)[0]] = False
