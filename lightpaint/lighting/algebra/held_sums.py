"""The optimum under bounds and required sums, by guessing which of them hold.

A primal-dual active set (Hintermüller, Ito, Kunisch, SIAM Journal on Optimization 13, 2002): with a
guess of the bounds and sums that hold, the rest is one linear system. Bounds that it then violates
are added to the guess, what pulls the wrong way leaves it, and at last comes the sum that is missed
most. From interior points near the optimum that takes one or two steps. It may cycle, where the
method of multipliers (required_sums.py) goes on.
"""

from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import Bools, Doubles
from lightpaint.lighting.algebra.optimum import NO_CAPS, Optimum
from lightpaint.lighting.algebra.quadratic import EPSILON, kkt_residual
from lightpaint.progress import cancellation_check
from lightpaint.threads import one_thread

#: Most guesses; violations of bounds and gradients that are round-off, relative to the largest
#: unknown and to b.
MAX_STEPS, ROUND_OFF = 80, 1e-12

#: Pull of a step to where it begins, relative to a unit diagonal: of equal mixes the nearest is
#: taken. Where it matters, steps are repeated until it does not.
NEARNESS = 1e-7


@dataclass(frozen=True)
class HeldSums:
    """Problems with one M, the same bounds and required sums, scaled.

    M: (k, k), of unit diagonal, with rows of 0 where an unknown changes nothing. rows: (m, k) of
    length 1; least: (m,). lower, upper: (k,). root: (k,), a scaled unknown is root times the
    unknown itself. lengths: (m,), of the rows before.
    """

    M: Doubles
    rows: Doubles
    least: Doubles
    lower: Doubles
    upper: Doubles
    root: Doubles
    lengths: Doubles

    @classmethod
    def of(
        cls,
        M: Doubles,
        rows: Doubles,
        least: Doubles,
        *,
        lower: Doubles,
        upper: Doubles,
        root: Doubles,
    ) -> "HeldSums":
        """Scale a problem. root: (k,), the lengths of the unknowns."""
        M = M / root[:, None] / root
        rows = rows / root
        lengths = np.linalg.norm(rows, axis=1)
        lengths = np.where(lengths > 0, lengths, 1.0)
        return cls(
            M, rows / lengths[:, None], least / lengths, lower * root, upper * root, root, lengths
        )

    def minimise(
        self,
        b: Doubles,
        start: Doubles,
        duals: Doubles,
        *,
        near: Doubles | None = None,
        tolerance: float,
        close: float,
    ) -> tuple[Optimum, Doubles] | None:
        """Minimise for b, (k,), with the bounds that hold an answer, (k,), to a similar problem,
        and its multipliers, (m,).

        near: (k,), where unknowns stay that change nothing; by default that answer. tolerance: of
        the KKT residual. close: the largest miss of a sum. Return the optimum, and the multipliers
        of the sums; None if the guesses cycle, or leave it.
        """
        b, held = b / self.root, duals > 0
        x = np.clip(start * self.root, self.lower, self.upper)
        is_fixed = self.lower >= self.upper
        low = is_fixed | (x <= self.lower)
        high = ~low & (x >= self.upper)
        if near is not None:
            x = np.clip(near * self.root, self.lower, self.upper)
        size = float(np.abs(b).max(initial=0)) or 1.0
        seen, check = set[bytes](), cancellation_check()
        is_repeated = False
        for step in range(MAX_STEPS):
            check()
            key = np.packbits(np.concatenate([low, high, held])).tobytes()
            if not is_repeated and (key in seen or held.sum() > (~(low | high)).sum()):
                return None
            seen.add(key)
            solved, multipliers = self._solved(b, x, low, high, held)
            if solved is None:
                return None
            x = solved
            gradient = self.M @ x - b - multipliers @ self.rows
            reach, pull = ROUND_OFF * float(np.abs(x).max(initial=0)), ROUND_OFF * size
            sums = self.rows @ x
            room = close * np.maximum(np.abs(self.least), np.abs(self.rows) @ np.abs(x))
            new_low = is_fixed | np.where(low, gradient > -pull, x < self.lower - reach)
            new_high = ~new_low & np.where(high, gradient < pull, x > self.upper + reach)
            new_held = held & (multipliers > -pull)
            is_same = (new_low == low).all() and (new_high == high).all()
            if is_same and (new_held == held).all():
                missed = np.where(held, 0.0, self.least - sums - room)
                if not (missed > 0).any():
                    found = self._optimum(x, gradient, multipliers, b, size, step + 1, tolerance)
                    if found is not None:
                        return found
                    is_repeated = True  # from nearer, since steps stay near where they begin
                    continue
                # One at a time: the next often meets others as well.
                new_held[int(np.argmax(missed))] = True
            low, high, held, is_repeated = new_low, new_high, new_held, False
        return None

    def _solved(
        self, b: Doubles, now: Doubles, low: Bools, high: Bools, held: Bools
    ) -> tuple[Doubles, Doubles] | tuple[None, Doubles]:
        """Return the unknowns between their bounds, and the multipliers (m,) of the sums that hold.

        now: where unknowns stay that change nothing, and near which equal mixes stay.
        """
        x = np.where(low, self.lower, np.where(high, self.upper, now))
        rows = self.rows[held]
        counts = (self.M.diagonal() > 0) | (rows != 0).any(axis=0)
        free = np.flatnonzero(~(low | high) & counts)
        rest = x.copy()
        rest[free] = 0
        f, m = free.size, len(rows)
        matrix = np.zeros((f + m, f + m))
        matrix[:f, :f] = self.M[free][:, free]
        matrix[:f, f:] = -rows[:, free].T
        matrix[f:, :f] = -rows[:, free]
        matrix.flat[: f * (f + m) : f + m + 1] += NEARNESS
        near = NEARNESS * now[free]
        right = np.concatenate([(b - self.M @ rest)[free] + near, rows @ rest - self.least[held]])
        multipliers = np.zeros(len(self.rows))
        try:
            with one_thread():
                solved = np.linalg.solve(matrix, right)
        except np.linalg.LinAlgError:
            return None, multipliers
        x[free], multipliers[held] = solved[:f], solved[f:]
        return (x, multipliers) if np.isfinite(solved).all() else (None, multipliers)

    def _optimum(
        self,
        x: Doubles,
        gradient: Doubles,
        multipliers: Doubles,
        b: Doubles,
        size: float,
        steps: int,
        tolerance: float,
    ) -> tuple[Optimum, Doubles] | None:
        """Return the optimum in unscaled unknowns; None if its residual is too large."""
        x = np.clip(x, self.lower, self.upper)
        residual = kkt_residual(gradient, x, size, self.lower, self.upper)
        terms = np.abs(self.M) @ np.abs(x) + np.abs(b)
        round_off = 4 * EPSILON * float(terms.max(initial=0)) / size
        limit = max(tolerance, round_off)
        if residual > limit:
            return None
        unscaled = x / self.root
        optimum = Optimum(unscaled, gradient * self.root, NO_CAPS, residual, 0, steps, limit)
        return optimum, np.maximum(multipliers, 0) / self.lengths
