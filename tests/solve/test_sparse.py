"""The best lighting of few lights, against trying all of them."""

from itertools import combinations
from typing import Any

import numpy as np
import pytest
from scipy.optimize import nnls

from lightpaint.solve.normal_equations import NormalEquations
from lightpaint.solve.solver import solve_normal_equations
from lightpaint.solve.sparse import sparse_path


def _problem(seed: int, n: int) -> tuple[Any, Any, NormalEquations]:
    """Images (3, m, n) and target (3, m) that no few of them make."""
    rng = np.random.default_rng(seed)
    A = rng.random((3, 40, n)) ** 2
    truth = rng.random((3, n)) * (rng.random(n) < 0.6)
    y = np.einsum("cmi,ci->cm", A, truth) + rng.normal(scale=0.1, size=(3, 40))
    equations = NormalEquations(
        np.einsum("cmi,cmj->cij", A, A), np.einsum("cmi,cm->ci", A, y), np.square(y).sum(axis=1)
    )
    return A, y, equations


def _best_of_all(A: Any, y: Any, k: int) -> float:
    """The least objective over all sets of k lights, by scipy on the pixels."""
    return min(
        sum(nnls(A[c][:, list(lights)], y[c])[1] ** 2 for c in range(3))
        for lights in combinations(range(A.shape[2]), k)
    )


def test_against_all_sets_of_lights():
    equal = tried = 0
    for seed in range(12):
        A, y, equations = _problem(seed, 7)
        path = sparse_path(equations)
        for k in range(1, len(path.chosen)):
            best = _best_of_all(A, y, k)
            # Nothing beats trying all; round-off is relative to ‖Ψ‖².
            assert path.objective[k] >= best - 1e-12 * equations.target_norm2.sum()
            assert path.objective[k] <= 1.3 * best
            equal += path.objective[k] <= best * (1 + 1e-9)
            tried += 1
    assert equal >= 0.95 * tried


def test_the_curve_falls_to_the_optimum_of_all_lights():
    _, _, equations = _problem(3, 9)
    path = sparse_path(equations)
    assert (np.diff(path.objective) < 0).all()
    everything = solve_normal_equations(equations, np.ones((9, 3)))
    np.testing.assert_allclose(
        path.objective[-1], equations.objective(everything.weights).sum(), rtol=1e-9
    )
    for k, lights in enumerate(path.chosen):
        assert len(lights) == k
        off = sorted(set(range(9)) - set(lights))
        np.testing.assert_array_equal(path.weights[k][off], 0)
        np.testing.assert_allclose(
            equations.objective(path.weights[k]).sum(), path.objective[k], rtol=1e-9
        )
    np.testing.assert_allclose(
        path.relative_objective, path.objective / equations.target_norm2.sum()
    )
    assert set(path.order) >= set(path.chosen[-1])


def test_kept_lights_stay_and_count_nothing():
    _, _, equations = _problem(4, 6)
    is_fixed = [False, True, False, False, False, True]
    path = sparse_path(equations, 2, is_fixed=is_fixed)
    np.testing.assert_array_equal(path.weights[:, [1, 5]], 1)
    assert not {1, 5} & set(path.order)
    assert len(path.chosen) <= 3
    for weights, objective in zip(path.weights, path.objective, strict=True):
        np.testing.assert_allclose(equations.objective(weights).sum(), objective, rtol=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_lights_with_one_weight_for_three_channels(seed: int):
    _, _, equations = _problem(seed, 6)
    is_scalar = [True, False, True, False, False, True]
    path = sparse_path(equations, is_scalar=is_scalar)
    for weights in path.weights:
        np.testing.assert_array_equal(
            weights[is_scalar].min(axis=1), weights[is_scalar].max(axis=1)
        )
    full = solve_normal_equations(equations, np.ones((6, 3)), is_scalar=is_scalar)
    np.testing.assert_allclose(
        path.objective[-1], equations.objective(full.weights).sum(), rtol=1e-9
    )


def test_a_black_target_needs_no_light():
    _, _, equations = _problem(0, 4)
    dark = NormalEquations(equations.M, 0 * equations.b, 0 * equations.target_norm2)
    path = sparse_path(dark)
    assert path.chosen == ((),)
    assert path.objective.tolist() == [0]
