"""The optimum under requirements, sums of unknowns that have to reach given values.

    minimise ½ xᵀM x − bᵀx    with    lower ≤ x ≤ upper    and    R x ≥ r

Unlike caps (quadratic.py), the sums may share unknowns and have coefficients of either sign, and
there may be thousands, few of which hold. The method of multipliers (Hestenes 1969, Powell 1969;
for inequalities Rockafellar, SIAM Journal on Control 12, 1974) solves problems without
requirements: a penalty draws x to the sums that it misses, and their multipliers, updated each
time, replace it. At its end the multipliers prove the optimum as the multipliers of bounds do. It
serves where an active set (dual_active_set.py), which is far quicker, does not end, and where
nothing meets all sums.

Sums that cannot all be reached are solved with shares of what they ask for that are given up:

    minimise ½ xᵀM x − bᵀx + p (Σ_j s_j + max_j s_j)
    with     lower ≤ x ≤ upper,   R x + S s ≥ r   and   0 ≤ s ≤ 1

At a price p above all that a share could buy elsewhere, no more is given up than has to be, and
nothing where all sums can be reached (an exact penalty; Han and Mangasarian, Mathematical
Programming 17, 1979). So one problem says what is within reach, and has the optimum there; limits
that leave x no room cannot contradict each other by round-off.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from lightpaint.arrays import Bools, Doubles, Indices
from lightpaint.lighting.algebra import Method
from lightpaint.lighting.algebra.dual_active_set import DualActiveSet, NearAnswer
from lightpaint.lighting.algebra.optimum import TOLERANCE, Optimum, QuadraticFamily
from lightpaint.lighting.algebra.quadratic import Cap
from lightpaint.progress import cancellation_check

#: Weight of the penalty, relative to a unit diagonal of M; its growth where the sums approach
#: their values slowly, and what is slow.
PENALTY, GROWTH, SLOW = 10.0, 10.0, 0.25

#: Largest miss of a sum, relative to its size; most updates of the multipliers, and most changes of
#: the sums that count between two updates.
CLOSE, MAX_UPDATES, MAX_CHANGES = 1e-9, 60, 40

#: Diagonal of M, relative to the largest, below which an unknown is scaled as if it had this one:
#: a light that no painted pixel sees still lights what is required.
LEAST_DIAGONAL = 1e-6

#: Bisections that end a step where the penalty is least.
BISECTIONS = 40


@dataclass(frozen=True)
class RequiredOptimum:
    """The best x under requirements.

    optimum: of the problem in which the multipliers, (m,), stand for them. multipliers: >= 0, the
    rise of the objective with each required value. miss: the largest shortfall of a sum, relative
    to its size. shares: (j,), that are given up; None where nothing may be.
    """

    optimum: Optimum
    multipliers: Doubles
    miss: float
    shares: Doubles | None = None

    @property
    def converged(self) -> bool:
        """True if all sums reach their values, and x is optimal."""
        return self.miss <= CLOSE and self.optimum.converged


class RequiredSums:
    """Problems with one M and the same sums, which differ in b.

    M: (k, k). rows: (m, k), R. least: (m,), r. lower, upper, caps, method: as in `minimise`. parts:
    places of unknowns that M joins with no others; all are one without.
    """

    def __init__(
        self,
        M: Doubles,
        rows: Doubles,
        least: Doubles,
        *,
        lower: Doubles,
        upper: Doubles,
        caps: Iterable[Cap] = (),
        method: Method = "polished",
        parts: Sequence[Indices] = (),
    ) -> None:
        self._M, self._rows, self._least = M, rows, least
        self._limits: dict[str, Any] = {
            "lower": lower,
            "upper": upper,
            "caps": tuple(caps),
            "method": method,
        }
        self._nothing_of_caps = np.zeros(len(self._limits["caps"]))
        self._active_set: DualActiveSet | None = None
        if method == "polished":
            self._active_set = DualActiveSet(
                M,
                rows,
                least,
                lower=lower,
                upper=upper,
                caps=self._limits["caps"],
                least_diagonal=LEAST_DIAGONAL,
                parts=parts,
            )
        self._penalty = PENALTY
        self._families: dict[bytes, QuadraticFamily] = {}

    def minimise(
        self,
        b: Doubles,
        start: Doubles,
        *,
        multipliers: Doubles | None = None,
        cap_multipliers: Doubles | None = None,
        close: float = CLOSE,
        max_updates: int = MAX_UPDATES,
        **options: Any,
    ) -> RequiredOptimum:
        """Minimise for b, (k,), from start, (k,), and the multipliers, (m,), of a similar problem.

        cap_multipliers: (c,), of its caps. close: the largest miss of a sum to end at. max_updates:
        of the method of multipliers; with 0, the result may be no more than the start. options: of
        `QuadraticFamily.minimise`.
        """
        duals = np.zeros(len(self._least)) if multipliers is None else multipliers
        if self._active_set is not None:
            of_caps = self._nothing_of_caps if cap_multipliers is None else cap_multipliers
            near = NearAnswer(start, duals, of_caps)
            tolerance = options.get("tolerance", TOLERANCE)
            found = self._active_set.minimise(
                b, near, tolerance=tolerance, is_quick=not max_updates
            )
            if found is not None:
                return RequiredOptimum(*found, miss=0.0)
        x, last, check = start, np.inf, cancellation_check()
        if not max_updates:
            nothing = np.zeros(start.size)
            unsolved = Optimum(start, nothing, self._nothing_of_caps, np.inf, 0, 0, TOLERANCE)
            return RequiredOptimum(unsolved, duals, np.inf)
        for _ in range(max_updates):
            check()
            optimum = self._with_multipliers(b, x, duals, options)
            x, weights = optimum.x, self._weights
            sums = self._rows @ x
            updated = np.maximum(0.0, duals + weights * (self._least - sums))
            # What an update changes is the miss of sums that hold, and of others the excess of
            # their multipliers.
            sizes = np.maximum(np.abs(self._least), np.abs(self._rows) @ np.abs(x))
            sizes = np.where(sizes > 0, sizes, 1.0)
            miss = float((np.abs(updated - duals) / (weights * sizes)).max(initial=0))
            duals = updated
            if miss <= close:
                break
            if miss > SLOW * last:
                self._penalty *= GROWTH
                self._families.clear()
            last = miss
        short = float(((self._least - self._rows @ x) / sizes).max(initial=0))
        return RequiredOptimum(optimum, duals, max(short, 0.0))

    @cached_property
    def _sizes(self) -> Doubles:
        """(m,), what a sum changes by where unknowns of length 1 push it."""
        power = self._M.diagonal()
        largest = float(power.max(initial=0)) or 1.0
        least = np.maximum(power, LEAST_DIAGONAL * largest)
        spread = np.einsum("mk,k->m", np.square(self._rows), 1 / least)
        return np.where(spread > 0, spread, 1.0)

    @property
    def _weights(self) -> Doubles:
        """(m,), of the penalty of each sum."""
        return self._penalty / self._sizes

    def _with_multipliers(
        self, b: Doubles, x: Doubles, duals: Doubles, options: dict[str, Any]
    ) -> Optimum:
        """Return the optimum with the penalty of the sums that count, under fixed multipliers."""
        counted: Bools | None = None
        for _ in range(MAX_CHANGES):
            counts = self._counts(x, duals)
            if counted is not None and (counts == counted).all():
                break
            counted = counts
            optimum = self._minimise_counted(b, x, duals, counted, options)
            x = self._end_of_step(b, x, optimum.x, duals)
        return optimum

    def _counts(self, x: Doubles, duals: Doubles) -> Bools:
        """Return, (m,), which sums miss their values or are held by their multipliers."""
        return np.asarray(duals + self._weights * (self._least - self._rows @ x) > 0)

    def _minimise_counted(
        self, b: Doubles, x: Doubles, duals: Doubles, counted: Bools, options: dict[str, Any]
    ) -> Optimum:
        rows, weights = self._rows[counted], self._weights[counted]
        key = np.packbits(counted).tobytes()
        if key not in self._families:
            self._families.clear()
            M = self._M + (rows.T * weights) @ rows
            self._families[key] = QuadraticFamily(M, **self._limits)
        right = b + (weights * self._least[counted] + duals[counted]) @ rows
        return self._families[key].minimise(right, x, **options)

    def _end_of_step(self, b: Doubles, x: Doubles, target: Doubles, duals: Doubles) -> Doubles:
        """Return where on the way from x to the optimum of some sums the penalty of all is least.

        It is the optimum itself unless sums that did not count are missed there.
        """
        move = target - x
        slope, curve = float(move @ (self._M @ x - b)), float(move @ self._M @ move)
        weights, rises = self._weights, self._rows @ move
        pulls = duals + weights * (self._least - self._rows @ x)

        def slope_at(t: float) -> float:
            held = np.maximum(0.0, pulls - t * weights * rises)
            return slope + t * curve - float(held @ rises)

        if slope_at(1.0) <= 0:
            return target
        low, high = 0.0, 1.0
        for _ in range(BISECTIONS):
            middle = (low + high) / 2
            low, high = (low, middle) if slope_at(middle) > 0 else (middle, high)
        return np.asarray(x + high * move)


class SumsWithShares:
    """Problems as `RequiredSums` has them, with shares of sums that may be given up.

    shares: (j,), to begin with. sizes: (m, j), S, by how much giving up all of a share lowers each
    sum. price: p, of a whole share, in the unit of the objective.
    """

    def __init__(
        self,
        M: Doubles,
        rows: Doubles,
        least: Doubles,
        *,
        shares: Doubles,
        sizes: Doubles,
        price: float,
        lower: Doubles,
        upper: Doubles,
        parts: Sequence[Indices] = (),
        **options: Any,
    ) -> None:
        self._k, self._m, j, self._shares = len(M), len(rows), shares.size, shares
        # The length of a share at which its cost and its limits have the same size.
        power = LEAST_DIAGONAL * float(M.diagonal().max(initial=0))
        self._length = (price / power) ** 0.5 if power > 0 else 1.0
        self._cost = np.full(j + 1, price / self._length)
        whole = np.zeros((self._k + j + 1,) * 2)
        whole[: self._k, : self._k] = M
        with_shares = np.hstack([rows, sizes / self._length, np.zeros((self._m, 1))])
        largest = np.hstack([np.zeros((j, self._k)), -np.eye(j), np.ones((j, 1))])
        self._sums = RequiredSums(
            whole,
            np.vstack([with_shares, largest]),
            np.append(least, np.zeros(j)),
            lower=np.append(lower, np.zeros(j + 1)),
            upper=np.append(upper, np.full(j + 1, self._length)),
            parts=[*(parts or [np.arange(self._k)]), np.arange(self._k, len(whole))],
            **options,
        )

    def minimise(
        self, b: Doubles, start: Doubles, *, multipliers: Doubles | None = None, **options: Any
    ) -> RequiredOptimum:
        """Minimise as `RequiredSums.minimise` does."""
        if multipliers is not None:
            multipliers = np.append(multipliers, np.zeros(self._shares.size))
        begin = self._length * np.append(self._shares, self._shares.max(initial=0))
        found = self._sums.minimise(
            np.append(b, -self._cost), np.append(start, begin), multipliers=multipliers, **options
        )
        optimum, k = found.optimum, self._k
        own = replace(optimum, x=optimum.x[:k], multipliers=optimum.multipliers[:k])
        self._shares = optimum.x[k:-1] / self._length
        of_sums = found.multipliers[: self._m]
        return replace(found, optimum=own, multipliers=of_sums, shares=self._shares)
