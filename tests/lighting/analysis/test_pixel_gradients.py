"""The effect of noise on a fit in display space: the tangent of its gradient."""

from typing import Any

import numpy as np
import pytest
from nightly import nightly

from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.images import pixel_blocks
from lightpaint.lighting.analysis.noise.noise_correction import correct_noise
from lightpaint.lighting.analysis.noise.residuals import (
    PixelGradients,
    Residuals,
    steadier_light,
)
from lightpaint.lighting.analysis.noise.uncertainty import error_bars
from lightpaint.lighting.default_solve import solve
from lightpaint.target.painted_target import Target

SIZE = (24, 24)


def _pools() -> Any:
    """Three overlapping pools of light, (n, h, w, 3)."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1]] / SIZE[0]
    pools = [
        np.exp(-((x - a) ** 2 + (y - b) ** 2) / 0.1) for a, b in ((0, 0.2), (1, 0.3), (0.5, 1))
    ]
    return np.stack(pools)[..., None] * np.array([0.3, 0.25, 0.2])


def _painting(clean: Any, over: tuple[slice, slice] | None = None) -> Target:
    """Half brighter, half darker than a mix of the pools, or only somewhere, `over` the look."""
    image = np.einsum("n,nhwc->hwc", [1.2, 0.6, 0.9], clean)
    image = image * np.where(np.arange(SIZE[1]) > 11, 1.3, 0.8)[:, None]
    importance = np.ones(SIZE, np.float32)
    if over is not None:
        importance[:] = 0
        importance[over] = 1
    painted = image.astype(np.float32)
    is_over = over is not None
    return Target("t", painted, importance, everything=not is_over, over_look=is_over)


def _noisy(clean: Any, sigma: float, seed: int) -> tuple[Any, Any]:
    """Mean and half difference of two halves with skewed noise, the same in all channels."""
    rng = np.random.default_rng(seed)
    a, b = (
        clean * (1 + sigma * np.sqrt(2) * (rng.exponential(1, (*clean.shape[:-1], 1)) - 1))
        for _ in range(2)
    )
    return (a + b) / 2, (a - b) / 2


@pytest.mark.parametrize(
    ("view", "over"),
    [("agx", None), nightly("srgb", (slice(12), slice(None)))],
    ids=["whole", "over"],
)
def test_intervals_hold_in_display_space(
    make_basis: Any, view: str, over: tuple[slice, slice] | None
):
    """95 % intervals over seeds, in every channel of every light."""
    clean, seeds = _pools(), 25
    options: dict[str, Any] = {"literal": True, "transform": ViewTransform(view)}
    options |= {"space": "display", "hold": 0.0 if over is None else 1.0}
    target = _painting(clean, over)
    truth = solve(make_basis(images=clean), target, **options).weights
    held = []
    for seed in range(seeds):
        images, halves = _noisy(clean, 0.5, seed)
        basis = make_basis(images=images, half_differences=halves)
        bars = error_bars(correct_noise(solve(basis, target, **options)))
        assert bars is not None
        low, high = bars.interval
        held.append((low <= truth) & (truth <= high))
    # Four standard errors of a count over independent seeds.
    assert np.mean(held, axis=0).min() > 0.95 - 4 * np.sqrt(0.05 * 0.95 / seeds)


def test_where_a_display_shows_light_itself_nothing_is_bent(make_basis: Any):
    """To round-off of the differences that stand for derivatives."""
    target = _painting(_pools())
    images, halves = _noisy(_pools(), 0.3, 1)
    basis = make_basis(images=images, half_differences=halves)
    view = ViewTransform("linear", -4.0)  # nothing is clipped
    shown = correct_noise(solve(basis, target, literal=True, space="display", transform=view))
    plain = correct_noise(solve(basis, target, literal=True))
    assert shown.problem.noise_removed == plain.problem.noise_removed > 0
    np.testing.assert_allclose(shown.weights, plain.weights, rtol=1e-6)
    bars = [error_bars(x) for x in (shown, plain)]
    assert bars[0] is not None
    assert bars[1] is not None
    np.testing.assert_allclose(bars[0].scatter, bars[1].scatter, rtol=1e-5)


def test_light_without_noise_stays_as_it_is():
    light = np.random.default_rng(0).random((9, 11, 3))
    steady, share = steadier_light(light, np.zeros_like(light), np.ones((9, 11, 1)))
    assert (steady == light).all()
    assert not share.any()


def test_even_light_is_steadied_by_its_neighbours_and_not_by_itself():
    rng = np.random.default_rng(0)
    a, b = 1 + 0.3 * rng.standard_normal((2, 64, 64, 3))
    light, half = (a + b) / 2, (a - b) / 2
    steady, _ = steadier_light(light, half, np.ones((64, 64, 1)))
    # The mean of eight pixels has 1/8 of the variance; shares are estimates and not quite 1.
    assert np.var(steady) < 0.25 * np.var(light)
    assert abs(np.mean((steady - 1) * (light - 1))) < 0.25 * np.var(light)


def test_an_edge_stays():
    """A step of many times the noise: no pixel moves by more than the noise."""
    light = np.ones((20, 20, 3))
    light[:, 10:] = 10
    noise = np.full_like(light, 0.1)
    steady, _ = steadier_light(light, noise, np.ones((20, 20, 1)))
    assert np.abs(steady - light)[:, 8:12].max() < 0.1


def _texture() -> Any:
    """Surfaces that change from pixel to pixel, (h, w, 1)."""
    return np.random.default_rng(7).uniform(0.1, 1, (*SIZE, 1))


def test_textured_light_is_steadied_relative_to_a_painting_of_it():
    """Noise of a tenth; the texture hides it from pixels alone, and the ratio shows it."""
    shown, rng = _texture() * np.ones(3), np.random.default_rng(1)
    a, b = shown * (1 + 0.1 * np.sqrt(2) * rng.standard_normal((2, *SIZE, 3)))
    light, half, counted = (a + b) / 2, (a - b) / 2, np.ones((*SIZE, 1))
    painting = shown * np.linspace(0.5, 2, SIZE[1])[:, None]

    def remaining(guide: Any) -> float:
        steady, _ = steadier_light(light, half, counted, guide)
        return float(np.square(steady / shown - 1).mean() / np.square(light / shown - 1).mean())

    assert remaining(None) > 0.8
    # The mean of eight pixels, and what shares are off; most near edges.
    assert remaining(painting) < 0.35
    # Without a painting in one half, nothing changes there.
    half_painting = painting * (np.arange(SIZE[1]) < 12)[:, None]
    without, found = (steadier_light(light, half, counted, x)[0] for x in (None, half_painting))
    np.testing.assert_array_equal(found[:, 12:], without[:, 12:])
    assert np.square(found / shown - 1)[:, :10].mean() < np.square(without / shown - 1).mean() / 2


def test_a_painting_with_the_noise_of_the_light_steadies_nothing():
    """The noisy look itself, painted over: its ratio to the light has no noise at all."""
    images, halves = _noisy(_pools(), 0.3, 1)
    light, half = images.sum(axis=0) * _texture(), halves.sum(axis=0) * _texture()
    counted = np.ones((*SIZE, 1))
    alone = steadier_light(light, half, counted)
    for gain in (1.0, 0.7):
        found = steadier_light(light, half, counted, gain * light)
        np.testing.assert_array_equal(found[0], alone[0])


@pytest.mark.parametrize("over", [None, (slice(12), slice(None))], ids=["whole", "over"])
def test_bands_have_the_gradients_of_whole_pictures(
    make_basis: Any, monkeypatch: pytest.MonkeyPatch, over: tuple[slice, slice] | None
):
    """To the bit but for the mean light of the painting, which is a sum of bands."""
    images, halves = _noisy(_pools(), 0.3, 1)
    basis = make_basis(images=images, half_differences=halves)
    solution = solve(basis, _painting(_pools(), over), literal=True, space="display")
    assert not solution.problem.is_linear

    def gradients() -> list[Any]:
        found = PixelGradients.of(solution, Residuals.of(solution))
        return [found.mean, found.half, found.bend, found.doubt]

    whole = gradients()
    monkeypatch.setattr(pixel_blocks, "BAND_PIXELS", 5 * SIZE[1])
    for banded, expected in zip(gradients(), whole, strict=True):
        # Differences over a step of 1e-2 magnify the round-off.
        np.testing.assert_allclose(banded, expected, rtol=1e-10, atol=1e-13)


def test_each_of_several_views_has_its_own_gradients(make_basis: Any):
    """The same view twice: the gradients of each are equal."""
    images, halves = _noisy(_pools(), 0.3, 1)
    basis = make_basis(images=images, half_differences=halves)
    targets = [_painting(_pools())] * 2
    solution = solve([basis, basis], targets, literal=True, space="display")
    found = PixelGradients.of(solution, Residuals.of(solution))
    for gradients in (found.mean, found.half, found.bend, found.doubt):
        assert gradients is not None
        first, second, _ = np.split(gradients, [SIZE[0] * SIZE[1], 2 * SIZE[0] * SIZE[1]])
        assert first.any()
        np.testing.assert_allclose(second, first, rtol=1e-10, atol=1e-13)


def test_no_tangent_leads_across_the_edge_of_clipping(make_basis: Any):
    """A pixel that is clipped for sure, beside noisy ones below white: its loss has no slope."""
    rng = np.random.default_rng(2)
    a, b = 0.8 * (1 + 0.1 * rng.standard_normal((2, 1, *SIZE, 3)))
    a[0, 12, 12], b[0, 12, 12] = 1.101, 1.099
    basis = make_basis(images=(a + b) / 2, half_differences=(a - b) / 2)
    image = np.full((*SIZE, 3), 0.8, np.float32)
    target = Target("t", image, np.ones(SIZE, np.float32), everything=True)
    transform = ViewTransform("srgb")
    solution = solve(basis, target, literal=True, space="display", transform=transform)
    gradients = PixelGradients.of(solution, Residuals.of(solution))
    pixel = 12 * SIZE[1] + 12
    assert solution.weights.min() * 1.1 > 1.05
    assert not gradients.mean[pixel].any()
    assert gradients.mean.any(axis=1).sum() > 500


def test_answers_to_a_painting_of_a_texture_have_no_bias(make_basis: Any):
    """Half of the noise of textured pictures is in the bend of a display's curve."""
    clean, seeds = _pools() * _texture(), 60
    target = _painting(clean)
    options: dict[str, Any] = {"literal": True, "space": "display"}
    options |= {"transform": ViewTransform("srgb")}
    truth = solve(make_basis(images=clean), target, **options).weights
    solved = []
    for seed in range(seeds):
        images, halves = _noisy(clean, 0.5, seed)
        basis = make_basis(images=images, half_differences=halves)
        solved.append(correct_noise(solve(basis, target, **options), share=1).weights)
    error = np.mean(solved, axis=0) - truth
    spread = np.std(solved, axis=0, ddof=1)
    # Channels have the same noise: four standard errors of the mean over seeds.
    assert (np.abs(error) < 4 * spread / np.sqrt(seeds)).all()
