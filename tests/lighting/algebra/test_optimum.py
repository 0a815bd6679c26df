"""The optimum between bounds and under caps: certified by code that shares nothing with it."""

from typing import Any

import numpy as np
import pytest
from qp import least
from scipy.optimize import lsq_linear, nnls

from lightpaint.lighting.algebra import clipped_newton
from lightpaint.lighting.algebra.optimum import Cap, Optimum, minimise

KINDS = ["plain", "condition 1e12", "more lights than pixels", "coincident", "uneven and dark"]


def _pixels(rng: np.random.Generator, n: int, kind: str) -> tuple[Any, Any]:
    """A (m, n) and y (m,)."""
    A = rng.random((3 * n + 3, n))
    if kind == "condition 1e12":
        U, _, V = np.linalg.svd(A, full_matrices=False)
        A = U * 10.0 ** np.linspace(0, -6, n) @ V
    if kind == "more lights than pixels":
        A = rng.random((max(1, n // 2), n))
    if kind == "coincident":
        A[:, n // 2 :] = A[:, : n - n // 2] * rng.random(n - n // 2)
    if kind == "uneven and dark":
        A *= 10.0 ** rng.uniform(-6, 6, n)
        A[:, 0] = 0
    y = A @ (rng.random(n) * (rng.random(n) < 0.7))
    return A, y + 0.1 * np.abs(A).mean() * rng.normal(size=len(A))


def _bounds(rng: np.random.Generator, n: int) -> tuple[Any, Any]:
    """Lower and upper bounds, some equal, some infinite."""
    lower = np.where(rng.random(n) < 0.3, rng.random(n), 0.0)
    room = rng.random(n) * (rng.random(n) < 0.7)
    return lower, lower + np.where(rng.random(n) < 0.4, room, np.inf)


def _certify(optimum: Optimum, M: Any, b: Any, lower: Any, upper: Any, caps: Any = ()) -> None:
    """Optimal, since what is left of the gradient is a sum of the limits that hold x.

    That is sufficient, the problem being convex; scipy's nnls finds the sum.
    """
    x, n = optimum.x, b.size
    assert (lower <= x).all()
    assert (x <= upper).all()
    size = 1 / np.sqrt(np.where(np.diag(M) > 0, np.diag(M), 1))
    normals = [np.eye(n)[i] for i in range(n) if x[i] == lower[i]]
    normals += [-np.eye(n)[i] for i in range(n) if x[i] == upper[i]]
    for cap in caps:
        a = np.zeros(n)
        a[list(cap.unknowns)] = cap.coefficients
        # A sum of three products, in float64.
        room = 1e-12 * max(1.0, float(a @ np.abs(x)))
        assert cap.lower - room <= a @ x <= cap.upper + room
        scaled = a * size / np.linalg.norm(a * size)
        normals += [scaled] if a @ x <= cap.lower + room else []
        normals += [-scaled] if a @ x >= cap.upper - room else []
    gradient = (M @ x - b) * size
    distance = nnls(np.array(normals).T, gradient)[1] if normals else np.linalg.norm(gradient)
    terms = np.abs(M * size[:, None]) @ np.abs(x) + np.abs(b * size)
    assert distance <= 1e-10 * max(terms.max(), 1e-300)


@pytest.fixture(params=["clipped steps", "polish"])
def _solver_path(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """As it comes, and with what follows where the clipped steps do not do."""
    if request.param == "polish":
        monkeypatch.setattr(clipped_newton, "MAX_STEPS", 0)


@pytest.mark.usefixtures("_solver_path")
@pytest.mark.parametrize("kind", KINDS)
def test_no_light_is_negative_as_in_scipy(kind: str):
    for seed in range(60):
        rng = np.random.default_rng([seed, len(kind)])
        n = int(rng.integers(2, 30))
        A, y = _pixels(rng, n, kind)
        M, b = A.T @ A, A.T @ y
        optimum = minimise(M, b, start=np.ones(n))
        assert optimum.converged
        _certify(optimum, M, b, np.zeros(n), np.full(n, np.inf))
        # Both minimise the same squares: ours are no more than scipy's, up to round-off.
        objective = np.square(A @ optimum.x - y).sum()
        oracle = nnls(A, y, maxiter=100 * n)[1] ** 2
        assert objective <= oracle + 1e-10 * np.square(y).sum()


@pytest.mark.usefixtures("_solver_path")
@pytest.mark.parametrize("kind", KINDS)
def test_between_bounds_as_in_scipy(kind: str):
    for seed in range(40):
        rng = np.random.default_rng([seed, len(kind), 1])
        n = int(rng.integers(2, 20))
        A, y = _pixels(rng, n, kind)
        lower, upper = _bounds(rng, n)
        M, b = A.T @ A, A.T @ y
        optimum = minimise(M, b, lower=lower, upper=upper, start=rng.random(n) * 2)
        assert optimum.converged
        _certify(optimum, M, b, lower, upper)
        free = lower < upper
        x = lower.copy()
        if free.any():
            rest = y - A[:, ~free] @ lower[~free]
            x[free] = lsq_linear(
                A[:, free], rest, (lower[free], upper[free]), tol=1e-14, method="bvls"
            ).x
        objective, oracle = (np.square(A @ v - y).sum() for v in (optimum.x, x))
        assert objective <= oracle + 1e-10 * (np.square(y).sum() + np.square(A @ lower).sum())


def _capped_problem(seed: int) -> tuple[Any, Any, Any, Any, list[Cap], Any]:
    """M, b, lower, upper, caps and a start, with three unknowns for each cap."""
    rng = np.random.default_rng([seed, 2])
    k = int(rng.integers(1, 5))
    n = 3 * k + int(rng.integers(0, 3))
    A, y = _pixels(rng, n, KINDS[seed % 4] if n > 3 else "plain")
    lower, upper = _bounds(rng, n)
    caps = []
    for group in range(k):
        unknowns = tuple(range(3 * group, 3 * group + 3))
        a = rng.random(3) + 0.05
        least = a @ lower[list(unknowns)]
        most = min(a @ upper[list(unknowns)], least + 3)
        low, high = least + np.sort(rng.random(2)) * (most - least)
        limits = [(-np.inf, high), (low, np.inf), (low, low), (low, high)][int(rng.integers(4))]
        caps.append(Cap(unknowns, tuple(a), *limits))
    return A.T @ A, A.T @ (2 * y), lower, upper, caps, rng.random(n) * 2


@pytest.mark.parametrize(
    "seeds", [range(140), pytest.param(range(140, 700), marks=pytest.mark.nightly)]
)
def test_under_caps_certified_and_as_quadprog(seeds: range):
    compared = 0
    for seed in seeds:
        M, b, lower, upper, caps, start = _capped_problem(seed)
        optimum = minimise(M, b, lower=lower, upper=upper, caps=caps, start=start)
        assert optimum.converged
        _certify(optimum, M, b, lower, upper, caps)
        if np.linalg.cond(M) > 1e8:
            continue  # quadprog needs a definite M
        rows = np.zeros((len(caps), b.size))
        for row, cap in zip(rows, caps, strict=True):
            row[list(cap.unknowns)] = cap.coefficients
        limits = [(cap.lower, cap.upper) for cap in caps]
        other = least(M, b, lower=lower, upper=upper, rows=rows, limits=limits)
        objective, oracle = (0.5 * x @ M @ x - b @ x for x in (optimum.x, other))
        # It keeps to its constraints to about 1e-12 of their size.
        assert objective == pytest.approx(oracle, abs=1e-9 * (1 + abs(oracle)))
        compared += 1
    assert compared >= 0.28 * len(seeds)


@pytest.mark.parametrize("seed", range(20))
def test_the_papers_iteration_comes_to_the_same_under_caps(seed: int):
    M, b, lower, upper, caps, start = _capped_problem(4 * seed)
    constraints = {"lower": lower, "upper": upper, "caps": caps, "start": start}
    swept = minimise(M, b, method="gauss-seidel", tolerance=1e-10, **constraints)
    best = minimise(M, b, **constraints)
    assert swept.converged
    assert (swept.sweeps > 0) or (swept.kkt_residual <= 1e-10)
    np.testing.assert_allclose(swept.x, best.x, atol=1e-6)


def test_no_sweep_raises_the_objective_under_caps():
    for seed in range(10):
        M, b, lower, upper, caps, start = _capped_problem(seed)
        constraints = {"lower": lower, "upper": upper, "caps": caps, "start": start}
        trace = []
        for k in range(12):
            x = minimise(M, b, method="gauss-seidel", max_sweeps=k, **constraints).x
            trace.append(0.5 * x @ M @ x - b @ x)
        assert np.diff(trace).max() <= 1e-13 * np.abs(trace).max()


def test_many_caps_take_few_steps():
    """As for texels of a wall that is limited: none fails by the round-off of a sum."""
    for seed in range(8):
        rng = np.random.default_rng([seed, 7])
        A, y = _pixels(rng, 120, "plain")
        luminance = (0.2126, 0.7152, 0.0722)
        caps = [Cap((3 * k, 3 * k + 1, 3 * k + 2), luminance, upper=0.1) for k in range(40)]
        optimum = minimise(A.T @ A, A.T @ (3 * y), caps=caps)
        assert optimum.converged
        assert optimum.cap_multipliers.any()
        assert optimum.steps <= 20


def test_caps_of_four_unknowns_and_of_one():
    rng = np.random.default_rng(5)
    for _ in range(40):
        A, y = _pixels(rng, 6, "plain")
        M, b = A.T @ A, A.T @ (3 * y)
        caps = [Cap((0, 2, 3, 5), (0.3, 0.5, 0.1, 0.7), upper=0.4), Cap((1,), (2.0,), 0.5, 0.5)]
        optimum = minimise(M, b, caps=caps)
        assert optimum.converged
        _certify(optimum, M, b, np.zeros(6), np.full(6, np.inf), caps)
        np.testing.assert_allclose(optimum.x[1], 0.25, rtol=1e-14)


def test_multipliers_are_prices():
    M, b = np.eye(3), np.array([1.0, 2.0, -1.0])
    optimum = minimise(M, b, upper=[np.inf, 0.5, np.inf])
    assert optimum.x[1:].tolist() == [0.5, 0]
    # One step with a ridge of 8 ε √n.
    np.testing.assert_allclose(optimum.x[0], 1, rtol=1e-14)
    np.testing.assert_allclose(optimum.multipliers, [0, -1.5, 1], atol=1e-14)
    cap = Cap((0, 1), (1.0, 1.0), upper=2.0)
    optimum = minimise(M, b, caps=[cap])
    np.testing.assert_allclose(optimum.x, [0.5, 1.5, 0], atol=1e-15)
    # One more of the limit would lower the objective by that much.
    np.testing.assert_allclose(optimum.cap_multipliers, [-0.5], rtol=1e-14)
    np.testing.assert_allclose(optimum.multipliers, [0, 0, 1], atol=1e-15)


def test_units_and_order_are_of_no_importance():
    for seed in range(30):
        M, b, lower, upper, caps, start = _capped_problem(4 * seed)
        n = b.size
        plain = minimise(M, b, lower=lower, upper=upper, caps=caps, start=start)
        rng = np.random.default_rng(seed)
        # x = s x'
        s = 10.0 ** rng.uniform(-4, 4, n)
        other_caps = [
            Cap(c.unknowns, tuple(np.array(c.coefficients) * s[list(c.unknowns)]), c.lower, c.upper)
            for c in caps
        ]
        other = minimise(
            M * s[:, None] * s,
            b * s,
            lower=lower / s,
            upper=upper / s,
            caps=other_caps,
            start=start / s,
        )
        np.testing.assert_allclose(other.x * s, plain.x, atol=1e-8)
        order = rng.permutation(n)
        place = np.argsort(order)
        moved_caps = [
            Cap(tuple(int(place[i]) for i in c.unknowns), c.coefficients, c.lower, c.upper)
            for c in caps
        ]
        other = minimise(
            M[np.ix_(order, order)],
            b[order],
            lower=lower[order],
            upper=upper[order],
            caps=moved_caps,
            start=start[order],
        )
        np.testing.assert_allclose(other.x, plain.x[order], atol=1e-8)


def test_of_equal_optima_one_near_the_start():
    rng = np.random.default_rng(0)
    a = rng.random((30, 1))
    A = np.hstack([a, a, rng.random((30, 1))])
    M, b = A.T @ A, A.T @ (A @ [1.0, 1, 1])
    optimum = minimise(M, b, start=np.array([1.5, 0.7, 1.0]))
    np.testing.assert_allclose(optimum.x, [1.4, 0.6, 1], atol=1e-9)
    second_optimum = minimise(M, b, start=optimum.x)
    np.testing.assert_array_equal(second_optimum.x, optimum.x)


def test_many_lights():
    rng = np.random.default_rng(1)
    A = rng.random((700, 400)) ** 3
    y = A @ (rng.random(400) * (rng.random(400) < 0.6)) + 0.3 * rng.normal(size=700)
    M, b = A.T @ A, A.T @ y
    optimum = minimise(M, b, start=np.ones(400))
    assert optimum.converged
    assert (optimum.x == 0).any()
    _certify(optimum, M, b, np.zeros(400), np.full(400, np.inf))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"b": np.ones(2)}, "expected"),
        ({"lower": 2.0, "upper": [1.0, 3, 3]}, "unknown 0: lower bound 2 is above"),
        ({"upper": np.nan}, "upper bound nan"),
        ({"M": np.full((3, 3), np.nan)}, "finite"),
        ({"caps": [Cap((0, 1), (1.0,), upper=1)]}, "one coefficient > 0"),
        ({"caps": [Cap((0, 1), (1.0, 0.0), upper=1)]}, "one coefficient > 0"),
        ({"caps": [Cap((0, 0), (1.0, 1.0), upper=1)]}, "shares an unknown"),
        ({"caps": [Cap((0,), (1.0,), upper=1), Cap((0,), (1.0,), upper=2)]}, "shares an unknown"),
        ({"caps": [Cap((0, 1), (1.0, 1.0), upper=-1.0)]}, "nothing satisfies both"),
        ({"caps": [Cap((0, 1), (1.0, 1.0), 3.0)], "upper": 1.0}, "nothing satisfies both"),
    ],
)
def test_problems_that_are_none(change: dict[str, Any], words: str):
    arguments = {"M": np.eye(3), "b": np.ones(3)} | change
    with pytest.raises(ValueError, match=words):
        minimise(**arguments)


def test_no_unknowns():
    optimum = minimise(np.zeros((0, 0)), np.zeros(0))
    assert optimum.converged
    assert optimum.x.shape == (0,)
