"""The optimum under bounds and required sums, by Newton's method on the multipliers of the sums.

Of thousands of sums few hold, so their multipliers λ are few unknowns. For given multipliers the
optimum x(λ) under bounds alone is quick: its matrix stays the same, and so does most of the factor
of the unknowns between their bounds. The dual function min_x ½ xᵀM x − bᵀx − λᵀ(R x − r) is
concave, and quadratic as long as no bound comes or goes: its gradient is r − R x(λ), its curvature
−R M⁻¹ Rᵀ over the unknowns between bounds. Newton's step under λ ≥ 0 is exact there. Sums join as x
misses them (Kelley's cutting planes), and so do caps. From the multipliers of a similar problem one
or two steps suffice; from nowhere, interior points lead near them.

Where many mixes are equal, M is singular. A pull to where x was makes the optimum single, and is
repeated until it pulls no longer (the proximal-point method; Rockafellar, SIAM Journal on Control
14, 1976).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from lightpaint.arrays import Doubles, Indices
from lightpaint.lighting.algebra.clipped_newton import clipped_newton
from lightpaint.lighting.algebra.free_factor import FreeFactor, projected_newton
from lightpaint.lighting.algebra.held_sums import HeldSums
from lightpaint.lighting.algebra.interior_point import interior_point
from lightpaint.lighting.algebra.optimum import NO_CAPS, Optimum, minimise
from lightpaint.lighting.algebra.quadratic import EPSILON, Cap, Quadratic, kkt_residual
from lightpaint.progress import cancellation_check
from lightpaint.threads import one_thread

#: The pull to where an answer was, relative to a unit diagonal of M, and how often it is repeated.
NEARNESS, MAX_PULLS = 1e-8, 30

#: Largest miss of a sum, relative to its size; sums that join in one step; and most steps.
CLOSE, JOINING, MAX_STEPS = 1e-10, 16, 16

#: Ridge of the curvature, relative to a sum of length 1: sums may depend on each other.
RIDGE = 1e-9

#: The slope of the dual function at the end of a step, relative to that at its beginning, at which
#: it is long enough; the factor by which it may get longer at a time; and most trials.
FLAT, LONGER, MAX_TRIALS = 0.5, 4.0, 5

#: KKT residual of the optimum for given multipliers.
TOLERANCE = 1e-13

#: Rounds of the interior-point method, each with the sums that the last one missed.
MAX_INTERIORS = 12


@dataclass(frozen=True)
class NearAnswer:
    """An answer to begin with. x: (k,). multipliers: (m,), of the sums; of_caps: (c,), as
    `Optimum` has them.
    """

    x: Doubles
    multipliers: Doubles
    of_caps: Doubles


@dataclass(frozen=True)
class _Part:
    """Unknowns that M joins with no others. places: (j,). q: with the pull."""

    places: Indices
    q: Quadratic
    factor: FreeFactor

    @classmethod
    def of(cls, M: Doubles, lower: Doubles, upper: Doubles, places: Indices) -> "_Part":
        """Return the part at some places of a scaled problem, with M (k, k)."""
        matrix = M[np.ix_(places, places)] if places.size < len(M) else M.copy()
        matrix.flat[:: places.size + 1] += NEARNESS
        nothing, none = np.zeros(0), np.zeros((0, places.size))
        ones, zeros = np.ones(places.size), np.zeros(places.size)
        limits = lower[places], upper[places], ones, none, nothing, nothing, nothing, ()
        return cls(places, Quadratic(matrix, zeros, *limits, 1.0), FreeFactor(matrix))

    def least(self, b: Doubles, x: Doubles) -> Doubles | None:
        """Return the optimum of the part, (j,), from x, (j,); None if steps do not end at it."""
        q = self.q.with_right_side(b)
        tolerance = max(TOLERANCE, q.round_off(x))
        limits = q.M[None], q.b[None], q.lower[None], q.upper[None]
        step = self.factor.newton_step
        found, residuals, _, _ = clipped_newton(
            *limits, x[None], np.array([q.size]), tolerance=tolerance, newton_step=step
        )
        if residuals[0] <= tolerance:
            return np.asarray(found[0])
        x, _ = projected_newton(q, x, self.factor, tolerance=tolerance)
        return x if q.violations(x)[2] <= max(tolerance, q.round_off(x)) else None

    def curvature(self, rows: Doubles, x: Doubles) -> Doubles:
        """Return R M⁻¹ Rᵀ over the unknowns of this part between their bounds, (w, w)."""
        free = (x > self.q.lower) & (x < self.q.upper)
        own = rows[:, self.places]
        return np.asarray(own @ self.factor.divided(free, own.T))


class _CountedSums:
    """The sums that count so far, each scaled to length 1.

    which: (w,), their numbers. rows: (w, k), least: (w,), lengths: (w,).
    """

    def __init__(self, k: int) -> None:
        self.which: Indices = np.zeros(0, np.intp)
        self.rows, self.least, self.lengths = np.zeros((0, k)), np.zeros(0), np.zeros(0)

    def join(self, which: Indices, rows: Doubles, least: Doubles) -> None:
        """Add sums, by their numbers, with rows (j, k) in scaled unknowns, and least (j,)."""
        lengths = np.linalg.norm(rows, axis=1)
        lengths = np.where(lengths > 0, lengths, 1.0)
        self.which = np.append(self.which, which)
        self.rows = np.vstack([self.rows, rows / lengths[:, None]])
        self.least = np.append(self.least, least / lengths)
        self.lengths = np.append(self.lengths, lengths)

    def missed(self, x: Doubles) -> Doubles:
        """Return what x, (k,), misses of the sums, (w,)."""
        return np.asarray(self.least - self.rows @ x)

    def sizes(self, x: Doubles) -> Doubles:
        """Return the sizes of the sums at x, (w,), to which misses are relative."""
        sizes = np.maximum(np.abs(self.least), np.abs(self.rows) @ np.abs(x))
        return np.where(sizes > 0, sizes, 1.0)


class DualNewton:
    """Problems with one M, the same bounds, caps and required sums, which differ in b.

    M: (k, k). rows: (m, k), least: (m,), of the sums. lower, upper, caps: as in `minimise`.
    least_diagonal: of M, relative to its largest, below which an unknown is scaled as if it had
    this one. parts: places of unknowns that M joins with no others; all are one without.
    """

    def __init__(
        self,
        M: Doubles,
        rows: Doubles,
        least: Doubles,
        *,
        lower: Doubles,
        upper: Doubles,
        caps: Sequence[Cap],
        least_diagonal: float,
        parts: Sequence[Indices] = (),
    ) -> None:
        power = M.diagonal()
        self._root = np.sqrt(np.maximum(power, least_diagonal * (power.max(initial=0) or 1.0)))
        self._M = M / self._root[:, None]
        self._M /= self._root
        self._bounds = lower, upper
        self._lower, self._upper = lower * self._root, upper * self._root
        self._rows, self._count = rows, len(least)
        self._cap_rows, cap_least = _cap_sums(caps, self._root)
        self._least = np.concatenate([least, cap_least])
        places = parts or [np.arange(len(M))]
        self._parts = [_Part.of(self._M, self._lower, self._upper, x) for x in places]

    def minimise(
        self, b: Doubles, near: NearAnswer, *, tolerance: float
    ) -> tuple[Optimum, Doubles] | None:
        """Minimise for b, (k,), from the answer to a similar problem.

        tolerance: of the KKT residual. Return the optimum, and the multipliers of the sums; None if
        the steps do not end.
        """
        b, sums = b / self._root, _CountedSums(len(b))
        size = float(np.abs(b).max(initial=0)) or 1.0
        x = np.clip(near.x * self._root, self._lower, self._upper)
        duals = self._all_multipliers(near)
        self._join(sums, np.flatnonzero(duals > 0))
        pushes = duals[duals > 0] * sums.lengths
        steps = 0
        with one_thread():
            for _ in range(MAX_PULLS):
                ended = self._ascend(b + NEARNESS * x, x, sums, pushes)
                if ended is None:
                    return None
                x, pushes, more = ended
                steps += more
                gradient = self._M @ x - b - pushes @ sums.rows
                residual = kkt_residual(gradient, x, size, self._lower, self._upper)
                limit = max(tolerance, self._round_off(x, b, pushes @ sums.rows, size))
                if residual <= limit:
                    found = Optimum(x, gradient, NO_CAPS, residual, 0, steps, limit)
                    return self._optimum(found, sums, pushes)
        return None

    def from_inside(
        self, b: Doubles, near: NearAnswer, *, tolerance: float
    ) -> tuple[Optimum, Doubles] | NearAnswer:
        """Minimise by interior points, which wishes that hardly leave room do not slow down, and by
        the limits that hold at their end (held_sums.py); where that fails, return an answer nearby.
        """
        b, sums, k = b / self._root, _CountedSums(len(b)), len(b)
        size = float(np.abs(b).max(initial=0)) or 1.0
        start = x = np.clip(near.x * self._root, self._lower, self._upper)
        self._join(sums, np.flatnonzero(near.multipliers > 0))
        self._join(sums, np.flatnonzero(np.isfinite(self._least[self._count :])) + self._count)
        self._join_missed(sums, x)
        matrix, pushes = self._M.copy(), np.zeros(sums.least.size)
        matrix.flat[:: k + 1] += NEARNESS
        with one_thread():
            for _ in range(MAX_INTERIORS):
                inside = interior_point(self._with_caps(matrix, b, start, sums, size), start)
                if inside is None:
                    return near
                x, pushes = inside.x, np.maximum(inside.multipliers, 0)
                ones = np.ones(k), np.ones(sums.least.size)
                held = HeldSums(
                    self._M, sums.rows, sums.least, self._lower, self._upper, *ones
                ).minimise(b, x, pushes, near=start, tolerance=tolerance, close=CLOSE)
                if held is not None:
                    x, pushes = held[0].x, held[1]
                if self._join_missed(sums, x):
                    continue
                if held is not None:
                    return self._optimum(held[0], sums, pushes)
                break
        pushes = np.append(pushes, np.zeros(sums.least.size - pushes.size))
        return NearAnswer(x / self._root, *self._multipliers(sums, pushes))

    def _with_caps(
        self, M: Doubles, b: Doubles, start: Doubles, sums: _CountedSums, size: float
    ) -> Quadratic:
        """Return the scaled problem with the pull to start, (k,), and the sums as caps."""
        infinite, ones = np.full(sums.least.size, np.inf), np.ones(sums.least.size)
        bounds = self._lower, self._upper, np.ones(start.size)
        right = b + NEARNESS * start
        return Quadratic(M, right, *bounds, sums.rows, sums.least, infinite, ones, (), size)

    def _ascend(
        self, b: Doubles, x: Doubles, sums: _CountedSums, pushes: Doubles
    ) -> tuple[Doubles, Doubles, int] | None:
        """Maximise the dual function from multipliers (w,) of the sums, which are more at the end.

        x: (k,), near the optimum. Return x, the multipliers, and the number of steps.
        """
        check = cancellation_check()
        found = self._least_for(b, x, sums, pushes)
        for step in range(MAX_STEPS):
            check()
            if found is None:
                return None
            x = found
            has_joined = self._join_missed(sums, x)
            pushes = np.append(pushes, np.zeros(sums.least.size - pushes.size))
            missed = sums.missed(x)
            off = np.where(pushes > 0, np.abs(missed), np.maximum(missed, 0))
            if not has_joined and (off <= CLOSE * sums.sizes(x)).all():
                return x, pushes, step
            move = np.zeros(missed.size)
            counts = (pushes > 0) | (missed > 0)
            move[counts] = self._step(x, sums.rows[counts], missed[counts], pushes[counts])
            found, pushes = self._along(b, x, sums, pushes, move)
        return None

    def _step(self, x: Doubles, rows: Doubles, missed: Doubles, pushes: Doubles) -> Doubles:
        """Return Newton's step, (j,), of the multipliers (j,) of sums with rows (j, k)."""
        curvature = np.add.reduce([part.curvature(rows, x[part.places]) for part in self._parts])
        curvature.flat[:: missed.size + 1] += RIDGE
        return minimise(curvature, missed + curvature @ pushes, start=pushes).x - pushes

    def _along(
        self, b: Doubles, x: Doubles, sums: _CountedSums, pushes: Doubles, move: Doubles
    ) -> tuple[Doubles | None, Doubles]:
        """Return the end of a step of the multipliers, where the dual function rises no longer, and
        x there; None if that fails.
        """
        first = float(sums.missed(x) @ move)
        if not first > 0:
            return None, pushes
        falls = move < 0
        most = float((pushes[falls] / -move[falls]).min(initial=np.inf))
        low, high, part = (0.0, first), None, 1.0
        for _ in range(MAX_TRIALS):
            moved = np.maximum(pushes + part * move, 0)
            found = self._least_for(b, x, sums, moved)
            if found is None:
                return None, pushes
            slope = float(sums.missed(found) @ move)
            if abs(slope) <= FLAT * abs(first) or (slope > 0 and part >= most):
                return found, moved
            if slope > 0:
                low, x = (part, slope), found
            else:
                high = part, slope
            if high is None:
                part = min(most, LONGER * part)
            else:
                share = low[1] / (low[1] - high[1])
                part = low[0] + (high[0] - low[0]) * min(max(share, 0.1), 0.9)
        return found, moved

    def _least_for(
        self, b: Doubles, x: Doubles, sums: _CountedSums, pushes: Doubles
    ) -> Doubles | None:
        """Return the optimum under bounds, (k,), for multipliers (w,), from x, (k,)."""
        right, found = b + pushes @ sums.rows, np.empty_like(x)
        for part in self._parts:
            least = part.least(right[part.places], x[part.places])
            if least is None:
                return None
            found[part.places] = least
        return found

    def _join_missed(self, sums: _CountedSums, x: Doubles) -> bool:
        """Add the sums that x, (k,), misses most; return whether there are any."""
        shorts = self._least - np.concatenate([self._rows @ (x / self._root), self._cap_rows @ x])
        shorts[sums.which] = 0
        places = np.flatnonzero(shorts > 0)
        if not places.size:
            return False
        rows = self._rows_of(places)
        sizes = np.maximum(np.abs(self._least[places]), np.abs(rows) @ np.abs(x))
        missed = shorts[places] > CLOSE * sizes
        places, rows = places[missed], rows[missed]
        lengths = np.linalg.norm(rows, axis=1)
        most = np.argsort(-shorts[places] / np.where(lengths > 0, lengths, 1))[:JOINING]
        sums.join(places[most], rows[most], self._least[places[most]])
        return bool(most.size)

    def _join(self, sums: _CountedSums, places: Indices) -> None:
        sums.join(places, self._rows_of(places), self._least[places])

    def _rows_of(self, places: Indices) -> Doubles:
        """Return the rows of some sums, (j, k), in scaled unknowns."""
        of_caps = places >= self._count
        rows = np.empty((places.size, self._root.size))
        rows[~of_caps] = self._rows[places[~of_caps]] / self._root
        rows[of_caps] = self._cap_rows[places[of_caps] - self._count]
        return rows

    def _all_multipliers(self, near: NearAnswer) -> Doubles:
        """Return the multipliers of all sums, then of the lower and upper limits of caps."""
        caps = near.of_caps
        return np.concatenate([near.multipliers, np.maximum(caps, 0), np.maximum(-caps, 0)])

    def _multipliers(self, sums: _CountedSums, pushes: Doubles) -> tuple[Doubles, Doubles]:
        """Return the multipliers of all sums, (m,), and of caps, (c,)."""
        multipliers = np.zeros(self._least.size)
        multipliers[sums.which] = pushes / sums.lengths
        at_least, at_most = multipliers[self._count :].reshape(2, -1)
        return multipliers[: self._count], at_least - at_most

    def _round_off(self, x: Doubles, b: Doubles, pushed: Doubles, size: float) -> float:
        terms = np.abs(self._M) @ np.abs(x) + np.abs(b) + np.abs(pushed)
        return 4 * EPSILON * float(terms.max(initial=0)) / size

    def _optimum(
        self, optimum: Optimum, sums: _CountedSums, pushes: Doubles
    ) -> tuple[Optimum, Doubles]:
        """Return an optimum in scaled unknowns in the unknowns themselves, and the multipliers of
        the sums, (m,).
        """
        (lower, upper), x = self._bounds, optimum.x
        value = np.where(x <= self._lower, lower, x / self._root)
        value = np.where(x >= self._upper, upper, value)
        multipliers, of_caps = self._multipliers(sums, pushes)
        gradient = optimum.multipliers * self._root
        unscaled = replace(optimum, x=value, multipliers=gradient, cap_multipliers=of_caps)
        return unscaled, multipliers


def _cap_sums(caps: Sequence[Cap], root: Doubles) -> tuple[Doubles, Doubles]:
    """Return caps as sums that are at least as large as given values: their lower limits, then
    their upper ones, (2 c, k) and (2 c,), in scaled unknowns.
    """
    rows = np.zeros((len(caps), root.size))
    for row, cap in zip(rows, caps, strict=True):
        row[list(cap.unknowns)] = cap.coefficients
    rows /= root
    lower, upper = (np.array([getattr(cap, x) for cap in caps]) for x in ("lower", "upper"))
    return np.concatenate([rows, -rows]), np.concatenate([lower, -upper])
