"""A lighting that somebody has set by hand as a start: the solve improves it, and stays near."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import nnls

import lightpaint as lp
from lightpaint.basis.light_basis import Basis
from lightpaint.colour.color import LUMINANCE
from lightpaint.errors import ConstraintError
from lightpaint.lighting.fit import resolve_for_targets
from lightpaint.lighting.live.live_solver import LiveSolver
from lightpaint.lighting.live.live_view import LiveView

#: By light, as somebody has set them; the third stays as it is.
START: dict[str, Any] = {"light 0": [0.2, 0.1, 0.05], "light 1": [1.2, 1.4, 2.0]}

SRGB = lp.ViewTransform("srgb", -1.0)


def _basis(make_basis: Any) -> Basis:
    rng = np.random.default_rng(3)
    images = rng.random((3, 12, 10, 3)) ** 3
    images[0, :, 5:] = 0  # the first light reaches the paint alone
    images[2, :, :5] = 0  # and the last one none of it
    basis: Basis = make_basis(images=images, emission=rng.random((3, 3)) + 0.2)
    return basis


def _start_weights(basis: Basis) -> np.ndarray:
    weights = basis.current_weights.copy()
    weights[:2] = list(START.values())
    return weights


def _painting(basis: Basis, image: Any = None, **fields: Any) -> lp.Target:
    """Something else, or `image`, within the left half."""
    rng = np.random.default_rng(5)
    mask = np.zeros(basis.size)
    mask[:, :5] = rng.uniform(0.3, 1, (basis.size[0], 5))
    other = rng.random((*basis.size, 3)) if image is None else image
    return replace(lp.Target.of(np.asarray(other, np.float32), mask), **fields)


def test_the_pull_is_as_the_formula_says(make_basis: Any):
    """The least squares of the painting, and of a row for each weight, by another solver."""
    basis = _basis(make_basis)
    painting, near, start = _painting(basis), 0.3, _start_weights(basis)
    constraints = lp.Constraints.of(start=START, near=near)
    solution = lp.solve(basis, painting, constraints=constraints)
    D = painting.importance.astype(float)
    images, root = basis.images.astype(float), np.sqrt(D)
    for c in range(3):
        rows = (images[..., c] * root).reshape(3, -1).T
        strength = near * D.mean() * np.square(images[..., c]).sum(axis=(1, 2))
        A = np.concatenate([rows, np.diag(np.sqrt(strength))])
        y = np.concatenate(
            [(painting.image[..., c] * root).ravel(), np.sqrt(strength) * start[:, c]]
        )
        np.testing.assert_allclose(solution.weights[:, c], nnls(A, y)[0], rtol=1e-6, atol=1e-9)
    assert solution.certificate.converged


@pytest.mark.parametrize("fields", [{}, {"through_view": True, "transform": SRGB}], ids=str)
def test_a_painting_of_these_lamps_leaves_them_as_they_are(make_basis: Any, fields: Any):
    """Also their colours, and what is not painted: none of it is pulled back to the scene."""
    basis = _basis(make_basis)
    start = _start_weights(basis)
    painting = _painting(basis, basis.mix(start), over_look=True, **fields)
    for near in (0.0, 0.1):
        constraints = lp.Constraints.of(start=START, near=near)
        weights = lp.solve(basis, painting, constraints=constraints).weights
        np.testing.assert_allclose(weights, start, rtol=1e-3)
    assert np.abs(lp.solve(basis, painting).weights - start).max() > 0.05


def test_it_settles_what_the_painting_leaves_open(make_basis: Any):
    """Of two lights that are alike the sum is as painted, and the difference as it was set."""
    image = np.random.default_rng(1).random((8, 9, 3))
    basis = make_basis(images=np.stack([image, image]), emission=[[1.0] * 3] * 2)
    painting = lp.Target.of((3.0 * image).astype(np.float32))
    start = {"light 0": [2.0] * 3, "light 1": [0.4] * 3}
    for near in (0.01, 0.1):
        constraints = lp.Constraints.of(start=start, near=near)
        weights = lp.solve(basis, painting, constraints=constraints).weights
        # The pull of both weights against the paint, which sees them together.
        expected = (2 * 3.0 + near * 2.4) / (2 + near)
        np.testing.assert_allclose(weights.sum(axis=0), expected, rtol=1e-6)
        np.testing.assert_allclose(weights[0] - weights[1], 1.6, rtol=1e-6)


@pytest.mark.parametrize("colors", ["free", "gentle", "own"])
@pytest.mark.parametrize("near", [0.0, 0.3])
def test_under_the_brush_the_answer_is_the_same(make_basis: Any, colors: Any, near: float):
    basis = _basis(make_basis)
    painting = _painting(basis, over_look=True)
    constraints = lp.Constraints.of(start=START, near=near)
    fit = resolve_for_targets(lp.Fit(colors=colors), [painting])
    view = LiveView(basis, painting.image, painting.importance)
    live = LiveSolver([view], fit=fit, constraints=lp.Constraints(), is_sketch=True)
    live.answer(basis.current_weights)
    live.constrain(fit, constraints)
    answer = live.answer(live.answer(basis.current_weights))
    exact = lp.solve(basis, painting, constraints=constraints, colors=colors).weights
    np.testing.assert_allclose(answer, exact, rtol=1e-4, atol=1e-6)
    live.constrain(fit, lp.Constraints())
    answer = live.answer(live.answer(basis.current_weights))
    exact = lp.solve(basis, painting, colors=colors).weights
    np.testing.assert_allclose(answer, exact, rtol=1e-4, atol=1e-6)


def test_without_paint_lamps_are_as_they_were_set(make_basis: Any):
    basis = _basis(make_basis)
    fit = resolve_for_targets(lp.Fit(), [_painting(basis, over_look=True)])
    view = LiveView(basis, basis.current_look.copy(), np.zeros(basis.size, np.float32))
    live = LiveSolver([view], fit=fit, constraints=lp.Constraints.of(start=START), is_sketch=True)
    weights = live.answer(basis.current_weights)
    np.testing.assert_allclose(weights, _start_weights(basis), rtol=1e-9)


def test_own_colors_are_those_that_were_set(make_basis: Any):
    basis = _basis(make_basis)
    constraints = lp.Constraints.of(start=START)
    weights = lp.solve(basis, _painting(basis), constraints=constraints, colors="own").weights
    start = _start_weights(basis)
    own = start / (start @ LUMINANCE)[:, None]
    np.testing.assert_allclose(weights, (weights @ LUMINANCE)[:, None] * own, rtol=1e-9)


@pytest.mark.parametrize(
    ("start", "words"),
    [
        ({"light 9": [1, 1, 1]}, "no light 'light 9'"),
        ({"light 0": [1, -1, 1]}, "three numbers >= 0"),
        ({"light 0": 3}, "three numbers >= 0"),
        ([1, 2], "emissions by name"),
    ],
)
def test_what_is_no_lighting_is_refused(make_basis: Any, start: Any, words: str):
    basis = _basis(make_basis)
    with pytest.raises(ConstraintError, match=words):
        lp.solve(basis, _painting(basis), constraints=lp.Constraints.of(start=start))
    with pytest.raises(ConstraintError, match="near"):
        lp.Constraints.of(near=-1)
