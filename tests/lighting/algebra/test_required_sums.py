"""Sums that the optimum has to reach: against quadprog, and where nothing reaches them."""

import numpy as np
import pytest
from nightly import seeds
from qp import least

from lightpaint.lighting.algebra.required_sums import RequiredSums

#: The penalty leaves sums short by up to 1e-9 of their size.
SAME = 1e-6


def _problem(rng, n, m):
    F = rng.random((3 * n, n))
    M, b = F.T @ F, F.T @ rng.random(3 * n) * 2
    rows = rng.random((m, n)) - 0.3 * (np.arange(m)[:, None] % 3 == 0)
    inside = rng.uniform(0.2, 1.8, n)
    return M, b, rows, rows @ inside - rng.uniform(0, 0.4, m)


@pytest.mark.parametrize("seed", list(seeds(8, 60)))
@pytest.mark.parametrize(("n", "m"), [(3, 2), (12, 30), (40, 8)])
def test_the_optimum_is_that_of_quadprog(seed, n, m):
    rng = np.random.default_rng(1000 * n + seed)
    M, b, rows, required = _problem(rng, n, m)
    sums = RequiredSums(M, rows, required, lower=np.zeros(n), upper=np.full(n, 2.0))
    found = sums.minimise(b, np.zeros(n))
    assert found.converged
    limits = [(value, np.inf) for value in required]
    expected = least(M, b, lower=0.0, upper=2.0, rows=rows, limits=limits)
    assert found.optimum.x == pytest.approx(expected, abs=SAME)
    # The multipliers prove it: they are 0 for sums with room, and balance the gradient elsewhere.
    room = rows @ found.optimum.x - required
    assert (found.multipliers >= 0).all()
    assert room[found.multipliers > 0] == pytest.approx(0, abs=SAME)
    rest = M @ found.optimum.x - b - found.multipliers @ rows
    inside = (found.optimum.x > SAME) & (found.optimum.x < 2 - SAME)
    assert rest[inside] == pytest.approx(0, abs=SAME)


def test_another_right_side_begins_with_the_multipliers_of_the_last():
    rng = np.random.default_rng(5)
    M, b, rows, required = _problem(rng, 20, 15)
    sums = RequiredSums(M, rows, required, lower=np.zeros(20), upper=np.full(20, 2.0))
    first = sums.minimise(b, np.zeros(20))
    second = sums.minimise(1.01 * b, first.optimum.x, multipliers=first.multipliers)
    expected = least(M, 1.01 * b, upper=2.0, rows=rows, limits=[(x, np.inf) for x in required])
    assert second.optimum.x == pytest.approx(expected, abs=SAME)


def test_an_unknown_that_the_problem_does_not_see_meets_what_is_required():
    sums = RequiredSums(
        np.diag([1.0, 0.0]),
        np.array([[0.0, 2.0]]),
        np.array([3.0]),
        lower=np.zeros(2),
        upper=np.full(2, np.inf),
    )
    found = sums.minimise(np.array([1.0, 0.0]), np.zeros(2))
    assert found.optimum.x == pytest.approx([1.0, 1.5], rel=1e-8)


def test_sums_that_nothing_reaches_are_not_called_reached():
    sums = RequiredSums(
        np.eye(2), np.ones((1, 2)), np.array([5.0]), lower=np.zeros(2), upper=np.ones(2)
    )
    found = sums.minimise(np.zeros(2), np.zeros(2))
    assert not found.converged
    assert found.miss == pytest.approx(3 / 5, rel=1e-6)
