"""Layered OpenRaster and Krita files: zip archives that contain a merged picture as PNG."""

import errno
import lzma
import struct
import tempfile
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import IO
from xml.etree import ElementTree

from lightpaint.errors import ImageError
from lightpaint.images.formats.bitmap import Bitmap, read_bitmap
from lightpaint.images.formats.file_kinds import kind_of
from lightpaint.images.formats.png import PNG_HEAD, longest_png

#: Media types of layered zip archives, and the name of their merged picture.
LAYERED = {b"image/openraster": "ora", b"application/x-krita": "kra"}
MERGED_PICTURE = "mergedimage.png"

#: Maximum size in bytes of a merged picture.
MAX_MERGED = 2**30

#: Exceptions raised by a damaged archive, whose offsets, lengths and methods are arbitrary, and
#: error numbers: bzip2 has none, and a position before the file's beginning is an invalid one.
DAMAGE_ERRNOS = (None, errno.EINVAL)
DAMAGES = (
    zipfile.BadZipFile,
    lzma.LZMAError,
    ElementTree.ParseError,
    LookupError,  # an unknown encoding
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
        path, " is a zip archive, but not one of OpenRaster or Krita: export it as PNG or OpenEXR"
    )


def read_merged(path: Path, kind: str) -> Bitmap:
    """Return the merged picture of a layered file. Raises ImageError, without naming the file."""
    with naming_damage(), zipfile.ZipFile(path) as archive:
        if MERGED_PICTURE not in archive.namelist():
            raise ImageError(f"has no merged picture ({MERGED_PICTURE}): save it again")
        with tempfile.TemporaryDirectory() as folder:
            merged = Path(folder) / MERGED_PICTURE
            unpack_png(archive, MERGED_PICTURE, merged, "merged picture")
            return replace(read_bitmap(merged, "png"), kind=kind)


@contextmanager
def naming_damage() -> Iterator[None]:
    """Turn the errors of a damaged archive, or of a list in it, into an ImageError in one line."""
    try:
        yield
    except KeyError as error:
        raise ImageError(f"is damaged: it lacks {_foreign(error)}") from None
    except OSError as error:
        if error.errno not in DAMAGE_ERRNOS:
            raise
        raise ImageError(f"is damaged: {_foreign(error)}") from error
    except DAMAGES as error:
        raise ImageError(f"is damaged: {_foreign(error)}") from error


def _foreign(error: Exception) -> str:
    """Return a message that has names from the archive, which may be anything."""
    return ascii(str(error))[1:-1][:200]


def unpack_png(archive: zipfile.ZipFile, name: str, place: Path, kind: str) -> None:
    """Unpack a PNG of an archive to `place`. kind: the word for it in errors.

    Raises ImageError if it is something else or too long, and what `naming_damage` turns into one.
    """
    member = archive.getinfo(name)
    if member.file_size > MAX_MERGED:
        raise ImageError(f"declares a {kind} that is too large to unpack")
    with archive.open(member) as packed, place.open("wb") as unpacked:
        head = packed.read(PNG_HEAD)
        if kind_of(head) != "png":
            raise ImageError(f"has a {kind} that is not a PNG: save it again")
        if member.file_size > longest_png(head):
            raise ImageError(f"is damaged: a {kind} is longer than it can be")
        unpacked.write(head)
        _copy(packed, unpacked, member.file_size - len(head), kind)


def _copy(source: IO[bytes], target: IO[bytes], length: int, kind: str) -> None:
    """Copy `length` bytes. Raises ImageError if there are more."""
    copied_bytes = 0
    while chunk := source.read(2**20):
        copied_bytes += len(chunk)
        if copied_bytes > length:
            raise ImageError(f"is damaged: a {kind} is longer than declared")
        target.write(chunk)
