"""The parts of the residual: closed forms, and that they add up."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.lighting.analysis.diagnosis import diagnose
from lightpaint.lighting.answer.combination import combine
from lightpaint.lighting.default_solve import solve
from lightpaint.target.painted_target import Target, Wish

SIZE = (12, 18)


def _target(image: Any, importance: Any = None) -> Target:
    importance = np.ones(SIZE) if importance is None else importance
    return Target(
        "painted", image.astype(np.float32), importance.astype(np.float32), everything=False
    )


def _halves() -> Any:
    """Two lights that share no pixel: one on the left, one on the right."""
    images = np.zeros((2, *SIZE, 3))
    images[0, :, :9], images[1, :, 9:] = 1, 2
    return images


def _diagnosis(basis: Any, target: Target) -> Any:
    return diagnose(solve(basis, target))


def test_a_mix_of_the_lights_misses_nothing(make_basis: Any):
    images = _halves()
    diagnosis = _diagnosis(make_basis(images=images), _target(0.3 * images[0] + 0.7 * images[1]))
    assert diagnosis.total == pytest.approx(0, abs=1e-9)
    assert diagnosis.bounds == ()


def test_darkness_that_only_negative_light_would_make_is_forbidden(make_basis: Any):
    images = _halves()
    images[1] = 1  # the second light shines everywhere
    diagnosis = _diagnosis(make_basis(images=images), _target(images[1] - 0.5 * images[0]))
    # The second light alone: 1 on the right and 0.5 on the left is met best by their mean.
    pixels = 3 * images[0, ..., 0].sum()
    assert diagnosis.total == pytest.approx(2 * pixels * 0.25**2, rel=1e-5)
    assert diagnosis.forbidden == pytest.approx(diagnosis.total, rel=1e-5)
    [bound] = diagnosis.bounds
    assert (bound.lights, bound.kind, bound.held_by) == (("light 0",), "zero", "zero")
    # Without that bound the painting is met.
    assert bound.gain == pytest.approx(diagnosis.total, rel=1e-4)
    # d/dw of the objective at w = 0 of that light: 2 Σ 1 · 0.25 over its pixels, per channel.
    assert bound.multiplier == pytest.approx([2 * 0.25 * images[0, ..., 0].sum()] * 3, rel=1e-5)


def test_what_is_orthogonal_to_all_lights_is_out_of_reach(make_basis: Any):
    images = _halves()
    stripes = np.zeros((*SIZE, 3))
    stripes[::2, :9, 2], stripes[1::2, :9, 2] = 0.5, -0.5  # blue, and on average nothing
    diagnosis = _diagnosis(make_basis(images=images), _target(images[0] + stripes))
    assert diagnosis.unreachable == pytest.approx(0.25 * 12 * 9, rel=1e-5)
    assert diagnosis.forbidden == pytest.approx(0, abs=1e-4)
    np.testing.assert_allclose(diagnosis.unreachable_map, stripes, atol=1e-5)


def test_the_place_is_where_light_is_missing(make_basis: Any):
    images = _halves()
    images[:, :3, :5] = 0  # no light comes to the top left
    image = images[0] + images[1]
    image[:3, :5] = (0.1, 0.2, 0.9)
    place = _diagnosis(make_basis(images=images), _target(image)).place
    assert place.region == (0, 0)
    assert place.share > 0.6
    assert place.painted == pytest.approx((0.1, 0.2, 0.9), rel=1e-5)
    assert place.reached == pytest.approx((0, 0, 0), abs=1e-6)
    top, left, bottom, right = place.box
    assert 0 <= top < bottom <= 4
    assert 0 <= left < right <= 6


def test_what_does_not_count_is_told_apart(make_basis: Any):
    images = _halves()
    importance = np.ones(SIZE)
    importance[:, 9:] = 0.25
    image = images[0] + images[1]
    image[:6, 9:] = 0.1
    diagnosis = _diagnosis(make_basis(images=images), _target(image, importance))
    # Half of the right is painted 0.1, half of it 2; the light does the mean of both.
    missed_energy = 3 * 12 * 9 * 0.95**2
    assert diagnosis.total == pytest.approx(0.25 * missed_energy, rel=1e-5)
    assert diagnosis.ignored == pytest.approx(0.75 * missed_energy, rel=1e-5)


def test_a_light_that_is_kept_stands_in_the_way(make_basis: Any):
    from dataclasses import replace

    basis = make_basis(images=_halves(), emission=[[1, 1, 1], [0.5, 0.5, 0.5]])
    kept_light = replace(basis.lights[0], is_fixed=True)
    basis = replace(basis, lights=(kept_light, basis.lights[1]))
    diagnosis = _diagnosis(basis, _target(0.5 * _halves()[0] + 0.2 * _halves()[1]))
    [bound] = diagnosis.bounds
    assert (bound.kind, bound.held_by) == ("kept", "kept")
    assert bound.gain == pytest.approx(diagnosis.total, rel=1e-5)
    # Held as it is, no weights of the others help.
    assert diagnosis.unreachable == pytest.approx(diagnosis.total, rel=1e-5)


@given(st.integers(0, 10_000), st.integers(1, 6), st.booleans())
def test_the_parts_add_up(make_basis: Any, seed: int, n: int, is_scalar: bool):
    from dataclasses import replace

    rng = np.random.default_rng(seed)
    noise = rng.normal(0, 0.05, (n, *SIZE, 3))
    basis = make_basis(n, SIZE, seed=seed, half_differences=noise)
    if is_scalar:
        basis = replace(basis, lights=(replace(basis.lights[0], is_scalar=True), *basis.lights[1:]))
    importance = np.clip(rng.normal(0.5, 0.5, SIZE), 0, None)
    importance[0, 0] = 1
    target = _target(rng.random((*SIZE, 3)) * rng.random(3), importance)
    solution = solve(basis, target)
    diagnosis = diagnose(solution)
    parts = (
        diagnosis.unreachable,
        diagnosis.forbidden,
        diagnosis.noise,
        diagnosis.painting_noise,
        diagnosis.ignored,
    )
    assert min(parts) >= 0
    assert sum(parts[:4]) == pytest.approx(diagnosis.total, rel=1e-12)
    # As the solve counts it, and as the pixels do, in float64 over float32.
    assert diagnosis.total == pytest.approx(sum(solution.certificate.objective), rel=1e-5)
    D = importance[..., None]
    separate = (D * (diagnosis.unreachable_map**2 + diagnosis.forbidden_map**2)).sum()
    assert separate == pytest.approx(diagnosis.total, rel=1e-5)
    residual = target.image - combine(basis, solution.lighting).image
    np.testing.assert_allclose(
        diagnosis.unreachable_map + diagnosis.forbidden_map, residual, atol=1e-6
    )
    # No bound alone can stand for more than all of them together.
    for bound in diagnosis.bounds:
        assert bound.gain <= diagnosis.forbidden + 1e-6 * diagnosis.total


def test_texture_is_no_grain_of_the_painting(make_basis: Any):
    """A shape that no light makes, painted over surfaces of every brightness: out of reach.

    Dark pixels count most in what a display shows, and were given the grain of bright ones.
    """
    rng = np.random.default_rng(4)
    size = (48, 64)
    albedo = 10 ** rng.uniform(-2.5, 0, size)[..., None] * np.ones(3)
    x = np.linspace(0, 1, size[1])[None, :, None]
    basis = make_basis(images=np.stack([albedo * (0.3 + 0.4 * x), albedo * (0.7 - 0.4 * x)]))
    y = np.linspace(-1, 1, size[0])[:, None, None]
    image = (albedo * 0.5 * 2.0 ** np.where(np.abs(y) < 0.4, 1.0, -0.5)).astype(np.float32)
    target = replace(
        Target.of(image),
        transform=ViewTransform(),
        through_view=True,
        # Without a contrast of its own, which the shape would have as a place of the painting.
        wishes=(Wish("painting", np.ones(size, np.float32)),),
    )
    diagnosis = diagnose(solve(basis, target))
    # Some of it is: albedo from pixel to pixel is finer than any surface's. It was all of it.
    assert diagnosis.share(diagnosis.unreachable) > 0.5
    assert diagnosis.share(diagnosis.painting_noise) < 0.4


def test_the_look_that_is_kept_has_the_noise_of_the_prediction(make_basis: Any):
    # One light, noisy on the right, which is to stay as it is; the left is painted brighter.
    noise = np.zeros((1, *SIZE, 3))
    noise[0, :, 9:] = np.random.default_rng(3).normal(0, 0.3, (SIZE[0], 9, 3))
    basis = make_basis(images=np.ones((1, *SIZE, 3)) + noise, half_differences=noise)
    is_left = np.broadcast_to(np.arange(SIZE[1]) < 9, SIZE)
    brighter = np.broadcast_to(1.5 * basis.current_weights[0], (*SIZE, 3))
    target = replace(_target(brighter, is_left), over_look=True)
    solution = solve(basis, target, unpainted=1.0, space="linear")
    diagnosis = diagnose(solution)
    change = solution.weights[0] - basis.current_weights[0]
    assert change.min() > 0
    # The residual on the right is (now − w) Φ, whose half difference is (now − w) h, not w h.
    expected = np.square(change * noise[0, :, 9:]).sum()
    assert diagnosis.noise == pytest.approx(expected, rel=1e-5)  # float32
    assert diagnosis.share(diagnosis.unreachable) > 0.5
