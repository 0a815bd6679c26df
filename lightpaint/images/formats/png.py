"""PNG files: 8 bits for viewing, 16 bits for painting, and their metadata."""

import io
import struct
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from lightpaint.arrays import Floats
from lightpaint.colour import (
    MAX_STOPS,
    Profile,
    choose_exposure,
    encode_display,
    gamma_profile,
    is_rec709,
    primaries_in,
    srgb_profile,
    to_8_bit,
)
from lightpaint.errors import ImageError, OutputError
from lightpaint.files import replacing, write_bytes
from lightpaint.keywords import keywords

#: Maximum size in bytes of a chunk before a PNG's pixels: printer profiles have a few million.
MAX_CHUNK = 2**24

#: Number of bytes at the start of a PNG that include its size.
PNG_HEAD = 26

#: Largest side of an image pixel in a picture for notebooks.
MAX_ZOOM = 1000

#: Number of bytes at the start of a PNG that are searched for texts.
MAX_TEXTS = 2**12

#: Compression level: renders are no larger than at the default 6, in a third of the time.
COMPRESSION_LEVEL = 3

#: Key of the text in a PNG that names its view transform.
TRANSFORM_KEY = "lightpaint.view"


def write_png_16(
    path: Path,
    image_display: Floats,
    *,
    texts: Mapping[str, str] | None = None,
    profile: bytes | None = None,
) -> None:
    """Write display values in [0, 1], (h, w), (h, w, 3) or (h, w, 4), as a 16-bit PNG, atomically.

    Colour is not multiplied by alpha, as PNG has it. texts: Latin-1 texts to store in the file.
    profile: an ICC profile to store in it.
    """
    import OpenImageIO

    values = np.round(image_display * 65535).astype(np.uint16)
    height, width = values.shape[:2]
    channels = 1 if values.ndim == 2 else values.shape[2]
    spec = OpenImageIO.ImageSpec(width, height, channels, "uint16")
    if channels == 4:
        spec["oiio:UnassociatedAlpha"] = 1
    if profile is not None:
        spec.attribute("ICCProfile", f"uint8[{len(profile)}]", np.frombuffer(profile, np.uint8))
    for key, text in (texts or {}).items():
        spec.attribute(key, text)
    with replacing(path) as temporary:
        output = OpenImageIO.ImageOutput.create("png")
        assert output is not None  # OpenImageIO is always built with PNG
        is_written = output.open(str(temporary), spec) and output.write_image(
            np.ascontiguousarray(values)
        )
        if not (output.close() and is_written):
            raise OutputError("cannot write ", path, f": {output.geterror() or 'no reason given'}")


def png_bytes(image_8_bit: npt.NDArray[Any], texts: Mapping[str, str] | None = None) -> bytes:
    """Return an (h, w, 3) or (h, w, 4) uint8 image as a PNG file with these Latin-1 texts."""
    info = PngInfo()
    for key, text in (texts or {}).items():
        info.add_text(key, text)
    buffer = io.BytesIO()
    Image.fromarray(image_8_bit).save(buffer, "PNG", pnginfo=info, compress_level=COMPRESSION_LEVEL)
    return buffer.getvalue()


def png_has_text(path: Path, key: str) -> bool:
    """Return True if the file at `path` is a PNG from `png_bytes` with a text of this key."""
    with path.open("rb") as file:
        head = file.read(MAX_TEXTS)
    return head.startswith(b"\x89PNG") and b"tEXt" + key.encode() + b"\0" in head


@keywords()
def display_picture(image: Floats, *, stops: float | None = None, zoom: int = 1) -> Image.Image:
    """Return a linear image as a picture that notebooks can show.

    Args:
        image: (h, w, 3) linear.
        stops: Exposure; by default chosen automatically.
        zoom: Side of an image pixel in the picture.

    Examples:
        >>> lp.display_picture(target.image, zoom=8).size
        (128, 128)
    """
    if np.ndim(image) != 3 or np.shape(image)[2:] != (3,) or not np.size(image):
        raise ImageError(f"an image of the shape {np.shape(image)}: expected (height, width, 3)")
    if not 1 <= zoom <= MAX_ZOOM:
        raise ImageError(f"zoom is {zoom}: expected a whole number from 1 to {MAX_ZOOM}")
    if np.isnan(image).any():
        raise ImageError("an image with NaN: np.nan_to_num(image) shows it with black there")
    if stops is not None and not abs(stops) <= MAX_STOPS:
        raise ImageError(f"stops is {stops}: expected from {-MAX_STOPS:g} to {MAX_STOPS:g}")
    exposure = choose_exposure(image) if stops is None else stops
    pixels = to_8_bit(encode_display(image, stops=exposure))
    return Image.fromarray(np.kron(pixels, np.ones((zoom, zoom, 1), np.uint8)))


def write_png(
    path: Path, image: Floats, *, stops: float = 0.0, texts: Mapping[str, str] | None = None
) -> None:
    """Write a linear image as a display-encoded 8-bit sRGB PNG, atomically."""
    write_bytes(path, png_bytes(to_8_bit(encode_display(image, stops=stops)), texts))


def png_size(head: bytes) -> tuple[int, int]:
    """Return the (height, width) that the head of a PNG declares.

    Raises ImageError, without naming the file, if `head` is not the head of a PNG.
    """
    if len(head) < PNG_HEAD or not head.startswith(b"\x89PNG\r\n\x1a\n"):
        raise ImageError("is damaged: it does not begin like a PNG")
    width, height = struct.unpack_from(">II", head, 16)
    return height, width


def longest_png(head: bytes) -> int:
    """Return the largest plausible size in bytes of a PNG that starts with `head`.

    It is the size of its uncompressed pixels, plus space for profiles, texts and a thumbnail.
    Raises ImageError, without naming the file, if `head` is not the head of a PNG.
    """
    height, width = png_size(head)
    bits, colour = struct.unpack_from(">BB", head, 24)
    channels = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}.get(colour, 4)
    # Adam7 interlacing stores seven pictures, each with one extra byte per row.
    row = -(-width * channels * bits // 8) + 1
    return int(2 * MAX_CHUNK + 8 * height + row * height * 1001 // 1000)


def read_png_head(path: Path) -> tuple[str | None, Profile | None]:
    """Return the view transform and the colour profile that a PNG declares in its small chunks.

    The precedence follows the standard: cICP, iCCP, sRGB, then gAMA and cHRM.
    """
    chunks = dict(_chunks(path))
    text = chunks.get(b"tEXt", b"")
    transform_text = text.partition(b"\0")[2].decode("latin-1") or None
    if b"cICP" in chunks:
        return transform_text, _of_cicp(chunks[b"cICP"])
    gamma, colours = chunks.get(b"gAMA", b""), chunks.get(b"cHRM", b"")
    if chunks.keys() & {b"iCCP", b"sRGB"} or len(gamma) != 4:
        return transform_text, None
    primaries = None
    if len(colours) == 32:
        wx, wy, *rgb = (v / 1e5 for v in struct.unpack(">8I", colours))
        primaries = (*rgb, wx, wy)
    encoding = int.from_bytes(gamma, "big") / 1e5
    if not encoding or (abs(encoding - 1 / 2.2) < 1e-3 and is_rec709(primaries)):
        return transform_text, None  # these chunks describe sRGB
    try:
        return transform_text, gamma_profile(1 / encoding, primaries)
    except ValueError as error:
        raise ImageError(f"declares impossible colours: {error}") from error


def _chunks(path: Path) -> Iterator[tuple[bytes, bytes]]:
    """Yield type and content of the chunks before the pixels; of texts, only lightpaint's own.

    Raises ImageError if a checksum is wrong, since the library would ignore that chunk.
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
            if head[4:] != b"tEXt" or content.startswith(TRANSFORM_KEY.encode() + b"\0"):
                yield head[4:], content


def _of_cicp(content: bytes) -> Profile | None:
    """Return the profile for coding-independent code points (ITU-T H.273): sRGB or Display P3."""
    srgb, display_p3 = b"\x01\x0d", b"\x0c\x0d"
    if content[:2] == srgb:
        return None
    if content[:2] == display_p3:
        return srgb_profile("Display P3", primaries_in("Display P3"))
    raise ImageError(
        f"declares the colours {content[:2].hex(' ')} (cICP): export it as sRGB or Display P3"
    )
