"""Projected Gauss–Seidel against scipy, against the optimality conditions, and its symmetries."""

from typing import Any

import numpy as np
import pytest
from least_squares import solve_free
from nightly import seeds
from scipy.optimize import nnls

from lightpaint.lighting.algebra.quadratic import kkt_residual
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.unknowns.reduced_problem import ReducedOptimum

# The solver stops at a KKT residual of 1e-10, which leaves an error of the weights of at most
# that times the condition of the Gram matrix: 10 to 100 here, a few hundred at worst, so that
# all come well below 1e-8. A matter of precision, not of noise.
WEIGHT_TOLERANCE = 1e-8

SIZES = [1, 2, 3, 5, 8, 13, 24]


def _equations(columns: Any, values: Any) -> NormalEquations:
    """columns: (3, m, n); values: (3, m)."""
    return NormalEquations(
        M=np.einsum("cmi,cmj->cij", columns, columns),
        b=np.einsum("cmi,cm->ci", columns, values),
        target_norm2=np.square(values).sum(axis=1),
    )


def _columns(rng: np.random.Generator, n: int, kind: str) -> Any:
    columns = rng.random((3, 6 * n + 10, n))
    if kind == "signed":
        columns -= 0.5
    if kind == "correlated":
        # Every light resembles its neighbour.
        columns[..., 1:] += 0.3 * columns[..., :-1]
    if kind == "uneven":
        columns *= 10.0 ** rng.uniform(-3, 3, n)
    return columns


def _problem(n: int, kind: str, seed: int) -> tuple[Any, Any]:
    rng = np.random.default_rng([n, seed, len(kind)])
    columns = _columns(rng, n, kind)
    truth = rng.random((3, n)) * (rng.random((3, n)) < 0.6) / columns.mean(axis=1)
    values = np.einsum("cmi,ci->cm", columns, truth)
    # What is not a mix of the lights at all pushes some of them against their limit.
    values += rng.normal(scale=0.5 * values.std() + 0.1, size=values.shape)
    return columns, values


def _solve(columns: Any, values: Any, start: Any = None, **options: Any) -> ReducedOptimum:
    start = np.ones((columns.shape[2], 3)) if start is None else start
    return solve_free(_equations(columns, values), start, **options)


def _solve_by_scipy(columns: Any, values: Any) -> Any:
    return np.stack([nnls(A, y)[0] for A, y in zip(columns, values, strict=True)], axis=1)


def _relative_error(weights: Any, truth: Any, columns: Any) -> float:
    """Largest error of a weight times the power of its light: what one would see of it."""
    power = np.sqrt(np.square(columns).sum(axis=1)).T
    return float(np.abs((weights - truth) * power).max() / max((truth * power).max(), 1e-300))


@pytest.mark.parametrize("kind", ["uniform", "signed", "correlated", "uneven"])
@pytest.mark.parametrize("n", SIZES)
def test_agrees_with_scipy(n: int, kind: str):
    zeros = 0
    for seed in range(8):
        columns, values = _problem(n, kind, seed)
        result = _solve(columns, values)
        truth = _solve_by_scipy(columns, values)
        assert result.converged
        assert _relative_error(result.weights, truth, columns) < WEIGHT_TOLERANCE
        # A light that should be off is off, not nearly off.
        np.testing.assert_array_equal(result.weights == 0, truth == 0)
        zeros += np.count_nonzero(truth == 0)
    assert zeros > 0 or n == 1, "none of these problems tests the limit w >= 0"


@pytest.mark.parametrize("kind", ["uniform", "signed", "correlated"])
@pytest.mark.parametrize("n", SIZES)
def test_optimality_conditions(n: int, kind: str):
    for seed in range(4):
        columns, values = _problem(n, kind, 100 + seed)
        w = _solve(columns, values).weights.T
        residual = values - np.einsum("cmi,ci->cm", columns, w)
        # Cosine-like: what is left of the target along each light, over the target's length.
        # The solver's 1e-10 is over something smaller by up to a factor of 50.
        correlations = np.einsum("cmi,cm->ci", columns, residual)
        correlations /= np.linalg.norm(columns, axis=1) * np.linalg.norm(values, axis=1)[:, None]
        assert (w >= 0).all()
        assert np.abs(correlations[w > 0]).max(initial=0) < 1e-9
        assert correlations[w == 0].max(initial=-1) < 1e-9


@pytest.mark.parametrize("start_at", [0.0, 1e-3, 1e3])
def test_the_start_does_not_change_the_answer(start_at: float):
    for seed in range(10):
        columns, values = _problem(8, "correlated", seed)
        start = np.random.default_rng(seed).random((8, 3)) * start_at
        result = _solve(columns, values, start)
        truth = _solve_by_scipy(columns, values)
        assert _relative_error(result.weights, truth, columns) < WEIGHT_TOLERANCE


def test_a_start_at_the_answer_needs_no_sweep():
    columns, values = _problem(8, "uniform", 0)
    assert _solve(columns, values, _solve_by_scipy(columns, values)).sweeps == (0, 0, 0)


def test_the_start_is_not_written_to():
    columns, values = _problem(3, "uniform", 0)
    start = np.full((3, 3), 0.25)
    _solve(columns, values, start)
    np.testing.assert_array_equal(start, 0.25)


@pytest.mark.parametrize("kind", ["uniform", "signed", "correlated", "uneven"])
def test_no_sweep_raises_the_objective(kind: str):
    columns, values = _problem(13, kind, 1)
    equations = _equations(columns, values)
    start = np.random.default_rng(0).random((13, 3))
    trace = [equations.objective(start)]
    for k in range(1, 40):
        result = solve_free(equations, start, method="gauss-seidel", max_sweeps=k)
        trace.append(equations.objective(result.weights))
    # Round-off of the objective, of size ‖Ψ‖² in float64.
    rise = np.diff(trace, axis=0) / equations.target_norm2
    assert rise.max() < 1e-13
    assert (np.diff(trace[:3], axis=0) < 0).all()


def test_scaling_a_light_scales_its_weight_inversely():
    columns, values = _problem(8, "uniform", 2)
    scale = 10.0 ** np.random.default_rng(0).uniform(-4, 4, 8)
    plain, scaled = _solve(columns, values), _solve(columns * scale, values)
    error = _relative_error(scaled.weights * scale[:, None], plain.weights, columns)
    assert error < WEIGHT_TOLERANCE


@pytest.mark.parametrize("scale", [1e-12, 1e12])
def test_scaling_the_target_scales_the_answer(scale: float):
    columns, values = _problem(8, "uniform", 3)
    plain, scaled = _solve(columns, values), _solve(columns, values * scale)
    assert scaled.converged
    assert _relative_error(scaled.weights / scale, plain.weights, columns) < WEIGHT_TOLERANCE


def test_the_order_of_lights_is_of_no_importance():
    columns, values = _problem(13, "correlated", 3)
    order = np.random.default_rng(1).permutation(13)
    plain, permuted = _solve(columns, values), _solve(columns[..., order], values)
    error = _relative_error(permuted.weights, plain.weights[order], columns[..., order])
    assert error < WEIGHT_TOLERANCE


def test_channels_are_solved_apart():
    columns, values = _problem(5, "uniform", 4)
    plain = _solve(columns, values)
    permuted = _solve(columns[[2, 0, 1]], values[[2, 0, 1]])
    np.testing.assert_array_equal(permuted.weights, plain.weights[:, [2, 0, 1]])
    assert permuted.sweeps == tuple(plain.sweeps[c] for c in (2, 0, 1))


def test_running_out_of_sweeps_is_a_result():
    columns, values = _problem(13, "correlated", 5)
    result = _solve(columns, values, method="gauss-seidel", max_sweeps=1)
    assert not result.converged
    assert result.sweeps == (1, 1, 1)
    assert (result.kkt_residual > result.tolerance).all()
    assert _solve(columns, values, max_sweeps=0).sweeps == (0, 0, 0)


def test_one_light_is_a_projection():
    columns, values = _problem(1, "uniform", 6)
    a, y = columns[..., 0], values
    expected = np.maximum((a * y).sum(axis=1) / np.square(a).sum(axis=1), 0)
    # One division in float64.
    np.testing.assert_allclose(_solve(columns, values).weights[0], expected, rtol=1e-14)


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
@pytest.mark.parametrize("n", SIZES)
def test_a_black_target_turns_everything_off(n: int, scale: float):
    columns, values = _problem(n, "uniform", 7)
    result = _solve(columns * scale, 0 * values)
    assert result.converged
    np.testing.assert_array_equal(result.weights, 0)


def test_a_target_of_negative_light_turns_everything_off():
    columns, values = _problem(5, "uniform", 8)
    np.testing.assert_array_equal(_solve(columns, -np.abs(values)).weights, 0)


def test_a_light_that_reaches_nothing_keeps_its_start():
    columns, values = _problem(3, "uniform", 9)
    dark = np.concatenate([columns, np.zeros_like(columns[..., :1])], axis=2)
    start = np.array([[1.0, 1, 1]] * 3 + [[0.25, 0.5, 0.75]])
    result = _solve(dark, values, start)
    assert result.reached.tolist() == [[True] * 3] * 3 + [[False] * 3]
    np.testing.assert_array_equal(result.weights[3], start[3])
    np.testing.assert_array_equal(result.weights[:3], _solve(columns, values).weights)


def test_a_light_of_one_colour_keeps_the_others_and_counts_as_reached():
    columns, values = _problem(2, "uniform", 10)
    columns[1:, :, 1] = 0
    result = _solve(columns, values, np.full((2, 3), 0.125))
    assert result.reached.tolist() == [[True] * 3, [True, False, False]]
    np.testing.assert_array_equal(result.weights[1, 1:], 0.125)
    assert result.weights[1, 0] != 0.125


def test_kkt_residual_by_hand():
    on_gradient, off_gradient = np.array([0.0, 0.0]), np.array([3.0, 0.0])
    bounds = (2.0, 0.0, np.inf)
    assert kkt_residual(on_gradient, off_gradient, *bounds) == 0
    # A light that is off may have a positive gradient, and one that is on may not.
    assert kkt_residual(np.array([0.0, 5.0]), off_gradient, *bounds) == 0
    assert kkt_residual(np.array([1.0, 0.0]), off_gradient, *bounds) == 0.5
    assert kkt_residual(np.array([0.0, -1.0]), off_gradient, *bounds) == 0.5
    # One at its upper bound may have a negative one; no step goes further than the bounds.
    assert kkt_residual(np.array([-7.0, 0.0]), off_gradient, 2.0, 0.0, 3.0) == 0
    assert kkt_residual(np.array([-7.0, 0.0]), off_gradient, 2.0, 0.0, 4.0) == 0.5


@pytest.mark.parametrize("seed", seeds(8, 60))
def test_lights_with_one_weight_agree_with_scipy_on_the_joint_problem(seed: int):
    rng = np.random.default_rng(seed)
    n, pixels = int(rng.integers(1, 9)), 80
    A = rng.random((3, n, pixels)) + 0.05
    target = rng.normal(0.4, 0.6, (3, pixels))
    is_scalar = (rng.random(n) < 0.5).tolist()
    is_scalar[0] = True
    M, b = A @ A.transpose(0, 2, 1), np.einsum("cnp,cp->cn", A, target)
    equations = NormalEquations(M, b, np.square(target).sum(axis=1))
    optimum = solve_free(equations, np.ones((n, 3)), is_scalar=is_scalar)
    # One column per weight over the pixels of all three channels, one after another.
    columns, owners = [], []
    for i in range(n):
        for channels in [[0, 1, 2]] if is_scalar[i] else [[0], [1], [2]]:
            column = np.zeros((3, pixels))
            column[channels] = A[channels, i]
            columns.append(column.ravel())
            owners.append((i, channels))
    expected, _ = nnls(np.stack(columns, axis=1), target.ravel())
    assert optimum.converged
    for (i, channels), value in zip(owners, expected, strict=True):
        # Precision: both stop at about 1e-10 of weights of the order of 1.
        np.testing.assert_allclose(optimum.weights[i, channels], value, atol=1e-8)
