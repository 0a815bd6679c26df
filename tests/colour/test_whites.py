"""Ranges of white: on Planck's locus all along, nearest by colour-science's distance."""

import numpy as np
import pytest

from lightpaint.colour.color import cct_and_duv, kelvin_to_rgb, luminance
from lightpaint.colour.color_ranges import white_range

#: Below 1901 K Rec.709 has no white.
RANGES = [(1901, 100_000, 0.0), (2200, 9000, 0.0), (2700, 6500, 0.005), (2700, 2701, 0.0)]


@pytest.mark.nightly
@pytest.mark.parametrize(("low", "high", "duv"), RANGES)
def test_all_whites_are_on_the_locus(low: float, high: float, duv: float) -> None:
    whites = white_range(low, high, duv)
    places = np.linspace(0, whites.last, 501)
    colors = whites.at(places)
    np.testing.assert_allclose(luminance(colors), 1, rtol=1e-12)
    temperatures = [cct_and_duv(rgb) for rgb in colors]
    kelvins, duvs = np.array([x for x in temperatures if x is not None]).T
    # The curve's distance from the chord of 8 mireds, and a clipped channel at 1901 K.
    assert np.abs(duvs - duv).max() < 3e-5
    assert np.all(np.diff(kelvins) > 0)
    np.testing.assert_allclose(kelvins[[0, -1]], [low, high], rtol=1e-4)
    np.testing.assert_allclose(whites.places(colors), places, atol=1e-6)


def test_the_nearest_white_is_that_of_its_temperature() -> None:
    whites = white_range(2200, 9000)
    for kelvin in (1950, 2200, 3210, 4800, 6500, 9000, 15_000):
        for duv in (-0.01, 0.0, 0.004):
            [near] = whites.nearest(2.5 * np.array([kelvin_to_rgb(kelvin, duv)]))
            assert luminance(near) == pytest.approx(2.5)
            white = cct_and_duv(near)
            assert white is not None
            # Pieces of 8 mireds are straight, and meet at an angle.
            assert 1e6 / white[0] == pytest.approx(1e6 / np.clip(kelvin, 2200, 9000), abs=2)
            if 2200 <= kelvin <= 9000:
                [green] = whites.greener(np.array([kelvin_to_rgb(kelvin, duv)]))
                assert green == pytest.approx(duv, abs=2e-5)


def test_what_is_black_has_no_side() -> None:
    assert white_range(2200, 9000).greener(np.zeros((1, 3))).tolist() == [0]


@pytest.mark.parametrize("reach", [0.0, 20.0, 1e4])
def test_a_piece_lies_on_its_tangent(reach: float) -> None:
    whites = white_range(2200, 9000)
    ends = whites.tangent((3, 4), reach)
    assert ends.min() >= 0
    np.testing.assert_allclose(luminance(ends), 1)
    for rgb in whites.colors[3:5]:
        parts = np.linalg.lstsq(ends.T, rgb, rcond=None)[0]
        np.testing.assert_allclose(parts @ ends, rgb, atol=1e-12)
        assert parts.min() >= -1e-12
