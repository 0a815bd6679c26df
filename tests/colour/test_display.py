"""Display encoding against IEC 61966-2-1, and pictures as others read them."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from lightpaint.colour.primaries import encode_display, to_8_bit
from lightpaint.images.formats.png import png_bytes, write_png


@pytest.mark.parametrize(
    ("linear", "encoded"),
    [
        (0.0, 0.0),
        (0.001, 0.01292),
        (0.0031308, 0.0031308 * 12.92),
        # Just above the break point the power law takes over, 3e-8 away.
        (0.00313081, 1.055 * 0.00313081 ** (1 / 2.4) - 0.055),
        (0.18, 0.461356),
        (0.214041, 0.5),
        (0.5, 0.735357),
        (1.0, 1.0),
        # What a display cannot show is clipped.
        (-0.5, 0.0),
        (7.0, 1.0),
    ],
)
def test_srgb_curve(linear: float, encoded: float):
    # The decimals given in the table.
    assert encode_display(np.array(linear)) == pytest.approx(encoded, abs=1e-6)


@given(encoded=st.floats(0, 1))
def test_the_standards_inverse_takes_it_back(encoded: float):
    """Decoding as IEC 61966-2-1 prints it."""
    linear = encoded / 12.92 if encoded <= 0.04045 else ((encoded + 0.055) / 1.055) ** 2.4
    # The standard's own two halves miss each other by 3e-8 at the break.
    assert float(encode_display(np.array(linear))) == pytest.approx(encoded, abs=1e-7)


@given(stops=st.floats(-8, 8), value=st.floats(0, 4))
def test_stops_are_powers_of_two(stops: float, value: float):
    actual = encode_display(np.array(value), stops=stops)
    assert actual == pytest.approx(float(encode_display(np.array(value * 2**stops))), abs=1e-15)


def test_every_8_bit_value_survives_a_png(tmp_path: Path):
    codes = np.arange(256) / 255
    linear = np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)
    image = np.stack([linear, linear[::-1], np.roll(linear, 9)], axis=-1).reshape(16, 16, 3)
    write_png(tmp_path / "a.png", image)
    with Image.open(tmp_path / "a.png") as picture:
        assert picture.mode == "RGB"
        assert picture.size == (16, 16)
        pixels = np.asarray(picture)
    np.testing.assert_array_equal(pixels[..., 0].ravel(), np.arange(256))
    np.testing.assert_array_equal(pixels[..., 1].ravel(), np.arange(256)[::-1])


def test_write_png_takes_stops(tmp_path: Path):
    write_png(tmp_path / "a.png", np.full((2, 3, 3), 0.25), stops=2)
    with Image.open(tmp_path / "a.png") as picture:
        np.testing.assert_array_equal(np.asarray(picture), np.full((2, 3, 3), 255))


def test_png_with_alpha(tmp_path: Path):
    pixels = np.random.default_rng(0).integers(0, 256, (4, 5, 4), dtype=np.uint8)
    (tmp_path / "a.png").write_bytes(png_bytes(pixels))
    with Image.open(tmp_path / "a.png") as picture:
        assert picture.mode == "RGBA"
        np.testing.assert_array_equal(np.asarray(picture), pixels)


def test_rounding_to_8_bit():
    np.testing.assert_array_equal(to_8_bit(np.array([0, 0.4 / 255, 0.6 / 255, 1])), [0, 0, 1, 255])
