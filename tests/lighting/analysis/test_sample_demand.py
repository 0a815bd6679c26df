"""Where samples are worth most: closed forms of the allocation, and what it never looks at."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lightpaint.lighting.analysis.noise.sample_demand import (
    AROUND,
    FLOOR,
    pixel_variances,
    sample_demand,
    top_up_counts,
)
from lightpaint.lighting.analysis.noise.uncertainty import error_bars
from lightpaint.lighting.default_solve import solve
from lightpaint.target.painted_target import Target

SIZE = (20, 24)


def test_pixels_add_up_to_the_scatter_of_the_weights(make_basis: Any):
    """Var(wᵢ) is a sum over pixels, that of error bars, for so little noise to the same digits."""
    rng = np.random.default_rng(0)
    images = 1 + rng.random((4, *SIZE, 3))
    basis = make_basis(images=images, half_differences=rng.normal(0, 1e-6, images.shape))
    painted = np.einsum("n,nhwc->hwc", [1, 0.5, 2, 1], images) + rng.normal(0, 0.2, (*SIZE, 3))
    importance = rng.random(SIZE).astype(np.float32) * (rng.random(SIZE) < 0.7)
    target = Target("t", painted.astype(np.float32), importance, everything=False)
    solution = solve(basis, target)
    assert (solution.weights > 0).all()
    scatter = error_bars(solution).scatter
    for light, channel in ((0, 0), (2, 1), (3, 2)):
        aim = np.zeros((1, 3, 4))
        aim[0, channel, light] = 1
        variances = pixel_variances(solution, aim.reshape(1, -1))
        assert np.sqrt(variances.sum()) == pytest.approx(scatter[light, channel], rel=1e-5)
        assert not variances[importance == 0].any()


@given(st.integers(0, 2**32 - 1))
def test_own_noise_never_decides(seed: int):
    """The samples of a pixel do not depend on what its own samples showed, but for the floor."""
    rng = np.random.default_rng(seed)
    variances, counts = rng.exponential(1, SIZE), rng.integers(1, 9, SIZE).astype(float)
    is_counted = rng.random(SIZE) < 0.8
    before = sample_demand(variances, is_counted, counts)
    y, x = rng.integers(0, SIZE[0]), rng.integers(0, SIZE[1])
    variances[y, x] *= 100
    after = sample_demand(variances, is_counted, counts)
    assert after.variance[y, x] == before.variance[y, x]
    assert not after.density[~is_counted].any()
    far = np.ones(SIZE, bool)
    far[max(y - AROUND, 0) : y + AROUND + 1, max(x - AROUND, 0) : x + AROUND + 1] = False
    np.testing.assert_array_equal(after.variance[far], before.variance[far])


def test_density_is_the_root_of_the_variance_of_one_sample():
    """Neighbours with unlike numbers of samples but one noise want the same."""
    counts = np.random.default_rng(0).integers(1, 9, SIZE).astype(float)
    sample_counts = sample_demand(4 / counts, np.ones(SIZE, bool), counts)
    np.testing.assert_allclose(sample_counts.density, 2, rtol=1e-12)
    np.testing.assert_allclose(sample_counts.variance, 4 / counts, rtol=1e-12)


def test_quiet_pixels_have_the_floor():
    variances = np.zeros(SIZE)
    variances[:, :4] = 1
    demand = sample_demand(variances, np.ones(SIZE, bool), np.ones(SIZE))
    quiet, loud = demand.density[:, 8:], demand.density[:, :4]
    # Roots of 0 and 1: their mean over the neighbours is that of the squares.
    mean = demand.variance.mean()
    np.testing.assert_allclose(quiet, FLOOR * mean)
    np.testing.assert_allclose(loud, demand.variance[:, :4])


def test_one_firefly_attracts_few_samples():
    """Half differences of heavy-tailed noise: variance by allocation against the best there is."""
    rng = np.random.default_rng(0)
    sigma = np.where(np.arange(SIZE[1]) < 6, 4.0, 1.0) * np.ones(SIZE)
    best = np.square(sigma.sum())
    spent_samples = []
    for _ in range(50):
        variance = np.square(sigma) * rng.standard_t(3, SIZE) ** 2 / 3
        density = sample_demand(variance, np.ones(SIZE, bool), np.ones(SIZE)).density
        spent_samples.append((np.square(sigma) / density).sum() * density.sum() / best)
    # With roots of the mean of squares it is 1.16.
    assert np.mean(spent_samples) < 1.13


@given(st.integers(0, 2**32 - 1), st.floats(0.1, 4))
def test_counts_spend_the_budget_where_variance_falls_most(seed: int, size: float):
    """After a top-up no exchange of a sample between two pixels has less variance, to rounding."""
    rng = np.random.default_rng(seed)
    variance, counts_before = rng.exponential(1, SIZE) ** 2, rng.integers(8, 20, SIZE).astype(float)
    budget = size * counts_before.sum()
    counts = top_up_counts(np.sqrt(variance), counts_before, budget)
    assert (counts >= 0).all()
    assert counts.sum() == pytest.approx(budget, abs=counts_before.size / 2)
    total = counts_before + counts
    gain, loss = variance / (total * (total + 1)), variance / (total * np.maximum(total - 1, 1))
    is_sampled = counts > 0
    if is_sampled.any():
        # One more where it helps most does not beat one less where it hurts least, but for halves.
        assert gain.max() <= loss[is_sampled].min() * (1 + 3 / total.min())


def test_nothing_wanted_is_nothing_added():
    assert not top_up_counts(np.zeros(SIZE), np.ones(SIZE), 100).any()
