"""Each light pays for what it does where nothing is painted, so that none goes off unasked."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import lightpaint as lp
from lightpaint.colour.color import luminance
from lightpaint.lighting.analysis.appearance.area_lights import compensating_lights
from lightpaint.lighting.fit import Fit
from lightpaint.lighting.loss import weight_penalty
from lightpaint.lighting.loss.expected_lights import DARK
from lightpaint.lighting.loss.painting import unpainted_weight_of
from lightpaint.lighting.loss.weight_penalty import RESTRAINT
from lightpaint.lighting.problem import Problem
from lightpaint.paint.session.session_messages import judge

SIZE = (8, 16)


def _room(make_basis: Any, spill: float = 0.3) -> lp.Basis:
    """A key light for the left half that spills on the right, and a fill for the right alone."""
    left = (np.arange(SIZE[1]) < SIZE[1] // 2) * np.ones(SIZE)
    pools = [left + spill * (1 - left), 0.5 * (1 - left)]
    images = np.array([pool[..., None] * np.ones(3) for pool in pools])
    basis: lp.Basis = make_basis(images=images, names=["key", "fill"], emission=np.ones((2, 3)))
    return basis


def _brighter(basis: lp.Basis, importance: np.ndarray, factor: float = 3.0) -> lp.Target:
    image = factor * basis.current_look
    return lp.Target("t", image, importance.astype(np.float32), False, over_look=True)


def _left(share: float = 1.0) -> np.ndarray:
    importance = np.zeros(SIZE)
    importance[:, : SIZE[1] // 2] = share
    return importance


def _levels(basis: lp.Basis, target: lp.Target, **fit: Any) -> np.ndarray:
    weights = lp.solve(basis, target, **fit).weights
    return np.asarray(luminance(weights) / luminance(basis.current_weights))


def test_a_light_that_nobody_painted_stays_on_while_another_spills(
    make_basis: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    basis = _room(make_basis)
    target = _brighter(basis, _left())
    key, fill = _levels(basis, target)
    assert key > 2.5
    assert fill > 0.05
    monkeypatch.setattr(weight_penalty, "RESTRAINT", 0.0)
    assert _levels(basis, target)[1] == 0


@pytest.mark.parametrize("transform", [None, lp.ViewTransform("srgb", 0.5)])
def test_the_price_is_that_of_each_light_by_itself(make_basis: Any, transform: Any) -> None:
    """Of all channels and unpainted shares of pixels, as a sum over them says it."""
    rng = np.random.default_rng(2)
    basis = make_basis(images=rng.random((3, *SIZE, 3)) * 0.2, emission=rng.random((3, 3)) + 0.2)
    importance = rng.random(SIZE)
    space = "linear" if transform is None else "display"
    fit = Fit(space=space, transform=transform, hold=0.7, colors="gentle")
    made = Problem.of(basis, _brighter(basis, importance), fit=fit)
    weights, look = rng.random((3, 3)), basis.current_look.astype(np.float64)
    slope: Any = 1.0
    if transform is not None:
        ahead, back = (transform.encode(look * x) for x in (1.02, 0.98))
        slope = (ahead - back) / (0.04 * look)
    # Light that is dark for the picture has a smaller relative change.
    slope = slope * look / (look + DARK * look.mean())
    own = basis.images * basis.current_weights[:, None, None]
    rest = unpainted_weight_of(made.views, made.fit) * (1 - importance[..., None])
    energy = (rest * np.square(slope * own)).sum(axis=(1, 2, 3), keepdims=True)[..., 0, 0]
    change = np.square(weights / basis.current_weights - 1)
    expected = (RESTRAINT * energy / 3 * change).sum(axis=0)
    assert made.restraint is not None
    # Importance and pictures are in single precision.
    np.testing.assert_allclose(made.restraint.objective(weights), expected, rtol=1e-5)


def test_nothing_is_paid_where_all_is_painted_or_only_paint_counts(make_basis: Any) -> None:
    basis = _room(make_basis)
    everywhere = Problem.of(basis, _brighter(basis, np.ones(SIZE)))
    assert everywhere.restraint is None or not everywhere.restraint.M.any()
    for fit in (Fit(hold=0.0, colors="free"), Fit(hold=2.0, literal=True)):
        assert Problem.of(basis, _brighter(basis, _left()), fit=fit).restraint is None


def test_no_light_goes_off_for_nearly_nothing_where_nothing_is_held(make_basis: Any) -> None:
    """A fill spills 5 % on half of the paint, which asks for what the key alone makes there."""
    images, spilt = _room(make_basis).images.copy(), _left()
    spilt[:, SIZE[1] // 4 :] = 0
    images[1] += 0.05 * spilt[..., None]
    basis = make_basis(images=images, names=["key", "fill"], emission=np.ones((2, 3)))
    target = _brighter(basis, _left())
    key_alone = np.where(spilt[..., None] > 0, 3 * images[0], target.image)
    target = replace(target, image=key_alone.astype(np.float32))
    key, fill = _levels(basis, target, hold=0.0)
    assert key > 2.9
    assert fill > 0.8


def test_a_hold_of_nothing_counts_no_unpainted_pixel(make_basis: Any) -> None:
    """A lamp that the paint asks for shines on the rest as it would alone."""
    basis = _room(make_basis, spill=1.0)
    assert _levels(basis, _brighter(basis, _left()), hold=0.0)[0] > 2.8
    assert _levels(basis, _brighter(basis, _left()), hold=4.0)[0] < 2.5


def test_a_light_that_is_down_for_unpainted_parts_is_named_with_what_helps(
    make_basis: Any,
) -> None:
    basis = _room(make_basis, spill=0.6)
    solution = lp.solve(basis, _brighter(basis, _left()))
    assert luminance(solution.weights[1]) < 0.25
    assert compensating_lights(solution) == ("fill",)
    [analysis] = lp.analyse(solution)
    [sentence] = [x for x in judge([analysis], [0]).worst.sentences if "fill" in x]
    assert sentence == (
        "Light fill is off or nearly off only because unpainted parts are held, and other lights "
        "would brighten them: paint what it lights, or lock it."
    )
    # What helps: its pool painted as it should be.
    painted = lp.solve(basis, _brighter(basis, np.ones(SIZE)))
    assert luminance(painted.weights[1]) > 1
    assert compensating_lights(painted) == ()


def test_a_light_that_the_paint_or_a_person_put_out_is_not_named(make_basis: Any) -> None:
    basis = _room(make_basis, spill=0.6)
    darker = lp.solve(basis, _brighter(basis, 1 - _left(), factor=0.1))
    assert luminance(darker.weights[1]) < 0.25
    assert compensating_lights(darker) == ()
    off = lp.Constraints.of(light={"fill": {"off": True}})
    assert compensating_lights(lp.solve(basis, _brighter(basis, _left()), constraints=off)) == ()
