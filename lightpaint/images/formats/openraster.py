"""OpenRaster's and Krita's layered files: zip archives with a merged picture in them, a PNG."""

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

#: What a layered zip says it is, and where its merged picture lies.
LAYERED = {b"image/openraster": "ora", b"application/x-krita": "kra"}
MERGED = "mergedimage.png"

#: Longest merged picture that is unpacked, in bytes.
MAX_MERGED = 2**30

#: What reading a damaged archive raises: its places and lengths may be any numbers.
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
    """OpenRaster and Krita name themselves in their first member, which is not compressed."""
    length = int.from_bytes(head[26:28], "little") + int.from_bytes(head[28:30], "little")
    said = head[30 + length :]
    for mark, kind in LAYERED.items():
        if said.startswith(mark):
            return kind
    raise ImageError(f"{path} is a zip archive, but neither OpenRaster's nor Krita's")


def read_merged(path: Path, kind: str) -> Bitmap:
    """The merged picture of such a file. Raises ImageError, without naming the file."""
    try:
        with zipfile.ZipFile(path) as archive, tempfile.TemporaryDirectory() as folder:
            member = archive.getinfo(MERGED)
            if member.file_size > MAX_MERGED:
                raise ImageError("declares a merged picture that is too large to unpack")
            merged = Path(folder) / MERGED
            with archive.open(member) as packed, merged.open("wb") as unpacked:
                head = packed.read(PNG_HEAD)
                if kind_of(head) != "png":
                    raise ImageError("has a merged picture that is no PNG")
                if member.file_size > longest_png(head):
                    raise ImageError("is damaged: its merged picture is longer than it can be")
                unpacked.write(head)
                _copy(packed, unpacked, member.file_size - len(head))
            return replace(read_bitmap(merged, "png"), kind=kind)
    except KeyError:
        raise ImageError(f"has no merged picture ({MERGED}): save it again") from None
    except DAMAGES as error:
        # The archive's own names stand in the message, and may be anything.
        raise ImageError(f"is damaged: {ascii(str(error))[1:-1][:200]}") from error


def _copy(source: IO[bytes], target: IO[bytes], length: int) -> None:
    """Copy what the archive declares, and see that it is no more."""
    copied = 0
    while chunk := source.read(2**20):
        copied += len(chunk)
        if copied > length:
            raise ImageError("is damaged: its merged picture is longer than declared")
        target.write(chunk)
