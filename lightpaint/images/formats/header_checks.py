"""Checks of the headers of TIFF and Photoshop files, before a library reads their pictures.

The library silently fills in missing fields by its own rules: a header that lost a field, or lists
fewer strips than the picture needs, would be read as a different picture.
"""

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

import numpy as np

from lightpaint.errors import ImageError

#: Fields of a directory (TIFF 6.0, section 8), and their value types: format and size.
WIDTH, HEIGHT, BITS, COMPRESSION, SAMPLES, PLANAR = 256, 257, 258, 259, 277, 284
STRIPS = (273, 279)  # offsets, lengths
TILES = (324, 325)
ROWS_PER_STRIP, TILE_WIDTH, TILE_HEIGHT = 278, 322, 323
TYPES = {1: ("B", 1), 3: ("H", 2), 4: ("I", 4), 16: ("Q", 8)}

#: Maximum number of values in a field; supported pictures have fewer.
MAX_COUNT = 2**22

Fields = dict[int, tuple[int, ...]]


def check_tiff(path: Path) -> None:
    """Raise ImageError unless the first picture of a TIFF is complete."""
    size = path.stat().st_size
    try:
        with path.open("rb") as file:
            fields = _first_directory(file)
    except (struct.error, ValueError, OverflowError, OSError):
        # Truncated, or with an impossible offset.
        raise ImageError("is cut off or damaged") from None
    if not {WIDTH, HEIGHT, BITS} <= fields.keys():
        raise ImageError("is damaged: its header lacks width, height or bits: export it again")
    width, height = _single_value(fields, WIDTH), _single_value(fields, HEIGHT)
    samples, planar = _single_value(fields, SAMPLES, 1), _single_value(fields, PLANAR, 1)
    bits = fields[BITS]
    if len(set(bits)) != 1 or len(bits) not in (1, samples):
        raise ImageError(f"has {len(bits)} depths for {samples} channels: expected one for all")
    if bits[0] not in ((8, 16, 32) if samples > 1 else (1, 2, 4, 8, 16, 32)):
        raise ImageError(f"has {bits[0]} bits: export it with 8 or 16")
    _check_chunks(fields, (height, width), samples, planar, bits[0], size)


def _check_chunks(
    fields: Fields, image: tuple[int, int], samples: int, planar: int, bits: int, size: int
) -> None:
    """Check that all strips or tiles exist, lie within the file, and hold all their pixels."""
    height, width = image
    if TILE_WIDTH in fields:
        chunk = _single_value(fields, TILE_HEIGHT), _single_value(fields, TILE_WIDTH)
        names = TILES if TILES[0] in fields else STRIPS
    else:
        chunk = min(_single_value(fields, ROWS_PER_STRIP, height), height), width
        names = STRIPS
    if min(*chunk, width, height, samples) < 1 or planar not in (1, 2):
        raise ImageError("is damaged: the numbers in its header are impossible")
    count = -(-height // chunk[0]) * -(-width // chunk[1]) * (samples if planar == 2 else 1)
    offsets, lengths = (fields.get(name, ()) for name in names)
    if not len(offsets) == len(lengths) == count:
        raise ImageError(
            f"is damaged: it needs {count} strips or tiles, but lists {len(offsets)} offsets and "
            f"{len(lengths)} lengths"
        )
    if any(start + length > size for start, length in zip(offsets, lengths, strict=True)):
        raise ImageError("is cut off")
    if _single_value(fields, COMPRESSION, 1) != 1:
        return
    row = -(-chunk[1] * bits * (samples if planar == 1 else 1) // 8)
    for k, length in enumerate(lengths):
        rows = chunk[0]
        if names == STRIPS:
            strips = -(-height // chunk[0])
            rows = min(rows, height - k % strips * chunk[0])
        if length < rows * row:
            raise ImageError("is damaged: a strip or tile is too short for its pixels")


def _single_value(fields: Fields, name: int, default: int = 0) -> int:
    return fields.get(name, (default,))[0]


def _first_directory(file: BinaryIO) -> Fields:
    head = file.read(16)
    order = {b"II": "<", b"MM": ">"}[head[:2]]
    big = struct.unpack(order + "H", head[2:4]) == (43,)
    offset = struct.unpack(order + ("Q" if big else "I"), head[8:16] if big else head[4:8])[0]
    file.seek(offset)
    entry, inline = (20, 8) if big else (12, 4)
    (count,) = struct.unpack(order + ("Q" if big else "H"), file.read(8 if big else 2))
    if count > 4096:
        raise ImageError("is damaged: its head has too many fields")
    entries = file.read(count * entry)
    fields: Fields = {}
    for k in range(count):
        name, kind = struct.unpack_from(order + "HH", entries, k * entry)
        (length,) = struct.unpack_from(order + ("Q" if big else "I"), entries, k * entry + 4)
        if kind not in TYPES or length > MAX_COUNT:
            continue
        letter, width = TYPES[kind]
        value = entries[(k + 1) * entry - inline : (k + 1) * entry]
        if length * width > inline:
            (offset,) = struct.unpack(order + ("Q" if big else "I"), value)
            file.seek(offset)
            value = file.read(length * width)
        if length and name not in fields:
            fields[name] = struct.unpack_from(f"{order}{length}{letter}", value)
    return fields


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
