"""Projected Gauss–Seidel (Schoeneman et al. 1993, Eq 6), with bounds and caps (limits of sums)."""

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.lighting.algebra.active_set import polish
from lightpaint.lighting.algebra.quadratic import Quadratic

#: Steps for the few unknowns of one cap.
MAX_BLOCK_STEPS = 60


def sweep(q: Quadratic, x: Doubles, gradient: Doubles) -> None:
    """Update each unknown in turn, in place, to its best value while the others stay.

        x_i ← min(max((b_i − Σ_{j≠i} M_ij x_j) / M_ii, lower_i), upper_i),   M_ii = 1

    The unknowns of a cap form one block, which is solved exactly. gradient:
    M x − b, kept up to date. The objective never rises.
    """
    lower, upper = q.lower.tolist(), q.upper.tolist()
    in_caps = {int(i) for group in q.groups for i in group}
    for i, row in enumerate(q.M):
        now = x[i]
        new = now - gradient[i]
        if new < lower[i]:
            new = lower[i]
        elif new > upper[i]:
            new = upper[i]
        if new != now and i not in in_caps and row[i]:
            x[i] = new
            gradient += (new - now) * row
    for k, group in enumerate(q.groups):
        part = _block(q, k, x, gradient)
        best, _ = polish(part, x[group], tolerance=1e-15, max_steps=MAX_BLOCK_STEPS)
        move = best - x[group]
        if move.any():
            x[group] = best
            gradient += move @ q.M[group]


def _block(q: Quadratic, k: int, x: Doubles, gradient: Doubles) -> Quadratic:
    """Return the problem in the unknowns of cap k while the others stay."""
    group = q.groups[k]
    M = q.M[np.ix_(group, group)]
    return Quadratic(
        M,
        M @ x[group] - gradient[group],
        q.lower[group],
        q.upper[group],
        q.scale[group],
        q.A[k : k + 1, group],
        q.cap_lower[k : k + 1],
        q.cap_upper[k : k + 1],
        q.cap_scale[k : k + 1],
        (np.arange(group.size),),
        q.size,
    )
