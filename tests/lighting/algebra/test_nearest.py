"""Of equally good answers the one nearest to the start, and the search under caps."""

from typing import Any

import numpy as np
import pytest

from lightpaint.lighting.algebra import optimum
from lightpaint.lighting.algebra.clipped_newton import capped_newton, nearest_equal
from lightpaint.lighting.algebra.optimum import Cap, minimise, minimise_each
from lightpaint.lighting.algebra.quadratic import clip_to_sums, scaled


@pytest.mark.parametrize("copies", [2, 3, 5])
def test_copies_of_a_light_share_the_change_evenly(copies: int) -> None:
    """In closed form: M sees the sum alone, and the nearest point moves all of them alike."""
    rng = np.random.default_rng(copies)
    a, other = rng.random((40, 1)), rng.random((40, 2))
    A = np.hstack([np.repeat(a, copies, axis=1), other])
    M, b = A.T @ A, A.T @ (A @ np.ones(copies + 2))
    start = np.concatenate([1 + rng.random(copies), [1, 1]])
    for nearest_optimum in (
        minimise(M, b, start=start),
        *minimise_each(
            np.stack([M, M]),
            np.stack([b, b]),
            lower=np.zeros((2, b.size)),
            upper=np.full((2, b.size), np.inf),
            start=np.stack([start, start]),
        ),
    ):
        expected = start[:copies] - (start[:copies].sum() - copies) / copies
        np.testing.assert_allclose(nearest_optimum.x, [*expected, 1, 1], atol=1e-9)
        assert nearest_optimum.converged


def test_what_has_no_part_in_it_stays_to_the_bit() -> None:
    """In closed form: two of three lights are one, and the third has nothing to do with them."""
    q = scaled(np.array([[1.0, 1, 0], [1, 1, 0], [0, 0, 1]]), np.ones(3), 0.0, np.inf, ())
    nearest = nearest_equal(q, np.array([0.75, 0.25, 1.0]), np.array([0.3, 0.2, 5.0]))
    np.testing.assert_allclose(nearest, [0.55, 0.45, 1.0], atol=1e-15)
    assert nearest[2] == 1.0
    unaffected = np.array([0.55, 0.45, 1.0])
    assert nearest_equal(q, unaffected, unaffected) is unaffected


def test_a_bound_ends_the_way_back() -> None:
    """Of two alike lights, one may not go up to where the nearest answer has it."""
    a = np.random.default_rng(0).random((20, 1))
    A = np.hstack([a, a])
    M, b = A.T @ A, A.T @ (A @ [1.0, 1.0])
    nearest_optimum = minimise(M, b, upper=[0.9, np.inf], start=np.array([0.9, 0.3]))
    assert nearest_optimum.x.sum() == pytest.approx(2, abs=1e-9)
    assert nearest_optimum.x[0] <= 0.9
    assert nearest_optimum.converged


def _capped_problem(seed: int) -> tuple[Any, Any, list[Cap]]:
    rng = np.random.default_rng(seed)
    A = rng.random((40, 12)) ** 2
    caps = [
        Cap((k, k + 4, k + 8), tuple(0.2 + rng.random(3)), *sorted(rng.random(2) * 2))
        for k in range(4)
    ]
    return A.T @ A, A.T @ (A @ rng.random(12) + rng.normal(0, 0.5, 40)), caps


def test_clipped_steps_under_caps_come_to_what_cannot_go_in_circles(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    certified = 0
    for seed in range(40):
        M, b, caps = _capped_problem(seed)
        quick = minimise(M, b, caps=caps)
        with monkeypatch.context() as patch:
            patch.setattr(optimum, "capped_newton", lambda _q, x, **_: (x, np.inf, 0))
            slow = minimise(M, b, caps=caps)
        assert quick.converged
        # The tolerance times the condition of M, some thousands.
        np.testing.assert_allclose(quick.x, slow.x, atol=1e-8)
        np.testing.assert_allclose(quick.cap_multipliers, slow.cap_multipliers, atol=1e-7)
        q = scaled(M, b, 0.0, np.inf, tuple(caps))
        _, residual, steps = capped_newton(q, q.feasible(np.zeros(12)), tolerance=1e-12)
        certified += residual <= 1e-12 and steps < 20
    # Else it would be no use.
    assert certified >= 36


@pytest.mark.parametrize("seed", range(20))
def test_moved_along_is_the_projection(seed: int) -> None:
    """On a box and a sum: of all points with that sum the nearest, by the optimality of it."""
    rng = np.random.default_rng(seed)
    k, m = 6, 3
    a, x = 0.1 + rng.random((k, m)), rng.normal(size=(k, m))
    low = np.where(rng.random((k, m)) < 0.3, -np.inf, -rng.random((k, m)))
    high = np.where(rng.random((k, m)) < 0.3, np.inf, rng.random((k, m)))
    feasible = np.clip(rng.normal(size=(k, m)), low, high)
    x, sums = np.clip(x, low, high), (a * feasible).sum(axis=1)
    clipped = clip_to_sums(a, x, low, high, sums)
    # float64 sums of three.
    np.testing.assert_allclose((a * clipped).sum(axis=1), sums, atol=1e-12)
    assert ((clipped >= low) & (clipped <= high)).all()
    # x − found is a multiple of a but for what bounds take, whose sign fits.
    for row in range(k):
        free = (clipped[row] > low[row]) & (clipped[row] < high[row])
        push = (x[row] - clipped[row]) / a[row]
        if free.any():
            t = push[free].mean()
            np.testing.assert_allclose(push[free], t, atol=1e-10)
            assert (push[clipped[row] <= low[row]] <= t + 1e-10).all()
            assert (push[clipped[row] >= high[row]] >= t - 1e-10).all()
