"""The optimum under sums that cannot all be reached: shares of what they ask for are given up.

    minimise ½ xᵀM x − bᵀx + p (Σ_j s_j + max_j s_j)
    with     lower ≤ x ≤ upper,   R x + S s ≥ r   and   0 ≤ s ≤ 1

At a price p above all that a share could buy elsewhere, no more is given up than has to be, and
nothing where all sums can be reached (an exact penalty; Han and Mangasarian, Mathematical
Programming 17, 1979). So one problem says what is within reach, and has the optimum there; limits
that leave x no room cannot contradict each other by round-off.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from lightpaint.arrays import Doubles, Indices
from lightpaint.lighting.algebra.required_sums import (
    LEAST_DIAGONAL,
    RequiredOptimum,
    RequiredSums,
)


class SumsWithShares:
    """Problems as `RequiredSums` has them, with shares of sums that may be given up.

    shares: (j,), to begin with. sizes: (m, j), S, by how much giving up all of a share lowers each
    sum. price: p, of a whole
    share, in the unit of the objective.
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
