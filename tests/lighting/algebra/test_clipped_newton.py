"""Clipped Newton steps: certified or discarded, together or one by one."""

from typing import Any

import numpy as np
import pytest
from least_squares import solve_free

from lightpaint.lighting.algebra import clipped_newton as clipped_newton_module
from lightpaint.lighting.algebra.clipped_newton import MAX_STEPS, clipped_newton, solve_ridged
from lightpaint.lighting.algebra.optimum import MAX_BATCHED_UNKNOWNS, minimise
from lightpaint.lighting.algebra.quadratic import kkt_residual, scaled
from lightpaint.lighting.normal_equations import NormalEquations

TOLERANCE = 1e-12


def _problems(n: int, seed: int, count: int = 3) -> tuple[Any, Any]:
    """M (count, n, n), of unit diagonal, and b (count, n)."""
    rng = np.random.default_rng([n, seed])
    columns = rng.random((count, 3 * n + 4, n)) ** 2
    columns /= np.linalg.norm(columns, axis=1, keepdims=True)
    target_images = columns @ (rng.random((count, n, 1)) * (rng.random((count, n, 1)) < 0.6))
    target_images += 0.3 * rng.normal(size=target_images.shape)
    transposed = columns.transpose(0, 2, 1)
    return transposed @ columns, (transposed @ target_images)[..., 0]


def _steps(M: Any, b: Any, upper: float, x: Any) -> tuple[Any, Any, int]:
    size = np.abs(b).max(axis=1)
    return clipped_newton(M, b, 0.0, upper, x, size, tolerance=TOLERANCE)[:3]


@pytest.mark.parametrize("upper", [np.inf, 0.3])
@pytest.mark.parametrize("n", [1, 2, 7, 40])
def test_what_is_certified_is_the_optimum(n: int, upper: float):
    certified = 0
    for seed in range(10):
        M, b = _problems(n, seed)
        x, residuals, steps = _steps(M, b, upper, np.full(b.shape, 0.1))
        assert steps <= MAX_STEPS
        for c in range(3):
            gradient, size = M[c] @ x[c] - b[c], np.abs(b[c]).max()
            # Sums of n products in another order.
            residual = kkt_residual(gradient, x[c], size, 0.0, upper)
            assert residual == pytest.approx(residuals[c], abs=1e-14)
            if residuals[c] <= TOLERANCE:
                best = minimise(M[c], b[c], upper=upper, method="gauss-seidel", tolerance=1e-11)
                # 1e-11 times the condition of M, some thousands at worst.
                np.testing.assert_allclose(x[c], best.x, atol=1e-7)
                np.testing.assert_array_equal(x[c] == 0, best.x == 0)
                certified += 1
    # Else it would be no use: most of them, where others go in circles.
    assert certified >= 20


def test_a_problem_that_is_solved_stays_as_it_is():
    M, b = _problems(9, 0)
    x, _, _ = _steps(M, b, np.inf, np.ones(b.shape))
    begin = np.ones(b.shape)
    begin[1] = x[1]
    unchanged, _, steps = _steps(M, b, np.inf, begin)
    assert steps > 0
    assert unchanged[1].tobytes() == x[1].tobytes()


def test_coincident_lights_stay_as_they_differ_at_the_start():
    """The first light stands twice; all are on at the optimum."""
    M, _ = _problems(5, 1)
    lights = [0, 1, 2, 3, 4, 0]
    M = M[:, lights][:, :, lights]
    b = (M @ np.full((3, 6, 1), 0.7))[..., 0]
    begin = np.ones((3, 6))
    begin[:, 0] = 1.2
    x, residuals, _ = _steps(M, b, np.inf, begin)
    assert (residuals <= TOLERANCE).all()
    np.testing.assert_allclose(x[:, 1:5], 0.7, rtol=1e-9)
    np.testing.assert_allclose(x[:, 0] + x[:, 5], 1.4, rtol=1e-9)
    # Round-off ε of the gradient, over a ridge of 8 ε √n.
    np.testing.assert_allclose(x[:, 0] - x[:, 5], 0.2, atol=0.1)


def _equations(n: int, seed: int) -> NormalEquations:
    M, b = _problems(n, seed)
    return NormalEquations(M, b, np.full(3, 10.0))


@pytest.mark.parametrize("n", [6, 30, MAX_BATCHED_UNKNOWNS + 6])
def test_without_them_the_answer_is_the_same(n: int, monkeypatch: pytest.MonkeyPatch):
    for seed in range(3):
        equations = _equations(n, seed)
        quick = solve_free(equations, np.ones((n, 3)))
        with monkeypatch.context() as patch:
            patch.setattr("lightpaint.lighting.algebra.clipped_newton.MAX_STEPS", 0)
            slow = solve_free(equations, np.ones((n, 3)))
        assert quick.converged
        assert slow.converged
        # The tolerance times the condition of M.
        np.testing.assert_allclose(quick.weights, slow.weights, atol=1e-8)
        np.testing.assert_array_equal(quick.weights == 0, slow.weights == 0)


def test_channels_in_threads_have_the_bits_of_one_after_another():
    n = MAX_BATCHED_UNKNOWNS + 6
    equations, start = _equations(n, 5), np.ones((n, 3))
    together = solve_free(equations, start)
    for c in range(3):
        separate = minimise(equations.M[c], equations.b[c], start=start[:, c])
        assert separate.x.tobytes() == together.weights[:, c].tobytes()


def test_a_channel_that_does_not_converge_does_not_spoil_the_others():
    equations = _equations(8, 3)
    # Nothing asks for light in the second: that is none of their business.
    equations.b[1] *= -1
    optimum = solve_free(equations, np.ones((8, 3)))
    assert optimum.converged
    np.testing.assert_array_equal(optimum.weights[:, 1], 0)
    for c in (0, 2):
        q = scaled(equations.M[c], equations.b[c], 0.0, np.inf, ())
        assert q.violations(optimum.weights[:, c] / q.scale)[2] <= TOLERANCE


def test_few_lights_and_pixels_that_are_not_finite():
    equations = _equations(4, 0)
    equations.b[1, 2] = np.nan
    with pytest.raises(ValueError, match="finite"):
        solve_free(equations, np.ones((4, 3)))


def test_a_matrix_that_is_singular_to_the_last_bit_is_solved():
    """By the ridge: unknowns that are alike share alike; the row of none stays exact."""
    alike = np.ones((2, 2))
    with pytest.raises(np.linalg.LinAlgError):
        np.linalg.solve(alike, np.ones(2))
    np.testing.assert_allclose(solve_ridged(alike, np.ones(2), 2), [0.5, 0.5], rtol=1e-3)  # ridge
    with_sum = np.array([[1, 1, 1], [1, 1, 1], [1, 1, 0.0]])
    x = solve_ridged(with_sum, np.array([1, 1, 0.25]), 2)
    assert x[:2].sum() == pytest.approx(0.25, rel=1e-3)  # ridge


def test_large_steps_by_cholesky_are_those_of_numpy(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(11)
    A = rng.random((40, 24))
    definite, right = A.T @ A + np.eye(24), rng.random(24)
    # Lights that are alike to the last bit, and caps, leave no Cholesky factor.
    singular, indefinite = np.ones((24, 24)), definite - 8 * np.eye(24)
    monkeypatch.setattr(clipped_newton_module, "MANY_UNKNOWNS", 8)
    for matrix in (definite, indefinite):
        expected = np.linalg.solve(matrix, right)
        np.testing.assert_allclose(solve_ridged(matrix, right, 24), expected, rtol=1e-9)
        several = solve_ridged(matrix[None], right[None, :, None], 24)
        np.testing.assert_allclose(several[0, :, 0], expected, rtol=1e-9)
    assert np.isfinite(solve_ridged(singular, right, 24)).all()
