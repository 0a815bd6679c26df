"""Soft averages, masks that grow and connected parts, against SciPy's."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage

from lightpaint.images.neighbourhoods import dilated, gaussian_mean, grown, number_parts

sizes = st.tuples(st.integers(1, 24), st.integers(1, 24))


@st.composite
def masks(draw: st.DrawFn) -> np.ndarray:
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    return rng.random(draw(sizes)) < draw(st.sampled_from([0.0, 0.2, 0.4, 0.6, 1.0]))


@given(masks())
def test_parts_and_their_order_are_scipys(mask: np.ndarray) -> None:
    parts, count = number_parts(mask)
    expected, expected_count = ndimage.label(mask)
    assert count == expected_count
    assert np.array_equal(parts, expected)


def test_a_long_snake_is_one_part() -> None:
    mask = np.zeros((41, 40), bool)
    mask[::2] = True
    mask[1::4, -1] = mask[3::4, 0] = True
    parts, count = number_parts(mask)
    assert count == 1
    assert np.array_equal(parts == 1, mask)


@given(masks(), st.integers(0, 4))
def test_masks_grow_as_scipys(mask: np.ndarray, radius: int) -> None:
    expected = ndimage.binary_dilation(mask, iterations=radius) if radius else mask
    assert np.array_equal(dilated(mask, radius), expected)
    expected = ndimage.binary_dilation(mask, np.ones((3, 3)))
    assert np.array_equal(grown(mask), expected)
    both = grown(np.dstack([mask, ~mask]))
    assert np.array_equal(both[..., 0], expected)
    assert np.array_equal(both[..., 1], ndimage.binary_dilation(~mask, np.ones((3, 3))))


@pytest.mark.parametrize("kind", [np.float32, np.float64])
@given(size=sizes, radius=st.floats(0.3, 4))
def test_gaussian_means_are_scipys(size: tuple[int, int], radius: float, kind: type) -> None:
    values = np.random.default_rng(1).random((2, *size)).astype(kind)
    expected = ndimage.gaussian_filter(values, (0, radius, radius))
    found = gaussian_mean(values, radius)
    assert found.dtype == kind
    # Round-off: SciPy rounds to the type between both axes.
    assert found == pytest.approx(expected, rel=8 * float(np.finfo(kind).eps))
