"""Luminance and CIEDE2000 against published numbers."""

from typing import Any

import numpy as np
import pytest

from lightpaint.images.color import delta_e, luminance

# Linear Rec.709 from the chromaticities of ITU-R BT.709: columns are the primaries' XYZ.
_XY = np.array([[0.640, 0.330], [0.300, 0.600], [0.150, 0.060]])
_PRIMARIES = np.column_stack([[x / y, 1, (1 - x - y) / y] for x, y in _XY])
_WHITE = np.array([0.3127 / 0.3290, 1, (1 - 0.3127 - 0.3290) / 0.3290])
RGB_TO_XYZ = _PRIMARIES * np.linalg.solve(_PRIMARIES, _WHITE)


def _rgb_of_lab(lab: Any) -> Any:
    """CIE 15: Lab under D65 to XYZ, then to linear Rec.709."""
    lightness, a, b = lab
    f = (lightness + 16) / 116 + np.array([a / 500, 0, -b / 200])
    xyz = np.where(f > 6 / 29, f**3, 3 * (6 / 29) ** 2 * (f - 4 / 29)) * _WHITE
    return np.linalg.solve(RGB_TO_XYZ, xyz)


@pytest.mark.parametrize(
    ("first", "second", "expected"),
    [
        # Sharma, Wu, Dalal 2005, Table 1: the pairs that lie within Rec.709.
        ((50, 2.5, 0), (73, 25, -18), 27.1492),
        ((50, 2.5, 0), (61, -5, 29), 22.8977),
        ((50, 2.5, 0), (56, -27, -3), 31.9030),
        ((50, 2.5, 0), (58, 24, 15), 19.4535),
        ((50, 2.5, 0), (50, 3.1736, 0.5854), 1.0000),
        ((50, 2.5, 0), (50, 3.2972, 0.0000), 1.0000),
        ((50, 2.5, 0), (50, 1.8634, 0.5757), 1.0000),
        ((50, 2.5, 0), (50, 3.2592, 0.3350), 1.0000),
    ],
)
def test_ciede2000_against_published_pairs(first: Any, second: Any, expected: float):
    a, b = _rgb_of_lab(first), _rgb_of_lab(second)
    assert a.min() >= 0
    assert b.min() >= 0
    assert max(a.max(), b.max()) <= 1
    # Published to four digits; the library rounds the Rec.709 matrix to four as well, which
    # a neutral colour feels most.
    assert delta_e(a, b) == pytest.approx(expected, abs=2e-3)
    assert delta_e(b, a) == pytest.approx(expected, abs=2e-3)


def test_equal_images_do_not_differ():
    image = np.random.default_rng(0).random((4, 5, 3)) * 2 - 0.5
    difference = delta_e(image, image.copy())
    assert difference.shape == (4, 5)
    np.testing.assert_array_equal(difference, 0)


def test_what_a_display_cannot_show_does_not_differ():
    a, b = np.array([[[1.0, 0.0, 0.5]]]), np.array([[[9.0, -3.0, 0.5]]])
    np.testing.assert_array_equal(delta_e(a, b), 0)


def test_black_against_white_is_a_hundred():
    # ΔL* is 100; S_L at the mean lightness of 50 is 1.
    assert delta_e(np.zeros(3), np.ones(3)) == pytest.approx(100, abs=1e-3)


def test_luminance():
    assert luminance(np.ones(3)) == pytest.approx(1, abs=1e-15)
    assert luminance(np.zeros((2, 4, 3))).shape == (2, 4)
    # The second row of the matrix above, which BT.709 rounds to four digits.
    np.testing.assert_allclose(luminance(np.eye(3)), RGB_TO_XYZ[1], atol=5e-5)
