"""An interior-point method for many caps (upper limits of sums), as a wall of LEDs has them.

Where Newton's step on all limits cycles, an active set changes by one limit at a time, and with a
hundred caps that takes as many steps. This method goes through the inside of all limits in some
twenty steps, however many there are, and so tells which of them hold. Its answer is only near the
optimum: `capped_newton` makes it exact by these limits.

It is Mehrotra's predictor and corrector (SIAM Journal on Optimization 2, 1992).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import Bools, Doubles, Indices
from lightpaint.lighting.algebra.quadratic import Quadratic
from lightpaint.lighting.algebra.symmetric_matrices import large_libraries
from lightpaint.progress import cancellation_check

#: Largest number of steps; complementarity that ends them, relative to the complementarity of the
#: start; and the share of the way to the first limit that a step goes.
MAX_STEPS, CLOSE, STEP_SHARE = 40, 1e-14, 0.995

#: Multipliers, relative to the gradient, that say that nothing satisfies all limits.
OUT_OF_REACH = 1e30

#: Numbers in a row up to which its products are added by place: a cap of one lamp has few.
SHORT = 8

#: Unknowns from which a matrix is large.
LARGE = 64


@dataclass(frozen=True)
class NearOptimum:
    """A point near the optimum. x: (n,), at a bound where one seems to hold it.

    at_lower, at_upper: caps that seem to hold it, (k,). multipliers: of caps, (k,), as `Optimum`
    has them.
    """

    x: Doubles
    at_lower: Bools
    at_upper: Bools
    multipliers: Doubles


def interior_point(q: Quadratic, start: Doubles, *, close: float = CLOSE) -> NearOptimum | None:
    """Return a point near the optimum; None if steps fail, nothing satisfies all limits, or an
    unknown or a sum is fixed.

    Unknowns that change nothing are drawn to `start`, (n,). close: the complementarity that ends
    steps, relative to the complementarity of the start.
    """
    limits = _Limits(q)
    if not len(limits.h) or (q.lower >= q.upper).any() or (q.cap_lower >= q.cap_upper).any():
        return None
    # Without a cost of their own, they would go as far inside as they can.
    changes_nothing = np.diag(q.M) == 0
    M, b = q.M + np.diag(changes_nothing * 1.0), np.where(changes_nothing, start, q.b)
    x, check = np.zeros(q.n), cancellation_check()
    slack = np.maximum(limits.h - limits.values(x), q.size)
    dual = np.full(len(slack), q.size)
    first = float(slack @ dual)
    for _ in range(MAX_STEPS):
        check()
        gap = float(slack @ dual)
        if not gap > close * first:
            break
        if dual.max(initial=0) > OUT_OF_REACH * q.size:
            return None
        try:
            moves = _Moves.at(limits, M, b, x, slack, dual)
        except np.linalg.LinAlgError:
            return None
        _, slack_move, dual_move = moves.less(slack * dual)
        share = min(_room(slack, slack_move), _room(dual, dual_move))
        left = float((slack + share * slack_move) @ (dual + share * dual_move))
        centre = (left / gap) ** 3 * gap / len(dual)
        x_move, slack_move, dual_move = moves.less(slack * dual + slack_move * dual_move - centre)
        share = STEP_SHARE * min(_room(slack, slack_move), _room(dual, dual_move))
        x, slack, dual = x + share * x_move, slack + share * slack_move, dual + share * dual_move
    if not np.isfinite(x).all():
        return None
    low, high, cap_low, cap_high = (part > 0 for part in limits.split(dual * (dual > slack)))
    *_, low_dual, high_dual = limits.split(dual)
    x = np.where(low, q.lower, np.where(high, q.upper, np.clip(x, q.lower, q.upper)))
    return NearOptimum(x, cap_low, cap_high, low_dual * cap_low - high_dual * cap_high)


class _Limits:
    """All finite limits of a problem as G x <= h: bounds from below and above, caps likewise."""

    def __init__(self, q: Quadratic) -> None:
        self._A, self._products = q.A, RowProducts(q.A)
        sides = (-q.lower, q.upper, -q.cap_lower, q.cap_upper)
        self._which: list[Indices] = [np.flatnonzero(np.isfinite(side)) for side in sides]
        self.h = np.concatenate([side[k] for side, k in zip(sides, self._which, strict=True)])
        self._ends = np.cumsum([len(k) for k in self._which])[:-1]

    def values(self, x: Doubles) -> Doubles:
        """Return G x."""
        low, high, cap_low, cap_high = self._which
        sums = self._A @ x
        return np.concatenate([-x[low], x[high], -sums[cap_low], sums[cap_high]])

    def split(self, of_each: Doubles) -> tuple[Doubles, Doubles, Doubles, Doubles]:
        """Return numbers of limits, 0 where a limit is infinite: (n,), (n,), (k,) and (k,)."""
        n, k = self._A.shape[1], len(self._A)
        parts = [np.zeros(count) for count in (n, n, k, k)]
        for part, which, values in zip(
            parts, self._which, np.split(of_each, self._ends), strict=True
        ):
            part[which] = values
        low, high, cap_low, cap_high = parts
        return low, high, cap_low, cap_high

    def pushes(self, dual: Doubles) -> Doubles:
        """Return Gᵀ dual, (n,)."""
        low, high, cap_low, cap_high = self.split(dual)
        return np.asarray(high - low + (cap_high - cap_low) @ self._A)

    def squares(self, weights: Doubles) -> Doubles:
        """Return Gᵀ diag(weights) G, (n, n)."""
        low, high, cap_low, cap_high = self.split(weights)
        matrix = self._products.sum(cap_low + cap_high)
        matrix.flat[:: len(matrix) + 1] += low + high
        return np.asarray(matrix)


class RowProducts:
    """The outer products of rows, (m, n), with themselves; short rows add theirs by place."""

    def __init__(self, rows: Doubles) -> None:
        counts = np.count_nonzero(rows, axis=1)
        self._is_short = (counts <= SHORT) & (counts > 0)
        self._n, self._long = rows.shape[1], rows[~self._is_short]
        short = rows[self._is_short]
        places = np.argsort(short == 0, axis=1, kind="stable")[:, :SHORT]
        values = np.take_along_axis(short, places, axis=1)
        self._places = (places[:, :, None] * self._n + places[:, None, :]).ravel()
        self._values = values[:, :, None] * values[:, None, :]

    def sum(self, weights: Doubles) -> Doubles:
        """Return the sum of weights, (m,), times the products, (n, n)."""
        matrix = (self._long.T * weights[~self._is_short]) @ self._long
        if self._values.size:
            terms = self._values * weights[self._is_short, None, None]
            matrix += np.bincount(self._places, terms.ravel(), self._n**2).reshape(matrix.shape)
        return np.asarray(matrix)


@dataclass(frozen=True)
class _Moves:
    """Newton's moves from a point inside of the limits.

    solve: divides by the matrix of x alone. stationary, primal: what the conditions of the optimum
    miss.
    """

    limits: _Limits
    solve: Callable[[Doubles], Doubles]
    stationary: Doubles
    primal: Doubles
    slack: Doubles
    dual: Doubles

    @classmethod
    def at(
        cls, limits: _Limits, M: Doubles, b: Doubles, x: Doubles, slack: Doubles, dual: Doubles
    ) -> "_Moves":
        """Return the moves from a point. Raises LinAlgError if there are none."""
        solve = _divider(M + limits.squares(dual / slack))
        stationary = M @ x - b + limits.pushes(dual)
        return cls(limits, solve, stationary, limits.values(x) + slack - limits.h, slack, dual)

    def less(self, product: Doubles) -> tuple[Doubles, Doubles, Doubles]:
        """Return the moves of x, slack and dual after which slack · dual is less by `product`."""
        pushed = (self.dual * self.primal - product) / self.slack
        x_move = self.solve(-self.stationary - self.limits.pushes(pushed))
        slack_move = -self.primal - self.limits.values(x_move)
        return x_move, slack_move, -(product + self.dual * slack_move) / self.slack


def _divider(matrix: Doubles) -> Callable[[Doubles], Doubles]:
    """Return a function that divides by a matrix (k, k): a large one is factored by Cholesky, which
    takes a sixth of the time. Raises LinAlgError if it is singular.
    """
    if len(matrix) > LARGE:
        lapack, _ = large_libraries()
        factor, failed = lapack.dpotrf(matrix.T, lower=1, clean=0)
        if not failed:
            return lambda right: np.asarray(lapack.dpotrs(factor, right, lower=1)[0])
    inverse = np.asarray(np.linalg.inv(matrix), np.float64)
    return lambda right: inverse @ right


def _room(values: Doubles, moves: Doubles) -> float:
    """Return the share of a move, at most 1, after which no value is negative."""
    falls = moves < 0
    return float(min(1.0, (values[falls] / -moves[falls]).min(initial=1.0)))
