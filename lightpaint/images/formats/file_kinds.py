"""Detects the format of a picture file from its first bytes rather than its name."""

import sys
from pathlib import Path

from lightpaint.errors import ImageError
from lightpaint.files import file_length, is_utf_8, one_line

#: First bytes of files, the usual name of the format, and its kind; "" if it is not supported.
SIGNATURES = (
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
    """Return the first bytes of an image file. Raises ImageError if it cannot be read."""
    if not is_utf_8(path):  # required by the libraries that read pixels
        raise ImageError(f"{one_line(str(path))} is a name that is not UTF-8: rename the file")
    file_length(path, "image file", ImageError, limit=sys.maxsize)
    try:
        with path.open("rb") as file:
            return file.read(length)
    except OSError as error:
        raise ImageError("cannot read ", path, f": {error.strerror}") from error


def kind_of(head: bytes) -> str:
    """Return `exr`, `png`, `jpeg`, `tiff`, `psd` or `zip`; "" if the format is not supported."""
    return next((kind for mark, _, kind in SIGNATURES if head.startswith(mark)), "")


def name_of(head: bytes) -> str:
    """Return the usual name of the file format; "" if it is unknown."""
    return next((name for mark, name, _ in SIGNATURES if head.startswith(mark)), "")
