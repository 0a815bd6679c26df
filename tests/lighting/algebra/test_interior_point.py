"""The interior-point method: near the certified optimum, and a way where Newton's steps fail."""

import numpy as np
import pytest
from qp import least_by_interior_points

from lightpaint.arrays import Doubles, Indices
from lightpaint.lighting.algebra import clipped_newton
from lightpaint.lighting.algebra import interior_point as interior_point_module
from lightpaint.lighting.algebra.interior_point import SHORT, RowProducts, interior_point
from lightpaint.lighting.algebra.optimum import minimise
from lightpaint.lighting.algebra.quadratic import Cap, Quadratic, scaled

#: Unknowns of each cap, and caps: more than the method is for at least.
EACH, CAPS = 3, 20


def problem(seed: int) -> tuple[Doubles, Doubles, Doubles, list[Cap]]:
    """M, b, upper bounds, some of them infinite, and caps of all kinds, none of them fixed."""
    rng = np.random.default_rng([seed, 11])
    n = EACH * CAPS + 2
    A = rng.random((2 * n, n)) ** 3
    wanted = A @ (rng.random(n) * 3)
    upper = np.where(rng.random(n) < 0.3, 0.2 + rng.random(n), np.inf)
    caps = []
    for k in range(CAPS):
        unknowns = tuple(range(EACH * k, EACH * (k + 1)))
        low, high = np.sort(rng.random(2)) * 0.5
        limits = [(-np.inf, high), (low, np.inf), (low, high + 0.1)][int(rng.integers(3))]
        caps.append(Cap(unknowns, tuple(rng.random(EACH) + 0.1), *limits))
    return A.T @ A, A.T @ wanted, upper, caps


def scaled_problem(seed: int) -> Quadratic:
    M, b, upper, caps = problem(seed)
    return scaled(M, b, 0.0, upper, tuple(caps))


@pytest.mark.parametrize("seed", range(12))
def test_it_comes_near_the_certified_optimum(seed: int) -> None:
    M, b, upper, caps = problem(seed)
    best, q = minimise(M, b, upper=upper, caps=caps), scaled_problem(seed)
    assert best.converged
    near = interior_point(q, np.zeros(q.n))
    assert near is not None
    # Its steps end at a complementarity of 1e-14.
    np.testing.assert_allclose(near.x * q.scale, best.x, atol=1e-5)
    held = np.abs(best.cap_multipliers) > 1e-6 * np.abs(best.cap_multipliers).max()
    assert held.any()
    np.testing.assert_array_equal((near.at_lower | near.at_upper)[held], True)
    np.testing.assert_allclose(
        near.multipliers / q.cap_scale,
        best.cap_multipliers,
        atol=1e-3 * np.abs(best.cap_multipliers).max(),
    )


@pytest.mark.parametrize("seed", range(4))
def test_what_newtons_steps_do_not_reach_is_certified(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As if they went in circles: from near the optimum there are few of them to go."""
    M, b, upper, caps = problem(seed)
    best = minimise(M, b, upper=upper, caps=caps)
    assert best.steps > 3
    monkeypatch.setattr(clipped_newton, "MAX_CAPPED_STEPS", 3)
    near = minimise(M, b, upper=upper, caps=caps)
    assert near.converged
    assert near.sweeps == 0
    assert near.steps <= 6
    np.testing.assert_allclose(near.x, best.x, atol=1e-9)


def test_unknowns_that_change_nothing_keep_their_start() -> None:
    M, b, upper, caps = problem(0)
    M[:, -1] = M[-1] = b[-1] = 0
    q = scaled(M, b, 0.0, upper, tuple(caps))
    start = np.full(q.n, 0.1)
    near = interior_point(q, start)
    assert near is not None
    assert near.x[-1] == pytest.approx(0.1, abs=1e-6)


def test_a_fixed_unknown_is_left_to_other_methods() -> None:
    M, b, upper, _ = problem(0)
    upper[0] = 0
    q = scaled(M, b, 0.0, upper, ())
    assert interior_point(q, np.zeros(q.n)) is None


@pytest.mark.parametrize("parts", [[], [np.arange(c, 90, 3) for c in range(3)]])
def test_long_sums_beside_unknowns_in_parts(parts: list[Indices]) -> None:
    """Against Clarabel: M of 90 unknowns in three parts, which 12 sums join."""
    rng = np.random.default_rng(7)
    A = rng.random((300, 90)) ** 3
    M, wanted = A.T @ A, rng.random(90)
    M[np.arange(90)[:, None] % 3 != np.arange(90) % 3] = 0
    rows = rng.random((12, 90))
    least, upper = rows @ wanted * 1.2, np.full(90, 1.5)
    expected, _ = least_by_interior_points(M, M @ wanted, np.zeros(90), upper, rows, least)
    nothing, none = np.ones(90), np.full(12, np.inf)
    size = float((M @ wanted).max())
    bounds, limits = (np.zeros(90), upper, nothing), (rows, least, none, np.ones(12))
    q = Quadratic(M, M @ wanted, *bounds, *limits, (), size)
    near = interior_point(q, np.zeros(90), parts=parts)
    assert near is not None
    np.testing.assert_allclose(near.x, expected, atol=1e-6)  # where Clarabel ends
    assert near.at_lower.any()


def test_sums_that_exclude_each_other_end_it_soon(monkeypatch: pytest.MonkeyPatch) -> None:
    """Multipliers prove it long before the steps run out."""
    rows, least = np.array([[1.0, 1, 1], [-1, -1, -1]]), np.array([2.0, -1.9])
    limits = (rows, least, np.full(2, np.inf), np.ones(2))
    bounds = (np.zeros(3), np.full(3, np.inf), np.ones(3))
    q = Quadratic(np.eye(3), np.ones(3), *bounds, *limits, (), 1.0)
    monkeypatch.setattr(interior_point_module, "MAX_STEPS", 30)
    monkeypatch.setattr(interior_point_module, "OFF", np.inf)
    assert interior_point(q, np.zeros(3)) is None


@pytest.mark.parametrize("n", [3, SHORT, 40])
def test_products_of_rows_add_up_however_many_numbers_they_have(n: int) -> None:
    """Rows of few numbers, of all, and of none: against the product of matrices, to round-off."""
    rng = np.random.default_rng(n)
    rows = rng.normal(size=(50, n)) * (rng.random((50, n)) < rng.random((50, 1)))
    rows[7] = 0
    weights = rng.random(50)
    found = np.zeros((n, n))
    RowProducts(rows).add_to(found, weights)
    np.testing.assert_allclose(found, (rows.T * weights) @ rows, atol=1e-12)
