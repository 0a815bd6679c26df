"""Which kind of picture a file is, by how it begins: its name says nothing."""

import sys
from pathlib import Path

from lightpaint.errors import ImageError
from lightpaint.files import file_length, is_utf_8, one_line

#: How files begin, what people call them, and the kind as which they are read; "" if they are not.
BEGINNINGS = (
    (b"\x76\x2f\x31\x01", "OpenEXR", "exr"),
    (b"\x89PNG\r\n\x1a\n", "PNG", "png"),
    (b"\xff\xd8\xff", "JPEG", "jpeg"),
    (b"II*\0", "TIFF", "tiff"),
    (b"MM\0*", "TIFF", "tiff"),
    (b"II+\0", "TIFF", "tiff"),
    (b"MM\0+", "TIFF", "tiff"),
    (b"8BPS\0\1", "Photoshop", "psd"),
    (b"PK\x03\x04", "layered (zip)", "zip"),
    (b"8BPS\0\2", "large Photoshop (PSB)", ""),
    (b"8BPS", "Photoshop", ""),
    (b"#?", "Radiance HDR", ""),
    (b"RIFF", "WebP", ""),
    (b"gimp xcf", "GIMP", ""),
    (b"GIF8", "GIF", ""),
    (b"BM", "BMP", ""),
)


def head_of(path: Path, length: int) -> bytes:
    """How an image file begins. Raises ImageError if there is none that can be read."""
    if not is_utf_8(path):  # as all libraries want it that read pixels
        raise ImageError(f"{one_line(str(path))} is not a name in UTF-8: rename the file")
    file_length(path, "image file", ImageError, limit=sys.maxsize)
    try:
        with path.open("rb") as file:
            return file.read(length)
    except OSError as error:
        raise ImageError(f"cannot read {path}: {error.strerror}") from error


def kind_of(head: bytes) -> str:
    """`exr`, `png`, `jpeg`, `tiff`, `psd` or `zip`; "" for what is not read."""
    return next((kind for mark, _, kind in BEGINNINGS if head.startswith(mark)), "")


def name_of(head: bytes) -> str:
    """What people call such a file; "" if nobody knows."""
    return next((name for mark, name, _ in BEGINNINGS if head.startswith(mark)), "")
