"""Isolux pictures: levels, colours, and where cells are."""

import numpy as np
import pytest
from lit_planes import UP

from lightpaint.photometry.illuminance import MeasuringPlane
from lightpaint.photometry.readings_file import (
    GROUND,
    LARGEST_CELL,
    LONGEST,
    MARGIN,
    NUMBER_GAP,
    TITLE_HEIGHT,
    colours_of,
    false_colours,
    isolux_levels,
    lengths_text,
    number_texts,
    numbered_cells,
)


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


@pytest.mark.parametrize("shape", [(1, 1), (3, 2), (2, 3), (8, 8), (14, 40), (60, 80), (1, 700)])
def test_numbers_neither_overlap_nor_leave_the_picture(shape: tuple[int, int]) -> None:
    side, size = max(1, min(LARGEST_CELL, LONGEST // max(shape))), (30.0, 12.0)
    for cells, count, length in zip(
        numbered_cells(shape, side, size), shape, size[::-1], strict=True
    ):
        centres = (np.arange(count)[cells] + 0.5) * side
        assert (np.diff(centres) >= length + NUMBER_GAP).all()
        assert (centres >= length / 2).all()
        assert (centres <= count * side - length / 2).all()


def test_each_cell_of_a_small_plane_has_its_number() -> None:
    picture = false_colours(ragged(), np.array([100.0, 100.0, 100.0]), "desk")
    cells = picture[TITLE_HEIGHT:, MARGIN:][:192, :192].reshape(2, 96, 2, 96, 3)
    inner = cells[:, 24:72, :, 24:72].astype(float).mean(axis=-1)
    spread = inner.max(axis=(1, 3)) - inner.min(axis=(1, 3))
    # Rows go upwards; under even light nothing but numbers differs.
    np.testing.assert_array_equal(spread > 60, [[True, False], [True, True]])
    assert spread[0, 1] == 0


def test_numbers_have_three_digits_or_no_decimals() -> None:
    assert number_texts(np.array([1234.5, 3.2])) == ["1234", "3"]
    assert number_texts(np.array([45.67])) == ["45.7"]
    assert number_texts(np.array([1.234, 0.5])) == ["1.23", "0.50"]


def test_lengths_are_those_of_the_grid() -> None:
    cells = np.array([(row, column) for row in range(2) for column in range(3)])
    points = np.stack([0.5 * cells[:, 1], np.full(6, 0.8), 0.4 * cells[:, 0]], axis=1)
    normals = np.tile(UP, (6, 1))
    plane = MeasuringPlane("desk", points, normals, 0.5, 0.2, (2, 3), cells)
    assert lengths_text(plane) == ", 1.5 m x 0.8 m"
    # Two surfaces beside each other have a column without points between them.
    apart = cells + np.outer(cells[:, 1] == 2, [0, 1])
    assert lengths_text(MeasuringPlane("desks", points, normals, 0.5, 0.2, None, apart)) == ""
    row = MeasuringPlane("row", points[:3], normals[:3], 0.5, 0.2, (1, 3), cells[:3])
    assert lengths_text(row) == ""
    listed = MeasuringPlane("listed", points, normals, 0.0, 0.0, None, cells)
    assert lengths_text(listed) == ""
