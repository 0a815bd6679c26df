"""Luminance and colour temperature against published numbers."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lightpaint.colour.color import (
    cct_and_duv,
    hex_to_rgb,
    kelvin_to_rgb,
    luminance,
    rgb_to_hex,
)
from lightpaint.colour.primaries import adaptation, colour_science
from lightpaint.errors import ColorError

# Linear Rec.709 from the chromaticities of ITU-R BT.709: columns are the primaries' XYZ.
_XY = np.array([[0.640, 0.330], [0.300, 0.600], [0.150, 0.060]])
_PRIMARIES = np.column_stack([[x / y, 1, (1 - x - y) / y] for x, y in _XY])
_WHITE = np.array([0.3127 / 0.3290, 1, (1 - 0.3127 - 0.3290) / 0.3290])
RGB_TO_XYZ = _PRIMARIES * np.linalg.solve(_PRIMARIES, _WHITE)


def test_luminance():
    assert luminance(np.ones(3)) == pytest.approx(1, abs=1e-15)
    assert luminance(np.zeros((2, 4, 3))).shape == (2, 4)
    # The second row of the matrix above, which BT.709 rounds to four digits.
    np.testing.assert_allclose(luminance(np.eye(3)), RGB_TO_XYZ[1], atol=5e-5)


#: Reciprocal megakelvin, in which equal steps look equal, for all that Rec.709 contains.
MIREDS = st.floats(10, 1e6 / 1902)


def _of_chromaticity(x: float, y: float) -> Any:
    return np.linalg.solve(RGB_TO_XYZ, np.array([x / y, 1, (1 - x - y) / y]))


def _chromaticity(rgb: Any) -> Any:
    xyz = RGB_TO_XYZ @ rgb
    return xyz[:2] / xyz.sum()


def _uv(rgb: Any) -> Any:
    """CIE 1960: u = 4x/(−2x + 12y + 3), v = 6y/(−2x + 12y + 3)."""
    x, y = _chromaticity(rgb)
    return np.array([4 * x, 6 * y]) / (-2 * x + 12 * y + 3)


@pytest.mark.parametrize(
    ("x", "y", "kelvin", "duv"),
    [
        # CIE 15:2018: chromaticities of the illuminants A, D50, D65 and E, 2° observer.
        (0.44758, 0.40745, 2856, 0.0),
        (0.34567, 0.35851, 5003, 0.0032),
        (0.31272, 0.32903, 6504, 0.0032),
        (1 / 3, 1 / 3, 5455, -0.0044),
    ],
)
def test_temperature_of_standard_illuminants(x: float, y: float, kelvin: float, duv: float):
    white = cct_and_duv(_of_chromaticity(x, y))
    assert white is not None
    # The daylight phases are tabulated from factors rounded to three digits.
    assert white[0] == pytest.approx(kelvin, abs=1.5)
    assert white[1] == pytest.approx(duv, abs=5e-5)


@pytest.mark.parametrize(
    ("x", "y", "kelvin"),
    [
        # CIE 15:2018, tables of the illuminants D55, D75, C and FL1, FL2, FL11.
        (0.33243, 0.34744, 5503),
        (0.29903, 0.31488, 7504),
        (0.31006, 0.31616, 6774),
        (0.3131, 0.3371, 6430),
        (0.3721, 0.3751, 4230),
        (0.3805, 0.3769, 4000),
    ],
)
def test_correlated_temperature_of_illuminants(x: float, y: float, kelvin: float):
    white = cct_and_duv(_of_chromaticity(x, y))
    assert white is not None
    assert white[0] == pytest.approx(kelvin, rel=2e-3)  # lamps' are rounded to tens of kelvin


@pytest.mark.parametrize(
    ("kelvin", "x", "y"),
    [
        # Wyszecki and Stiles 1982, table 1(3.11).
        (2000, 0.5267, 0.4133),
        (3000, 0.4369, 0.4041),
        (4000, 0.3805, 0.3768),
        (5000, 0.3451, 0.3516),
        (6500, 0.3135, 0.3236),
        (10000, 0.2806, 0.2883),
    ],
)
def test_black_bodies(kelvin: float, x: float, y: float):
    np.testing.assert_allclose(_chromaticity(kelvin_to_rgb(kelvin)), (x, y), atol=1e-4)


@given(st.floats(100, 330), st.floats(-0.01, 0.01))  # all within Rec.709
def test_duv_is_a_distance_at_a_right_angle(mireds: float, duv: float):
    on, shifted = _uv(kelvin_to_rgb(1e6 / mireds)), _uv(kelvin_to_rgb(1e6 / mireds, duv))
    assert np.hypot(*(shifted - on)) == pytest.approx(abs(duv), abs=1e-12)
    along = _uv(kelvin_to_rgb(1e6 / (mireds + 1))) - _uv(kelvin_to_rgb(1e6 / (mireds - 1)))
    # A chord of two mireds differs from the tangent by less than 1e-4; u and v are float64.
    assert abs((shifted - on) @ along) / np.hypot(*along) <= 1e-4 * abs(duv) + 1e-15


def test_white_is_d65():
    white = cct_and_duv(np.ones(3))
    assert white is not None
    assert white[0] == pytest.approx(6504, abs=1)
    np.testing.assert_allclose(kelvin_to_rgb(*white), 1, atol=1e-9)


@given(MIREDS)
def test_temperature_and_back(mireds: float):
    rgb = kelvin_to_rgb(1e6 / mireds)
    assert rgb.min() >= 0
    assert luminance(rgb) == pytest.approx(1, abs=1e-12)
    white = cct_and_duv(rgb * 17)
    assert white is not None
    assert 1e6 / white[0] == pytest.approx(mireds, rel=1e-9)  # float64
    assert white[1] == pytest.approx(0, abs=1e-12)


@given(st.floats(100, 330), st.floats(-0.01, 0.01))  # all within Rec.709
def test_temperature_off_the_locus_and_back(mireds: float, duv: float):
    white = cct_and_duv(kelvin_to_rgb(1e6 / mireds, duv))
    assert white is not None
    assert 1e6 / white[0] == pytest.approx(mireds, rel=1e-9)
    assert white[1] == pytest.approx(duv, abs=1e-12)


def test_duv_is_positive_towards_green():
    green, pink = kelvin_to_rgb(4000, 0.02), kelvin_to_rgb(4000, -0.02)
    assert green[1] > kelvin_to_rgb(4000)[1] > pink[1]


@pytest.mark.parametrize("kelvin", [1000, 1500, 1800])
def test_candles_are_redder_than_rec709(kelvin: float):
    rgb = kelvin_to_rgb(kelvin)
    assert rgb[2] == 0
    assert luminance(rgb) == pytest.approx(1, abs=1e-12)
    # What was cut off shows, and little.
    white = cct_and_duv(rgb)
    assert white is not None
    assert kelvin < white[0] < 1.03 * kelvin


@pytest.mark.parametrize(
    "rgb", [(0, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 0, 0), (0.1, 1, 0.2)]
)
def test_far_from_the_locus_there_is_no_temperature(rgb: Any):
    assert cct_and_duv(np.array(rgb, float)) is None


@pytest.mark.parametrize(
    ("kelvin", "duv"), [(999, 0), (100_001, 0), (-1, 0), (np.nan, 0), (3000, 0.06), (3000, np.nan)]
)
def test_temperatures_that_there_are_none_of(kelvin: float, duv: float):
    with pytest.raises(ColorError, match="expected"):
        kelvin_to_rgb(kelvin, duv)


@given(st.integers(0, 0xFFFFFF))
def test_hexadecimal_and_back(number: int):
    rgb = hex_to_rgb(f"#{number:06x}")
    assert 0 <= rgb.min() <= rgb.max() <= 1
    brightest = max(number >> 16, number >> 8 & 255, number & 255)
    if brightest == 255:
        assert rgb_to_hex(rgb * 3.7) == f"#{number:06x}"


def test_hexadecimal_of_known_colours():
    np.testing.assert_allclose(hex_to_rgb("#ffffff"), 1, atol=1e-15)
    # IEC 61966-2-1: ((128/255 + 0.055) / 1.055) ** 2.4.
    np.testing.assert_allclose(hex_to_rgb(" 800000"), [0.2158605, 0, 0], atol=1e-7)
    np.testing.assert_array_equal(hex_to_rgb("#FA6"), hex_to_rgb("#ffaa66"))
    assert rgb_to_hex(np.array([40.0, 40, 0])) == "#ffff00"
    assert rgb_to_hex(np.zeros(3)) == "#000000"
    assert rgb_to_hex(np.array([1, -0.1, 0])) == "#ff0000"


@pytest.mark.parametrize("text", ["", "#ffaa6", "red", "#ffaa66ff", "##ffaa66", "#-1aa66", "12"])
def test_what_is_no_hexadecimal_colour(text: str):
    with pytest.raises(ColorError, match="six hexadecimal digits"):
        hex_to_rgb(text)


@pytest.mark.parametrize("rgb", [(1, 2), (1, 2, np.nan), (np.inf, 0, 0)])
def test_what_is_no_colour(rgb: Any):
    with pytest.raises(ColorError, match="three finite"):
        rgb_to_hex(np.array(rgb))
    with pytest.raises(ColorError, match="three finite"):
        cct_and_duv(np.array(rgb))


def test_adaptation_is_that_of_colour_science():
    rng = np.random.default_rng(9)
    for white, to in rng.uniform(0.5, 1.5, (20, 2, 3)):
        expected = colour_science().adaptation.matrix_chromatic_adaptation_VonKries(
            white, to, transform="Bradford"
        )
        np.testing.assert_allclose(adaptation(white, to), expected, rtol=1e-9, atol=1e-12)
