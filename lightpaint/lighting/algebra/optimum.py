"""The optimum of a convex quadratic between bounds and under caps (upper limits of sums)."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles, Indices
from lightpaint.lighting.algebra import Method
from lightpaint.lighting.algebra.active_set import polish
from lightpaint.lighting.algebra.clipped_newton import (
    MANY_UNKNOWNS,
    capped_newton,
    clipped_newton,
    nearest_equal,
)
from lightpaint.lighting.algebra.free_factor import FreeFactor, projected_newton
from lightpaint.lighting.algebra.gauss_seidel import sweep
from lightpaint.lighting.algebra.interior_point import interior_point
from lightpaint.lighting.algebra.quadratic import UNREACHED_POWER, Cap, Quadratic, scaled
from lightpaint.progress import cancellation_check
from lightpaint.threads import one_thread, parallel_map

#: Largest KKT residual of an optimum, unless the round-off of M x − b is larger.
TOLERANCE = 1e-12

#: The multipliers of a problem without caps.
NO_CAPS = np.zeros(0)

#: Unknowns up to which numpy solves several problems in one call; larger ones get a thread each.
MAX_BATCHED_UNKNOWNS = 64

#: Caps above which an interior-point method is tried where Newton's steps on all limits cycle.
MANY_CAPS = 8

#: Sweeps before a polish is tried again, if one was not enough.
SWEEPS_BETWEEN = 50


@dataclass(frozen=True)
class Optimum:
    """The best x, with the multipliers that prove it.

    x: (n,), at a bound exactly where it is held there.
    multipliers: (n,), gradient M x − b of each unknown minus the contribution of caps: 0 between
    the bounds, >= 0 where the lower bound holds x, <= 0 where the upper one does.
    cap_multipliers: (k,), the change of the objective if the limit of a cap rose by one. <= 0 at
    the upper, >= 0 at the lower limit.
    kkt_residual: largest violation of the above, after scaling (see `kkt_residual`).
    sweeps: Gauss–Seidel passes; steps: of Newton's method on what is free.
    tolerance: the limit for kkt_residual, raised to the round-off of M x − b where it is not met.
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
        """True if the residual is within the tolerance."""
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
    tolerance: float = TOLERANCE,
    max_sweeps: int = 20_000,
) -> Optimum:
    """Minimise ½ xᵀM x − bᵀx over lower ≤ x ≤ upper and the caps.

    M: (n, n) symmetric, positive semidefinite up to round-off; b: (n,). lower, upper: numbers
    or (n,); equal ones fix an unknown. start: (n,), moved into the bounds; their nearest point
    to 0 by default. max_sweeps: the limit of Gauss–Seidel passes; running out of them is a
    result.

    If M is singular, as with two lights at one place, many x are optimal: the answer is one near
    `start` (`nearest_equal`). Unknowns with M_ii = 0 keep their start.

    Raises ValueError if shapes do not fit or no x satisfies bounds and caps.
    """
    family = QuadraticFamily(M, lower=lower, upper=upper, caps=caps, method=method)
    return family.minimise(b, start, tolerance=tolerance, max_sweeps=max_sweeps)


class QuadraticFamily:
    """Problems that differ in b alone, for which the work on M is done once. See `minimise`."""

    def __init__(
        self,
        M: Doubles,
        *,
        lower: npt.ArrayLike = 0.0,
        upper: npt.ArrayLike = np.inf,
        caps: Iterable[Cap] = (),
        method: Method = "polished",
    ) -> None:
        M = np.asarray(M, np.float64)
        self._q = scaled(M, np.zeros(len(M)), lower, upper, tuple(caps))
        self._lower, self._upper, self._method = lower, upper, method
        is_large = self._q.n > MANY_UNKNOWNS and not self._q.groups
        self._factor = FreeFactor(self._q.M) if is_large else None

    def minimise(
        self,
        b: Doubles,
        start: Doubles | None = None,
        *,
        tolerance: float = TOLERANCE,
        max_sweeps: int = 20_000,
    ) -> Optimum:
        """Minimise ½ xᵀM x − bᵀx within the limits. b, start: (n,)."""
        q = self._q.with_right_side(np.asarray(b, np.float64))
        begin = np.zeros(q.n) if start is None else np.asarray(start, np.float64)
        x = q.feasible(begin / q.scale)
        if not (q.b > 0).any():
            # The target needs no light: where bounds allow it, all lights off is exactly optimal.
            dark = q.feasible(np.where(np.diag(q.M) > 0, 0.0, x))
            x = dark if q.violations(dark)[2] == 0 else x
        start_at, factor = x, self._factor
        with one_thread():
            if self._method == "gauss-seidel":
                x, sweeps, steps = _solve_by_sweeps(q, x, tolerance, max_sweeps)
            else:
                x, sweeps, steps = _solve_polished(q, x, tolerance, max_sweeps, factor)
            gradient, multipliers, residual = q.violations(x)
            if steps and (nearest := _nearest(q, x, start_at, factor)) is not x:
                violations = q.violations(nearest)
                if violations[2] <= max(tolerance, residual):
                    x, (gradient, multipliers, residual) = nearest, violations
        return Optimum(
            _unscaled(q, x, self._lower, self._upper),
            gradient / q.scale,
            multipliers / q.cap_scale,
            residual,
            sweeps,
            steps,
            tolerance if residual <= tolerance else max(tolerance, q.round_off(x)),
        )


def _nearest(q: Quadratic, x: Doubles, start: Doubles, factor: FreeFactor | None) -> Doubles:
    if factor is None:
        return nearest_equal(q, x, start)
    return nearest_equal(q, x, start, knows_regular=factor.knows_regular)


def minimise_each(
    M: Doubles,
    b: Doubles,
    *,
    lower: Doubles,
    upper: Doubles,
    start: Doubles,
    method: Method = "polished",
    tolerance: float = TOLERANCE,
    max_sweeps: int = 20_000,
) -> list[Optimum]:
    """Minimise as `minimise` does, for each of c problems of one size, without caps.

    M: (c, n, n); b, lower, upper, start: (c, n). For few unknowns numpy's calls cost more than
    the arithmetic in them, so that the same calls solve all problems; larger ones run on threads.
    """
    count, n = b.shape
    optima: dict[int, Optimum] = {}
    if n <= MAX_BATCHED_UNKNOWNS and method == "polished" and max_sweeps > 0:
        optima = _solve_together(M, b, lower, upper, start, tolerance)

    def solve(c: int) -> Optimum:
        return minimise(
            M[c],
            b[c],
            lower=lower[c],
            upper=upper[c],
            start=start[c],
            method=method,
            tolerance=tolerance,
            max_sweeps=max_sweeps,
        )

    remaining = [c for c in range(count) if c not in optima]
    solved = (
        parallel_map(solve, remaining)
        if n > MAX_BATCHED_UNKNOWNS and len(remaining) > 1
        else map(solve, remaining)
    )
    optima.update(zip(remaining, solved, strict=True))
    return [optima[c] for c in range(count)]


def _solve_together(
    M: Doubles, b: Doubles, lower: Doubles, upper: Doubles, start: Doubles, tolerance: float
) -> dict[int, Optimum]:
    """Solve the problems that clipped steps can solve; return them by index. For the arguments see
    `minimise_each`.
    """
    power = np.einsum("cii->ci", M)
    counts = power > UNREACHED_POWER * power.max(axis=1, keepdims=True, initial=0)
    # A problem that needs no light has an answer that takes no steps.
    asks = np.any((b > 0) & counts, axis=1)
    if not (asks.any() and np.isfinite(M).all() and np.isfinite(b).all()):
        return {}
    # Unknowns that change nothing are left out, so that the others get the same bits as without
    # them.
    rows: slice | Indices = slice(None)
    if not (reached := counts.any(axis=0)).all():
        rows = np.flatnonzero(reached)
        M, b = np.ascontiguousarray(M[:, rows][:, :, rows]), b[:, rows]
        counts, power = counts[:, rows], power[:, rows]
    active = counts & asks[:, None]
    root = np.sqrt(np.where(active, power, 1))
    scale = np.where(active, 1 / root, 0)
    M, b = (M * scale[:, :, None]) * scale[:, None, :], b * scale
    low, high = lower[:, rows] * root, upper[:, rows] * root
    size = np.where(asks, _gradient_sizes(M, b, low, high), 1)
    begin = np.where(active, np.minimum(np.maximum(start[:, rows] * root, low), high), 0)
    with one_thread():
        x, residuals, steps, is_singular = clipped_newton(
            M, b, low, high, begin, size, tolerance=tolerance
        )
        if is_singular:
            return {}
        gradient = np.matmul(M, x[:, :, None])[:, :, 0] - b
    value = np.where(x <= low, lower[:, rows], x * scale)
    value = np.where(x >= high, upper[:, rows], value)
    answers, multipliers = np.minimum(np.maximum(start, lower), upper), np.zeros(start.shape)
    answers[:, rows] = np.where(counts, value, answers[:, rows])
    multipliers[:, rows] = gradient * root
    return {
        c: Optimum(answers[c], multipliers[c], NO_CAPS, float(residuals[c]), 0, steps, tolerance)
        for c in np.flatnonzero(asks & (residuals <= tolerance)).tolist()
    }


def _gradient_sizes(M: Doubles, b: Doubles, low: Doubles, high: Doubles) -> Doubles:
    """Return the largest entry, (c,), of each problem's b and of M x at the bounds nearest to 0."""
    sizes = np.abs(b).max(axis=1)
    if low.any():
        pull = np.matmul(M, np.clip(0, low, high)[:, :, None])[:, :, 0]
        sizes = np.maximum(sizes, np.abs(pull).max(axis=1))
    return np.asarray(sizes)


def _solve_polished(
    q: Quadratic, x: Doubles, tolerance: float, max_sweeps: int, factor: FreeFactor | None
) -> tuple[Doubles, int, int]:
    """Solve by Newton's clipped steps, or else by polishes with sweeps between them.

    factor: of many unknowns, for which steps that never raise the objective come in between.
    """
    _, _, residual = q.violations(x)
    sweeps, steps = 0, 0
    if residual > tolerance and max_sweeps > 0 and q.groups:
        solved, kkt, steps = capped_newton(q, x, tolerance=tolerance)
        if kkt <= tolerance and q.violations(solved)[2] <= tolerance:
            return solved, 0, steps
        if len(q.groups) > MANY_CAPS and (near := interior_point(q, x)) is not None:
            solved, kkt, more_steps = capped_newton(q, x, tolerance=tolerance, near=near)
            steps += more_steps
            if kkt <= tolerance and q.violations(solved)[2] <= tolerance:
                return solved, 0, steps
    elif residual > tolerance and max_sweeps > 0:
        trial, residuals, steps, _ = clipped_newton(
            q.M[None],
            q.b[None],
            q.lower[None],
            q.upper[None],
            x[None],
            np.array([q.size]),
            tolerance=tolerance,
            newton_step=None if factor is None else factor.newton_step,
        )
        if residuals[0] <= tolerance:
            return trial[0], 0, steps
        if factor is not None:
            x, more_steps = projected_newton(q, x, factor, tolerance=tolerance)
            steps += more_steps
            _, _, residual = q.violations(x)
            if residual <= max(tolerance, q.round_off(x)):
                return x, 0, steps
    count = 0
    while residual > tolerance and sweeps < max_sweeps:
        gradient = q.gradient(x)
        for _ in range(min(count, max_sweeps - sweeps)):
            sweep(q, x, gradient)
            sweeps += 1
        most = 50 + 3 * min(q.n, 300)
        x, extra_steps = polish(q, x, tolerance=tolerance, max_steps=most, factor=factor)
        steps += extra_steps
        _, _, residual = q.violations(x)
        if residual <= q.round_off(x) or sweeps >= 8 * SWEEPS_BETWEEN:
            break
        count = SWEEPS_BETWEEN
    return x, sweeps, steps


def _solve_by_sweeps(
    q: Quadratic, x: Doubles, tolerance: float, max_sweeps: int
) -> tuple[Doubles, int, int]:
    """Solve by Gauss–Seidel sweeps alone; return (x, sweeps, 0)."""
    _, _, residual = q.violations(x)
    sweeps = 0
    check = cancellation_check()
    while residual > tolerance and sweeps < max_sweeps:
        check()
        # The gradient is computed anew each time, so that its round-off does not decide when to
        # stop.
        sweep(q, x, q.gradient(x))
        sweeps += 1
        _, _, residual = q.violations(x)
    return x, sweeps, 0


def _unscaled(q: Quadratic, x: Doubles, lower: npt.ArrayLike, upper: npt.ArrayLike) -> Doubles:
    """Return x in its own units; one at a bound equals it to the last bit."""
    value = x * q.scale
    value = np.where(x <= q.lower, lower, value)
    value = np.where(x >= q.upper, upper, value)
    return np.asarray(np.clip(value, lower, upper))
