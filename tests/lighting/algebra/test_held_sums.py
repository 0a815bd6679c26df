"""Guesses of bounds and sums that hold: exact where they end, and honest where they do not."""

import numpy as np
import pytest
from nightly import seeds
from qp import least

from lightpaint.lighting.algebra.held_sums import HeldSums
from lightpaint.lighting.algebra.optimum import minimise

#: Float64 of these conditions.
SAME = 1e-8


def _lamps_over_a_floor(rng, n=8, points=20):
    """The matrix of lamps whose pictures overlap a little, and rows for the light of a floor."""
    F = rng.random((6 * n, n)) ** 4
    M, levels = F.T @ F, rng.random(n)
    lamps, floor = rng.random((n, 2)) * 6, rng.random((points, 2)) * 6
    squares = ((floor[:, None] - lamps) ** 2).sum(-1) + 2.1**2
    light = 900 * 2.1**2 / squares**2
    now, mean = light @ levels, light.mean(axis=0)
    uniformity = min(0.5, 1.2 * now.min() / now.mean())
    rows = np.vstack([mean, light - uniformity * mean])
    return M, M @ levels, rows, np.append(1.15 * now.mean(), np.zeros(points))


@pytest.mark.parametrize("seed", list(seeds(10, 40)))
def test_the_optimum_is_that_of_quadprog(seed):
    M, b, rows, required = _lamps_over_a_floor(np.random.default_rng(seed))
    n, m = len(M), len(rows)
    bounds = {"lower": np.zeros(n), "upper": np.full(n, 2.0)}
    sums = HeldSums.of(M, rows, required, **bounds, root=np.sqrt(M.diagonal()))
    start = minimise(M, b, **bounds).x
    found = sums.minimise(b, start, np.zeros(m), tolerance=1e-12, close=1e-9)
    assert found is not None
    optimum, multipliers = found
    limits = [(value, np.inf) for value in required]
    expected = least(M, b, lower=0.0, upper=2.0, rows=rows, limits=limits)
    assert optimum.x == pytest.approx(expected, abs=SAME)
    assert optimum.converged
    gradient = M @ optimum.x - b - multipliers @ rows
    assert optimum.multipliers == pytest.approx(gradient, abs=SAME)
    # From its own answer it needs two steps at most.
    again = sums.minimise(b, optimum.x, multipliers, tolerance=1e-12, close=1e-9)
    assert again is not None
    assert again[0].steps <= 2


def test_it_does_not_claim_what_nothing_reaches():
    sums = HeldSums.of(
        np.eye(2),
        np.ones((1, 2)),
        np.array([5.0]),
        lower=np.zeros(2),
        upper=np.ones(2),
        root=np.ones(2),
    )
    assert sums.minimise(np.zeros(2), np.zeros(2), np.zeros(1), tolerance=1e-12, close=1e-9) is None
