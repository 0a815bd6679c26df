"""Optima of many unknowns under some bounds and sums, by one Cholesky factor while these change.

With the unknowns F between their bounds and the sums A that hold, the optimum and its multipliers y
solve

    M_FF z − A_Fᵀ y = c_F,    A_F z = d

A factor of those unknowns that were free at first serves all similar F and A: a sum that holds, an
unknown that became held, and one that became free are each one more row and column beside it (Gill,
Murray, Saunders, Wright, SIAM Review 33, 1991: Schur complement methods). Its column is divided by
the factor once.
"""

from collections.abc import Hashable, Sequence

import numpy as np

from lightpaint.arrays import Bools, Doubles, Indices
from lightpaint.lighting.algebra.symmetric_matrices import BlockFactor, cholesky

#: Columns beside a factor: at least so many, and else this share of its unknowns. With more, a new
#: factor is as quick.
LEAST_COLUMNS, COLUMN_SHARE = 48, 1 / 4


class BorderedFactor:
    """M, (k, k), positive definite. parts: places of unknowns that M joins with no others."""

    def __init__(self, M: Doubles, parts: Sequence[Indices]) -> None:
        self._M, self._parts = M, tuple(parts)
        self._base = np.zeros(len(M), bool)
        self._rows = np.zeros(0, np.intp)
        self._factor = BlockFactor(0, ())
        self._border = Border(0, 0)

    def solve(
        self, free: Bools, right: Doubles, sums: Doubles, which: Indices, least: Doubles
    ) -> tuple[Doubles, Doubles] | None:
        """Return z, (k,), 0 where it is not free, and the multipliers y, (w,); None if M is not
        positive definite.

        free: (k,). right: (k,), c. sums: (m, k), all that may hold, numbered; which: (w,), that do;
        least: (w,), d.
        """
        added = np.flatnonzero(free & ~self._base)
        held = np.flatnonzero(~free & self._base)
        if added.size + held.size + which.size > self._border.room:
            if not self._refactor(free, which.size):
                return None
            added = held = added[:0]
        border = self._places(sums, which, held, added)
        half = self._factor.divide(right[self._rows])
        sides = np.concatenate([least, np.zeros(held.size), right[added]])
        small = -self._border.products[np.ix_(border, border)]
        first, w = which.size + held.size, which.size
        small[first:, first:] += self._M[np.ix_(added, added)]
        across = sums[np.ix_(which, added)]
        small[first:, :w] += across.T
        small[:w, first:] += across
        if border.size:
            columns = self._border.columns[:, border]
            try:
                beside = np.linalg.solve(small, sides - columns.T @ half)
            except np.linalg.LinAlgError:
                return None
            half -= columns @ beside
        else:
            beside = sides
        z = np.zeros(len(self._M))
        z[self._rows] = self._factor.divide(half, is_second=True)
        z[held], z[added] = 0, beside[first:]
        return z, np.asarray(-beside[:w], np.float64)

    def _refactor(self, free: Bools, sums: int) -> bool:
        """Factor the matrix of the free unknowns; return whether it is positive definite."""
        self._base, rows, begin = free.copy(), list[Indices](), 0
        factors = list[tuple[slice, Doubles]]()
        for part in self._parts:
            own = part[free[part]]
            try:
                # The transpose, in the order of LAPACK, needs no copy.
                factor = cholesky(self._M[np.ix_(own, own)].T)
            except np.linalg.LinAlgError:
                self._base[:] = False
                return False
            if own.size:
                factors.append((slice(begin, begin + own.size), factor))
            rows.append(own)
            begin += own.size
        self._factor = BlockFactor(begin, factors)
        self._rows = np.concatenate(rows)
        room = sums + max(LEAST_COLUMNS, int(COLUMN_SHARE * begin))
        self._border = Border(begin, room)
        return True

    def _places(self, sums: Doubles, which: Indices, held: Indices, added: Indices) -> Indices:
        """Return the columns of sums, held and added unknowns, made where they are new."""
        border = self._border
        keys = [("sum", x) for x in which.tolist()] + [("held", x) for x in held.tolist()]
        keys += [("added", x) for x in added.tolist()]
        new = [key for key in keys if key not in border.places]
        if len(border.places) + len(new) > border.room:
            self._border = border = Border(self._rows.size, border.room)
            new = keys
        if new:
            columns = np.zeros((self._rows.size, len(new)))
            for column, (kind, x) in zip(columns.T, new, strict=True):
                if kind == "sum":
                    column[:] = sums[x, self._rows]
                elif kind == "added":
                    column[:] = self._M[x, self._rows]
                else:
                    column[self._rows == x] = 1
            border.join(new, self._factor.divide(columns))
        return np.array([border.places[key] for key in keys], np.intp)


class Border:
    """Columns beside a factor of r unknowns, divided by it, at most `room`.

    places: the column of each sum or unknown, by a key. columns: (r, room), 0 where there is none
    yet. products: their inner products, (room, room).
    """

    def __init__(self, rows: int, room: int) -> None:
        self.places: dict[Hashable, int] = {}
        self.columns = np.zeros((rows, room), order="F")
        self.products = np.zeros((room, room))
        self.room = room

    def join(self, keys: Sequence[Hashable], columns: Doubles) -> None:
        """Add columns, (r, j)."""
        first = len(self.places)
        end = first + len(keys)
        self.places |= {key: first + k for k, key in enumerate(keys)}
        self.columns[:, first:end] = columns
        products = self.columns[:, :end].T @ columns
        self.products[:end, first:end], self.products[first:end, :end] = products, products.T
