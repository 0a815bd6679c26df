"""Pictures as other programs write them, byte by byte."""

import io
import struct
import zipfile
import zlib
from typing import Any

import numpy as np

#: Display P3 and Adobe RGB (1998): colours of the primaries relative to D50, as their profiles
#: have them.
P3 = [(0.51510, 0.24118, -0.00105), (0.29197, 0.69224, 0.04189), (0.15715, 0.06658, 0.78407)]
ADOBE = [(0.60974, 0.31111, 0.01947), (0.20528, 0.62567, 0.06087), (0.14919, 0.06322, 0.74457)]
SRGB = [(0.43607, 0.22249, 0.01392), (0.38515, 0.71687, 0.09708), (0.14307, 0.06061, 0.71410)]

SRGB_CURVE = (2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045)


def _fixed(*values: float) -> bytes:
    return struct.pack(f">{len(values)}i", *(round(v * 65536) for v in values))


def para(kind: int, *values: float) -> bytes:
    return b"para\0\0\0\0" + struct.pack(">HH", kind, 0) + _fixed(*values)


def curv(*values: int) -> bytes:
    return b"curv\0\0\0\0" + struct.pack(f">I{len(values)}H", len(values), *values)


def icc(curve: bytes, columns: Any, *, space: bytes = b"RGB ", **others: bytes) -> bytes:
    """A profile of one curve and these colours of its primaries under D50."""
    text = "Made for a test".encode("utf-16-be")
    tags = {
        b"desc": b"mluc\0\0\0\0" + struct.pack(">II4sII", 1, 12, b"enUS", len(text), 28) + text,
        b"wtpt": b"XYZ \0\0\0\0" + _fixed(0.9642, 1, 0.8249),
        b"cprt": b"mluc\0\0\0\0" + struct.pack(">II4sII", 1, 12, b"enUS", len(text), 28) + text,
    }
    if space == b"GRAY":
        tags[b"kTRC"] = curve
    else:
        for c, xyz in zip(b"rgb", columns, strict=True):
            tags[b"%cXYZ" % c] = b"XYZ \0\0\0\0" + _fixed(*xyz)
            tags[b"%cTRC" % c] = curve
    tags |= {name.encode(): content for name, content in others.items()}
    table, body = b"", b""
    start = 132 + 12 * len(tags)
    for name, content in tags.items():
        table += struct.pack(">4sII", name, start + len(body), len(content))
        body += content + bytes(-len(content) % 4)
    head = struct.pack(
        ">I4sI4s4s4s12s4s28xI12s48x",
        start + len(body),
        b"lcms",
        0x04200000,
        b"mntr",
        space,
        b"XYZ ",
        struct.pack(">6H", 2024, 1, 1, 0, 0, 0),
        b"acsp",
        0,
        _fixed(0.9642, 1, 0.8249),
    )
    return head[:128] + struct.pack(">I", len(tags)) + table + body


def png(pixels: Any, *chunks: tuple[bytes, bytes], color: int | None = None) -> bytes:
    """A PNG of 8 or 16 bits, written by hand, with these chunks before the pixels."""

    def chunk(name: bytes, data: bytes) -> bytes:
        return (
            struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
        )

    height, width, channels = pixels.shape
    depth = pixels.dtype.itemsize * 8
    kind = {1: 0, 2: 4, 3: 2, 4: 6}[channels] if color is None else color
    rows = pixels.astype(pixels.dtype.newbyteorder(">")).reshape(height, -1)
    data = zlib.compress(b"".join(b"\0" + row.tobytes() for row in rows))
    head = struct.pack(">IIBBBBB", width, height, depth, kind, 0, 0, 0)
    middle = b"".join(chunk(*c) for c in chunks)
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", head)
        + middle
        + chunk(b"IDAT", data)
        + chunk(b"IEND", b"")
    )


def psd(pixels: Any, *, mode: int = 3, merged: bool | None = None, packed: bool = False) -> bytes:
    """A Photoshop file that is only a merged picture, of 8 or 16 bits."""
    height, width, channels = pixels.shape
    depth = pixels.dtype.itemsize * 8
    resource = b""
    if merged is not None:
        header = struct.pack(">IB", 1, merged) + bytes(9)
        resource = b"8BIM" + struct.pack(">HHI", 1057, 0, len(header)) + header
    planes = np.moveaxis(pixels, -1, 0).astype(pixels.dtype.newbyteorder(">"))
    rows = [row.tobytes() for plane in planes for row in plane]
    if packed:
        rows = [bytes([len(row) - 1]) + row for row in rows]
        data = b"\0\1" + b"".join(struct.pack(">H", len(row)) for row in rows) + b"".join(rows)
    else:
        data = b"\0\0" + b"".join(rows)
    head = b"8BPS" + struct.pack(">H6xHIIHH", 1, channels, height, width, depth, mode)
    return head + struct.pack(">II", 0, len(resource)) + resource + struct.pack(">I", 0) + data


def layered(merged: bytes | None, mimetype: bytes = b"image/openraster", **options: Any) -> bytes:
    """An OpenRaster or Krita file with this merged picture."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", **options) as archive:
        archive.writestr("mimetype", mimetype, zipfile.ZIP_STORED)
        if merged is not None:
            archive.writestr("mergedimage.png", merged)
    return buffer.getvalue()


def _attribute(name: str, kind: str, value: bytes) -> bytes:
    return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<I", len(value)) + value


def luminance_chroma(y: Any, ry: Any, by: Any, primaries: Any = None) -> bytes:
    """An EXR with chroma at half the resolution, by hand: the library's module writes none."""
    height, width = y.shape
    channels = b"".join(
        name + b"\0" + struct.pack("<iB3xii", 1, 0, step, step)
        for name, step in ((b"BY", 2), (b"RY", 2), (b"Y", 1))
    )
    box = struct.pack("<4i", 0, 0, width - 1, height - 1)
    head = b"\x76\x2f\x31\x01\x02\0\0\0" + b"".join([
        _attribute("channels", "chlist", channels + b"\0"),
        b"" if primaries is None
        else _attribute("chromaticities", "chromaticities", struct.pack("<8f", *primaries)),
        _attribute("compression", "compression", b"\0"),
        _attribute("dataWindow", "box2i", box),
        _attribute("displayWindow", "box2i", box),
        _attribute("lineOrder", "lineOrder", b"\0"),
        _attribute("pixelAspectRatio", "float", struct.pack("<f", 1)),
        _attribute("screenWindowCenter", "v2f", bytes(8)),
        _attribute("screenWindowWidth", "float", struct.pack("<f", 1)),
        b"\0",
    ])  # fmt: skip
    table, lines = b"", b""
    for row in range(height):
        planes = [by[row // 2], ry[row // 2]] if row % 2 == 0 else []
        data = b"".join(p.astype("<f2").tobytes() for p in (*planes, y[row]))
        table += struct.pack("<Q", len(head) + 8 * height + len(lines))
        lines += struct.pack("<iI", row, len(data)) + data
    return head + table + lines
