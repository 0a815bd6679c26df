"""EXR files in every shape that programs give them, by what they must mean."""

from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import OpenImageIO
import pytest
from picture_files import luminance_chroma

from lightpaint.colour.primaries import colour_science
from lightpaint.errors import ImageError
from lightpaint.images.picture import Picture, read_picture

DATA = Path(__file__).parent / "data"
SIZE = (9, 7)


def _exr(path: Path, channels: Any, **header: Any) -> Path:
    head = {"type": OpenEXR.scanlineimage, "compression": OpenEXR.ZIP_COMPRESSION, **header}
    channels = {n: np.ascontiguousarray(c) for n, c in channels.items()}
    OpenEXR.File(head, channels).write(str(path))
    return path


def _rgb(dtype: Any = np.float32, seed: int = 0) -> Any:
    values = np.random.default_rng(seed).random((*SIZE, 3)) * (1 if dtype != np.uint32 else 99)
    return values.astype(dtype)


def _name_channels(image: Any, prefix: str = "", names: Any = "RGB") -> Any:
    return {prefix + name: image[..., k] for k, name in enumerate(names)}


@pytest.mark.parametrize("dtype", ["f2", "f4", "u4"])
@pytest.mark.parametrize("kind", ["scanlineimage", "tiledimage"])
@pytest.mark.parametrize(
    "compression", ["NO", "RLE", "ZIPS", "ZIP", "PIZ", "PXR24", "B44", "B44A", "DWAA", "DWAB"]
)
def test_exr(tmp_path: Path, dtype: str, kind: str, compression: str):
    image = _rgb(np.dtype(dtype).type)
    header: dict[str, Any] = {"compression": getattr(OpenEXR, f"{compression}_COMPRESSION")}
    if kind == "tiledimage":
        header["tiles"] = OpenEXR.TileDescription()
    path = _exr(tmp_path / "a.exr", _name_channels(image), type=getattr(OpenEXR, kind), **header)
    picture = read_picture(path)
    assert (picture.kind, picture.codes) == ("exr", None)
    # Lossy compressions are of half (B44, DWA) or of 24 bits (PXR24).
    rtol = {"PXR24": 2**-15}.get(compression, 0.2 if compression[:3] in ("B44", "DWA") else 0)
    np.testing.assert_allclose(picture.image, image, rtol=rtol, atol=rtol / 10)


def test_mip_maps(tmp_path: Path):
    image = _rgb()
    source = OpenImageIO.ImageBuf(OpenImageIO.ImageSpec(SIZE[1], SIZE[0], 3, OpenImageIO.FLOAT))
    source.set_pixels(OpenImageIO.ROI(), image)
    spec = OpenImageIO.ImageSpec()
    spec.tile_width = spec.tile_height = 16
    OpenImageIO.ImageBufAlgo.make_texture(
        OpenImageIO.MakeTxTexture, source, str(tmp_path / "a.exr"), spec
    )
    header = OpenEXR.File(str(tmp_path / "a.exr"), header_only=True).parts[0].header
    assert "MIPMAP" in str(header["tiles"])
    np.testing.assert_array_equal(read_picture(tmp_path / "a.exr").image, image)


def test_layers_by_name(tmp_path: Path):
    colours = {"": _rgb(seed=1), "Combined_key": _rgb(seed=2), "ViewLayer.Combined": _rgb(seed=3)}
    channels = {}
    for name, image in colours.items():
        channels |= _name_channels(image, f"{name}." if name else "")
    channels |= {"Normal.X": colours[""][..., 0], "Normal.Y": colours[""][..., 1]}
    path = _exr(tmp_path / "a.exr", channels)
    np.testing.assert_array_equal(read_picture(path).image, colours[""])
    for name in ("Combined_key", "ViewLayer.Combined"):
        np.testing.assert_array_equal(read_picture(path, layer=name).image, colours[name])
    with pytest.raises(ImageError, match=r"no layer 'Normal': it has one without a name, Combined"):
        read_picture(path, layer="Normal")
    del channels["R"], channels["G"], channels["B"]
    with pytest.raises(ImageError, match=r"2 layers \(Combined_key, View.*layer=\.\.\."):
        read_picture(_exr(path, channels))


def test_layers_of_krita_are_not_taken_for_a_picture(tmp_path: Path):
    """Krita 5.1.5 leaves the background without a prefix, and the paint beside it."""
    background, paint = _rgb(seed=1), _rgb(seed=2)
    channels = _name_channels(background) | _name_channels(paint, "paint.")
    path = _exr(
        tmp_path / "a.exr", channels, krita_layers_info="<!DOCTYPE krita-extra-layers-info>"
    )
    with pytest.raises(
        ImageError, match=r"2 layers of Krita \(one without a name, paint\).*flatten"
    ):
        read_picture(path)
    np.testing.assert_array_equal(read_picture(path, layer="paint").image, paint)
    flat = _exr(path, _name_channels(paint, "root Merged."), krita_layers_info="<!DOCTYPE>")
    np.testing.assert_array_equal(read_picture(flat).image, paint)


@pytest.mark.parametrize("names", ["rgb", ["red", "green", "blue"]])
def test_other_names_of_channels(tmp_path: Path, names: Any):
    image = _rgb()
    path = _exr(tmp_path / "a.exr", _name_channels(image, "paint.", names))
    np.testing.assert_array_equal(read_picture(path).image, image)


def test_views_of_one_part(tmp_path: Path):
    left, right = _rgb(seed=1), _rgb(seed=2)
    channels = _name_channels(left) | _name_channels(right, "right.")
    path = _exr(tmp_path / "a.exr", channels, multiView=["left", "right"])
    np.testing.assert_array_equal(read_picture(path).image, left)
    np.testing.assert_array_equal(read_picture(path, layer="left").image, left)
    np.testing.assert_array_equal(read_picture(path, layer="right").image, right)


def test_views_in_parts(tmp_path: Path):
    images = {"left": _rgb(seed=1), "right": _rgb(seed=2)}
    parts = [
        OpenEXR.Part(
            {"view": view}, {n: c.copy() for n, c in _name_channels(image).items()}, f"rgb.{view}"
        )
        for view, image in images.items()
    ]
    OpenEXR.File(parts).write(str(tmp_path / "a.exr"))
    with pytest.raises(ImageError, match=r"2 layers \(rgb\.left, rgb\.right\)"):
        read_picture(tmp_path / "a.exr")
    for view, image in images.items():
        for name in (view, f"rgb.{view}"):
            np.testing.assert_array_equal(read_picture(tmp_path / "a.exr", layer=name).image, image)


def _chroma(tmp_path: Path, *planes: Any) -> Picture:
    (tmp_path / "yc.exr").write_bytes(luminance_chroma(*planes))
    return read_picture(tmp_path / "yc.exr")


def test_luminance_and_chroma(tmp_path: Path):
    """One hue at many brightnesses: chroma is constant then, however it is interpolated."""
    y = np.random.default_rng(0).random((8, 10)).astype(np.float16).astype(np.float64)
    hue = np.array([0.9, 0.4, 0.2])
    hue /= hue @ [0.2126, 0.7152, 0.0722]
    planes = [np.full((4, 5), hue[k] - 1) for k in (0, 2)]
    picture = _chroma(tmp_path, y, *planes)
    # Chroma is rounded to half, and the luminance of green to four digits.
    np.testing.assert_allclose(picture.image, y[..., None] * hue, rtol=2e-3, atol=1e-6)
    # Its means are those of the primaries that are declared.
    acescg = colour_science().RGB_COLOURSPACES["ACEScg"]
    hue = np.array([0.9, 0.4, 0.2])
    hue /= hue @ acescg.matrix_RGB_to_XYZ[1]
    planes = [np.full((4, 5), hue[k] - 1) for k in (0, 2)]
    primaries = (*acescg.primaries.ravel(), *acescg.whitepoint)
    picture = _chroma(tmp_path, y, *planes, primaries)
    rec709 = colour_science().RGB_COLOURSPACES["ITU-R BT.709"]
    expected = y[..., None] * colour_science().RGB_to_RGB(hue, acescg, rec709, "Bradford")
    np.testing.assert_allclose(picture.image, expected, rtol=4e-3, atol=1e-5)


def test_chroma_between_its_samples(tmp_path: Path):
    """It lies on every other pixel, and between those on the others."""
    ramp = np.linspace(-0.3, 0.3, 5)[None].repeat(4, axis=0)
    image = _chroma(tmp_path, np.ones((8, 10)), ramp, 0 * ramp).image
    # Rounded to half.
    np.testing.assert_allclose(image[:, ::2, 0], 1 + ramp[:1].repeat(8, axis=0), atol=3e-4)
    assert (np.diff(image[..., 0])[:, :-1] > 0).all()
    np.testing.assert_allclose(image[..., 2], 1, atol=1e-6)


def test_the_librarys_own_reader_agrees_on_chroma():
    """Both files are the C++ library's (RgbaOutputFile, WRITE_YC; RgbaInputFile)."""
    image = read_picture(DATA / "luminance_chroma.exr").image
    reference = read_picture(DATA / "luminance_chroma_as_rgb.exr").image
    # The library computes in half. In the last row and column, past the last chroma, it pads
    # otherwise.
    np.testing.assert_allclose(image[:-1, :-1], reference[:-1, :-1], rtol=0, atol=1e-3)
    np.testing.assert_allclose(image, reference, rtol=0, atol=2e-2)


def test_xyz_is_not_adapted(tmp_path: Path):
    xyz = (1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1 / 3, 1 / 3)
    path = _exr(tmp_path / "a.exr", _name_channels(_rgb()), chromaticities=xyz)
    expected = colour_science().algebra.vecmul(
        np.linalg.inv(colour_science().RGB_COLOURSPACES["ITU-R BT.709"].matrix_RGB_to_XYZ), _rgb()
    )
    # The matrix of the standard has four digits.
    np.testing.assert_allclose(read_picture(path).image, expected, rtol=0, atol=1e-3)


@pytest.mark.parametrize(
    ("name", "space"),
    [
        ("lin_ap1_scene", "ACEScg"),
        ("lin_ap0_scene", "ACES2065-1"),
        ("lin_rec2020_scene", "ITU-R BT.2020"),
        ("lin_p3d65_scene", "P3-D65"),
        ("lin_rec709_scene", "ITU-R BT.709"),
        ("unknown", "ITU-R BT.709"),
    ],
)
def test_a_colour_space_by_name_is_converted(tmp_path: Path, name: str, space: str):
    """As Blender declares it, without chromaticities."""
    path = _exr(tmp_path / "a.exr", _name_channels(_rgb()), colorInteropID=name)
    spaces = colour_science().RGB_COLOURSPACES
    expected = colour_science().RGB_to_RGB(
        _rgb(), spaces[space], spaces["ITU-R BT.709"], "Bradford"
    )
    # colour-science has whites of five decimals.
    np.testing.assert_allclose(read_picture(path).image, expected, rtol=0, atol=2e-5)
    # Numbers go before names.
    rec709 = (0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329)
    header = {"colorInteropID": name, "chromaticities": rec709}
    path = _exr(tmp_path / "b.exr", _name_channels(_rgb()), **header)
    np.testing.assert_array_equal(read_picture(path).image, _rgb())


def test_encoded_colours_are_no_light(tmp_path: Path):
    path = _exr(tmp_path / "a.exr", _name_channels(_rgb()), colorInteropID="srgb_rec709_display")
    with pytest.raises(ImageError, match=r"a\.exr is in the colour space 'srgb_rec709_display'"):
        read_picture(path)


@pytest.mark.parametrize("names", ["RGBA", "rgba", ["red", "green", "blue", "alpha"]])
@pytest.mark.parametrize("case", [str, str.upper, str.capitalize])
def test_channels_in_any_words(tmp_path: Path, names: Any, case: Any):
    image, alpha = _rgb(), np.full(SIZE, 0.5, np.float32)
    channels = _name_channels(image * 0.5, names=[case(name) for name in names[:3]])
    picture = read_picture(_exr(tmp_path / "a.exr", channels | {case(names[3]): alpha}))
    np.testing.assert_array_equal(picture.image, image)
    np.testing.assert_array_equal(picture.alpha, alpha)


@pytest.mark.parametrize(
    "primaries", [(0.0,) * 8, (0.3, 0.3, 0.3, 0.3, 0.3, 0.3, 0.3, 0.3), (np.nan,) * 8]
)
def test_chromaticities_that_mean_nothing(tmp_path: Path, primaries: Any):
    path = _exr(tmp_path / "a.exr", _name_channels(_rgb()), chromaticities=primaries)
    with pytest.raises(ImageError, match=r"a\.exr declares chromaticities that span no colours"):
        read_picture(path)


def test_alpha_and_weight_of_a_layer(tmp_path: Path):
    image, alpha = _rgb(), np.full(SIZE, 0.5, np.float32)
    alpha[0] = 0
    layer = _name_channels(image * alpha[..., None], "paint.") | {"paint.A": alpha}
    picture = read_picture(_exr(tmp_path / "a.exr", layer | {"A": alpha * 0}))
    np.testing.assert_array_equal(picture.alpha, alpha)
    np.testing.assert_array_equal(picture.image[1:], image[1:])
    assert picture.notes == ()
    weighted = layer | {"paint.W": alpha * 3}
    picture = read_picture(_exr(tmp_path / "a.exr", weighted))
    np.testing.assert_array_equal(picture.weight, alpha * 3)
    np.testing.assert_array_equal(picture.image, image * alpha[..., None])


def test_straight_alpha_is_pointed_out(tmp_path: Path):
    alpha = np.random.default_rng(0).random(SIZE).astype(np.float32)
    alpha[:3] = 0
    picture = read_picture(_exr(tmp_path / "a.exr", _name_channels(_rgb()) | {"A": alpha}))
    assert "if it is not premultiplied" in picture.notes[0]
