"""Polygons of colours: what is mixed of them stays in them."""

import numpy as np
import pytest

from lightpaint.colour.color import kelvin_to_rgb, luminance
from lightpaint.colour.color_ranges import (
    DIRECTIONS,
    ColorHull,
    chromaticity,
    reach_of,
    white_range,
)

WHITE = np.array([1.0, 0.95, 0.9])


def _hull(margin: float = 0.01) -> ColorHull:
    return ColorHull(reach_of(white_range(2200, 9000).colors) + margin, WHITE)


@pytest.mark.parametrize("seed", range(5))
def test_it_has_all_mixes_of_its_primaries_and_no_more(seed: int) -> None:
    hull, rng = _hull(), np.random.default_rng(seed)
    np.testing.assert_allclose(luminance(hull.primaries), 1)
    for _ in range(50):
        assert hull.has(rng.exponential(1, len(hull.primaries)) @ hull.primaries)
    for rgb in np.vstack([rng.random((200, 3)), white_range(2200, 9000).colors]):
        is_within = (chromaticity(rgb) @ DIRECTIONS.T <= hull.reach).all()
        assert hull.has(rgb) == is_within


@pytest.mark.parametrize("rgb", [(0, 1, 0), (1, 0, 1), (1, 0, 0), (0, 0, 1), (0.2, 3, 0.5)])
def test_what_is_beyond_comes_to_its_border(rgb: tuple[float, ...]) -> None:
    hull, light = _hull(), np.array(rgb, float)
    assert not hull.has(light)
    near = hull.nearest(light)
    assert hull.has(near)
    assert luminance(near) == pytest.approx(luminance(light))
    # On the way from its own colour, and at the end of it: a little more is beyond.
    assert not hull.has(near + 1e-3 * light)


def test_black_and_its_own_colour_are_as_they_are() -> None:
    hull = _hull()
    assert hull.has(np.zeros(3))
    assert hull.side_towards(np.zeros(3)) == 0
    for rgb in (np.zeros(3), WHITE, 3 * kelvin_to_rgb(2700)):
        np.testing.assert_array_equal(hull.nearest(rgb), rgb)


@pytest.mark.parametrize("seed", range(5))
def test_every_colour_is_a_mix_of_one_fan_or_beyond_its_side(seed: int) -> None:
    """The middle and both ends of a side mix it; what is beyond takes less than 0 of the middle."""
    hull, rng = _hull(), np.random.default_rng(seed)
    for _ in range(100):
        rgb = rng.exponential(1, 3)
        mixed = np.linalg.solve(hull.fan(hull.side_towards(rgb)).T, rgb)
        assert (mixed[1:] >= -1e-9).all()
        assert hull.has(rgb) == (mixed[0] >= -1e-9)


def test_fans_share_their_ends() -> None:
    hull = _hull()
    for side in range(-1, len(hull.primaries)):
        np.testing.assert_array_equal(hull.fan(side)[2], hull.fan(side + 1)[1])
        np.testing.assert_array_equal(hull.fan(side)[0], hull.primaries.mean(axis=0))
