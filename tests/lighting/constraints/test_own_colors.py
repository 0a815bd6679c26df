"""Lamps that keep their own colours have a dimmer each, and nothing else."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import nnls

import lightpaint as lp
from lightpaint.basis.light_basis import Basis
from lightpaint.colour.color import LUMINANCE
from lightpaint.lighting.fit import resolve_for_targets
from lightpaint.lighting.live.live_solver import LiveSolver
from lightpaint.lighting.live.live_view import LiveView

#: The last light is off.
EMISSION = [[1.0, 0.5, 0.2], [0.3, 0.4, 0.9], [2.0, 2.0, 2.0], [0.0, 0.0, 0.0]]


def _basis(make_basis: Any) -> Basis:
    images = np.random.default_rng(3).random((4, 12, 10, 3)) ** 3
    basis: Basis = make_basis(images=images, emission=EMISSION)
    return basis


def _painting(basis: Basis, **fields: Any) -> lp.Target:
    rng = np.random.default_rng(5)
    mask = np.zeros(basis.size)
    mask[:, :6] = rng.uniform(0.2, 1, (basis.size[0], 6))
    return replace(lp.Target.of(rng.random((*basis.size, 3)), mask), **fields)


def _own(basis: Basis) -> np.ndarray:
    """Colours at luminance 1, (n, 3); white for a light that is off."""
    emission = np.where(basis.current_weights.any(axis=1)[:, None], basis.current_weights, 1.0)
    return np.asarray(emission / (emission @ LUMINANCE)[:, None])


@pytest.mark.parametrize("space", ["linear", "display"])
def test_the_answer_has_the_colours_that_lamps_have(make_basis: Any, space: Any):
    basis = _basis(make_basis)
    weights = lp.solve(basis, _painting(basis), colors="own", space=space).weights
    dimmers = weights @ LUMINANCE
    assert (dimmers > 0.01).sum() > 1
    np.testing.assert_allclose(weights, dimmers[:, None] * _own(basis), rtol=1e-12)


def test_dimmers_are_the_least_squares_of_one_column_for_each_lamp(make_basis: Any):
    basis = _basis(make_basis)
    painting = _painting(basis)
    columns = basis.images * _own(basis)[:, None, None, :]
    root = np.sqrt(painting.importance)[..., None]
    expected, _ = nnls(
        (columns * root).reshape(len(columns), -1).T.astype(float),
        (painting.image * root).ravel().astype(float),
    )
    solution = lp.solve(basis, painting, colors="own")
    np.testing.assert_allclose(solution.weights @ LUMINANCE, expected, rtol=1e-6, atol=1e-9)
    assert solution.certificate.converged
    assert solution.certificate.colors == "own"


def test_constraints_of_single_lamps_come_first(make_basis: Any):
    basis = _basis(make_basis)
    asked = {
        "light 0": {"color": "#ff0000"},
        "light 1": {"lock": [0.1, 0.2, 0.1]},
        "light 2": {"limits": {"max": 0.05}},
    }
    constraints = lp.Constraints.of(asked)
    solution = lp.solve(basis, _painting(basis), colors="own", constraints=constraints)
    weights, own = solution.weights, _own(basis)
    assert weights[0, 1:].tolist() == [0, 0]
    np.testing.assert_allclose(weights[1], [0.1, 0.2, 0.1])
    np.testing.assert_allclose(weights[2], weights[2] @ LUMINANCE * own[2], rtol=1e-12)
    assert weights[2] @ LUMINANCE <= 0.05 * (1 + 1e-9)
    labels = solution.problem.reduction.labels
    assert labels[2:] == ("limits 0 to 0.05, own colour", "own colour")


def test_under_the_brush_the_answer_is_the_same(make_basis: Any):
    basis = _basis(make_basis)
    painting = _painting(basis, over_look=True)
    fit = resolve_for_targets(lp.Fit(colors="own"), [painting])
    view = LiveView(basis, painting.image, painting.importance)
    live = LiveSolver([view], fit=fit, constraints=lp.Constraints(), is_sketch=True)
    answer = live.answer(basis.current_weights)
    exact = lp.solve(basis, painting, colors="own").weights
    np.testing.assert_allclose(answer, exact, rtol=1e-6, atol=1e-9)


def test_without_paint_lamps_stay_as_they_are(make_basis: Any):
    basis = _basis(make_basis)
    fit = resolve_for_targets(lp.Fit(colors="own"), [_painting(basis, over_look=True)])
    view = LiveView(basis, basis.current_look.copy(), np.zeros(basis.size, np.float32))
    answer = LiveSolver([view], fit=fit, constraints=lp.Constraints()).answer(basis.current_weights)
    np.testing.assert_allclose(answer, basis.current_weights, rtol=1e-9)
