"""Writes a multi-part OpenEXR file part by part, with only one part in memory.

The OpenEXR project's own module takes all pixels of a file at once. Writing scan lines takes little
code: headers, offset tables, and lines that are uncompressed or ZIP-compressed.
"""

import struct
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.files import replacing
from lightpaint.images.formats.exr import VERSION_KEY, Channels, is_worth_packing
from lightpaint.images.formats.exr_rows import HEAD, LINES, MAGIC, MULTI_PART, TYPES, zip_filtered
from lightpaint.version import __version__

#: Version number of a file; the flag for names longer than LONGEST_NAME characters; and that
#: length.
VERSION, LONG_NAMES, LONGEST_NAME = 2, 0x400, 31

#: Upper bound in bytes for the header of a light's part, without its texts.
PLAIN_HEAD_BYTES = 2048

#: OpenEXR's codes for no compression and for ZIP of 16 lines; and the ZIP level.
PLAIN, ZIPPED, LEVEL = 0, 3, 4

#: Approximate number of bytes of pixels that are prepared at a time.
BLOCK_BYTES = 2**18


#: Returns all channels of a part from one row to another.
Rows = Callable[[int, int], Channels]


@dataclass(frozen=True)
class PartHead:
    """The header of a part.

    size: (height, width). channels: name → type of its pixels. texts: its text attributes. display:
    (height, width) of the picture; None for `size`. is_packed: whether to compress with ZIP.
    """

    name: str
    size: tuple[int, int]
    channels: Mapping[str, np.dtype[Any]]
    texts: Mapping[str, str] = field(default_factory=dict)
    display: tuple[int, int] | None = None
    is_packed: bool = True

    @classmethod
    def of(
        cls,
        name: str,
        channels: Channels,
        texts: Mapping[str, str] | None = None,
        *,
        display: tuple[int, int] | None = None,
    ) -> "PartHead":
        """Return the header for a part with these pixels, compressed if that helps."""
        height, width = next(iter(channels.values())).shape
        kinds = {channel: pixels.dtype for channel, pixels in channels.items()}
        packed = is_worth_packing(channels)
        return cls(name, (height, width), kinds, texts or {}, display, packed)

    @property
    def lines(self) -> int:
        """Number of rows in a chunk."""
        return LINES[ZIPPED if self.is_packed else PLAIN]

    @property
    def chunks(self) -> int:
        """Number of chunks of its pixels."""
        return -(-self.size[0] // self.lines)

    def encoded(self) -> bytes:
        """Return the header's attributes as the bytes of the file."""
        height, width = self.size
        shown = self.display or self.size
        window = struct.pack("<4i", 0, 0, width - 1, height - 1)
        return b"".join(
            [
                _attribute("channels", "chlist", self._table()),
                _attribute("chunkCount", "int", struct.pack("<i", self.chunks)),
                _attribute("compression", "compression", bytes([ZIPPED if self.is_packed else 0])),
                _attribute("dataWindow", "box2i", window),
                _attribute(
                    "displayWindow", "box2i", struct.pack("<4i", 0, 0, shown[1] - 1, shown[0] - 1)
                ),
                _attribute("lineOrder", "lineOrder", b"\0"),
                _attribute("name", "string", self.name.encode()),
                _attribute("pixelAspectRatio", "float", struct.pack("<f", 1)),
                _attribute("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0)),
                _attribute("screenWindowWidth", "float", struct.pack("<f", 1)),
                _attribute("type", "string", b"scanlineimage"),
                *(_attribute(key, "string", text.encode()) for key, text in self.texts.items()),
                b"\0",
            ]
        )

    def _table(self) -> bytes:
        """Return names and types of the channels, in the order of a line."""
        kinds = {kind: number for number, kind in TYPES.items()}
        entries = [
            name.encode() + b"\0" + struct.pack("<iIii", kinds[self.channels[name]], 0, 1, 1)
            for name in sorted(self.channels)
        ]
        return b"".join([*entries, b"\0"])

    def packed(self, channels: "Channels | Rows") -> Iterator[tuple[int, bytes]]:
        """Yield the first line and the bytes of each chunk of pixels."""
        line_bytes = sum(self.size[1] * kind.itemsize for kind in self.channels.values())
        # Chunks of few bytes are filtered many at a time.
        step = self.lines * max(1, BLOCK_BYTES // (line_bytes * self.lines))
        for top in range(0, self.size[0], step):
            bottom = min(top + step, self.size[0])
            if callable(channels):
                block = channels(top, bottom)
            else:
                block = {name: pixels[top:bottom] for name, pixels in channels.items()}
            # A line stores its channels one after the other.
            parts = [
                np.ascontiguousarray(block[name]).view(np.uint8).reshape(bottom - top, -1)
                for name in sorted(self.channels)
            ]
            yield from self._chunks(np.concatenate(parts, axis=1), top)

    def _chunks(self, rows: npt.NDArray[np.uint8], top: int) -> Iterator[tuple[int, bytes]]:
        """Yield the chunks of lines from `top` on, whose bytes are rows."""
        whole = len(rows) // self.lines * self.lines
        for first, last in ((0, whole), (whole, len(rows))):
            if first == last:
                continue
            lines = min(self.lines, last - first)
            data = rows[first:last].reshape((last - first) // lines, -1)
            filtered = zip_filtered(data) if self.is_packed else data
            for k, (plain, steps) in enumerate(zip(data, filtered, strict=True)):
                small = zlib.compress(steps, LEVEL) if self.is_packed else b""
                is_smaller = self.is_packed and len(small) < len(plain)
                yield top + first + k * lines, small if is_smaller else plain.tobytes()


def write_streamed(
    path: Path,
    parts: Iterable[tuple[PartHead, Channels | Rows]],
    *,
    room: int,
    texts: Callable[[], Mapping[str, str]] = dict,
) -> None:
    """Write a multi-part EXR file atomically.

    Pixels are written as they arrive, after space reserved for the headers.

    parts: the header of each and its channels, of the types and size in it, or what returns rows of
    them, which is called with the first row and the end; all have the same display window. room:
    largest size of all headers in bytes, the sum of `room_for`. texts: returns attributes of the
    first header, which also records the version of lightpaint; called after all parts. Raises
    OutputError for every refusal of the system.
    """
    with replacing(path) as temporary, temporary.open("wb") as file:
        file.seek(room)
        heads, offsets = [], []
        for number, (head, channels) in enumerate(parts):
            heads.append(head)
            for first, data in head.packed(channels):
                offsets.append(file.tell())
                file.write(HEAD.pack(number, first, len(data)))
                file.write(data)
        first_texts = {VERSION_KEY: __version__, **texts(), **heads[0].texts}
        beginning = _beginning([replace(heads[0], texts=first_texts), *heads[1:]], offsets)
        if len(beginning) > room:
            raise ValueError(f"headers of {len(beginning)} bytes in a room of {room}")
        file.seek(0)
        file.write(beginning)


def room_for(name: str, texts: Mapping[str, str], height: int) -> int:
    """Return an upper bound for the bytes that a part takes before the pixels of a file.

    texts: its text attributes, including any of the file. height: number of rows.
    """
    return (
        PLAIN_HEAD_BYTES
        + sum(len(text.encode()) + 64 for text in (name, *texts.values()))
        + 8 * height
    )


def _beginning(heads: Sequence[PartHead], offsets: Sequence[int]) -> bytes:
    """Return all bytes of a file before its pixels. offsets: positions of all chunks."""
    names = [name for head in heads for name in (*head.channels, *head.texts)]
    flags = VERSION | MULTI_PART | (LONG_NAMES if max(map(len, names)) > LONGEST_NAME else 0)
    encoded = [head.encoded() for head in heads]
    table = np.array(offsets, "<u8").tobytes()
    return b"".join([struct.pack("<iI", MAGIC, flags), *encoded, b"\0", table])


def _attribute(name: str, kind: str, value: bytes) -> bytes:
    return b"%s\0%s\0%s%s" % (name.encode(), kind.encode(), struct.pack("<i", len(value)), value)
