"""Layered OpenRaster and Krita files: zip archives that contain a merged picture as PNG."""

import struct
import tempfile
import zipfile
import zlib
from dataclasses import replace
from pathlib import Path
from typing import IO

from lightpaint.errors import ImageError
from lightpaint.images.formats.bitmap import Bitmap, read_bitmap
from lightpaint.images.formats.file_kinds import kind_of
from lightpaint.images.formats.png import PNG_HEAD, longest_png

#: Media types of layered zip archives, and the name of their merged picture.
LAYERED = {b"image/openraster": "ora", b"application/x-krita": "kra"}
MERGED_PICTURE = "mergedimage.png"

#: Maximum size in bytes of a merged picture.
MAX_MERGED = 2**30

#: Exceptions raised by a damaged archive, whose offsets and lengths are arbitrary.
DAMAGES = (
    zipfile.BadZipFile,
    NotImplementedError,
    RuntimeError,
    EOFError,
    ValueError,
    OverflowError,
    struct.error,
    zlib.error,
)


def layered_kind(path: Path, head: bytes) -> str:
    """Return `ora` or `kra`, according to the archive's first member, which is uncompressed."""
    length = int.from_bytes(head[26:28], "little") + int.from_bytes(head[28:30], "little")
    media_type = head[30 + length :]
    for mark, kind in LAYERED.items():
        if media_type.startswith(mark):
            return kind
    raise ImageError(
        f"{path} is a zip archive, but not one of OpenRaster or Krita: export it as PNG or OpenEXR"
    )


def read_merged(path: Path, kind: str) -> Bitmap:
    """Return the merged picture of a layered file. Raises ImageError, without naming the file."""
    try:
        with zipfile.ZipFile(path) as archive, tempfile.TemporaryDirectory() as folder:
            member = archive.getinfo(MERGED_PICTURE)
            if member.file_size > MAX_MERGED:
                raise ImageError("declares a merged picture that is too large to unpack")
            merged = Path(folder) / MERGED_PICTURE
            with archive.open(member) as packed, merged.open("wb") as unpacked:
                head = packed.read(PNG_HEAD)
                if kind_of(head) != "png":
                    raise ImageError("has a merged picture that is not a PNG: save it again")
                if member.file_size > longest_png(head):
                    raise ImageError("is damaged: its merged picture is longer than it can be")
                unpacked.write(head)
                _copy(packed, unpacked, member.file_size - len(head))
            return replace(read_bitmap(merged, "png"), kind=kind)
    except KeyError:
        raise ImageError(f"has no merged picture ({MERGED_PICTURE}): save it again") from None
    except DAMAGES as error:
        # The message contains names from the archive, which may be anything.
        raise ImageError(f"is damaged: {ascii(str(error))[1:-1][:200]}") from error


def _copy(source: IO[bytes], target: IO[bytes], length: int) -> None:
    """Copy `length` bytes. Raises ImageError if there are more."""
    copied_bytes = 0
    while chunk := source.read(2**20):
        copied_bytes += len(chunk)
        if copied_bytes > length:
            raise ImageError("is damaged: its merged picture is longer than declared")
        target.write(chunk)
