"""Prediction against verification: noise alone agrees, anything else does not."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from nightly import nightly

from lightpaint.colour.color import delta_e
from lightpaint.errors import SizeError
from lightpaint.images.estimate import Estimate
from lightpaint.relit.verification import LIMIT, compare

SIZE = (48, 40)
SEEDS = range(100)
SIGMA = 0.2

Noise = Callable[[np.random.Generator, Any], Any]


def _gaussian(rng: np.random.Generator, shape: Any) -> Any:
    return rng.normal(scale=SIGMA, size=shape)


def _same_in_all_channels(rng: np.random.Generator, shape: Any) -> Any:
    """White light on grey walls: three channels, one truth."""
    return np.broadcast_to(rng.normal(scale=SIGMA, size=shape[:2])[..., None], shape)


def _uneven(rng: np.random.Generator, shape: Any) -> Any:
    """A thousandfold more noise at one side of the picture than at the other."""
    return rng.normal(size=shape) * np.geomspace(1e-3, 1, shape[1])[:, None]


def _heavy_tailed(rng: np.random.Generator, shape: Any) -> Any:
    """Log-normal: nearly all of the squared noise in a hundredth of the pixels."""
    return SIGMA * (rng.lognormal(0, 2, size=shape) - np.exp(2))


def _fireflies(rng: np.random.Generator, shape: Any) -> Any:
    hit = rng.random((*shape[:2], 1)) < 0.003
    bright = np.where(hit, 100 * rng.random((*shape[:2], 1)), 0)
    return bright + rng.normal(scale=0.05, size=shape)


def _truth(size: tuple[int, int] = SIZE) -> Any:
    return 0.2 + np.random.default_rng(0).random((*size, 3))


def _estimate(truth: Any, noise: Noise, rng: np.random.Generator) -> Estimate:
    """Two halves with independent noise."""
    a, b = ((truth + noise(rng, truth.shape)).astype(np.float32) for _ in range(2))
    return Estimate.of_halves(a, b)


def _pair(seed: int, noise: Noise, *, bias: Any = 0.0, size: Any = SIZE) -> Any:
    rng = np.random.default_rng(seed)
    truth = _truth(size)
    return _estimate(truth, noise, rng), _estimate(truth + bias, noise, rng)


@pytest.mark.parametrize(
    "noise", [_gaussian, *map(nightly, [_same_in_all_channels, _uneven, _heavy_tailed]), _fireflies]
)
def test_noise_alone_agrees(noise: Noise):
    # Five standard errors: less than one false alarm in ten thousand of these pictures.
    assert all(compare(*_pair(seed, noise)).agrees for seed in SEEDS)


def test_pattern_of_noise_is_zero_on_average_however_skew():
    z_values = np.array([compare(*_pair(seed, _fireflies)).z_pattern for seed in SEEDS])
    assert abs(z_values.mean()) <= 4 * z_values.std() / np.sqrt(len(SEEDS))
    # The standard error it is measured in is an upper bound.
    assert z_values.std() < 1.2


def test_z_is_one_for_noise_alone():
    verifications = [compare(*_pair(seed, _gaussian)) for seed in SEEDS]
    # 30 blocks, 3 channels: a mean of that many z² is 1 ± √(2/90), and 64 degrees of freedom
    # add 2/62; four standard errors of the mean over all seeds.
    z2 = np.mean([v.z_rms**2 for v in verifications])
    assert z2 == pytest.approx(1 + 2 / 62, abs=4 * np.sqrt(2 / 90 / len(SEEDS)))
    z_mean = np.array([v.z_mean for v in verifications])
    assert np.square(z_mean).mean() == pytest.approx(1, abs=4 * np.sqrt(2 / z_mean.size))
    z = np.concatenate([v.z.ravel() for v in verifications])
    # The noise is pooled over at most 25 pixels and both pictures, so that z is Student's t
    # with up to 50 degrees of freedom, 9 + 9 at corners: of variance 1.04 to 1.13.
    assert 1.0 < np.square(z).mean() < 1.13
    assert np.mean([v.rmse / v.noise_rmse for v in verifications]) == pytest.approx(1, abs=0.01)


@pytest.mark.parametrize("noise", [_gaussian, nightly(_same_in_all_channels)])
def test_a_bias_of_three_standard_errors_of_a_block_is_seen(noise: Noise):
    # The difference has the standard deviation SIGMA; its mean over 64 pixels an eighth of it.
    # The sign alternates, so that the picture's mean tells nothing.
    blocks = np.indices((SIZE[0] // 8, SIZE[1] // 8)).sum(axis=0) % 2 * 2 - 1
    bias = np.kron(blocks, np.ones((8, 8)))[..., None] * 3 * SIGMA / 8
    for seed in SEEDS:
        verification = compare(*_pair(seed, noise, bias=bias))
        assert not verification.agrees
        assert verification.z_pattern > LIMIT


def test_one_percent_of_the_whole_picture_is_seen_where_no_block_shows_it():
    size = (96, 128)

    def noise(rng: np.random.Generator, shape: Any) -> Any:
        return rng.normal(scale=0.1, size=shape)

    for seed in range(20):
        verification = compare(*_pair(seed, noise, bias=0.01 * _truth(size), size=size))
        assert verification.z_pattern <= LIMIT
        # The verified picture is the brighter one: the difference is negative.
        assert min(verification.z_mean) < -LIMIT
        assert not verification.agrees


@pytest.mark.parametrize("size", [SIZE, (8, 8), (5, 7), (1, 1), (17, 9)])
def test_without_noise_equal_pictures_agree(size: tuple[int, int]):
    image = _truth(size).astype(np.float32)
    silent = Estimate(image, np.zeros_like(image))
    verification = compare(silent, silent)
    assert verification.agrees
    assert (
        verification.z_rms
        == verification.rmse
        == verification.delta_e_mean
        == verification.delta_e_95
        == 0
    )
    assert verification.z_mean == (0, 0, 0)
    np.testing.assert_array_equal(verification.z, 0)
    # Round-off of float32 is no difference, and one percent is.
    assert compare(silent, replace(silent, image=image * np.float32(1 + 1e-6))).agrees
    assert not compare(silent, replace(silent, image=image * np.float32(1.01))).agrees


@pytest.mark.parametrize("place", [(0, 0), (16, 8), (16, 0), (3, 8)])
def test_every_pixel_is_looked_at(place: tuple[int, int]):
    """Also those of the ragged border, which belong to no whole block."""
    image = np.ones((17, 9, 3), np.float32)
    half = np.full_like(image, 0.01)
    other = image.copy()
    other[place] += 10
    assert compare(Estimate(image, half), Estimate(image, half)).agrees
    assert not compare(Estimate(image, half), Estimate(other, half)).agrees


def test_black_agrees_with_black_and_with_nothing_else():
    black = np.zeros((*SIZE, 3), np.float32)
    dark = Estimate(black, black)
    verification = compare(dark, dark)
    assert verification.agrees
    assert np.isfinite(verification.z).all()
    assert verification.z_rms == verification.rmse == verification.delta_e_mean == 0
    assert not compare(dark, Estimate(black + np.float32(1e-3), black)).agrees
    # A picture of which most is black, the rest noisy.
    predicted, verified = _pair(0, _gaussian)
    for estimate in (predicted, verified):
        estimate.image[:30] = estimate.half_difference[:30] = 0
    assert compare(predicted, verified).agrees


def test_the_rms_is_of_blocks_that_have_noise():
    """A screen in view has none, and an error there is one whatever the noise elsewhere."""
    predicted, verified = _pair(2, _gaussian)
    columns = 8 * (SIZE[1] // 16)
    expected = compare(
        *(
            Estimate(x.image[:, columns:], x.half_difference[:, columns:])
            for x in (predicted, verified)
        )
    ).z_rms
    screen = predicted.image[:, :columns].copy()
    for estimate in (predicted, verified):
        estimate.image[:, :columns], estimate.half_difference[:, :columns] = screen, 0
    assert compare(predicted, verified).z_rms == pytest.approx(expected, rel=1e-6)
    verified.image[:, :columns] *= np.float32(1.001)
    assert compare(predicted, verified).z_rms > 10 * expected


def test_closed_forms():
    shape = (*SIZE, 3)
    predicted = Estimate(np.full(shape, 0.7, np.float32), np.full(shape, 0.03, np.float32))
    verified = Estimate(np.full(shape, 0.675, np.float32), np.full(shape, -0.04, np.float32))
    verification = compare(predicted, verified)
    # 3, 4, 5: a difference of 0.025 with a standard deviation of 0.05. Precision: float32 of
    # a difference, and the 1e-5 of round-off that counts as noise.
    assert verification.rmse == pytest.approx(0.025, rel=1e-5)
    assert verification.noise_rmse == pytest.approx(0.05, rel=1e-5)
    np.testing.assert_allclose(verification.z, 0.5, rtol=1e-5)
    assert verification.z_rms == pytest.approx(0.5 * 8, rel=1e-5)
    assert verification.z_mean == pytest.approx([0.5 * np.sqrt(SIZE[0] * SIZE[1])] * 3, rel=1e-5)
    assert verification.verified is verified
    far = Estimate(verified.image - 1, verified.half_difference)
    assert not compare(predicted, far).agrees


@pytest.mark.parametrize("scale", [2.0**-20, 2.0**20])
def test_the_unit_of_radiance_is_of_no_importance(scale: float):
    predicted, verified = _pair(0, _gaussian)
    plain = compare(predicted, verified)

    def scaled(e: Estimate) -> Estimate:
        factor = np.float32(scale)
        return Estimate(e.image * factor, e.half_difference * factor)

    verification = compare(scaled(predicted), scaled(verified))
    # Powers of two scale exactly; float64 sums.
    assert verification.z_rms == pytest.approx(plain.z_rms, rel=1e-9)
    assert verification.z_mean == pytest.approx(plain.z_mean, rel=1e-9)
    assert verification.rmse == pytest.approx(plain.rmse * scale, rel=1e-9)


def test_both_ways_the_same():
    predicted, verified = _pair(1, _gaussian, bias=0.05)
    forward, backward = compare(predicted, verified), compare(verified, predicted)
    # Sums of the same numbers in another order.
    assert forward.z_rms == pytest.approx(backward.z_rms, rel=1e-12)
    assert forward.z_mean == pytest.approx([-z for z in backward.z_mean], rel=1e-12)
    assert forward.agrees == backward.agrees


@pytest.mark.parametrize(("brightness", "exposure"), [(1.0, 1.0), (2.0**-10, 2.0**8.5)])
def test_colour_difference_is_taken_as_it_is_shown(brightness: float, exposure: float):
    """A picture too dark to show anything is compared near middle grey: at 0.36."""
    image = np.full((8, 8, 3), 1.0, np.float32) * np.float32(brightness)
    other = image * np.array([0.9, 1, 1], np.float32)
    other[:2] = image[:2]
    zero = np.zeros_like(image)
    verification = compare(Estimate(other, zero), Estimate(image, zero))
    differences = delta_e(other * exposure, image * exposure)
    # The very same float64 numbers, averaged.
    assert verification.delta_e_mean == pytest.approx(differences.mean(), rel=1e-12)
    assert verification.delta_e_95 == pytest.approx(differences.max(), rel=1e-12)
    assert differences.max() > 1


def test_a_larger_verification_is_judged_by_its_block_means():
    rng = np.random.default_rng(3)
    small = _truth((24, 20))
    large = np.kron(small, np.ones((4, 4, 1))) * rng.uniform(0.5, 1.5, (96, 80, 1))
    large *= np.kron(small / Estimate(large, large).reduced(4).image, np.ones((4, 4, 1)))
    predicted = _estimate(small, _gaussian, rng)
    verified = _estimate(large, _gaussian, rng)
    judged = compare(predicted, verified)
    assert judged.agrees
    assert judged.verified is verified
    assert judged.z.shape == (24, 20, 3)
    reduced = compare(predicted, verified.reduced(4))
    assert (judged.difference, judged.rmse) == (reduced.difference, reduced.rmse)
    assert not compare(predicted, _estimate(1.2 * large, _gaussian, rng)).agrees
    with pytest.raises(SizeError, match="cannot be compared"):
        compare(predicted, _estimate(_truth((48, 60)), _gaussian, rng))
