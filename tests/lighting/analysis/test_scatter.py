"""The scatter of weights as error bars state it at few samples, against that over seeds."""

from typing import Any

import numpy as np
import pytest

from lightpaint.lighting.analysis.noise import noise_rows
from lightpaint.lighting.analysis.noise.noise_correction import correct_noise
from lightpaint.lighting.analysis.noise.noise_rows import UNCORRECTED, factor, values_beside
from lightpaint.lighting.analysis.noise.uncertainty import error_bars
from lightpaint.lighting.analysis.noise.weight_directions import WeightSpread
from lightpaint.lighting.default_solve import solve
from lightpaint.target.painted_target import Target

SIZE = (24, 24)
SEEDS = 60


def _pools() -> Any:
    """Pools of light, (3, h, w, 3)."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1]] / SIZE[0]
    places = ((0.2, 0.3), (0.8, 0.5), (0.5, 0.8))
    pools = [np.exp(-((x - a) ** 2 + (y - b) ** 2) / 0.1) for a, b in places]
    return np.stack(pools)[..., None] * np.ones(3)


def _painting(clean: Any) -> Target:
    """Something no mix of the pools is."""
    image = np.einsum("n,nhwc->hwc", [1, 0.8, 1.2], clean)
    image[:, 12:] *= [0.8, 0.7, 0.6]
    return Target("t", image.astype(np.float32), np.ones(SIZE, np.float32), everything=True)


@pytest.mark.parametrize("removed", [0.0, 1.0])
def test_the_stated_scatter_is_that_over_seeds(make_basis: Any, removed: float):
    """Of solves with all and with none of the noise's power in M, of skewed noise."""
    clean, rng = _pools(), np.random.default_rng(3)
    target, solved, stated = _painting(clean), [], []
    for _ in range(SEEDS):
        a, b = (clean * (0.5 + 0.5 * rng.exponential(1, (3, *SIZE, 1))) for _ in range(2))
        basis = make_basis(images=(a + b) / 2, half_differences=(a - b) / 2)
        bars = error_bars(correct_noise(solve(basis, target), share=removed), with_painting=False)
        solved.append(bars.weights)
        stated.append(bars.scatter)
    assert np.min(solved) > 0
    # In a few seeds a single pixel decides a light, and its error bar is wide on purpose.
    ratio = np.median(stated, axis=0) / np.std(solved, axis=0, ddof=1)
    # Channels have the same noise, lights their own. The logarithm of a standard deviation of n
    # values has the standard error 1/√(2 (n − 1)), of which this is four for the mean of lights.
    assert abs(np.log(ratio).mean()) < 4 / np.sqrt(2 * (SEEDS - 1) * len(clean))


@pytest.mark.parametrize("removed", [0.0, 0.5, 1.0])
def test_pairs_of_pixels_have_the_variance_of_the_gradient(
    monkeypatch: pytest.MonkeyPatch, removed: float
):
    """One light under two, by the definition: g = Φ̂ (Ψ − P̂) + s h ν, of paths that hit both."""
    monkeypatch.setattr(noise_rows, "MAX_HALVES_APART", np.inf)
    rng, batches, count = np.random.default_rng(0), 50, 20_000
    shape = (2, 2, batches, count)
    both = rng.gamma(0.2, 1 / 0.2, (2, 1, batches, count))
    halves = 0.5 + 0.3 * both + 0.2 * rng.exponential(1, shape)
    weights = np.array([1.0, 0.7])
    light, half = (halves[0] + halves[1]) / 2, (halves[0] - halves[1]) / 2
    predicted, mixed = (np.einsum("n,nbp->bp", weights, x) for x in (light, half))
    residual = 2.1 - predicted
    gradient = light[0] * residual + removed * half[0] * mixed
    own = UNCORRECTED * (1 - removed)
    push = half[0] * factor(residual, mixed, own) - factor(light[0], half[0], own) * mixed
    differences = np.square(gradient - gradient.mean()).mean(axis=1) - np.square(push).mean(axis=1)
    # Means of batches have a known scatter: four standard errors.
    assert abs(differences.mean()) < 4 * differences.std(ddof=1) / np.sqrt(batches)
    # A pixel's own values alone fail this test.
    push = half[0] * residual - light[0] * mixed
    differences = np.square(gradient - gradient.mean()).mean(axis=1) - np.square(push).mean(axis=1)
    assert abs(differences.mean()) > 4 * differences.std(ddof=1) / np.sqrt(batches)


def test_a_pixel_that_both_halves_have_met_keeps_its_own_value():
    values = np.array([1.0, 5.0, 1.0, 5.0, 2.0])
    halves = np.array([3.0, 5.0, 0.1, 0.1, 0.0])
    np.testing.assert_array_equal(values_beside(np.arange(5)), [1, 0, 3, 2, 3])
    # The first two are mostly noise; the others differ by more than their noise.
    np.testing.assert_allclose(factor(values, halves, 0.25), [4, 2, 1, 5, 2])
    np.testing.assert_array_equal(factor(values, halves, 1), values)
    np.testing.assert_array_equal(values_beside(np.arange(1)), [0])
    assert values_beside(np.arange(0)).size == 0


def test_a_light_in_doubt_widens_its_own_spread_alone():
    ones = np.ones((3, 3))
    usual, weak = (
        WeightSpread(k * ones, (0 * ones, k * ones), np.full(9, k), np.array(far))
        for k, far in ((1.0, [True, False, False]), (7.0, [False, True, False]))
    )
    spread = usual.mixed_with(weak, np.array([[0.0], [0.5], [1.0]]) * ones)
    for deviations in (spread.inside, spread.exits[1]):
        np.testing.assert_allclose(deviations[:, 0], [1, 5, 7])
    assert not spread.exits[0].any()
    np.testing.assert_array_equal(spread.excess, usual.excess)
    np.testing.assert_array_equal(spread.is_far, [True, True, False])
