"""Weights are fitted to the noise that the prediction shows: verification's z is standard normal.

Noise is of few paths in each pixel, gamma distributed, so that it is skew as in renders.
"""

from functools import cache

import numpy as np
import pytest
import scipy
from conftest import BasisFactory
from nightly import nightly

from lightpaint.images.estimate import Estimate
from lightpaint.lighting.analysis.noise.noise_correction import correct_noise
from lightpaint.lighting.answer.combination import combine
from lightpaint.lighting.default_solve import solve
from lightpaint.relit.verification import compare
from lightpaint.target.painted_target import Target

SIZE, SEEDS = (16, 24), 120

#: Paths of each half that a pixel's noise is like.
PATHS = 3.0

WEIGHTS = np.array([[0.8, 0.6, 0.4], [0.3, 0.4, 0.7], [1.5, 1.2, 0.9]])


def truth() -> np.ndarray:
    """Return what three lights do, (n, h, w, 3): pools on surfaces of several colours."""
    rng = np.random.default_rng(5)
    y, x = np.mgrid[: SIZE[0], : SIZE[1]] / SIZE[0]
    albedo = np.kron(rng.uniform(0.2, 0.8, (4, 6, 3)), np.ones((4, 4, 1)))
    places = rng.uniform(0, 1.5, (3, 2))
    return np.stack([np.exp(-2 * np.hypot(y - a, x - b))[..., None] * albedo for a, b in places])


def halves(mean: np.ndarray, rng: np.random.Generator) -> Estimate:
    """Return two noisy renders of a picture; one path carries all three channels."""
    noise = rng.gamma(PATHS, 1 / PATHS, (2, *mean.shape[:-1], 1))
    return Estimate.of_halves(*(mean * noise).astype(np.float32))


@cache
def judged(make_basis: BasisFactory, is_painted: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return z of the whole, (seeds,), and what fitting adds to the prediction, relative."""
    images = truth()
    target_image = np.einsum("ic,ihwc->hwc", WEIGHTS, images)
    if is_painted:  # as no lights can make it
        target_image = target_image * 2 ** np.sin(np.arange(SIZE[1]) / 3)[:, None]
    target = Target.of(target_image)
    z, weights, errors = [], [], []
    for seed in range(SEEDS):
        rng = np.random.default_rng(seed)
        noisy = halves(images, rng)
        basis = make_basis(images=noisy.image, half_differences=noisy.half_difference)
        solution = correct_noise(solve(basis, target))
        picture = np.einsum("ic,ihwc->hwc", solution.weights, images)
        verification = compare(combine(basis, solution.lighting), halves(picture, rng))
        z.append(verification.z_mean[1])
        weights.append(solution.weights)
        errors.append((noisy.image - images).sum(axis=(1, 2)))
    # With weights that know nothing of this noise the prediction has no bias: the paired
    # difference is what fitting adds.
    deviation = np.array(weights) - np.mean(weights, axis=0)
    light = np.einsum("ic,ihwc->", np.mean(weights, axis=0), images)
    return np.array(z), np.einsum("sic,sic->s", deviation, np.array(errors)) / light


@pytest.mark.nightly
@pytest.mark.parametrize("is_painted", [nightly(False), True])
def test_z_is_standard_normal_where_the_prediction_is_true(
    make_basis: BasisFactory, is_painted: bool
):
    z, _ = judged(make_basis, is_painted)
    # Four standard errors of a mean and of a standard deviation; noise of few paths has the latter
    # rather wider. Kolmogorov and Smirnov would be so far off once in a thousand times.
    assert abs(z.mean()) < 4 / np.sqrt(SEEDS)
    assert z.std() == pytest.approx(1, abs=4 / np.sqrt(2 * SEEDS))
    assert scipy.stats.kstest(z, "norm").pvalue > 1e-3


@pytest.mark.nightly
@pytest.mark.parametrize("is_painted", [nightly(False), True])
def test_fitting_darkens_the_prediction_by_less_than_a_thousandth(
    make_basis: BasisFactory, is_painted: bool
):
    _, added = judged(make_basis, is_painted)
    assert abs(added.mean()) < 1e-3 + 4 * added.std() / np.sqrt(SEEDS)


def test_a_prediction_that_is_off_is_no_standard_normal(make_basis: BasisFactory):
    """The test can see what it is for: renders are five percent brighter."""
    images, z = truth(), []
    for seed in range(30):
        rng = np.random.default_rng(seed)
        noisy = halves(images, rng)
        basis = make_basis(images=noisy.image, half_differences=noisy.half_difference)
        solution = solve(basis, Target.of(np.einsum("ic,ihwc->hwc", WEIGHTS, images)))
        picture = np.einsum("ic,ihwc->hwc", solution.weights, 1.05 * images)
        z.append(compare(combine(basis, solution.lighting), halves(picture, rng)).z_mean[1])
    assert np.mean(z) < -4 / np.sqrt(len(z))
