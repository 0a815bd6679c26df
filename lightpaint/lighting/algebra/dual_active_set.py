"""The optimum under bounds and required sums, by a dual active set.

The method of Goldfarb and Idnani (Mathematical Programming 27, 1983). Its points are optima under
some of the bounds and sums, whose multipliers have the right sign; the limit that such a point
misses most is added, and others leave whose multipliers come to 0 on the way. Each such step raises
the objective, so that steps end. Of thousands of sums few hold: those that a point misses join
later (Kelley's cutting planes), and so do caps (quadratic.py). An answer to a similar problem says
with which limits to begin, so that few change; without one, an interior-point method guesses them,
and again where many steps follow.

Where many mixes are equal, M is singular. A pull to where x was makes the optimum single, and is
repeated until it pulls no longer (the proximal-point method; Rockafellar, SIAM Journal on Control
14, 1976).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from lightpaint.arrays import Bools, Doubles, Indices
from lightpaint.lighting.algebra.bordered_factor import BorderedFactor
from lightpaint.lighting.algebra.interior_point import interior_point
from lightpaint.lighting.algebra.optimum import NO_CAPS, Optimum
from lightpaint.lighting.algebra.quadratic import EPSILON, Cap, Quadratic, cap_rows, kkt_residual
from lightpaint.lighting.algebra.symmetric_matrices import BlockMatrix, large_libraries
from lightpaint.progress import cancellation_check
from lightpaint.threads import one_thread

#: The pull to where an answer was, relative to a unit diagonal of M, and how often it is repeated.
NEARNESS, MAX_PULLS = 1e-8, 30

#: Largest miss of a sum, relative to its size; and sums that join at a time.
CLOSE, JOINING = 1e-10, 16

#: Distance of a sum from what it has to reach, relative to its size, at which an answer meets it.
MET = 1e-6

#: Violations of bounds and multipliers that are round-off, relative to the largest unknown and b.
ROUND_OFF = 1e-12

#: Share of a limit's own direction below which the limits that hold leave it none.
NO_DIRECTION = 1e-9

#: Miss of a sum that is to hold, relative to its size, from which sums depend on each other; and
#: the share of a row of length 1 that is its own.
DEPENDENT = 1e-6

#: Where an interior-point method ends: the limits that hold are clear by then. Most sums that join
#: for it, and steps after which it is tried with those that have joined: they take as long as it.
INSIDE_CLOSE, INSIDE_SUMS, PATIENCE = 1e-16, 64, 48

#: Share of the most wrong multiplier from which others leave with it.
WORST = 0.5

#: Most steps for each unknown and sum.
STEPS_EACH = 4

#: Most steps of a quick attempt. A linear program, which says whether there is an answer at all,
#: takes as long as these.
QUICK_STEPS = 200


@dataclass(frozen=True)
class NearAnswer:
    """An answer to begin with. x: (k,). multipliers: (m,), of the sums; of_caps: (c,), as
    `Optimum` has them.
    """

    x: Doubles
    multipliers: Doubles
    of_caps: Doubles


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


@dataclass
class _Held:
    """The limits that hold. low, high: (k,), unknowns at their bounds; sums: (w,), by place."""

    low: Bools
    high: Bools
    sums: Bools

    @property
    def free(self) -> Bools:
        """(k,), the unknowns between their bounds."""
        return ~(self.low | self.high)

    @property
    def count(self) -> int:
        """The number of limits that hold."""
        return int(self.low.sum() + self.high.sum() + self.sums.sum())


@dataclass
class _DualPoint:
    """x, (k,), the multipliers of sums, (w,), and the gradient less what these balance, (k,)."""

    x: Doubles
    pushes: Doubles
    gradient: Doubles


#: The field of `_Held` that says whether a limit holds.
Kind = Literal["low", "high", "sums"]


@dataclass(frozen=True)
class _Place:
    """A limit, by its place in a field of `_Held`."""

    kind: Kind
    place: int


@dataclass(frozen=True)
class _Missed(_Place):
    """A limit that is missed. missed: by how much. normal: (k,), the direction that it asks for."""

    missed: float
    normal: Doubles


class DualActiveSet:
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
        whole = M / self._root[:, None]
        whole /= self._root
        whole.flat[:: len(M) + 1] += NEARNESS
        self._whole, self._parts = whole, parts
        self._M = BlockMatrix.of(whole, parts)
        self._bounds = lower, upper
        self._lower, self._upper = lower * self._root, upper * self._root
        self._is_fixed = self._lower >= self._upper
        self._rows, self._count = rows, len(least)
        self._cap_rows, cap_least = cap_rows(caps, len(M))
        self._cap_rows /= self._root
        self._least = np.concatenate([least, cap_least])
        self._factor = BorderedFactor(whole, parts or [np.arange(len(M))])
        self._sums = _CountedSums(len(M))

    def minimise(
        self, b: Doubles, near: NearAnswer, *, tolerance: float, is_quick: bool = False
    ) -> tuple[Optimum, Doubles] | None:
        """Minimise for b, (k,), from the answer to a similar problem.

        tolerance: of the KKT residual. is_quick: whether to end without an answer after
        `QUICK_STEPS`. Return the optimum, and the multipliers of the sums; None if nothing
        satisfies all limits, or steps do not end.
        """
        b = b / self._root
        size = float(np.abs(b).max(initial=0)) or 1.0
        x = np.clip(near.x * self._root, self._lower, self._upper)
        with one_thread():
            held, steps = self._limits_of(near, x), 0
            is_inside = held is None
            if held is None:
                inside = self._limits_inside(b + NEARNESS * x, x)
                # Interior points fail where nothing satisfies all limits, or an unknown is fixed.
                if inside is None and is_quick and not self._is_fixed.any():
                    return None
                held, is_inside = inside or self._bounds_of(x), inside is not None
            for _ in range(MAX_PULLS):
                ended = self._optimum_from(b, x, held, is_inside=is_inside, is_quick=is_quick)
                if ended is None:
                    return None
                last, (point, held, more) = x, ended
                x, steps = point.x, steps + more
                gradient = point.gradient + NEARNESS * (last - x)
                residual = kkt_residual(gradient, x, size, self._lower, self._upper)
                limit = max(tolerance, self._round_off(x, b, point.pushes, size))
                if residual <= limit:
                    found = Optimum(x, gradient, NO_CAPS, residual, 0, steps, limit)
                    return self._unscaled(found, point.pushes)
        return None

    def _limits_of(self, near: NearAnswer, x: Doubles) -> _Held | None:
        """Return the limits that hold an answer, whose scaled unknowns are x, (k,); None if it
        misses sums and has no multipliers, as at the first time.
        """
        caps, count = near.of_caps, self._count
        holds = np.concatenate([near.multipliers > 0, caps > 0, caps < 0])
        if not (holds[:count].any() and caps.any()):
            is_met, is_missed = self._met(x)
            if not holds.any() and is_missed:
                return None
            if not holds[:count].any():
                holds[:count] = is_met[:count]
            if not caps.any():
                holds[count:] = is_met[count:]
        known = np.zeros(holds.size, bool)
        known[self._sums.which] = True
        self._join(np.flatnonzero(holds & ~known))
        low = self._is_fixed | (x <= self._lower)
        return _Held(low, ~low & (x >= self._upper), holds[self._sums.which])

    def _bounds_of(self, x: Doubles) -> _Held:
        """Return the bounds at which x, (k,), is, and no sums."""
        low = self._is_fixed | (x <= self._lower)
        return _Held(low, ~low & (x >= self._upper), np.zeros(self._sums.which.size, bool))

    def _limits_inside(self, b: Doubles, x: Doubles) -> _Held | None:
        """Return the limits that hold near the optimum, as interior points know it, with the sums
        that x, (k,), misses most; None where these fail.
        """
        sums, caps = self._sums, np.arange(self._count, self._least.size)
        self._join(caps[np.isfinite(self._least[caps]) & ~np.isin(caps, sums.which)])
        self._join_missed(x, INSIDE_SUMS)
        nothing, infinite = np.ones(b.size), np.full(sums.least.size, np.inf)
        bounds, scale = (self._lower, self._upper), np.ones(sums.least.size)
        size = float(np.abs(b).max(initial=0)) or 1.0
        problem = Quadratic(
            self._whole, b, *bounds, nothing, sums.rows, sums.least, infinite, scale, (), size
        )
        inside = interior_point(problem, x, close=INSIDE_CLOSE, parts=self._parts)
        if inside is None:
            return None
        return replace(self._bounds_of(inside.x), sums=inside.multipliers > 0)

    def _optimum_from(
        self, b: Doubles, start: Doubles, held: _Held, *, is_inside: bool, is_quick: bool
    ) -> tuple[_DualPoint, _Held, int] | None:
        """Return the optimum with the pull, the limits that hold there, and the number of steps.

        start: (k,), to which the pull is. held: limits that may hold there. is_inside: whether
        interior points have found them.
        """
        b = b + NEARNESS * start
        begun = self._begin(b, start, held)
        if begun is None:
            return None
        point, held, steps = begun
        check, again = cancellation_check(), PATIENCE
        known_inside = self._sums.which.size if is_inside else -1
        most = QUICK_STEPS if is_quick else STEPS_EACH * (b.size + len(self._least))
        while steps < most:
            check()
            if steps > again and self._sums.which.size > known_inside:
                begun = self._begin_inside(b, point.x)
                if begun is None and is_quick:
                    return None
                point, held = begun[:2] if begun else self._with_joined(point, held)
                again, known_inside = steps + PATIENCE, self._sums.which.size
            limit = self._most_missed(point, held)
            if limit is not None:
                more = self._add(point, held, limit)
                if more is None:
                    return None
                steps += more
                continue
            exact = self._solved(b, held)
            if exact is None:
                return None
            if not self._join_missed(exact.x):
                return exact, held, steps
            point, held = self._with_joined(exact, held)
        return None

    def _begin(
        self, b: Doubles, start: Doubles, held: _Held
    ) -> tuple[_DualPoint, _Held, int] | None:
        """Return an optimum under some limits, their multipliers of the right sign.

        Of the limits that may hold, those leave whose multipliers have the wrong sign. Where these
        limits depend on each other, interior points find others.

        start: (k,), where unknowns are that change nothing.
        """
        return (
            self._with_right_signs(b, held)
            or self._begin_inside(b, start)
            or self._with_right_signs(b, self._bounds_of(start))
        )

    def _begin_inside(self, b: Doubles, x: Doubles) -> tuple[_DualPoint, _Held, int] | None:
        """Return an optimum under limits that interior points find, as `_limits_inside` does."""
        limits = self._limits_inside(b, x)
        return None if limits is None else self._with_right_signs(b, limits)

    def _with_right_signs(self, b: Doubles, held: _Held) -> tuple[_DualPoint, _Held, int] | None:
        """Drop limits until all multipliers have the right sign."""
        steps = 0
        while True:
            point, steps = self._solved(b, held), steps + 1
            if point is None or not self._keeps(point, held):
                if not held.sums.any():
                    return None
                fewer = self._independent(held)
                is_same = fewer.count == held.count
                held = replace(held, sums=np.zeros_like(held.sums)) if is_same else fewer
                continue
            if self._rightly_held(b, point, held).count == held.count:
                return point, held, steps
            # Where one leaves, others often come to the right sign.
            held = self._without_worst(point, held)

    def _rightly_held(self, b: Doubles, point: _DualPoint, held: _Held) -> _Held:
        """Return the limits whose multipliers have the right sign at a point."""
        pull = ROUND_OFF * float(np.abs(b).max(initial=0))
        low = self._is_fixed | (held.low & (point.gradient >= -pull))
        high = held.high & (point.gradient <= pull)
        return _Held(low, high, held.sums & (point.pushes >= -pull))

    def _keeps(self, point: _DualPoint, held: _Held) -> bool:
        """Return whether a point reaches the sums that are to hold: if they depend on each other,
        it does not.
        """
        off = np.abs(self._sums.missed(point.x)[held.sums])
        return bool((off <= DEPENDENT * self._sums.sizes(point.x)[held.sums]).all())

    def _without_worst(self, point: _DualPoint, held: _Held) -> _Held:
        """Return the limits without those whose multipliers are most wrong."""
        wrongs = (
            np.where(held.low & ~self._is_fixed, -point.gradient, 0),
            np.where(held.high, point.gradient, 0),
            np.where(held.sums, -point.pushes, 0),
        )
        worst = WORST * max(float(wrong.max(initial=0)) for wrong in wrongs)
        low, high, sums = (wrong < worst for wrong in wrongs)
        return _Held(held.low & low, held.high & high, held.sums & sums)

    def _independent(self, held: _Held) -> _Held:
        """Return the limits without sums that depend on the others over the free unknowns."""
        if not held.free.any():
            return replace(held, sums=np.zeros_like(held.sums))
        lapack, _ = large_libraries()
        which = np.flatnonzero(held.sums)
        rows = self._sums.rows[np.ix_(which, held.free)]
        factored, order, *_ = lapack.dgeqp3(rows.T)
        sizes = np.abs(factored.diagonal())
        sums = np.zeros_like(held.sums)
        sums[which[order[: sizes.size][sizes > DEPENDENT] - 1]] = True
        return replace(held, sums=sums)

    def _solved(self, b: Doubles, held: _Held) -> _DualPoint | None:
        """Return the optimum under the limits that hold, whatever it misses; None if there is
        none.
        """
        sums, which = self._sums, np.flatnonzero(held.sums)
        x = np.where(held.low, self._lower, np.where(held.high, self._upper, 0.0))
        gradient = self._M @ x - b
        pushes = np.zeros(held.sums.size)
        for _ in range(2):  # the second time corrects the round-off of the first
            least = sums.missed(x)[which]
            solved = self._factor.solve(held.free, -gradient, sums.rows, which, least)
            if solved is None:
                return None
            x, pushes[which] = x + solved[0], pushes[which] + solved[1]
            gradient = self._M @ x - b - pushes @ sums.rows
        return _DualPoint(x, pushes, gradient) if np.isfinite(x).all() else None

    def _most_missed(self, point: _DualPoint, held: _Held) -> _Missed | None:
        """Return the limit that a point misses most, of bounds and of the sums that count."""
        x, sums = point.x, self._sums
        missed = sums.missed(x)
        missed[held.sums | (missed <= CLOSE * sums.sizes(x))] = 0
        room = ROUND_OFF * float(np.abs(x).max(initial=0))
        below = np.where(held.free, self._lower - x, 0)
        above = np.where(held.free, x - self._upper, 0)
        most = max((float(y.max(initial=0)) for y in (below, above)), default=0.0)
        if missed.max(initial=0) > 0 and missed.max() >= most:
            place = int(np.argmax(missed))
            return _Missed("sums", place, float(missed[place]), sums.rows[place])
        if not most > room:
            return None
        is_low = below.max() >= above.max()
        place = int(np.argmax(below if is_low else above))
        normal = np.zeros(x.size)
        normal[place] = 1 if is_low else -1
        return _Missed("low" if is_low else "high", place, most, normal)

    def _add(self, point: _DualPoint, held: _Held, limit: _Missed) -> int | None:
        """Add a limit, in place, while others leave whose multipliers come to 0; return the
        number of steps, None if nothing satisfies all of them.
        """
        missed, pushed, steps = limit.missed, 0.0, 0
        while True:
            which, steps = np.flatnonzero(held.sums), steps + 1
            solved = self._factor.solve(
                held.free, limit.normal, self._sums.rows, which, np.zeros(which.size)
            )
            if solved is None:
                return None
            z, pushes = solved[0], np.zeros(held.sums.size)
            pushes[which] = solved[1]
            rise = self._M @ z
            own = np.abs(limit.normal[held.free]).max(initial=0)
            is_dependent = np.abs(rise[held.free]).max(initial=0) <= NO_DIRECTION * own
            slope = 0.0 if is_dependent else float(limit.normal @ z)
            rise -= limit.normal + pushes @ self._sums.rows
            whole = missed / slope if slope > 0 else np.inf
            part, leaving = self._first_to_leave(point, held, rise, pushes)
            if whole == part == np.inf:
                return None
            step = min(whole, part)
            if slope > 0:
                point.x += step * z
                missed -= step * slope
            point.pushes += step * pushes
            point.gradient += step * rise
            pushed += step
            if whole <= part:
                self._let_hold(point, held, limit, pushed)
                return steps
            getattr(held, leaving.kind)[leaving.place] = False
            (point.pushes if leaving.kind == "sums" else point.gradient)[leaving.place] = 0

    def _first_to_leave(
        self, point: _DualPoint, held: _Held, rise: Doubles, pushes: Doubles
    ) -> tuple[float, _Place]:
        """Return the step after which the first multiplier comes to 0, and its limit.

        rise, pushes: the changes of the gradient, (k,), and of the sums' multipliers, (w,).
        """
        found = np.inf, _Place("sums", -1)
        kinds: tuple[tuple[Kind, Bools, Doubles, Doubles], ...] = (
            ("sums", held.sums, point.pushes, pushes),
            ("low", held.low & ~self._is_fixed, point.gradient, rise),
            ("high", held.high, -point.gradient, -rise),
        )
        for kind, holds, now, change in kinds:
            falling = np.flatnonzero(holds & (change < 0))
            if falling.size:
                steps = np.maximum(now[falling], 0) / -change[falling]
                least = int(np.argmin(steps))
                if steps[least] < found[0]:
                    found = float(steps[least]), _Place(kind, int(falling[least]))
        return found

    def _let_hold(self, point: _DualPoint, held: _Held, limit: _Missed, pushed: float) -> None:
        """Add a limit that a point reaches now, with its multiplier, in place."""
        kind, place = limit.kind, limit.place
        getattr(held, kind)[place] = True
        if kind == "sums":
            point.pushes[place] = pushed
            return
        point.x[place] = (self._lower if kind == "low" else self._upper)[place]
        point.gradient[place] = pushed * limit.normal[place]

    def _missed(self, x: Doubles) -> Doubles:
        """Return what x, (k,), misses of all sums and caps."""
        sums = np.concatenate([self._rows @ (x / self._root), self._cap_rows @ x])
        return np.asarray(self._least - sums)

    def _met(self, x: Doubles) -> tuple[Bools, bool]:
        """Return which sums and caps x, (k,), meets or misses, and whether it misses any."""
        missed, least = self._missed(x), np.where(np.isfinite(self._least), np.abs(self._least), 0)
        # No sum is larger, so that few are near enough to need their own size.
        rooms = MET * np.maximum(least, self._lengths * np.linalg.norm(x))
        near = np.flatnonzero(np.abs(missed) <= rooms)
        terms = np.abs(self._rows_of(near)) @ np.abs(x)
        rooms[near] = MET * np.maximum(least[near], terms)
        return missed >= -rooms, bool((missed > rooms).any())

    @cached_property
    def _lengths(self) -> Doubles:
        """The lengths of the rows of all sums and caps."""
        of_sums = np.einsum("mk,mk,k->m", self._rows, self._rows, 1 / np.square(self._root))
        of_caps = np.square(self._cap_rows).sum(axis=1)
        return np.asarray(np.sqrt(np.concatenate([of_sums, of_caps])))

    def _join_missed(self, x: Doubles, most: int = JOINING) -> bool:
        """Add the sums that x, (k,), misses most; return whether there are any."""
        sums, shorts = self._sums, self._missed(x)
        shorts[sums.which] = 0
        places = np.flatnonzero(shorts > 0)
        if not places.size:
            return False
        rows = self._rows_of(places)
        sizes = np.maximum(np.abs(self._least[places]), np.abs(rows) @ np.abs(x))
        missed = shorts[places] > CLOSE * sizes
        places, rows = places[missed], rows[missed]
        lengths = np.linalg.norm(rows, axis=1)
        order = np.argsort(-shorts[places] / np.where(lengths > 0, lengths, 1))[:most]
        sums.join(places[order], rows[order], self._least[places[order]])
        return bool(order.size)

    def _with_joined(self, point: _DualPoint, held: _Held) -> tuple[_DualPoint, _Held]:
        """Return a point and the limits that hold it, with sums that have joined."""
        more = self._sums.which.size - held.sums.size
        pushes = np.append(point.pushes, np.zeros(more))
        sums = np.append(held.sums, np.zeros(more, bool))
        return replace(point, pushes=pushes), replace(held, sums=sums)

    def _join(self, places: Indices) -> None:
        self._sums.join(places, self._rows_of(places), self._least[places])

    def _rows_of(self, places: Indices) -> Doubles:
        """Return the rows of some sums, (j, k), in scaled unknowns."""
        of_caps = places >= self._count
        rows = np.empty((places.size, self._root.size))
        rows[~of_caps] = self._rows[places[~of_caps]] / self._root
        rows[of_caps] = self._cap_rows[places[of_caps] - self._count]
        return rows

    def _round_off(self, x: Doubles, b: Doubles, pushes: Doubles, size: float) -> float:
        pushed = np.abs(pushes @ self._sums.rows)
        terms = self._M.absolute() @ np.abs(x) + np.abs(b) + pushed
        return 4 * EPSILON * float(terms.max(initial=0)) / size

    def _unscaled(self, optimum: Optimum, pushes: Doubles) -> tuple[Optimum, Doubles]:
        """Return an optimum in the unknowns themselves, and the multipliers of the sums, (m,)."""
        (lower, upper), x = self._bounds, optimum.x
        value = np.where(x <= self._lower, lower, x / self._root)
        value = np.where(x >= self._upper, upper, value)
        multipliers = np.zeros(self._least.size)
        multipliers[self._sums.which] = np.maximum(pushes, 0) / self._sums.lengths
        at_least, at_most = multipliers[self._count :].reshape(2, -1)
        gradient = optimum.multipliers * self._root
        unscaled = replace(
            optimum, x=value, multipliers=gradient, cap_multipliers=at_least - at_most
        )
        return unscaled, multipliers[: self._count]
