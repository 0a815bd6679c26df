"""Planes that are one picture in the colours of several lights."""

import numpy as np
import pytest

from lightpaint.basis.derived_planes import ScaledPlanes
from lightpaint.basis.planes import MemoryPlanes

PICTURE = np.random.default_rng(1).random((5, 7, 3), np.float32)
WEIGHTS = np.array([[2, 0, 1], [0.5, 0, 1], [0, 0, 3.0]])


def test_they_sum_to_the_picture_in_channels_where_a_light_is_on() -> None:
    planes = ScaledPlanes.summing_to(PICTURE, WEIGHTS)
    np.testing.assert_allclose(planes.mix(WEIGHTS), PICTURE * [1, 0, 1], rtol=1e-6)
    # All that are on do it alike.
    np.testing.assert_allclose(planes.plane(0)[..., 0] * 2, PICTURE[..., 0] / 2, rtol=1e-6)
    np.testing.assert_allclose(planes.plane(2)[..., 2] * 3, PICTURE[..., 2] / 3, rtol=1e-6)
    assert not planes.plane(2)[..., :2].any()


@pytest.mark.parametrize("where", [slice(3, 20), np.array([0, 7, 34])])
def test_they_are_what_an_array_of_them_is(where: slice | np.ndarray) -> None:
    planes = ScaledPlanes(PICTURE, WEIGHTS)
    plain = MemoryPlanes(planes.array())
    assert (planes.count, planes.size) == (plain.count, plain.size)
    np.testing.assert_array_equal(planes.pixels(where), plain.pixels(where))
    np.testing.assert_array_equal(planes.rows(1, 3), plain.rows(1, 3))
    for k in range(len(WEIGHTS)):
        np.testing.assert_array_equal(planes.plane(k), plain.plane(k))
    others = np.random.default_rng(2).random((2, *WEIGHTS.shape))
    np.testing.assert_allclose(planes.mixes(others), plain.mixes(others), rtol=1e-6)
    weight = np.ones((5, 7), np.float32)
    for mine, his in zip(planes.sums(weight, PICTURE), plain.sums(weight, PICTURE), strict=True):
        np.testing.assert_allclose(mine, his, rtol=1e-12)
