"""Isolux pictures: levels, colours, and where cells are."""

import numpy as np
import pytest
from lit_planes import UP

from lightpaint.photometry.false_colour import (
    GROUND,
    MARGIN,
    TITLE_HEIGHT,
    colours_of,
    false_colours,
    isolux_levels,
)
from lightpaint.photometry.measuring_plane import MeasuringPlane


def ragged() -> MeasuringPlane:
    """Return a plane of two rows: two cells, and above the first of them one more."""
    cells = np.array([[0, 0], [0, 1], [1, 0]])
    points = np.zeros((3, 3))
    return MeasuringPlane("desk", points, np.tile(UP, (3, 1)), 1.0, 3.0, None, cells)


@pytest.mark.parametrize(
    ("most", "last", "step"), [(487, 500, 50), (1000, 1000, 100), (3, 3, 0.5), (0, 1, 1)]
)
def test_levels_are_round_numbers(most: float, last: float, step: float) -> None:
    levels = isolux_levels(most)
    assert levels[0] == 0
    assert levels[-1] == pytest.approx(last)
    assert levels[1] == pytest.approx(step)


def test_rows_go_upwards_and_missing_cells_stay_dark() -> None:
    picture = false_colours(ragged(), np.array([100.0, 300.0, 900.0]), "desk")
    inside = picture[TITLE_HEIGHT:, MARGIN:]
    side = 96
    corners = [inside[5, 5], inside[2 * side - 5, 5], inside[2 * side - 5, 2 * side - 5]]
    expected = [colours_of(np.array(lux / 900)) for lux in (900, 100, 300)]
    np.testing.assert_allclose(corners, expected, atol=1)
    np.testing.assert_array_equal(inside[5, 2 * side - 5], GROUND)


def test_brighter_is_lighter() -> None:
    shown = colours_of(np.linspace(0, 1, 50)) @ (0.2126, 0.7152, 0.0722)
    assert (np.diff(shown) > 0).all()


def test_a_dark_plane_has_a_picture() -> None:
    assert false_colours(ragged(), np.zeros(3), "desk").dtype == np.uint8
