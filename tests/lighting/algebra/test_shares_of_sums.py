"""Sums that cannot all be reached: against a linear program of HiGHS, and quadprog."""

from typing import Any

import numpy as np
import pytest
from nightly import seeds
from qp import least
from scipy.optimize import linprog

from lightpaint.lighting.algebra.quadratic import Cap
from lightpaint.lighting.algebra.required_sums import RequiredSums, SumsWithShares

#: Both active sets end at 1e-10 of the sums' size, and HiGHS at 1e-7.
SAME = 1e-6

#: Room for quadprog in limits that leave x none; what that gains it is less than this.
ROOM, GAIN = 1e-7, 1e-4


def _problem(rng: Any, n: int, m: int, *, beyond: float) -> Any:
    """M, b, rows, and what they ask for: `beyond` more than some x reaches."""
    F = rng.random((3 * n, n))
    M, b = F.T @ F, F.T @ rng.random(3 * n) * 2
    rows = rng.random((m, n)) - 0.3 * (np.arange(m)[:, None] % 3 == 0)
    return M, b, rows, rows @ rng.uniform(0.2, 0.9, n) + beyond


def _sizes(rng: Any, m: int, j: int) -> Any:
    """Rows in turns belong to one of j wishes."""
    return (np.arange(m)[:, None] % j == np.arange(j)) * rng.uniform(0.5, 2, (m, 1))


@pytest.mark.parametrize("seed", list(seeds(6, 60)))
@pytest.mark.parametrize(("n", "m"), [(3, 4), (12, 30), (80, 20)])
def test_no_more_is_given_up_than_a_linear_program_gives_up(seed, n, m):
    rng = np.random.default_rng(1000 * n + seed)
    M, b, rows, required = _problem(rng, n, m, beyond=0.4 * n)
    sizes, j = _sizes(rng, m, 3) * n, 3
    limits: Any = {"lower": np.zeros(n), "upper": np.ones(n)}
    price = 1e6 * float(b @ np.linalg.solve(M, b))
    sums = SumsWithShares(M, rows, required, shares=np.zeros(j), sizes=sizes, price=price, **limits)
    found = sums.minimise(b, np.zeros(n))
    assert found.converged
    assert found.shares is not None
    # The shares and the largest of them: x, s, t with t >= s.
    largest = np.hstack([np.zeros((j, n)), -np.eye(j), np.ones((j, 1))])
    columns = np.vstack([np.hstack([rows, sizes, np.zeros((m, 1))]), largest])
    expected = linprog(
        np.append(np.zeros(n), np.ones(j + 1)),
        A_ub=-columns,
        b_ub=-np.append(required, np.zeros(j)),
        bounds=[(0, 1)] * (n + j) + [(0, None)],
    )
    assert expected.fun > 0
    assert found.shares.sum() + found.shares.max() == pytest.approx(expected.fun, rel=SAME)
    # Of all that gives up no more, it is the optimum.
    x = found.optimum.x
    lowered = required - sizes @ found.shares
    assert (rows @ x >= lowered - SAME).all()
    oracle = least(M, b, upper=1.0, rows=rows, limits=[(y, np.inf) for y in lowered - ROOM])
    values = [float(0.5 * y @ M @ y - b @ y) for y in (x, oracle)]
    assert values[0] == pytest.approx(values[1], abs=GAIN * float(b @ np.linalg.solve(M, b)))


@pytest.mark.parametrize("seed", list(seeds(4, 40)))
def test_nothing_is_given_up_of_sums_within_reach(seed):
    rng = np.random.default_rng(seed)
    n, m = 12, 30
    M, b, rows, required = _problem(rng, n, m, beyond=-0.05)
    caps = tuple(Cap((3 * k, 3 * k + 1, 3 * k + 2), (1.0, 2.0, 1.0), upper=3.6) for k in range(4))
    limits: Any = {"lower": np.zeros(n), "upper": np.ones(n), "caps": caps}
    strict = RequiredSums(M, rows, required, **limits).minimise(b, np.zeros(n))
    sums = SumsWithShares(
        M, rows, required, shares=np.zeros(2), sizes=_sizes(rng, m, 2), price=1e7, **limits
    )
    found = sums.minimise(b, np.zeros(n))
    assert strict.converged
    assert found.converged
    assert found.shares is not None
    assert not found.shares.any()
    assert found.optimum.x == pytest.approx(strict.optimum.x, abs=SAME)
    assert found.multipliers == pytest.approx(strict.multipliers, abs=1e-4)


def test_what_may_not_be_given_up_is_kept_or_nothing_is_found():
    limits: Any = {"lower": np.zeros(2), "upper": np.ones(2)}
    rows, required = np.array([[1.0, 1.0], [-1.0, -1.0]]), np.array([5.0, -0.5])
    priced: Any = {"shares": np.zeros(1), "sizes": np.array([[5.0], [0.0]]), "price": 1e6}
    kept = SumsWithShares(np.eye(2), rows, required, **priced, **limits)
    found = kept.minimise(np.zeros(2), np.zeros(2))
    assert found.optimum.x.sum() == pytest.approx(0.5, abs=SAME)
    assert found.shares == pytest.approx([0.9], abs=SAME)
    against = SumsWithShares(np.eye(2), rows, np.array([5.0, 0.5]), **priced, **limits)
    assert not against.minimise(np.zeros(2), np.zeros(2), max_updates=0).converged
