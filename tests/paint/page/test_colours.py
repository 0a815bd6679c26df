"""Colours of the page are those of the library."""

from typing import Any

import numpy as np
import pytest

from lightpaint.colour.color import cct_and_duv, hex_to_rgb, kelvin_to_rgb, luminance, rgb_to_hex


@pytest.fixture
def colour(page: Any) -> Any:
    """A function of colour.js, called with lists of arguments."""

    def call(name: str, arguments: Any) -> np.ndarray:
        function = page.evaluate(
            """async ([name, all]) => {
                const colour = await import("/viewer/drawing/colour.js");
                return all.map((one) => colour[name](...one));
            }""",
            [name, arguments],
        )
        return np.array(function) if None not in function else function

    return call


def test_kelvin_and_green(colour: Any):
    whites = [
        (k, d) for k in (1900, 2700, 3200, 4300, 5600, 6504, 10000, 14000) for d in (-15, 0, 12)
    ]
    colours = colour("fromKelvin", [list(white) for white in whites])
    expected = np.array([kelvin_to_rgb(kelvin, green / 1000) for kelvin, green in whites])
    np.testing.assert_allclose(colours.max(axis=1), 1)
    # Krystek's locus is good to 1e-4 in (u, v).
    np.testing.assert_allclose(colours, expected / expected.max(axis=1, keepdims=True), atol=4e-3)


def test_kelvin_of_a_colour(colour: Any):
    rng = np.random.default_rng(0)
    colours = [
        kelvin_to_rgb(k, d)
        for k, d in zip(rng.uniform(2000, 12000, 20), rng.uniform(-0.02, 0.02, 20), strict=True)
    ]
    for rgb, white in zip(colours, colour("toKelvin", [[list(x)] for x in colours]), strict=True):
        kelvin, duv = cct_and_duv(rgb)
        assert 1e6 / white["kelvin"] == pytest.approx(1e6 / kelvin, abs=1.5)  # mireds
        assert white["green"] == pytest.approx(1000 * duv, abs=0.3)
    assert colour("toKelvin", [[[0, 0, 0]], [[0, 1, 0]], [[0, 0, 1]]]) == [None] * 3


def test_hex(colour: Any):
    texts = ["#ffaa66", "#fa6", "000000", "#0a0b0c"]
    expected = np.array([hex_to_rgb(text) for text in texts])
    np.testing.assert_allclose(colour("fromHex", [[x] for x in texts]), expected, atol=1e-12)
    assert colour("fromHex", [["#ffaa6"], ["red"], [""]]) == [None] * 3
    bright = [[4, 1, 0.2], [1, 0.3, 0.3], [1, 0, 0]]
    assert colour("toHex", [[x] for x in bright]).tolist() == [
        rgb_to_hex(np.array(x)) for x in bright
    ]


def test_hsv_and_back(colour: Any):
    rgb = np.random.default_rng(1).random((50, 3))
    hsv = colour("toHsv", [[list(x)] for x in rgb])
    np.testing.assert_allclose(colour("fromHsv", [[list(x)] for x in hsv]), rgb, atol=1e-9)
    assert colour("toHsv", [[[0, 0, 1]], [[0.5, 0.5, 0.5]]])[:, :2].tolist() == [[240, 1], [0, 0]]


def test_warmer_keeps_luminance_and_goes_along_the_locus(colour: Any):
    gains = colour("warmer", [[x] for x in (-100, 0, 100, 200)])
    np.testing.assert_allclose(luminance(gains), 1)
    np.testing.assert_allclose(gains[1], 1)
    # 5000 K are 200 mired.
    for mired, gain in zip((100, 200, 300, 400), gains, strict=True):
        white = cct_and_duv(gain * kelvin_to_rgb(5000))
        assert white is not None
        assert 1e6 / white[0] == pytest.approx(mired, abs=1)
