"""An interior-point method for many caps (upper limits of sums), as a wall of LEDs has them.

Where Newton's step on all limits cycles, an active set changes by one limit at a time, and with a
hundred caps that takes as many steps. This method goes through the inside of all limits in some
twenty steps, however many there are, and so tells which of them hold. Its answer is only near the
optimum: `capped_newton` makes it exact by these limits.

It is Mehrotra's predictor and corrector (SIAM Journal on Optimization 2, 1992).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lightpaint.arrays import Bools, Doubles, Indices
from lightpaint.lighting.algebra.quadratic import Quadratic
from lightpaint.lighting.algebra.symmetric_matrices import BlockFactor, BlockMatrix
from lightpaint.progress import cancellation_check

#: Largest number of steps; complementarity that ends them, relative to the complementarity of the
#: start; and the share of the way to the first limit that a step goes.
MAX_STEPS, CLOSE, STEP_SHARE = 100, 1e-14, 0.995

#: How many times farther away than x multipliers exclude what satisfies all limits.
FAR = 1e3

#: What limits may miss at the end, relative to the larger of a limit and x.
OFF = 1e-6

#: Numbers in a row up to which its products are added by place: a cap of one lamp has few.
SHORT = 8

#: Unknowns up to which a matrix is inverted; long rows, as a share of these, that are many.
LARGE, MANY_ROWS = 64, 0.5


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


@np.errstate(over="ignore", invalid="ignore", divide="ignore")
def interior_point(
    q: Quadratic, start: Doubles, *, close: float = CLOSE, parts: Sequence[Indices] = ()
) -> NearOptimum | None:
    """Return a point near the optimum; None if steps do not come there, nothing satisfies all
    limits, or an unknown or a sum is fixed.

    Unknowns that change nothing are drawn to `start`, (n,). close: the complementarity that ends
    steps, relative to the complementarity of the start. parts: places of unknowns that M joins with
    no others; all are one without.
    """
    limits = _Limits(q)
    if not len(limits.h) or (q.lower >= q.upper).any() or (q.cap_lower >= q.cap_upper).any():
        return None
    # Without a cost of their own, they would go as far inside as they can.
    changes_nothing = q.M.diagonal() == 0
    if changes_nothing.any():
        b = np.where(changes_nothing, start, q.b)
        q = replace(q, M=q.M + np.diag(changes_nothing * 1.0), b=b)
    system = _System(q, limits, parts)
    x, check = np.zeros(q.n), cancellation_check()
    slack = np.maximum(limits.h - limits.values(x), q.size)
    dual = np.full(len(slack), q.size)
    first = float(slack @ dual)
    for _ in range(MAX_STEPS):
        check()
        gap = float(slack @ dual)
        if not gap > close * first:
            break
        if limits.contradict_each_other(dual, max(float(np.abs(x).max(initial=0)), q.size)):
            return None
        try:
            moves = _Moves.at(system, x, slack, dual)
        except np.linalg.LinAlgError:  # by round-off: no step gets nearer
            break
        _, slack_move, dual_move = moves.less(slack * dual)
        share = min(_room(slack, slack_move), _room(dual, dual_move))
        left = float((slack + share * slack_move) @ (dual + share * dual_move))
        centre = (left / gap) ** 3 * gap / len(dual)
        x_move, slack_move, dual_move = moves.less(slack * dual + slack_move * dual_move - centre)
        share = STEP_SHARE * min(_room(slack, slack_move), _room(dual, dual_move))
        x, slack, dual = x + share * x_move, slack + share * slack_move, dual + share * dual_move
    # Steps that overflow come to what is not finite, and end here.
    off = np.abs(limits.values(x) + slack - limits.h)
    size = np.maximum(np.abs(limits.h), np.abs(x).max(initial=0))
    if not (np.isfinite(x).all() and (off <= OFF * size).all()):
        return None
    low, high, cap_low, cap_high = (part > 0 for part in limits.split(dual * (dual > slack)))
    *_, low_dual, high_dual = limits.split(dual)
    x = np.where(low, q.lower, np.where(high, q.upper, np.clip(x, q.lower, q.upper)))
    return NearOptimum(x, cap_low, cap_high, low_dual * cap_low - high_dual * cap_high)


class _Limits:
    """All finite limits of a problem as G x <= h: bounds from below and above, caps likewise."""

    def __init__(self, q: Quadratic) -> None:
        self._A = q.A
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

    def contradict_each_other(self, dual: Doubles, largest: float) -> bool:
        """Return whether multipliers prove, by Farkas' lemma, that no unknowns within `FAR` times
        the `largest` satisfy all limits.
        """
        reach = FAR * largest * float(np.abs(self.pushes(dual)).sum())
        return bool(reach < -(self.h @ dual))


class RowProducts:
    """The outer products of rows, (m, n), with themselves; short rows add theirs by place."""

    def __init__(self, rows: Doubles) -> None:
        counts = np.count_nonzero(rows, axis=1)
        self._is_short = (counts <= SHORT) & (counts > 0)
        self._n, self._long = rows.shape[1], rows[~self._is_short]
        short = rows[self._is_short]
        columns = np.argsort(short == 0, axis=1, kind="stable")[:, :SHORT]
        values = np.take_along_axis(short, columns, axis=1)
        places = columns[:, :, None] * self._n + columns[:, None, :]
        self._places, self._order = np.unique(places, return_inverse=True)
        self._values = values[:, :, None] * values[:, None, :]

    @property
    def has_short(self) -> bool:
        """True if any row is short."""
        return bool(self._places.size)

    def add_to(self, matrix: Doubles, weights: Doubles) -> None:
        """Add the sum of weights, (m,), times the products to a matrix (n, n), in place."""
        if len(self._long):
            matrix += (self._long.T * weights[~self._is_short]) @ self._long
        if self.has_short:
            terms = self._values * weights[self._is_short, None, None]
            matrix.flat[self._places] += np.bincount(self._order.ravel(), terms.ravel())


class _System:
    """The matrices of Newton's moves, M + Gᵀ diag(weights) G: few long rows in G stay beside a
    factor of the rest.
    """

    def __init__(self, q: Quadratic, limits: _Limits, parts: Sequence[Indices]) -> None:
        self.M, self.b, self.limits = BlockMatrix.of(q.M, parts), q.b, limits
        self._dense, self._rows, self._products = q.M, q.A, RowProducts(q.A)

    def divider(self, weights: Doubles) -> Callable[[Doubles], Doubles]:
        """Return a function that divides (n,) by the matrix. Raises LinAlgError if it is singular.

        weights: of each limit.
        """
        low, high, cap_low, cap_high = self.limits.split(weights)
        diagonal, of_rows = low + high, cap_low + cap_high
        n = diagonal.size
        if n <= LARGE:
            matrix = self._dense.copy()
            self._products.add_to(matrix, of_rows)
            matrix.flat[:: n + 1] += diagonal
            inverse = np.asarray(np.linalg.inv(matrix), np.float64)
            return lambda right: inverse @ right
        if self._products.has_short or len(self._rows) > MANY_ROWS * n:
            matrix = self._dense.copy()
            self._products.add_to(matrix, of_rows)
            factor = BlockMatrix.of(matrix).factored(diagonal)
            return lambda right: factor.divide(factor.divide(right), is_second=True)
        return _beside(self.M.factored(diagonal), self._rows, of_rows)


def _beside(factor: BlockFactor, rows: Doubles, weights: Doubles) -> Callable[[Doubles], Doubles]:
    """Return a function that divides by L Lᵀ + Aᵀ diag(weights) A, by the identity of Woodbury.

    factor: L. rows: (m, n), A.
    """
    counts = weights > 0
    columns = factor.divide(rows[counts].T)
    small = columns.T @ columns
    small.flat[:: len(small) + 1] += 1 / weights[counts]
    inner = BlockMatrix.of(small).factored(np.zeros(len(small)))

    def divide(right: Doubles) -> Doubles:
        half = factor.divide(right)
        across = inner.divide(inner.divide(columns.T @ half), is_second=True)
        return factor.divide(half - columns @ across, is_second=True)

    return divide


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
    def at(cls, system: _System, x: Doubles, slack: Doubles, dual: Doubles) -> "_Moves":
        """Return the moves from a point. Raises LinAlgError if there are none."""
        limits = system.limits
        stationary = system.M @ x - system.b + limits.pushes(dual)
        primal = limits.values(x) + slack - limits.h
        return cls(limits, system.divider(dual / slack), stationary, primal, slack, dual)

    def less(self, product: Doubles) -> tuple[Doubles, Doubles, Doubles]:
        """Return the moves of x, slack and dual after which slack · dual is less by `product`."""
        pushed = (self.dual * self.primal - product) / self.slack
        x_move = self.solve(-self.stationary - self.limits.pushes(pushed))
        slack_move = -self.primal - self.limits.values(x_move)
        return x_move, slack_move, -(product + self.dual * slack_move) / self.slack


def _room(values: Doubles, moves: Doubles) -> float:
    """Return the share of a move, at most 1, after which no value is negative."""
    falls = moves < 0
    return float(min(1.0, (values[falls] / -moves[falls]).min(initial=1.0)))
