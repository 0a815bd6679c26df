"""Convex quadratics by quadprog, the active-set method of Goldfarb and Idnani, and by Clarabel."""

from typing import Any

import clarabel
import numpy as np
import quadprog
from scipy import sparse


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


def least_by_interior_points(
    M: Any, b: Any, lower: Any, upper: Any, rows: Any, required: Any
) -> tuple[Any, Any]:
    """x that minimises ½ xᵀM x − bᵀx over lower ≤ x ≤ upper and rows · x ≥ required, and the
    multipliers of the rows, by Clarabel (Goulart and Chen 2024).
    """
    n = b.size
    limits = np.vstack([-rows, -np.eye(n), np.eye(n)])
    values = np.concatenate([-required, -lower, upper])
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-11
    cones = [clarabel.NonnegativeConeT(len(values))]
    solver = clarabel.DefaultSolver(
        sparse.triu(M).tocsc(), -b, sparse.csc_matrix(limits), values, cones, settings
    )
    solution = solver.solve()
    return np.array(solution.x), np.array(solution.z)[: len(rows)]
