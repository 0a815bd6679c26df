"""Noise of an estimate: closed forms and its file."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import uniform_filter

from lightpaint.arrays import in_all_channels, in_any_channel, mean_square
from lightpaint.errors import ImageError, SizeError
from lightpaint.images.estimate import Estimate, box_mean, read_estimate, write_estimate
from lightpaint.images.formats.exr import write_rgb


def test_of_halves():
    a, b = np.random.default_rng(0).random((2, 4, 5, 3))
    estimate = Estimate.of_halves(a, b)
    assert estimate.size == (4, 5)
    # One rounding in float64.
    np.testing.assert_allclose(estimate.image + estimate.half_difference, a, rtol=1e-15)
    np.testing.assert_allclose(estimate.image - estimate.half_difference, b, rtol=1e-15)


def test_shapes_must_agree():
    with pytest.raises(ImageError, match="differ in shape"):
        Estimate(np.zeros((2, 3, 3)), np.zeros((3, 2, 3)))


@pytest.mark.parametrize("radius", [0, 1, 2, 50])
def test_variance_of_a_constant_half_difference(radius: int):
    shape = (6, 9, 3)
    estimate = Estimate(np.ones(shape), np.full(shape, -0.5, np.float32))
    # Running sums in float64.
    np.testing.assert_allclose(estimate.variance(radius=radius), 0.25, rtol=1e-12)


def test_variance_without_pooling_is_the_square():
    half = np.random.default_rng(0).normal(size=(6, 9, 3)).astype(np.float32)
    variance = Estimate(np.zeros_like(half), half).variance(radius=0)
    # Differences of running sums, of order 10, in float64.
    np.testing.assert_allclose(variance, np.square(half, dtype=np.float64), atol=1e-13)


def test_variance_is_that_of_the_mean_of_the_halves():
    """Two halves of standard deviation σ have a mean of variance σ²/2."""
    sigma, shape = 0.3, (200, 200, 3)
    rng = np.random.default_rng(0)
    estimate = Estimate.of_halves(*(1 + sigma * rng.normal(size=(2, *shape))))
    count = np.prod(shape)
    # Noise: a mean of squares of n normals has the relative standard error √(2/n); four of them.
    tolerance = 4 * np.sqrt(2 / count)
    assert estimate.variance().mean() == pytest.approx(sigma**2 / 2, rel=tolerance)
    assert estimate.image.var() == pytest.approx(sigma**2 / 2, rel=tolerance)


@given(
    seed=st.integers(0, 1000),
    height=st.integers(1, 12),
    width=st.integers(1, 12),
    radius=st.integers(0, 8),
)
def test_box_mean_agrees_with_scipy(seed: int, height: int, width: int, radius: int):
    values = np.random.default_rng(seed).random((height, width, 2))
    size = (2 * radius + 1, 2 * radius + 1, 1)
    # A window that is cut off at the border: the mean of what is inside.
    counts = uniform_filter(np.ones_like(values), size, mode="constant")
    expected = uniform_filter(values, size, mode="constant") / counts
    # float64, and both sum up running.
    np.testing.assert_allclose(box_mean(values, radius), expected, rtol=1e-10)


def test_a_window_beyond_the_picture_is_the_whole_picture():
    rng = np.random.default_rng(0)
    half = rng.standard_normal((3, 4, 3)).astype(np.float32)
    estimate = Estimate(half, half)
    mean = np.square(half, dtype=np.float64).mean(axis=(0, 1))
    for radius in (4, 10**12):
        found = estimate.variance(radius=radius)
        np.testing.assert_allclose(found, np.broadcast_to(mean, (3, 4, 3)), rtol=1e-12)
    with pytest.raises(SizeError, match="radius is -1: expected a whole number of pixels >= 0"):
        estimate.variance(radius=-1)


@given(st.integers(0, 2**16), st.sampled_from([np.float16, np.float32, np.float64]))
def test_channels_are_reduced_as_numpy_reduces_them(seed: int, kind: type):
    image = np.random.default_rng(seed).normal(size=(5, 7, 3)).astype(kind)
    assert (mean_square(image) == np.square(image, dtype=np.float64).mean(axis=-1)).all()
    assert (in_any_channel(image > 0) == (image > 0).any(axis=-1)).all()
    assert (in_all_channels(image > 0) == (image > 0).all(axis=-1)).all()


def test_box_mean_of_an_impulse():
    values = np.zeros((7, 8))
    values[3, 0] = 1
    mean = box_mean(values, 1)
    expected = np.zeros((7, 8))
    # Two columns of the window are inside the picture at column 0, three at column 1.
    expected[2:5, 0], expected[2:5, 1] = 1 / 6, 1 / 9
    np.testing.assert_allclose(mean, expected, atol=1e-15)
    assert mean[3, 2:].max() == 0


def test_there_and_back(tmp_path: Path):
    rng = np.random.default_rng(0)
    image, half = rng.random((2, 5, 7, 3)).astype(np.float32)
    write_estimate(tmp_path / "a.exr", Estimate(image, half), {"lightpaint.seed": "7"})
    reread, _ = read_estimate(tmp_path / "a.exr")
    np.testing.assert_array_equal(reread.image, image)
    np.testing.assert_array_equal(reread.half_difference, half)
    assert reread.image.dtype == reread.half_difference.dtype == np.float32


def test_an_image_that_knows_nothing_of_its_noise(tmp_path: Path):
    write_rgb(tmp_path / "a.exr", np.ones((2, 2, 3)))
    with pytest.raises(ImageError, match=r"a\.exr has no half_difference layer"):
        read_estimate(tmp_path / "a.exr")
