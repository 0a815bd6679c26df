"""The optimum of a convex quadratic between bounds and under caps, with its certificate."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles
from lightpaint.lighting.algebra.active_set import polish
from lightpaint.lighting.algebra.clipped_newton import clipped_newton
from lightpaint.lighting.algebra.gauss_seidel import sweep
from lightpaint.lighting.algebra.quadratic import Cap, Quadratic, scaled
from lightpaint.lighting.algebra.threads import one_thread

__all__ = ["Cap", "Method", "Optimum", "minimise"]

#: The paper's iteration alone, or Newton's on the active set, with the paper's to fall back on.
Method = Literal["polished", "gauss-seidel"]

#: Sweeps before a polish is tried again, if one did not do.
SWEEPS_BETWEEN = 50


@dataclass(frozen=True)
class Optimum:
    """The best x, and what shows that it is.

    x: (n,), at a bound exactly where it is held there.
    multipliers: (n,), gradient M x − b of each unknown less what caps take of it: 0 between
    the bounds, >= 0 where x is held at the lower, <= 0 where it is held at the upper one.
    cap_multipliers: (k,), what a cap takes per unit of coefficient: by how much the objective
    would change if its limit rose by one. <= 0 at the upper, >= 0 at the lower limit.
    kkt_residual: largest violation of the above, after scaling (see `kkt_residual`).
    sweeps: Gauss–Seidel passes; steps: of Newton's method on what is free.
    tolerance: what kkt_residual was to come down to, raised to the round-off of M x − b.
    """

    x: Doubles
    multipliers: Doubles
    cap_multipliers: Doubles
    kkt_residual: float
    sweeps: int
    steps: int
    tolerance: float

    @property
    def converged(self) -> bool:
        """Whether the tolerance was met."""
        return self.kkt_residual <= self.tolerance


def minimise(
    M: Doubles,
    b: Doubles,
    *,
    lower: npt.ArrayLike = 0.0,
    upper: npt.ArrayLike = np.inf,
    caps: Iterable[Cap] = (),
    start: Doubles | None = None,
    method: Method = "polished",
    tolerance: float = 1e-12,
    max_sweeps: int = 20_000,
) -> Optimum:
    """Minimise ½ xᵀM x − bᵀx over lower ≤ x ≤ upper and the caps.

    M: (n, n) symmetric, positive semidefinite up to round-off; b: (n,). lower, upper: numbers
    or (n,); equal ones hold an unknown. start: (n,), moved into the bounds; their nearest point
    to 0 by default. max_sweeps: the limit of Gauss–Seidel passes; running out of them is a
    result.

    If M is singular, as with two lights at one place, many x are optimal. The polish leaves
    directions in which nothing changes as they are at `start`, so that the answer stays near it;
    which one it is, is not promised. Unknowns with M_ii = 0 keep their start.

    Raises ValueError if shapes do not fit or no x satisfies bounds and caps.
    """
    q = scaled(np.asarray(M, np.float64), np.asarray(b, np.float64), lower, upper, tuple(caps))
    begin = np.zeros(q.n) if start is None else np.asarray(start, np.float64)
    x = q.feasible(begin / q.scale)
    if not (q.b > 0).any():
        # Nothing in the target asks for light. Where bounds allow it, all off is exactly optimal.
        dark = q.feasible(np.where(np.diag(q.M) > 0, 0.0, x))
        x = dark if q.violations(dark)[2] == 0 else x
    by_method = _by_sweeps if method == "gauss-seidel" else _polished
    with one_thread():
        x, sweeps, steps = by_method(q, x, tolerance, max_sweeps)
        left, multipliers, residual = q.violations(x)
    return Optimum(
        _unscaled(q, x, lower, upper),
        left / q.scale,
        multipliers / q.cap_scale,
        residual,
        sweeps,
        steps,
        max(tolerance, q.round_off(x)),
    )


def _polished(
    q: Quadratic, x: Doubles, tolerance: float, max_sweeps: int
) -> tuple[Doubles, int, int]:
    """(x, sweeps, steps): Newton's clipped steps, or else the polish with sweeps between tries."""
    _, _, residual = q.violations(x)
    sweeps, steps = 0, 0
    if residual > tolerance and max_sweeps > 0 and not q.groups:
        trial, left, steps = clipped_newton(
            q.M[None],
            q.b[None],
            q.lower[None],
            q.upper[None],
            x[None],
            np.array([q.size]),
            tolerance=tolerance,
        )
        if left[0] <= tolerance:
            return trial[0], 0, steps
    count = 0
    while residual > tolerance and sweeps < max_sweeps:
        gradient = q.gradient(x)
        for _ in range(min(count, max_sweeps - sweeps)):
            sweep(q, x, gradient)
            sweeps += 1
        x, taken = polish(q, x, tolerance=tolerance, max_steps=50 + 3 * min(q.n, 300))
        steps += taken
        _, _, residual = q.violations(x)
        if residual <= q.round_off(x) or sweeps >= 8 * SWEEPS_BETWEEN:
            break
        count = SWEEPS_BETWEEN
    return x, sweeps, steps


def _by_sweeps(
    q: Quadratic, x: Doubles, tolerance: float, max_sweeps: int
) -> tuple[Doubles, int, int]:
    """(x, sweeps, 0): Gauss–Seidel alone."""
    _, _, residual = q.violations(x)
    sweeps = 0
    while residual > tolerance and sweeps < max_sweeps:
        # Computed anew each time, the gradient's round-off does not decide when to stop.
        sweep(q, x, q.gradient(x))
        sweeps += 1
        _, _, residual = q.violations(x)
    return x, sweeps, 0


def _unscaled(q: Quadratic, x: Doubles, lower: npt.ArrayLike, upper: npt.ArrayLike) -> Doubles:
    """x in its own units, at its own bounds to the last bit."""
    value = x * q.scale
    value = np.where(x <= q.lower, lower, value)
    value = np.where(x >= q.upper, upper, value)
    return np.asarray(np.clip(value, lower, upper))
