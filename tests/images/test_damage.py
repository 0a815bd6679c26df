"""Damaged, truncated and lying pictures: each is refused clearly or read right.

Read right is what can be known: the same picture as before the damage, or what another program
sees in the damaged file too. Where pixels have no checksum no reader can know of a turned bit.
"""

import io
import tempfile
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest
import tifffile
from damaged_files import Case, damage, outcomes, read_despite_cut, wrong_outcomes
from nightly import TENTHS, tenth_of
from picture_files import P3, SRGB_CURVE, icc, layered, luminance_chroma, para, png, psd
from PIL import Image

from lightpaint.errors import ImageError
from lightpaint.images.estimate import Estimate, write_estimate
from lightpaint.images.picture import read_mask, read_picture

RNG = np.random.default_rng(0)
BYTES = RNG.integers(0, 256, (8, 8, 3), dtype=np.uint8)
WORDS = RNG.integers(0, 65536, (8, 8, 4), dtype=np.uint16)
FLOATS = RNG.random((8, 8, 3)).astype(np.float32)


def _tiff(pixels: Any, **options: Any) -> bytes:
    buffer = io.BytesIO()
    tifffile.imwrite(buffer, pixels, photometric="rgb", metadata=None, **options)
    return buffer.getvalue()


def _jpeg(**options: Any) -> bytes:
    buffer = io.BytesIO()
    Image.fromarray(BYTES).save(buffer, "JPEG", quality=90, **options)
    return buffer.getvalue()


def _exr(*parts: Any) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        OpenEXR.File([OpenEXR.Part(dict(h), c, n) for h, c, n in parts]).write(f"{folder}/a.exr")
        return Path(folder, "a.exr").read_bytes()


def _channels(dtype: str = "f4") -> dict[str, Any]:
    return {c: np.ascontiguousarray(FLOATS[..., k].astype(dtype)) for k, c in enumerate("RGB")}


def _compressed(name: str, dtype: str = "f2") -> bytes:
    compression = getattr(OpenEXR, f"{name}_COMPRESSION")
    header = {"type": OpenEXR.scanlineimage, "compression": compression}
    return _exr((header, _channels(dtype), "x"))


def _checked_files() -> dict[str, bytes]:
    """Formats whose every byte of pixels is under a checksum."""
    profile = b"x\0\0" + zlib.compress(icc(para(3, *SRGB_CURVE), P3))
    words = png(WORDS, (b"iCCP", profile), (b"tEXt", b"lightpaint.view\0agx 1.0"))
    return {
        "words.png": words,
        "bytes.png": png(BYTES, (b"gAMA", (55_000).to_bytes(4, "big"))),
        "stored.ora": layered(png(WORDS)),
        "packed.kra": layered(png(BYTES), b"application/x-krita", compression=zipfile.ZIP_DEFLATED),
    }


def _unchecked_files() -> dict[str, bytes]:
    return {
        "plain.tif": _tiff(WORDS[..., :3]),
        "zip.tif": _tiff(WORDS, compression="zlib", extrasamples=["unassalpha"]),
        "tiles.tif": _tiff(
            np.tile(WORDS[..., :3], (4, 4, 1)), tile=(16, 16), compression="zlib", predictor=True
        ),
        "floats.tif": _tiff(FLOATS),
        "big.tif": _tiff(WORDS[..., :3], bigtiff=True),
        "plain.jpg": _jpeg(),
        "progressive.jpg": _jpeg(progressive=True),
        "plain.psd": psd(WORDS[..., :3], merged=True),
        "packed.psd": psd(BYTES, packed=True),
    }


def _exrs() -> dict[str, bytes]:
    plain = {"type": OpenEXR.scanlineimage}
    tiled = {"type": OpenEXR.tiledimage, "tiles": OpenEXR.TileDescription()}
    names = ("NO", "RLE", "ZIP", "PIZ", "B44", "DWAA")
    rec709 = (0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329)
    return {f"{name}.exr": _compressed(name) for name in names} | {
        "PXR24.exr": _compressed("PXR24", "f4"),
        "tiles.exr": _exr((tiled, _channels(), "x")),
        "parts.exr": _exr((plain, _channels(), "x"), (plain, {"Z": FLOATS[..., 0].copy()}, "y")),
        "chroma.exr": luminance_chroma(
            FLOATS[..., 0], FLOATS[:4, :4, 0], FLOATS[:4, :4, 1], rec709
        ),
    }


def _outcomes(
    samples: dict[str, bytes], folder: Path, each: int, tenth: int, *right: str
) -> list[tuple[Case, str]]:
    """Every one is refused or right; of those that are cut, only what lacks nothing is read."""
    cases = [
        case
        for k, (name, content) in enumerate(samples.items())
        for case in damage(name, content, k, each, each)
    ]
    results = outcomes("picture", samples, tenth_of(cases, tenth), folder)
    assert wrong_outcomes(results, ("same", "refused", *right)) == []
    assert read_despite_cut(results) == []
    assert len(results) > 300
    return results


@pytest.mark.nightly
@pytest.mark.parametrize("tenth", TENTHS)
def test_what_has_checksums(tmp_path: Path, tenth: int):
    _outcomes(_checked_files(), tmp_path, 250, tenth)


@pytest.mark.parametrize("tenth", TENTHS)
def test_what_has_none(tmp_path: Path, tenth: int):
    results = _outcomes(_unchecked_files(), tmp_path, 120, tenth, "agreed", "alone")
    # Few are such that the other reader has no opinion.
    assert sum(outcome == "alone" for _, outcome in results) < len(results) / 50


@pytest.mark.parametrize("tenth", TENTHS)
def test_exr(tmp_path: Path, tenth: int):
    results = _outcomes(_exrs(), tmp_path, 100, tenth, "agreed", "alone")
    # The other reader has none of luminance and chroma.
    unharmed = [
        case for case, outcome in results if outcome == "alone" and case.file != "chroma.exr"
    ]
    assert len(unharmed) < len(results) / 50


@pytest.mark.nightly
@pytest.mark.parametrize("tenth", TENTHS)
def test_masks(tmp_path: Path, tenth: int):
    samples = {
        **_checked_files(),
        **{k: v for k, v in _exrs().items() if k in ("ZIP.exr", "parts.exr")},
    }
    masks = {name: content for name, content in samples.items() if name != "parts.exr"}
    cases = [
        case
        for k, (name, content) in enumerate(samples.items())
        for case in damage(name, content, k, 60, 60)
    ]
    results = outcomes("mask", masks, tenth_of(cases, tenth), tmp_path)
    assert wrong_outcomes(results) == []
    assert read_despite_cut(results) == []


@pytest.mark.nightly
@pytest.mark.parametrize("tenth", TENTHS)
def test_estimates(tmp_path: Path, tenth: int):
    rng = np.random.default_rng(0)
    estimate = Estimate(*(rng.random((2, 6, 5, 3), np.float32)))
    write_estimate(tmp_path / "predicted.exr", estimate, {"lightpaint.view": "{}"})
    content = (tmp_path / "predicted.exr").read_bytes()
    cases = tenth_of(damage("predicted.exr", content, 1, 150, 150), tenth)
    renamed = content.replace(b"half_difference.G", b"half_difference.X")
    cases += [
        Case("predicted.exr", "no green", content.replace(b"\0G\0", b"\0Q\0")),
        Case("predicted.exr", "no noise in green", renamed),
    ]
    results = outcomes("estimate", {"predicted.exr": content}, cases, tmp_path)
    assert wrong_outcomes(results) == []
    assert [outcome for case, outcome in results if case.done.startswith("no ")] == ["refused"] * 2


@pytest.mark.parametrize("name", ["is", "a", "damaged", "it"])
def test_a_name_that_is_a_word_of_the_message(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
):
    """The file is named all the same, and first."""
    monkeypatch.chdir(tmp_path)
    plain = {"type": OpenEXR.scanlineimage}
    broken = (png(BYTES)[:-20], _tiff(FLOATS)[:-40], _exr((plain, _channels(), "x"))[:-40])
    for content in (*broken, _exr((plain, {"Z": FLOATS[..., 0].copy()}, "x"))):
        Path(name).write_bytes(content)
        for read in (read_picture, read_mask):
            with pytest.raises(ImageError, match=rf"^(mask )?{name} (is|has) "):
                read(name)


def test_names_in_a_file_that_a_terminal_would_obey(tmp_path: Path):
    plain = {"type": OpenEXR.scanlineimage}
    (tmp_path / "a.exr").write_bytes(_exr((plain, {"\x1b[2J": FLOATS[..., 0].copy()}, "x")))
    for read in (read_picture, read_mask):
        with pytest.raises(ImageError, match=r"a\.exr .*it has \\x1b") as refusal:
            read(tmp_path / "a.exr")
        assert str(refusal.value).isprintable()


def _declare_size(content: bytes, position: int, order: Any, width: int, height: int) -> bytes:
    size = width.to_bytes(4, order) + height.to_bytes(4, order)
    return content[:position] + size + content[position + 8 :]


@pytest.mark.parametrize(("width", "height"), [(2**31 - 1, 1), (60_000, 60_000), (2**20, 2**20)])
def test_sizes_that_no_picture_has(tmp_path: Path, width: int, height: int):
    png_content = png(BYTES)
    resized = _declare_size(png_content, 16, "big", width, height)
    checksum = zlib.crc32(resized[12:29]).to_bytes(4, "big")
    photoshop = psd(BYTES)
    files = {
        "a.png": resized[:29] + checksum + resized[33:],
        "a.psd": _declare_size(photoshop, 14, "big", height, width),
    }
    for name, content in files.items():
        (tmp_path / name).write_bytes(content)
        with pytest.raises(ImageError, match=name):
            read_picture(tmp_path / name)
