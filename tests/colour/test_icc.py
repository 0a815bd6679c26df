"""Embedded profiles: against Little CMS, which converts the same bytes in 8 bits."""

import io
from typing import Any

import numpy as np
import pytest
from picture_files import ADOBE, P3, SRGB, SRGB_CURVE, curv, icc, para
from PIL import Image, ImageCms

from lightpaint.colour.primaries import (
    colour_science,
    decode_display,
    encode_display,
    gamma_profile,
    read_icc,
)
from lightpaint.errors import ImageError


def _by_lcms(profile: bytes, pixels: Any) -> Any:
    """8-bit sRGB of 8-bit values of the profile, by Little CMS."""
    mode = "RGB" if pixels.ndim == 3 else "L"
    source = ImageCms.ImageCmsProfile(io.BytesIO(profile))
    image = Image.fromarray(pixels)
    assert image.mode == mode
    display = ImageCms.profileToProfile(
        image, source, ImageCms.createProfile("sRGB"), outputMode="RGB", renderingIntent=1
    )
    return np.asarray(display)


@pytest.mark.parametrize(
    ("curve", "columns"),
    [
        (para(3, *SRGB_CURVE), P3),
        (curv(round(2.19921875 * 256)), ADOBE),
        (para(0, 1.8), ADOBE),
        (curv(), P3),
        (para(3, *SRGB_CURVE), SRGB),
        (curv(*np.round(np.linspace(0, 1, 1024) ** 2.2 * 65535).astype(int)), ADOBE),
        (para(4, 2.0, 0.9, 0.1, 0.3, 0.1, 0.0, 0.0), SRGB),
        (para(1, 2.2, 0.95, 0.05), SRGB),
        (para(2, 2.2, 0.9, 0.05, 0.01), SRGB),
    ],
)
def test_little_cms_agrees(curve: bytes, columns: Any):
    profile = icc(curve, columns)
    pixels = np.random.default_rng(0).integers(0, 256, (16, 16, 3), dtype=np.uint8)
    transform = read_icc(profile)
    curved = [curve(pixels[..., k] / 255) for k, curve in enumerate(transform.curves)]
    light = np.stack(curved, axis=-1) @ transform.matrix.T
    display = np.round(encode_display(light) * 255)
    # Little CMS works in 16 bits and rounds to 8; what is out of sRGB both clip.
    assert np.abs(display - _by_lcms(profile, pixels)).max() <= 1


def test_grey():
    profile = icc(para(0, 1.8), [], space=b"GRAY")
    ramp = np.arange(256, dtype=np.uint8).reshape(16, 16)
    transform = read_icc(profile)
    display = np.round(encode_display(transform.curves[0](ramp / 255)) * 255)
    np.testing.assert_allclose(display, _by_lcms(profile, ramp)[..., 0], atol=1)
    np.testing.assert_array_equal(transform.matrix, np.eye(3))


def test_srgb_is_known():
    assert read_icc(icc(para(3, *SRGB_CURVE), SRGB)).is_srgb
    built_in = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    assert read_icc(built_in).is_srgb
    assert "sRGB" in read_icc(built_in).name
    assert not read_icc(icc(para(3, *SRGB_CURVE), P3)).is_srgb
    assert not read_icc(icc(para(0, 2.2), SRGB)).is_srgb
    linear = read_icc(icc(curv(), SRGB))
    assert linear.is_linear
    assert not linear.is_srgb
    assert linear.name == "Made for a test"


def test_p3_by_its_primaries():
    matrix = read_icc(icc(curv(), P3)).matrix
    spaces = colour_science().RGB_COLOURSPACES
    expected = colour_science().matrix_RGB_to_RGB(
        spaces["Display P3"], spaces["ITU-R BT.709"], None
    )
    # Profiles hold colours with sixteen bits behind the point.
    np.testing.assert_allclose(matrix, expected, rtol=0, atol=1e-3)


def test_gamma():
    profile = gamma_profile(2.2, None)
    np.testing.assert_allclose(profile.curves[1](np.array([0.5])), 0.5**2.2)
    np.testing.assert_array_equal(profile.matrix, np.eye(3))
    assert decode_display is not profile.curves[0]


@pytest.mark.parametrize(
    "profile",
    [
        icc(curv(), P3, A2B0=b"mft2" + bytes(40)),
        icc(curv(), P3, space=b"CMYK"),
        icc(curv(), P3, space=b"Lab "),
    ],
)
def test_tables_of_colours_are_refused_by_name(profile: bytes):
    with pytest.raises(ImageError, match="'Made for a test', which is not made of curves"):
        read_icc(profile)


@pytest.mark.parametrize(
    "profile",
    [
        b"",
        b"no profile" * 30,
        icc(curv(), [(0.0, 0.0, 0.0)] * 3),
        icc(curv(65535, 0), P3),
        icc(para(7, 1.0), P3),
        icc(para(0, 0.0), P3),
        icc(para(0, -3.0), P3),
        icc(b"text" + bytes(20), P3),
        icc(curv(), P3)[:-30],
    ],
)
def test_damaged_profiles(profile: bytes):
    with pytest.raises(ImageError, match="damaged colour profile"):
        read_icc(profile)


def test_every_cut_and_flip_is_refused_or_read():
    content = icc(para(3, *SRGB_CURVE), P3)
    rng = np.random.default_rng(0)
    refusals = 0
    for k in range(1500):
        damaged = bytearray(content[: k * len(content) // 500 if k < 500 else None])
        if k >= 500:
            damaged[rng.integers(len(content))] ^= 1 << rng.integers(8)
        try:
            transform = read_icc(bytes(damaged))
        except ImageError:
            refusals += 1
        else:
            assert np.isfinite(transform.matrix).all()
            with np.errstate(over="ignore"):
                transform.curves[0](np.linspace(0, 1, 9))
    # Of the cuts all are.
    assert refusals >= 490
