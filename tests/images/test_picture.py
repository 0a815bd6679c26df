"""Pictures from other programs' writers, in every format and numbering, by what they must mean."""

import io
import shutil
import struct
import subprocess
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tifffile
from picture_files import ADOBE, P3, SRGB, SRGB_CURVE, curv, icc, layered, para, png, psd
from PIL import Image, ImageCms

from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.colour.primaries import colour_science, decode_display
from lightpaint.errors import ImageError
from lightpaint.images.formats import openraster
from lightpaint.images.formats.png import MAX_CHUNK, longest_png
from lightpaint.images.picture import Picture, read_mask, read_picture

SIZE = (9, 7)


def _pixels(dtype: Any = np.uint8, channels: int = 3, seed: int = 0) -> Any:
    """Random numbers, with the lowest and the highest among them."""
    top = np.iinfo(dtype).max
    pixels = np.random.default_rng(seed).integers(0, top + 1, (*SIZE, channels), dtype=dtype)
    pixels[0, 0], pixels[0, 1] = 0, top
    return pixels


def _light(pixels: Any) -> Any:
    return decode_display(pixels[..., :3] / np.iinfo(pixels.dtype).max)


def _assert_is(picture: Picture, pixels: Any, kind: str) -> None:
    top = np.iinfo(pixels.dtype).max
    assert picture.kind == kind
    assert picture.codes == top
    assert picture.image.dtype == np.float32
    # float32, through a power of 2.4.
    np.testing.assert_allclose(picture.image, _light(pixels), rtol=2e-6, atol=1e-9)
    np.testing.assert_array_equal(picture.saturated, pixels[..., :3] == top)
    assert picture.finite.all()
    assert not picture.lossy


def _read(tmp_path: Path, content: bytes, **options: Any) -> Picture:
    path = tmp_path / "painted"
    path.write_bytes(content)
    return read_picture(path, **options)


# --- PNG


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
@pytest.mark.parametrize("channels", [1, 2, 3, 4])
def test_png(tmp_path: Path, dtype: Any, channels: int):
    """All 16 bits of them: some readers keep eight in silence."""
    pixels = _pixels(dtype, channels)
    picture = _read(tmp_path, png(pixels))
    colours = pixels if channels > 2 else pixels[..., :1].repeat(3, axis=-1)
    _assert_is(picture, colours, "png")
    if channels in (2, 4):
        expected = pixels[..., -1] / np.iinfo(dtype).max
        np.testing.assert_allclose(picture.alpha, expected, rtol=1e-6)
    else:
        assert picture.alpha is None


def test_png_of_pillow_interlaced_and_indexed(tmp_path: Path):
    few = Image.fromarray(_pixels()).quantize(16)
    buffer = io.BytesIO()
    few.save(buffer, "PNG")
    picture = _read(tmp_path, buffer.getvalue())
    np.testing.assert_allclose(picture.image, _light(np.asarray(few.convert("RGB"))), rtol=2e-6)
    black_and_white = Image.fromarray(_pixels()[..., 0] > 99)
    buffer = io.BytesIO()
    black_and_white.save(buffer, "PNG")
    np.testing.assert_array_equal(
        _read(tmp_path, buffer.getvalue()).image[..., 1], np.asarray(black_and_white)
    )


def test_an_opaque_alpha_says_nothing(tmp_path: Path):
    pixels = _pixels(channels=4)
    pixels[..., 3] = 255
    assert _read(tmp_path, png(pixels)).alpha is None


def _magick() -> str | None:
    """ImageMagick, and not what stands in for it."""
    for name in ("magick", "convert-im6", "convert"):
        path = shutil.which(name)
        if (
            path
            and b"ImageMagick" in subprocess.run([path, "-version"], capture_output=True).stdout
        ):
            return path
    return None


@pytest.mark.skipif(_magick() is None, reason="ImageMagick")
@pytest.mark.parametrize(
    ("options", "kind"),
    [
        ("-interlace PNG PNG48", "png"),
        ("-compress LZW TIFF", "tiff"),
        ("-compress Zip -endian MSB TIFF", "tiff"),
        ("-interlace plane -compress None TIFF", "tiff"),
        ("-define tiff:tile-geometry=16x16 -compress Zip TIFF", "tiff"),
        ("-compress RLE PSD", "psd"),
    ],
)
def test_what_imagemagick_writes(tmp_path: Path, options: str, kind: str):
    pixels = _pixels(np.uint16)
    (tmp_path / "source.png").write_bytes(png(pixels))
    *flags, target = options.split()
    output = f"{target}:{tmp_path / 'painted'}"
    subprocess.run(
        [_magick() or "", str(tmp_path / "source.png"), "-depth", "16", *flags, output],
        check=True,
    )
    _assert_is(read_picture(tmp_path / "painted"), pixels, kind)


# --- What the numbers mean


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
@pytest.mark.parametrize(
    ("curve", "columns", "space"),
    [(para(3, *SRGB_CURVE), P3, "Display P3"), (curv(563), ADOBE, "Adobe RGB (1998)")],
)
def test_profiles_are_converted(tmp_path: Path, dtype: Any, curve: Any, columns: Any, space: str):
    pixels = _pixels(dtype)
    profile = icc(curve, columns)
    content = png(pixels, (b"iCCP", b"x\0\0" + zlib.compress(profile)))
    other, rec709 = (
        colour_science().RGB_COLOURSPACES[space],
        colour_science().RGB_COLOURSPACES["ITU-R BT.709"],
    )
    light = other.cctf_decoding(pixels / np.iinfo(dtype).max)
    expected = colour_science().RGB_to_RGB(
        light, other, rec709, chromatic_adaptation_transform=None
    )
    picture = _read(tmp_path, content)
    # Profiles hold colours with sixteen bits behind the point, and colour-science rounds others.
    np.testing.assert_allclose(picture.image, expected, rtol=0, atol=1e-3)
    # Colours beyond Rec.709 stay what they are.
    assert picture.image.min() < -0.05
    brighter = _read(tmp_path, content, transform=ViewTransform("srgb", 2.0))
    np.testing.assert_allclose(brighter.image, picture.image / 4, rtol=1e-6)


@pytest.mark.parametrize(
    "chunks",
    [
        [(b"iCCP", b"x\0\0" + zlib.compress(icc(para(3, *SRGB_CURVE), SRGB)))],
        [(b"sRGB", b"\0"), (b"gAMA", struct.pack(">I", 99_999))],
        [(b"gAMA", struct.pack(">I", 45455))],
        [
            (b"gAMA", struct.pack(">I", 45455)),
            (b"cHRM", struct.pack(">8I", 31270, 32900, 64000, 33000, 30000, 60000, 15000, 6000)),
        ],
        [(b"cICP", b"\1\x0d\0\1")],
    ],
)
def test_srgb_in_every_way_to_say_it(tmp_path: Path, chunks: Any):
    pixels = _pixels(np.uint16)
    _assert_is(_read(tmp_path, png(pixels, *chunks)), pixels, "png")


def test_gamma_and_primaries_of_a_png(tmp_path: Path):
    pixels = _pixels(np.uint16)
    p3 = struct.pack(">8I", 31270, 32900, 68000, 32000, 26500, 69000, 15000, 6000)
    picture = _read(tmp_path, png(pixels, (b"gAMA", struct.pack(">I", 100_000)), (b"cHRM", p3)))
    spaces = colour_science().RGB_COLOURSPACES
    expected = colour_science().RGB_to_RGB(
        pixels / 65535, spaces["Display P3"], spaces["ITU-R BT.709"], None
    )
    np.testing.assert_allclose(picture.image, expected, rtol=0, atol=2e-5)
    by_code = _read(tmp_path, png(pixels, (b"cICP", b"\x0c\x0d\0\1")))
    light = decode_display(pixels / 65535)
    expected = colour_science().RGB_to_RGB(
        light, spaces["Display P3"], spaces["ITU-R BT.709"], None
    )
    np.testing.assert_allclose(by_code.image, expected, rtol=0, atol=2e-5)
    with pytest.raises(ImageError, match=r"colours 09 10 \(cICP\)"):
        _read(tmp_path, png(pixels, (b"cICP", b"\x09\x10\0\1")))


def test_linear_numbers(tmp_path: Path):
    """A view may say it, a profile, or both; not a profile the contrary."""
    pixels = _pixels(np.uint16)
    linear = (b"iCCP", b"x\0\0" + zlib.compress(icc(curv(), SRGB)))
    for content in (png(pixels), png(pixels, linear)):
        picture = _read(tmp_path, content, transform=ViewTransform("linear"))
        np.testing.assert_allclose(picture.image, pixels / 65535, atol=2e-3)
    np.testing.assert_allclose(
        _read(tmp_path, png(pixels, linear)).image, pixels / 65535, atol=2e-3
    )
    gamma = (b"iCCP", b"x\0\0" + zlib.compress(icc(para(0, 1.8), SRGB)))
    with pytest.raises(ImageError, match="but the view transform is linear"):
        _read(tmp_path, png(pixels, gamma), transform=ViewTransform("linear"))


@pytest.mark.parametrize(
    "transform",
    [ViewTransform("agx", 1.0), ViewTransform("filmic", -2.0), ViewTransform("srgb", 3.0)],
)
def test_views(tmp_path: Path, transform: ViewTransform):
    pixels = _pixels(np.uint16)
    expected = transform.decode(pixels / 65535)
    picture = _read(tmp_path, png(pixels), transform=transform)
    np.testing.assert_allclose(picture.image, expected, rtol=2e-4, atol=1e-6)
    assert picture.transform == transform
    # What a PNG says of itself holds unless another is given.
    chunk = (b"tEXt", b"lightpaint.view\0" + f"{transform.name} {transform.stops!r}".encode())
    own = _read(tmp_path, png(pixels, chunk))
    np.testing.assert_array_equal(own.image, picture.image)
    assert own.transform == transform
    assert (
        _read(tmp_path, png(pixels, chunk), transform=ViewTransform()).transform == ViewTransform()
    )


@pytest.mark.parametrize("chunk", [b"nothing", b"agx much", b"rec709 1.0", b"srgb nan", b" "])
def test_a_png_that_names_no_view(tmp_path: Path, chunk: bytes):
    with pytest.raises(ImageError, match="painted"):
        _read(tmp_path, png(_pixels(), (b"tEXt", b"lightpaint.view\0" + chunk)))


# --- TIFF


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
@pytest.mark.parametrize(
    "options",
    [
        {},
        {"compression": "lzw", "predictor": True},
        {"compression": "zlib"},
        {"compression": "packbits"},
        {"tile": (16, 16), "compression": "zlib"},
        {"byteorder": ">"},
        {"bigtiff": True},
        {"rowsperstrip": 2},
    ],
)
def test_tiff(tmp_path: Path, dtype: Any, options: Any):
    if options.get("compression") in ("lzw", "packbits"):
        pytest.importorskip("imagecodecs", reason="imagecodecs")
    pixels = _pixels(dtype)
    tifffile.imwrite(tmp_path / "a.tif", pixels, photometric="rgb", **options)
    _assert_is(read_picture(tmp_path / "a.tif"), pixels, "tiff")


@pytest.mark.parametrize("extra", ["unassalpha", "assocalpha", "unspecified"])
def test_alpha_of_a_tiff(tmp_path: Path, extra: str):
    pixels = _pixels(np.uint16, 4)
    pixels[..., 3] |= 2**15
    pixels[2, 2, 3] = 0
    stored = pixels.copy()
    if extra == "assocalpha":
        share = pixels[..., 3:] / 65535
        stored[..., :3] = np.round(pixels[..., :3] * share)
    tifffile.imwrite(tmp_path / "a.tif", stored, photometric="rgb", extrasamples=[extra])
    picture = read_picture(tmp_path / "a.tif")
    if extra == "unspecified":
        assert picture.alpha is None
    else:
        np.testing.assert_allclose(picture.alpha, pixels[..., 3] / 65535, rtol=1e-6)
    painted = pixels[..., 3] > 0
    # Of the associated ones at least half a code is rounded away.
    atol = 1e-7 if extra != "assocalpha" else 5e-5
    np.testing.assert_allclose(
        picture.image[painted], _light(pixels)[painted], rtol=3e-6, atol=atol
    )


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_white_under_associated_alpha_is_saturated(tmp_path: Path, dtype: Any):
    """A program stores white times alpha, which is alpha: no file can say that it was brighter."""
    top = np.iinfo(dtype).max
    alpha = np.random.default_rng(0).integers(top // 8, top + 1, SIZE).astype(dtype)
    alpha[0, :2], alpha[1, 1] = top, 0
    display = np.random.default_rng(1).choice([0.0, 0.5, 0.9, 1.0], (*SIZE, 3))
    stored = np.round(display * alpha[..., None]).astype(dtype)
    tifffile.imwrite(
        tmp_path / "a.tif",
        np.dstack([stored, alpha]),
        photometric="rgb",
        extrasamples=["assocalpha"],
    )
    picture = read_picture(tmp_path / "a.tif")
    white = (display == 1) & (alpha > 0)[..., None]
    assert white[alpha < top].any()
    np.testing.assert_array_equal(picture.saturated, white)
    np.testing.assert_array_equal(picture.image[white], 1)


@pytest.mark.parametrize("dtype", [np.float16, np.float32])
def test_a_tiff_of_floats_is_light(tmp_path: Path, dtype: Any):
    pixels = (np.random.default_rng(0).standard_normal((*SIZE, 3)) * 50).astype(dtype)
    pixels[1, 1, 0], pixels[2, 2, 1] = np.nan, np.inf
    tifffile.imwrite(tmp_path / "a.tif", pixels, photometric="rgb")
    picture = read_picture(tmp_path / "a.tif", transform=ViewTransform("agx"))
    assert (~picture.finite).sum() == 2
    np.testing.assert_array_equal(picture.image[picture.finite], pixels[picture.finite])
    np.testing.assert_array_equal(picture.image[~picture.finite], 0)
    assert picture.saturated is None
    assert picture.transform is None
    assert picture.codes is None
    profile = icc(para(3, *SRGB_CURVE), SRGB)
    tifffile.imwrite(tmp_path / "b.tif", pixels, photometric="rgb", iccprofile=profile)
    with pytest.raises(ImageError, match="which is not linear"):
        read_picture(tmp_path / "b.tif")


def test_grey_tiffs_of_both_polarities(tmp_path: Path):
    grey = _pixels(channels=1)[..., 0]
    tifffile.imwrite(tmp_path / "a.tif", grey, photometric="minisblack")
    tifffile.imwrite(tmp_path / "b.tif", 255 - grey, photometric="miniswhite")
    for name in ("a.tif", "b.tif"):
        _assert_is(read_picture(tmp_path / name), grey[..., None].repeat(3, axis=-1), "tiff")


@pytest.mark.parametrize(
    ("photometric", "channels", "kind_name"),
    [("separated", 4, "holds CMYK"), ("cielab", 3, "holds Lab")],
)
def test_other_colours(tmp_path: Path, photometric: Any, channels: int, kind_name: str):
    tifffile.imwrite(tmp_path / "a.tif", _pixels(channels=channels), photometric=photometric)
    with pytest.raises(ImageError, match=rf"a\.tif {kind_name}: convert it to RGB"):
        read_picture(tmp_path / "a.tif")


def test_pages_are_not_lost_in_silence(tmp_path: Path):
    tifffile.imwrite(tmp_path / "a.tif", np.stack([_pixels()] * 2), photometric="rgb")
    with pytest.raises(ImageError, match=r"several pages or layers: flatten it"):
        read_picture(tmp_path / "a.tif")
    with tifffile.TiffWriter(tmp_path / "b.tif") as file:
        file.write(_pixels(), photometric="rgb")
        file.write(_pixels()[:3, :3], photometric="rgb", subfiletype=1)
    _assert_is(read_picture(tmp_path / "b.tif"), _pixels(), "tiff")


def test_integers_of_32_bits(tmp_path: Path):
    tifffile.imwrite(tmp_path / "a.tif", _pixels(np.uint32), photometric="rgb")
    with pytest.raises(ImageError, match="export it with 8 or 16 bits"):
        read_picture(tmp_path / "a.tif")


# --- JPEG


def _smooth_pixels() -> Any:
    y, x = np.mgrid[:40, :48] / 48
    return np.round(255 * np.stack([x, y, (x + y) / 2], axis=-1)).astype(np.uint8)


@pytest.mark.parametrize("options", [{}, {"progressive": True}, {"subsampling": 0}])
def test_jpeg(tmp_path: Path, options: Any):
    pixels = _smooth_pixels()
    Image.fromarray(pixels).save(tmp_path / "a.jpg", quality=98, **options)
    picture = read_picture(tmp_path / "a.jpg")
    assert picture.kind == "jpeg"
    assert picture.lossy
    assert picture.codes == 255
    with Image.open(tmp_path / "a.jpg") as file:
        decoded = np.asarray(file)
    # Two builds of one library may round apart by a code.
    display = ViewTransform().encode(picture.image) * 255
    np.testing.assert_allclose(display, decoded, atol=1.01)
    np.testing.assert_array_equal(picture.saturated, np.round(display) >= 253)


@pytest.mark.parametrize("orientation", range(1, 9))
@pytest.mark.parametrize("suffix", ["jpg", "tif"])
def test_pictures_are_upright(tmp_path: Path, orientation: int, suffix: str):
    from PIL import ImageOps

    exif = Image.Exif()
    exif[0x112] = orientation
    path = tmp_path / f"a.{suffix}"
    Image.fromarray(_smooth_pixels()).save(
        path, exif=exif, **({"quality": 98} if suffix == "jpg" else {})
    )
    with Image.open(path) as file:
        upright = np.asarray(ImageOps.exif_transpose(file))
    display = ViewTransform().encode(read_picture(path).image) * 255
    assert display.shape == upright.shape
    np.testing.assert_allclose(display, upright, atol=1.01)


def test_jpeg_of_cmyk_is_refused(tmp_path: Path):
    Image.fromarray(_smooth_pixels()).convert("CMYK").save(tmp_path / "a.jpg")
    with pytest.raises(ImageError, match="holds CMYK"):
        read_picture(tmp_path / "a.jpg")


# --- Layered files


@pytest.mark.parametrize("mimetype", [b"image/openraster", b"application/x-krita"])
def test_merged_pictures(tmp_path: Path, mimetype: bytes):
    pixels = _pixels(np.uint16, 4)
    picture = _read(tmp_path, layered(png(pixels), mimetype))
    _assert_is(picture, pixels, "ora" if b"raster" in mimetype else "kra")
    assert picture.alpha is not None


def test_archives_without_a_merged_picture(tmp_path: Path):
    with pytest.raises(ImageError, match=r"has no merged picture \(mergedimage\.png\): save it"):
        _read(tmp_path, layered(None))
    with pytest.raises(ImageError, match="merged picture that is not a PNG"):
        _read(tmp_path, layered(psd(_pixels())))
    with pytest.raises(ImageError, match="not one of OpenRaster or Krita"):
        _read(tmp_path, layered(png(_pixels()), b"application/zip"))


def test_an_archive_that_inflates(tmp_path: Path):
    """A merged picture that declares 2 GB."""
    merged = png(_pixels())
    sizes = struct.pack("<II", len(merged), len(merged))
    content = layered(merged)
    assert content.count(sizes) == 2  # before the picture, and in the directory at the end
    content = content.replace(sizes, struct.pack("<II", len(merged), 2**31))
    with pytest.raises(ImageError, match="too large to unpack"):
        _read(tmp_path, content)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
@pytest.mark.parametrize("packed", [False, True])
def test_photoshop(tmp_path: Path, dtype: Any, packed: bool):
    pixels = _pixels(dtype)
    _assert_is(_read(tmp_path, psd(pixels, packed=packed, merged=True)), pixels, "psd")
    grey = pixels[..., :1]
    picture = _read(tmp_path, psd(grey, packed=packed, mode=1))
    _assert_is(picture, grey.repeat(3, axis=-1), "psd")


def test_photoshop_files_that_are_no_picture(tmp_path: Path):
    with pytest.raises(ImageError, match="has no merged picture: save it with maximised"):
        _read(tmp_path, psd(_pixels(), merged=False))
    with pytest.raises(ImageError, match="holds CMYK"):
        _read(tmp_path, psd(_pixels(channels=4), mode=4))
    with pytest.raises(ImageError, match="holds Lab"):
        _read(tmp_path, psd(_pixels(), mode=9))


# --- Precision, masks, and files that are none


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_masks_are_numbers(tmp_path: Path, dtype: Any):
    """Not decoded: half grey is half importance."""
    pixels = _pixels(dtype, 2)
    top = np.iinfo(dtype).max
    (tmp_path / "mask.png").write_bytes(png(pixels))
    expected = pixels[..., 0] / top * (pixels[..., 1] / top)
    np.testing.assert_allclose(read_mask(tmp_path / "mask.png"), expected, rtol=1e-6)
    (tmp_path / "mask.png").write_bytes(png(pixels[..., :1]))
    np.testing.assert_allclose(read_mask(tmp_path / "mask.png"), pixels[..., 0] / top, rtol=1e-6)


@pytest.mark.parametrize(
    ("content", "kind_name"),
    [
        (b"#?RADIANCE\n", "a Radiance HDR file"),
        (b"RIFF1234WEBPVP8 ", "a WebP file"),
        (b"gimp xcf v011\0", "a GIMP file"),
        (b"8BPS\0\2" + bytes(40), "a large Photoshop"),
        (b"%PDF-1.7", "not a picture that can be read"),
    ],
)
def test_other_files(tmp_path: Path, content: bytes, kind_name: str):
    with pytest.raises(ImageError, match=rf"painted is {kind_name}.*: export it as OpenEXR"):
        _read(tmp_path, content)


def test_a_scene_in_place_of_a_picture(tmp_path: Path):
    """Scene and painting exchanged: the scene was to be exported as OpenEXR."""
    with pytest.raises(ImageError, match="painted is a scene, not a picture: name the scene first"):
        _read(tmp_path, b'<?xml version="1.0"?>\n<scene version="3.0.0">\n</scene>')


def test_no_file(tmp_path: Path):
    with pytest.raises(ImageError, match="no such image file"):
        read_picture(tmp_path / "none.png")
    with pytest.raises(ImageError, match="is a folder"):
        read_picture(tmp_path)


def test_libraries_keep_quiet(tmp_path: Path, capfd: pytest.CaptureFixture[str]):
    content = bytearray(png(_pixels()))
    content[16:20] = b"\xff" * 4
    content[29:33] = struct.pack(">I", zlib.crc32(content[12:29]))
    with pytest.raises(ImageError):
        _read(tmp_path, bytes(content))
    assert capfd.readouterr() == ("", "")


def test_layers_are_of_exr_files(tmp_path: Path):
    with pytest.raises(ImageError, match="has no layers to choose 'a' from"):
        _read(tmp_path, png(_pixels()), layer="a")


@pytest.mark.parametrize("name", ["a?b=c.png", "50%d#1.png", "-x.png", "ünï cödé.png", "a.exr"])
def test_names_of_files(tmp_path: Path, name: str):
    """A name is a name, whatever a library reads into it; and what a file is, it says itself."""
    (tmp_path / name).write_bytes(png(_pixels()))
    _assert_is(read_picture(tmp_path / name), _pixels(), "png")


def test_the_profile_of_pillow(tmp_path: Path):
    profile = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    pixels = _pixels()
    Image.fromarray(pixels).save(tmp_path / "a.tif", icc_profile=profile)
    _assert_is(read_picture(tmp_path / "a.tif"), pixels, "tiff")


# --- Files that are longer than what they hold


@pytest.mark.parametrize("begins", [b"", "png"])
def test_a_merged_picture_of_nothing_is_not_unpacked(
    tmp_path: Path, begins: Any, monkeypatch: pytest.MonkeyPatch
):
    """No more than its head is, however long it says it is."""
    buffer, head = io.BytesIO(), png(_pixels()) if begins else b""
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("mimetype", b"application/x-krita", zipfile.ZIP_STORED)
        archive.writestr("mergedimage.png", head + bytes(2**26))
    unpacked = []
    monkeypatch.setattr(openraster, "_copy", lambda *arguments: unpacked.append(arguments))
    with pytest.raises(ImageError, match=r"that is not a PNG|longer than it can be"):
        _read(tmp_path, buffer.getvalue())
    assert unpacked == []


def test_what_stands_behind_a_png_is_not_read(tmp_path: Path):
    path = tmp_path / "long.png"
    path.write_bytes(png(_pixels()))
    read_picture(path)
    with path.open("ab") as file:
        for _ in range(40):
            file.write(bytes(range(256)) * 2**12)
    with pytest.raises(ImageError, match=r"a PNG of its size has at most \d+: save it again"):
        read_picture(path)


@pytest.mark.parametrize("mode", ["RGBA", "RGB", "L", "1"])
def test_no_png_of_noise_is_too_long(mode: str):
    """Which is the longest there is, stored as it is."""
    noise = np.random.default_rng(0).integers(0, 256, (300, 401, 4), np.uint8)
    buffer = io.BytesIO()
    Image.fromarray(noise).convert(mode).save(buffer, "PNG", compress_level=0)
    data = buffer.getvalue()
    assert len(data) <= longest_png(data[:26]) - 2 * MAX_CHUNK
    assert longest_png(data[:26]) < 2 * MAX_CHUNK + 1.1 * len(data) + 8 * 300 + 1000
