"""The effect of noise on a fit in display space: the tangent of its gradient."""

from typing import Any

import numpy as np
import pytest
from nightly import nightly

from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.lighting.analysis.noise.noise_correction import correct_noise
from lightpaint.lighting.analysis.noise.residuals import steadier_light
from lightpaint.lighting.analysis.noise.uncertainty import error_bars
from lightpaint.lighting.solver import solve
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
