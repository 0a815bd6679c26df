"""Convex quadratics solved by quadprog, the dual active-set method of Goldfarb and Idnani."""

from typing import Any

import numpy as np
import quadprog


def least(
    M: Any, b: Any, *, lower: Any = 0.0, upper: Any = np.inf, rows: Any = (), limits: Any = ()
) -> Any:
    """x that minimises ½ xᵀM x − bᵀx over lower ≤ x ≤ upper and low ≤ row · x ≤ high.

    M: (n, n), positive definite. rows: (k, n); limits: k pairs, which may be infinite or equal.
    """
    n = b.size
    lower, upper = np.broadcast_to(lower, n), np.broadcast_to(upper, n)
    equal, unequal = [], []
    every = [*zip(np.eye(n), lower, upper, strict=True)]
    every += [(row, low, high) for row, (low, high) in zip(rows, limits, strict=True)]
    for row, low, high in every:
        if low == high:
            equal.append((row, low))
            continue
        unequal += [(row, low)] if np.isfinite(low) else []
        unequal += [(-row, -high)] if np.isfinite(high) else []
    # Units in which all unknowns matter alike, for its own tolerances.
    scale = 1 / np.sqrt(np.diag(M))
    columns = np.array([row * scale for row, _ in (*equal, *unequal)]).T
    sizes = np.linalg.norm(columns, axis=0)
    values = np.array([value for _, value in (*equal, *unequal)]) / sizes
    optimum = quadprog.solve_qp(
        M * scale[:, None] * scale, b * scale, columns / sizes, values, len(equal)
    )
    return optimum[0] * scale
