"""PNG, TIFF, JPEG and PSD: a picture's numbers as they are stored, and what they mean.

Decoding is OpenImageIO's, over the formats' own libraries. It is given no file that declares more
pixels than MAX_PIXELS. What it would read as something else than it is (CMYK, Lab, several pages,
a Photoshop file without its merged picture) is refused here.
"""

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt
import OpenImageIO

from lightpaint.colour.icc import Profile, gamma_profile, read_icc, srgb_profile
from lightpaint.colour.primaries import is_rec709, primaries_in
from lightpaint.errors import ImageError
from lightpaint.images.silence import silenced
from lightpaint.images.tiff import check_tiff

#: Above this many pixels nothing is decoded: 8192x4096, for which decoding takes some 1 GB.
MAX_PIXELS = 2**25

#: Longest file that is opened, in bytes.
MAX_FILE = 2**31

#: Longest chunk before a PNG's pixels, in bytes: profiles of printers have a few million.
MAX_CHUNK = 2**24

#: Text in a PNG that names the view it was shown through.
VIEW_KEY = "lightpaint.view"

#: TIFF's PhotometricInterpretation: what its numbers may be, and what else they are called.
TIFF_COLOURS = {0: "grey", 1: "grey", 2: "RGB", 3: "palette", 6: "YCbCr"}
TIFF_OTHERS = {4: "a mask", 5: "CMYK", 8: "Lab", 9: "Lab", 10: "Lab", 32844: "LogLuv"}
PSD_COLOURS = {1: "grey", 3: "RGB"}
PSD_OTHERS = {0: "black and white", 2: "indexed colours", 4: "CMYK", 7: "multichannel", 9: "Lab"}


@dataclass(frozen=True)
class Bitmap:
    """A picture of numbers.

    kind: `png`, `tiff`, `jpeg` or `psd`. values: (h, w, 3) uint8, uint16, float16 or float32;
    grey is repeated. alpha: (h, w) of the same type, None if there is none or all is opaque.
    premultiplied: whether `values` are multiplied by it. codes: largest integer there can be;
    None for floats. profile: what the numbers mean; None is sRGB. lossy: whether compression
    changed them. shown: the view that the file says it was made with, as `name stops`.
    """

    kind: str
    values: npt.NDArray[Any]
    alpha: npt.NDArray[Any] | None
    premultiplied: bool
    codes: int | None
    profile: Profile | None
    lossy: bool
    shown: str | None = None


def read_bitmap(path: Path, kind: str) -> Bitmap:
    """The picture in a file of this kind, upright. Raises ImageError, without naming the file."""
    if path.stat().st_size > MAX_FILE:
        raise ImageError("is too long to be a picture")
    shown: str | None = None
    profile: Profile | None = None
    transparency = True
    if kind == "png":
        shown, profile = _png_says(path)
    elif kind == "psd":
        transparency = _check_psd(path)
    elif kind == "tiff":
        check_tiff(path)
    with silenced():
        spec, pixels = _decoded(path, kind)
    if kind == "tiff":
        _check_tiff(spec)
    if kind == "jpeg" and spec.getattribute("jpeg:ColorSpace") == "CMYK":
        raise ImageError("holds CMYK: convert it to RGB and export it again")
    icc = spec.getattribute("ICCProfile")
    if icc is not None:
        profile = read_icc(np.asarray(icc, np.uint8).tobytes())
    pixels = _upright(pixels, int(spec.get_int_attribute("Orientation", 1)))
    alpha = _alpha(spec, pixels)
    if alpha is not None and not transparency:
        raise ImageError(
            "has a channel beside its colours that is no transparency: delete it, or export a PNG"
        )
    integer = np.issubdtype(pixels.dtype, np.integer)
    return Bitmap(
        kind,
        _rgb(spec, pixels),
        alpha,
        premultiplied=alpha is not None
        and kind == "tiff"
        and not spec.get_int_attribute("oiio:UnassociatedAlpha", 0),
        codes=_largest(pixels.dtype) if integer else None,
        profile=profile,
        lossy=kind == "jpeg" or spec.get_int_attribute("tiff:Compression", 1) in (6, 7, 34887),
        shown=shown,
    )


def _decoded(path: Path, kind: str) -> tuple[Any, npt.NDArray[Any]]:
    OpenImageIO.geterror()  # what is left of an earlier one
    plain = OpenImageIO.ImageSpec()
    plain["oiio:UnassociatedAlpha"] = 1  # or it multiplies display values by alpha
    file = OpenImageIO.ImageInput.open(str(path), plain)
    if file is None:
        raise ImageError(f"is damaged: {_first_line(OpenImageIO.geterror())}")
    try:
        if file.format_name() != kind:
            raise ImageError(f"is damaged: it begins like {kind.upper()} and is none")
        spec = file.spec()
        _check_size(spec)
        pixels = file.read_image(0, 0, 0, spec.nchannels, spec.format)
        error = file.geterror()
        if pixels is None or error:
            raise ImageError(f"is damaged or cut off: {_first_line(error)}")
        if kind == "tiff":
            _check_pages(file, spec)
    finally:
        file.close()
    return spec, np.asarray(pixels).reshape(spec.height, spec.width, spec.nchannels)


def _check_size(spec: Any) -> None:
    if min(spec.width, spec.height) < 1 or spec.width * spec.height > MAX_PIXELS:
        raise ImageError(
            f"declares {spec.width}x{spec.height} pixels: expected at most "
            f"{MAX_PIXELS / 1e6:.0f} million"
        )
    if spec.nchannels > 8 or spec.depth > 1 or spec.deep:
        raise ImageError(f"has {spec.nchannels} channels: expected grey or RGB, with alpha or not")
    if str(spec.format) not in ("uint8", "uint16", "half", "float"):
        raise ImageError(f"holds numbers of type {spec.format}: export it with 8 or 16 bits")


def _check_pages(file: Any, first: Any) -> None:
    """Refuse a second page of the same size: a layer, which must not be lost in silence."""
    size = first.width, first.height
    for page in range(1, 64):
        if not file.seek_subimage(page, 0):
            file.geterror()
            return
        other = file.spec()
        is_small = other.get_int_attribute("tiff:subfiletype", 0) & 1
        if (other.width, other.height) == size and not is_small:
            raise ImageError("has several pages or layers: flatten it and export it again")


def _check_tiff(spec: Any) -> None:
    colours = spec.get_int_attribute("tiff:PhotometricInterpretation", 2)
    if colours not in TIFF_COLOURS:
        named = TIFF_OTHERS.get(colours, f"colours of kind {colours}")
        raise ImageError(f"holds {named}: convert it to RGB and export it again")
    if (TIFF_COLOURS[colours] == "grey") != (spec.channelnames[0] == "Y"):
        raise ImageError(f"is damaged: {spec.nchannels} channels of {TIFF_COLOURS[colours]}")


def _check_psd(path: Path) -> bool:
    """Refuse Photoshop files of other colours, and those without the merged picture.

    Returns whether a channel beside the colours is transparency, and not a saved selection.
    """
    with path.open("rb") as file:
        head = file.read(26)
        if len(head) < 26:
            raise ImageError("is cut off")
        mode = int.from_bytes(head[24:26], "big")
        if mode not in PSD_COLOURS:
            named = PSD_OTHERS.get(mode, f"colours of kind {mode}")
            raise ImageError(f"holds {named}: convert it to RGB and save it again")
        height, width = struct.unpack(">II", head[14:22])
        if height * width > MAX_PIXELS:
            raise ImageError(f"declares {width}x{height} pixels: too many to read")
        file.seek(int.from_bytes(file.read(4), "big"), 1)
        length = int.from_bytes(file.read(4), "big")
        resources = file.read(min(length, 2**26))
        file.seek(length - len(resources), 1)
        length = int.from_bytes(file.read(4), "big")
        layers = file.read(min(length, 6))
        file.seek(length - len(layers), 1)
        _check_packed_rows(file, head)
    for ident, data in _resources(resources):
        # VersionInfo: a version, then whether the merged picture is there.
        if ident == 1057 and len(data) >= 5 and not data[4]:
            raise ImageError(
                "has no merged picture: save it with maximised compatibility, or export a PNG"
            )
    # The number of layers is negative then.
    return len(layers) == 6 and layers[4] >= 0x80


def _check_packed_rows(file: BinaryIO, head: bytes) -> None:
    """Refuse rows that are too short for their pixels: the library leaves them out in silence."""
    if file.read(2) != b"\0\1":
        return
    channels, height, width, depth = struct.unpack(">HIIH", head[12:24])
    table = file.read(2 * channels * height)
    lengths = np.frombuffer(table[: len(table) // 2 * 2], ">u2")
    shortest = 2 * -(-width * depth // 8 // 128)
    if lengths.size < channels * height or (lengths < shortest).any():
        raise ImageError("is damaged: rows of its merged picture are missing")


def _resources(data: bytes) -> Iterator[tuple[int, bytes]]:
    """(number, content) of each image resource block of a Photoshop file."""
    at = 0
    while data[at : at + 4] == b"8BIM" and at + 12 <= len(data):
        ident = int.from_bytes(data[at + 4 : at + 6], "big")
        at += 6 + (data[at + 6] // 2 + 1) * 2  # a name, padded to an even length
        length = int.from_bytes(data[at : at + 4], "big")
        yield ident, data[at + 4 : at + 4 + length]
        at += 4 + length + length % 2


def _png_says(path: Path) -> tuple[str | None, Profile | None]:
    """What the small chunks of a PNG say: the view it was made with, and its colours.

    The order is the standard's: cICP, iCCP, sRGB, then gAMA and cHRM.
    """
    chunks = dict(_png_chunks(path))
    text = chunks.get(b"tEXt", b"")
    shown = text.partition(b"\0")[2].decode("latin-1") or None
    if b"cICP" in chunks:
        return shown, _of_cicp(chunks[b"cICP"])
    gamma, colours = chunks.get(b"gAMA", b""), chunks.get(b"cHRM", b"")
    if chunks.keys() & {b"iCCP", b"sRGB"} or len(gamma) != 4:
        return shown, None
    primaries = None
    if len(colours) == 32:
        wx, wy, *rgb = (v / 1e5 for v in struct.unpack(">8I", colours))
        primaries = (*rgb, wx, wy)
    encoding = int.from_bytes(gamma, "big") / 1e5
    if not encoding or (abs(encoding - 1 / 2.2) < 1e-3 and is_rec709(primaries)):
        return shown, None  # how sRGB is written in these chunks
    try:
        return shown, gamma_profile(1 / encoding, primaries)
    except ValueError as error:
        raise ImageError(f"declares colours that make no sense: {error}") from error


def _png_chunks(path: Path) -> Iterator[tuple[bytes, bytes]]:
    """Type and content of the chunks before the pixels, of which only ours of the texts.

    Raises ImageError where a checksum is wrong: the library would do without that chunk.
    """
    with path.open("rb") as file:
        file.seek(8)
        while len(head := file.read(8)) == 8 and head[4:] not in (b"IDAT", b"IEND"):
            length = int.from_bytes(head[:4], "big")
            if length > MAX_CHUNK:
                raise ImageError("is damaged: a part of its head is too long")
            content, checksum = file.read(length), file.read(4)
            if zlib.crc32(content, zlib.crc32(head[4:])) != int.from_bytes(checksum, "big"):
                raise ImageError("is damaged: a checksum is wrong")
            if head[4:] != b"tEXt" or content.startswith(VIEW_KEY.encode() + b"\0"):
                yield head[4:], content


def _of_cicp(content: bytes) -> Profile | None:
    """Coding-independent code points (ITU-T H.273): sRGB and Display P3."""
    srgb, display_p3 = b"\x01\x0d", b"\x0c\x0d"
    if content[:2] == srgb:
        return None
    if content[:2] == display_p3:
        return srgb_profile("Display P3", primaries_in("Display P3"))
    raise ImageError(
        f"declares the colours {content[:2].hex(' ')} (cICP): export it as sRGB or Display P3"
    )


def _rgb(spec: Any, pixels: npt.NDArray[Any]) -> npt.NDArray[Any]:
    if spec.channelnames[0] == "R" and spec.nchannels >= 3:
        return np.ascontiguousarray(pixels[..., :3])
    return np.repeat(pixels[..., :1], 3, axis=-1)


def _alpha(spec: Any, pixels: npt.NDArray[Any]) -> npt.NDArray[Any] | None:
    if spec.alpha_channel < 0:
        return None
    alpha = pixels[..., spec.alpha_channel]
    opaque = 1 if np.issubdtype(alpha.dtype, np.floating) else _largest(alpha.dtype)
    return None if (alpha == opaque).all() else alpha.copy()


def _largest(dtype: np.dtype[Any]) -> int:
    return int(np.iinfo(dtype).max)


def _upright(pixels: npt.NDArray[Any], orientation: int) -> npt.NDArray[Any]:
    """Turned and mirrored as EXIF's Orientation says."""
    if orientation in (5, 6, 7, 8):
        pixels = pixels.swapaxes(0, 1)
    if orientation in (3, 4, 7, 8):
        pixels = pixels[::-1]
    if orientation in (2, 3, 6, 7):
        pixels = pixels[:, ::-1]
    return pixels


def _first_line(text: str) -> str:
    return next(iter(text.strip().splitlines()), "no reason given")
