"""What newcomers paint first, and bounds for what comes of it, which a literal reading misses."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import lightpaint as lp
from lightpaint.colour.color import delta_e

SIZE = (36, 64)


@pytest.fixture
def basis(make_basis: Any) -> lp.Basis:
    """A room of seven white lamps: broad washes that overlap, and a spot on what is at the left."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1]] / SIZE[0]
    places = [(0.5, 0.3, 0.12), *((0.2 + 0.1 * k, 0.25 * k, 0.5) for k in range(6))]
    shapes = np.array([np.exp(-((y - a) ** 2 + (x - b) ** 2) / (2 * s**2)) for a, b, s in places])
    colors = np.random.default_rng(0).uniform(0.7, 1, (7, 3))
    albedo = np.random.default_rng(1).uniform(0.3, 0.6, (*SIZE, 1))
    images = (0.02 + shapes[..., None] * colors[:, None, None, :]) * albedo
    return make_basis(images=images, emission=np.full((7, 3), 0.3))


def _paint_over(look: np.ndarray, factor: Any, region: Any) -> lp.Target:
    """Painted over the look, and saved in 8 bits."""
    mask = np.zeros(SIZE)
    mask[region] = 1
    view = lp.ViewTransform()
    painted = np.where(mask[..., None] > 0, look * np.asarray(factor), look)
    codes = np.round(255 * view.encode(painted)) / 255
    target = lp.Target.of(view.decode(codes).astype(np.float32), mask)
    return replace(target, transform=view, through_view=True, over_look=True)


def _mean_change(basis: lp.Basis, solution: lp.Solution, region: Any) -> float:
    """Mean ΔE from the current look."""
    look, picture = basis.mix(basis.current_weights), basis.mix(solution.weights)
    return float(delta_e(look, picture)[region].mean())


def _hue(basis: lp.Basis, solution: lp.Solution) -> float:
    """How far lamps are from their colour, of their brightness, all together."""
    ratio = solution.weights / basis.current_weights
    return float(np.ptp(ratio, axis=1).sum() / ratio.max(axis=1).sum())


def test_more_light_on_the_statue_leaves_the_room_alone(basis: lp.Basis):
    """One percent of the picture, two stops brighter: the room next door stays as it was."""
    look = basis.mix(basis.current_weights)
    target = _paint_over(look, 2.5, (slice(15, 21), slice(9, 13)))
    outside = (slice(None), slice(32, None))
    by_meaning, literal = lp.solve(basis, target), lp.solve(basis, target, literal=True)
    assert _mean_change(basis, literal, outside) > 5
    assert _mean_change(basis, by_meaning, outside) < 1
    # And it is brighter: by more than half of the stops that were painted.
    stops_gained = np.log2(basis.mix(by_meaning.weights) / look)[target.importance > 0]
    assert stops_gained.mean() > 0.5 * np.log2(2.5)


def test_a_warm_stroke_makes_no_red_and_green_lamps(basis: lp.Basis):
    look = basis.mix(basis.current_weights)
    noise = np.random.default_rng(5).normal(0, 0.15, (*SIZE, 3))
    target = _paint_over(look, np.array([1.5, 1.2, 0.9]) * 2**noise, (slice(4, 30), slice(2, 20)))
    by_meaning, literal = lp.solve(basis, target), lp.solve(basis, target, literal=True)
    assert _hue(basis, literal) > 0.8
    assert _hue(basis, by_meaning) < 0.5


def test_an_untouched_look_changes_nothing(basis: lp.Basis):
    look = basis.mix(basis.current_weights)
    target = _paint_over(look, 1.0, (slice(None), slice(0, 30)))
    # Codes of 8 bits are a percent or so of light.
    assert _mean_change(basis, lp.solve(basis, target), ...) < 0.2


def test_what_has_its_own_mask_is_taken_at_its_word(basis: lp.Basis):
    """The paper's case: float light, nothing under it."""
    rng = np.random.default_rng(2)
    target = lp.Target.of(rng.random((*SIZE, 3)), rng.random(SIZE))
    by_meaning, literal = lp.solve(basis, target), lp.solve(basis, target, literal=True)
    np.testing.assert_array_equal(by_meaning.weights, literal.weights)
