"""Reads and writes multi-part OpenEXR files by rows, with a part of their pixels in memory.

The OpenEXR project's own module reads and writes only whole files. Rows take little code: headers,
offset tables, and scan lines that are uncompressed or ZIP-compressed. All other files are left to
that module.
"""

import os
import struct
import threading
import weakref
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Floats, copy_as_singles
from lightpaint.errors import ImageError
from lightpaint.files import replacing
from lightpaint.images.formats.exr import VERSION_KEY, Channels, is_worth_packing
from lightpaint.version import __version__

MAGIC, MULTI_PART = 20000630, 0x1000

#: Version flags of unsupported parts: tiles, deep pixels.
UNSUPPORTED = 0x200 | 0x800

#: Number of lines in a chunk, by compression: none, ZIP of single lines, ZIP of 16 lines.
LINES = {0: 1, 2: 1, 3: 16}

TYPES: dict[int, np.dtype[Any]] = {0: np.dtype("<u4"), 1: np.dtype("<f2"), 2: np.dtype("<f4")}

#: Number of bytes that is enough for most headers, of a thousand lights too, and maximum size of a
#: header.
FIRST_READ, MAX_HEADER = 2**21, 2**26

#: Number of bytes of a part read at a time when many rows are read.
READ_BYTES = 2**22

#: Header of a chunk: its part, its first line, and the number of bytes that follow.
HEAD = struct.Struct("<iii")

#: The length of an attribute.
INT = struct.Struct("<i")

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


class RowsUnsupportedError(Exception):
    """A file of an unsupported kind."""


@dataclass(frozen=True)
class PartLayout:
    """The layout of a part's pixels in its file.

    display: (height, width) of the picture. channels: names and types in file order. texts: its
    text attributes. lines: rows in a chunk. offsets: (chunks,), positions in the file.
    """

    number: int
    size: tuple[int, int]
    display: tuple[int, int]
    channels: Mapping[str, np.dtype[Any]]
    texts: Mapping[str, str]
    lines: int
    is_packed: bool
    offsets: npt.NDArray[np.int64]

    @property
    def line_bytes(self) -> int:
        """Number of bytes in a row, for all channels together."""
        return self.size[1] * sum(kind.itemsize for kind in self.channels.values())


class RowFile:
    """An open file whose rows are read on request, unaffected by a later replacement of the file.

    Raises RowsUnsupportedError for a file of an unsupported kind, and OSError.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file = os.open(path, os.O_RDONLY | getattr(os, "O_BINARY", 0))
        weakref.finalize(self, os.close, self._file)
        self._lock = threading.Lock()
        self.length = os.fstat(self._file).st_size
        try:
            self.parts = self._all_layouts()
        except (IndexError, KeyError, ValueError, OverflowError, struct.error) as error:
            raise RowsUnsupportedError(str(error)) from error

    def _read(self, start: int, count: int) -> bytes:
        if hasattr(os, "pread"):
            parts = []
            while count > 0 and (part := os.pread(self._file, count, start)):
                parts.append(part)
                start, count = start + len(part), count - len(part)
            return parts[0] if len(parts) == 1 else b"".join(parts)
        with self._lock, os.fdopen(os.dup(self._file), "rb") as file:  # Windows has no pread
            file.seek(start)
            return file.read(count)

    def _all_layouts(self) -> tuple[PartLayout, ...]:
        """Return the layouts of all parts, reading as much of the file's beginning as needed."""
        limit = min(MAX_HEADER, self.length)
        for length in (FIRST_READ, limit):
            try:
                return self._layouts(self._read(0, min(length, limit)))
            except (IndexError, ValueError, struct.error):
                if length >= limit:
                    raise
        raise RowsUnsupportedError("no header")

    def _layouts(self, head: bytes) -> tuple[PartLayout, ...]:
        magic, version = struct.unpack_from("<iI", head)
        if magic != MAGIC or not version & MULTI_PART or version & UNSUPPORTED:
            raise RowsUnsupportedError("not a multi-part file of scan lines")
        position, headers = 8, []
        while head[position]:
            attributes, position = _attributes(head, position)
            headers.append(attributes)
        position += 1
        parts = []
        for number, attributes in enumerate(headers):
            parts.append(_layout(number, attributes, head, position))
            position += 8 * len(parts[-1].offsets)
        return tuple(parts)

    def read_rows(
        self, part: PartLayout, top: int, bottom: int, names: Sequence[str], out: Floats
    ) -> None:
        """Read rows of some channels of a part into an array (channels, bottom - top, w) float32.

        Raises ImageError if the file is truncated or damaged.
        """
        starts = dict(zip(part.channels, _starts(part), strict=True))
        last, step = -(-bottom // part.lines), self._chunks_at_a_time(part)
        for first in range(top // part.lines, last, step):
            for lines, begin in self._lines(part, first, min(first + step, last)):
                rows = slice(max(top, begin), min(bottom, begin + len(lines)))
                inner = lines[rows.start - begin : rows.stop - begin]
                for target, name in zip(out, names, strict=True):
                    values = _values(part, inner, starts, name)
                    copy_as_singles(values, target[rows.start - top : rows.stop - top])

    def _chunks_at_a_time(self, part: PartLayout) -> int:
        """Return the number of chunks to read at a time."""
        return max(1, READ_BYTES // (part.line_bytes * part.lines))

    def channels(self, part: PartLayout) -> dict[str, npt.NDArray[Any]]:
        """Read all channels of a part in their stored types, (h, w) each."""
        starts = dict(zip(part.channels, _starts(part), strict=True))
        channels = {name: np.empty(part.size, kind) for name, kind in part.channels.items()}
        step = self._chunks_at_a_time(part)
        for first in range(0, len(part.offsets), step):
            for lines, begin in self._lines(part, first, first + step):
                for name, pixels in channels.items():
                    pixels[begin : begin + len(lines)] = _values(part, lines, starts, name)
        return channels

    def _lines(
        self, part: PartLayout, first: int, last: int
    ) -> Sequence[tuple[npt.NDArray[np.uint8], int]]:
        """Return the bytes of the rows of some chunks, (rows, line_bytes) each, with their first
        row.
        """
        offsets, size = part.offsets[first:last], part.line_bytes
        if not part.is_packed and len(offsets):
            stride = HEAD.size + size
            if (np.diff(offsets) == stride).all():  # contiguous
                data = self._read(int(offsets[0]), stride * len(offsets))
                if len(data) != stride * len(offsets):
                    raise self._damaged()
                lines = np.frombuffer(data, np.uint8).reshape(-1, stride)[:, HEAD.size :]
                return [(lines, first)]
        blocks = []
        for k, offset in enumerate(offsets.tolist(), first):
            begin = k * part.lines
            rows = min(part.lines, part.size[0] - begin)
            head = self._read(offset, HEAD.size)
            if len(head) != HEAD.size:
                raise self._damaged()
            number, _, count = HEAD.unpack(head)
            if number != part.number or not 0 <= count <= rows * size:
                raise self._damaged()
            stored = self._read(offset + HEAD.size, count)
            is_plain = count == rows * size
            lines = np.frombuffer(stored, np.uint8) if is_plain else _unpacked(stored, rows * size)
            if len(lines) != rows * size:
                raise self._damaged()
            blocks.append((lines.reshape(rows, size), begin))
        return blocks

    def _damaged(self) -> ImageError:
        return ImageError(self.path, " is cut off or damaged: make it again")


def _attributes(head: bytes, position: int) -> tuple[dict[str, tuple[str, bytes]], int]:
    """Return name → (type, value) of the attributes of the header at `position`, and its end."""
    attributes, length = {}, len(head)
    find, size_at = head.index, INT.unpack_from
    while head[position]:
        middle = find(b"\0", position)
        end = find(b"\0", middle + 1)
        (size,) = size_at(head, end + 1)
        begin = end + 1 + INT.size
        if not 0 <= size <= length - begin:
            raise ValueError("an attribute is longer than the file")
        kind = head[middle + 1 : end].decode()
        attributes[head[position:middle].decode()] = kind, head[begin : begin + size]
        position = begin + size
    return attributes, position + 1


def _text(head: bytes, position: int) -> tuple[str, int]:
    end = head.index(b"\0", position)
    return head[position:end].decode(), end + 1


def _layout(
    number: int, attributes: Mapping[str, tuple[str, bytes]], head: bytes, position: int
) -> PartLayout:
    values = {name: value for name, (_, value) in attributes.items()}
    if values["type"] != b"scanlineimage" or values["compression"][0] not in LINES:
        raise RowsUnsupportedError("tiles, or another compression")
    windows = [struct.unpack("<4i", values[name]) for name in ("dataWindow", "displayWindow")]
    left, top, right, bottom = windows[0]
    size = bottom - top + 1, right - left + 1
    if (left, top) != windows[1][:2] or min(size) < 1:
        raise RowsUnsupportedError("a crop, or a margin")
    channels: dict[str, np.dtype[Any]] = {}
    end = 0
    table = values["channels"]
    while table[end]:
        name, end = _text(table, end)
        kind, _, width, height = struct.unpack_from("<iIii", table, end)
        if (width, height) != (1, 1):
            raise RowsUnsupportedError("chroma of lower resolution")
        channels[name], end = TYPES[kind], end + 16
    lines = LINES[values["compression"][0]]
    chunks = -(-size[0] // lines)
    offsets = np.frombuffer(head, "<i8", chunks, position)
    if values["lineOrder"][0] > 1:
        raise RowsUnsupportedError("lines in any order")
    texts = {name: value.decode() for name, (kind, value) in attributes.items() if kind == "string"}
    is_packed = values["compression"] != b"\0"
    display_size = windows[1][3] - windows[1][1] + 1, windows[1][2] - windows[1][0] + 1
    offsets_of_rows = offsets.astype(np.int64)
    return PartLayout(
        number, size, display_size, channels, texts, lines, is_packed, offsets_of_rows
    )


def _values(
    part: PartLayout, lines: npt.NDArray[np.uint8], starts: Mapping[str, int], name: str
) -> npt.NDArray[Any]:
    """Return the values of a channel, (rows, w), from the bytes of some rows."""
    kind, start = part.channels[name], starts[name]
    return np.ascontiguousarray(lines[:, start : start + part.size[1] * kind.itemsize]).view(kind)


def _starts(part: PartLayout) -> list[int]:
    """Return the position of each channel in the bytes of a row."""
    sizes = [part.size[1] * kind.itemsize for kind in part.channels.values()]
    return [sum(sizes[:k]) for k in range(len(sizes))]


def zip_filtered(chunks: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
    """Return the bytes of chunks, (k, b), filtered for ZIP.

    The filter puts even bytes before odd bytes, and then takes differences.
    """
    separated = np.concatenate([chunks[:, 0::2], chunks[:, 1::2]], axis=1)
    steps = np.empty_like(separated)
    steps[:, :1] = separated[:, :1]
    np.subtract(separated[:, 1:], separated[:, :-1], out=steps[:, 1:])
    steps[:, 1:] += np.uint8(128)
    return steps


def _unpacked(compressed: bytes, size: int) -> npt.NDArray[np.uint8]:
    """Return ZIP-compressed bytes decoded: the inverse of `zip_filtered`; none if damaged."""
    try:
        packed = np.frombuffer(zlib.decompress(compressed, bufsize=size), np.uint8)
    except zlib.error:
        return np.empty(0, np.uint8)
    steps = packed - np.uint8(128)
    steps[:1] = packed[:1]
    values = _running_sums(steps)
    unfiltered = np.empty_like(values)
    half = -(-values.size // 2)
    unfiltered[0::2], unfiltered[1::2] = values[:half], values[half:]
    return unfiltered


def _running_sums(steps: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
    """Return the sums modulo 256 of all bytes up to each, and overwrite `steps`.

    Sums of 1, 2, 4, … bytes, whole arrays at a time, take a third of the time of `cumsum`, whose
    every addition waits for the one before.
    """
    sums, longer, length = steps, np.empty_like(steps), 1
    while length < len(sums):
        longer[:length] = sums[:length]
        np.add(sums[length:], sums[:-length], out=longer[length:])
        sums, longer, length = longer, sums, 2 * length
    return sums


@dataclass(frozen=True)
class PartHead:
    """The header of a part.

    size: (height, width). channels: name → type of its pixels. texts: its text attributes. display:
    (height, width) of the picture; None for `size`. is_packed: whether to compress with ZIP. level:
    of ZIP.
    """

    name: str
    size: tuple[int, int]
    channels: Mapping[str, np.dtype[Any]]
    texts: Mapping[str, str] = field(default_factory=dict)
    display: tuple[int, int] | None = None
    is_packed: bool = True
    level: int = LEVEL

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
                small = zlib.compress(steps, self.level) if self.is_packed else b""
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
