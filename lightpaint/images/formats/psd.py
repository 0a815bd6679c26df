"""Checks that a Photoshop file has a merged picture in grey or RGB, the only supported form."""

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

import numpy as np

from lightpaint.errors import ImageError

#: Supported colour modes, and names of unsupported ones.
PSD_COLOURS = {1: "grey", 3: "RGB"}
PSD_OTHERS = {0: "black and white", 2: "indexed colours", 4: "CMYK", 7: "multichannel", 9: "Lab"}


def check_psd(path: Path, *, max_pixels: int) -> bool:
    """Reject Photoshop files in other colour modes or without a merged picture, with ImageError.

    max_pixels: maximum number of pixels. Returns True if an extra channel is transparency rather
    than a saved selection.
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
        if height * width > max_pixels:
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
        # VersionInfo: a version number, then a flag for the merged picture.
        if ident == 1057 and len(data) >= 5 and not data[4]:
            raise ImageError(
                "has no merged picture: save it with maximised compatibility, or export a PNG"
            )
    # The number of layers is negative if there is transparency.
    return len(layers) == 6 and layers[4] >= 0x80


def _check_packed_rows(file: BinaryIO, head: bytes) -> None:
    """Reject rows that are too short for their pixels, which the library skips silently."""
    if file.read(2) != b"\0\1":
        return
    channels, height, width, depth = struct.unpack(">HIIH", head[12:24])
    table = file.read(2 * channels * height)
    lengths = np.frombuffer(table[: len(table) // 2 * 2], ">u2")
    shortest = 2 * -(-width * depth // 8 // 128)
    if lengths.size < channels * height or (lengths < shortest).any():
        raise ImageError("is damaged: rows of its merged picture are missing")


def _resources(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield number and content of each image resource block of a Photoshop file."""
    position = 0
    while data[position : position + 4] == b"8BIM" and position + 12 <= len(data):
        ident = int.from_bytes(data[position + 4 : position + 6], "big")
        position += 6 + (data[position + 6] // 2 + 1) * 2  # a name, padded to an even length
        length = int.from_bytes(data[position : position + 4], "big")
        yield ident, data[position + 4 : position + 4 + length]
        position += 4 + length + length % 2
