"""Sums over blocks of pixels."""

import numpy as np
import pytest

from lightpaint.images.pixel_blocks import block_mean, block_sums, blocks_in, fitting_factor


@pytest.mark.parametrize("factor", [1, 2, 3, 5, 9])
@pytest.mark.parametrize("shape", [(7, 8), (6, 9, 3), (4, 5, 3)])
def test_sums_are_those_of_each_block_and_of_what_is_left_over(
    shape: tuple[int, ...], factor: int
) -> None:
    image = np.random.default_rng(0).random(shape).astype(np.float32)
    sums = block_sums(image, factor)
    for row, column in np.ndindex(sums.shape[:2]):
        rows, columns = (slice(factor * k, factor * (k + 1)) for k in (row, column))
        block = image[rows, columns].sum(axis=(0, 1), dtype=np.float64)
        np.testing.assert_allclose(
            sums[row, column], block, rtol=1e-14
        )  # float64, in another order
    np.testing.assert_allclose(sums.sum(), image.sum(dtype=np.float64), rtol=1e-13)


def test_means_are_sums_of_whole_blocks() -> None:
    image = np.random.default_rng(1).random((6, 9, 3))
    np.testing.assert_allclose(block_mean(image, 3), block_sums(image, 3) / 9, rtol=1e-14)


def test_blocks_fit_into_thin_pictures() -> None:
    cases = ((3, 3000), 19, 3), ((1, 1), 5, 1), ((9, 9), 2, 2), ((4, 4), 0, 1)
    for size, factor, fitting in cases:
        assert fitting_factor(size, factor) == fitting
        assert all(blocks_in(size, fitting))
