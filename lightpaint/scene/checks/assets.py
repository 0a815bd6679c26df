"""Checks of the files that a scene refers to, before Mitsuba reads them.

Mitsuba's own readers wait forever for a pipe, crash on a damaged OpenEXR file or mesh, and allocate
as much memory as a header declares. They crash as well on a mesh that is shorter than it declares,
or whose faces use vertices that do not exist. Faults that Mitsuba itself reports, such as
non-triangular faces or unknown types, are not checked here.
"""

import struct
import zlib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.errors import ImageError, SceneError
from lightpaint.files import file_length, one_line
from lightpaint.images.formats import ExrPart, read_parts
from lightpaint.luminaires import LUMINAIRE_PLUGINS, read_web

#: Maximum size in bytes of a file that is read.
MAX_ASSET = 2**32

#: A picture is not decoded if its declared size in bytes, at four per pixel, exceeds both MAX_BYTES
#: and MAX_COMPRESSION times the size of its file.
MAX_BYTES = 2**29
MAX_COMPRESSION = 1000

#: Maximum size of a PLY header in bytes.
MAX_HEAD = 2**16
#: Maximum size in bytes to which a mesh is decompressed.
MAX_UNPACKED = 2**31

_TYPES = {
    **{"char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1"},
    **{"short": "i2", "int16": "i2", "ushort": "u2", "uint16": "u2"},
    **{"int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4"},
    **{"long": "i8", "int64": "i8", "ulong": "u8", "uint64": "u8"},
    **{"half": "f2", "float16": "f2", "float": "f4", "float32": "f4"},
    **{"double": "f8", "float64": "f8"},
}
_ORDERS = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}
_INDICES = ("vertex_index", "vertex_indices")

#: Name, number of rows, and row type, which has a field `faces` for the element `face`.
Element = tuple[str, int, np.dtype[np.void]]


def check_assets(scene: Path, state: Any, resolver: Any) -> bool:
    """Raise SceneError if a file of the parsed scene is unfit for the plugin that reads it.

    Returns True if one of them is an OpenEXR file.
    """
    import mitsuba as mi

    checked: set[tuple[Path, str, int]] = set()
    for node in state.nodes:
        props = node.props
        for key in props:
            if not key.endswith("filename") or props.type(key) != mi.Properties.Type.String:
                continue
            path = Path(str(resolver.resolve(props[key])))
            asset = (path, props.plugin_name(), int(props.get("shape_index", 0)))
            if path.exists() and asset not in checked:  # Mitsuba reports missing files
                try:
                    check_asset(*asset)
                except SceneError as error:
                    raise SceneError(f"{scene}: ", error) from None
                checked.add(asset)
    return any(path.suffix.lower() == ".exr" for path, _, _ in checked)


def check_asset(path: Path, plugin: str, index: int = 0) -> None:
    """Raise SceneError unless `plugin` can safely read the file at `path`.

    index: index of the mesh in the file. Faults that Mitsuba itself reports cleanly are not
    checked.
    """
    length = file_length(path, "file to read", SceneError, limit=MAX_ASSET)
    try:
        if plugin == "ply":
            check_ply(path)
        elif plugin == "serialized":
            check_serialized(path, index)
        elif plugin == "gridvolume":
            _check_volume(path, length)
        elif plugin in ("bitmap", "envmap", "projector", "spot", "area"):
            _check_picture(path, length)
        elif plugin in LUMINAIRE_PLUGINS:
            read_web(path)
    except MeshError as damage:
        raise SceneError(f"{path} is damaged: {one_line(str(damage))}; export it again") from None
    except ImageError as error:
        raise SceneError(one_line(str(error))) from None
    except OSError as error:
        raise SceneError(f"cannot read {path}: {error.strerror or error}") from None
    except MemoryError:
        raise SceneError(f"{path} needs more memory than there is") from None


def _check_picture(path: Path, length: int) -> None:
    with path.open("rb") as file:
        head = file.read(32)
        if head.startswith(b"\x76\x2f\x31\x01"):
            # Only a complete read shows whether Mitsuba's reader will survive.
            _check_origin(path, read_parts(path))
            return
        width = height = 0
        if head.startswith(b"\x89PNG") and len(head) >= 24:
            width, height = struct.unpack(">II", head[16:24])
        elif head.startswith(b"\xff\xd8"):
            file.seek(2)
            width, height = _jpeg_size(file.read(2**24))
    if 4 * width * height > max(MAX_BYTES, MAX_COMPRESSION * length):
        raise ImageError(
            f"{path} declares {width}x{height} pixels, in {length} bytes: too many to read"
        )


def _check_origin(path: Path, parts: Iterable[ExrPart]) -> None:
    for part in parts:
        if min(part.origin) < 0:
            y, x = part.origin
            raise ImageError(
                f"{path} begins at pixel ({x}, {y}), which Mitsuba cannot read: crop it to its "
                "display window"
            )


def _jpeg_size(data: bytes) -> tuple[int, int]:
    """Return (width, height) from the header; 0 if missing. data: bytes after the first marker."""
    position = 0
    while position + 9 <= len(data) and data[position] == 0xFF:
        mark = data[position + 1]
        if mark == 0xFF:  # a fill byte
            position += 1
            continue
        if 0xC0 <= mark <= 0xCF and mark not in (0xC4, 0xC8, 0xCC):
            height, width = struct.unpack(">HH", data[position + 5 : position + 9])
            return width, height
        position += 2 + int.from_bytes(data[position + 2 : position + 4], "big")
    return 0, 0


def _check_volume(path: Path, length: int) -> None:
    with path.open("rb") as file:
        head = file.read(24)
    if len(head) == 24 and head.startswith(b"VOL\x03"):
        kind, width, height, depth, channels = struct.unpack("<5i", head[4:])
        if kind == 1 and min(width, height, depth, channels) < 1:
            size = f"{width}x{height}x{depth} points of {channels} numbers"
            raise SceneError(f"{path} is damaged: it declares {size}")
        if kind == 1 and 4 * channels * width * height * depth > length:
            raise SceneError(f"{path} is damaged: it is shorter than it declares")


class MeshError(Exception):
    """An error in a mesh, without the name of its file."""


def check_ply(path: Path) -> None:
    """Check a PLY file. Raises MeshError."""
    length = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(MAX_HEAD)
    form, elements, position = _ply_head(head)
    vertices = next((count for name, count, _ in elements if name == "vertex"), 0)
    if form == "ascii":
        _check_ascii(path, position, elements, vertices)
        return
    for name, count, row in elements:
        if position + count * row.itemsize > length:
            raise MeshError(f"it is shorter than its {count} rows of {name!r}")
        if name == "face" and count and "faces" in (row.names or ()):
            table = np.memmap(path, row, "r", position, (count,))
            # Mitsuba itself rejects lists of other lengths.
            if (table["sides"] == 3).all():
                _check_faces(table["faces"], vertices)
        position += count * row.itemsize


def _ply_head(head: bytes) -> tuple[str, list[Element], int]:
    """Return the format, the elements, and the position of the first row."""
    format_name, position, is_complete = "", 0, False
    counts: list[tuple[str, int]] = []
    fields: list[list[tuple[str, str, tuple[int, ...]]]] = []
    while not is_complete:
        end = head.find(b"\n", position)
        if end < 0 or (position == 0 and head[:end].split() != [b"ply"]):
            raise MeshError("it does not have the header of a PLY")
        words = head[position:end].decode("latin-1").split()
        position = end + 1
        match words:
            case ["format", name, *_]:
                format_name = name
            case ["element", name, count] if count.isascii() and count.isdigit():
                counts.append((name, int(count[:20])))
                fields.append([])
            case ["property", "list", sides, kind, name] if fields and {sides, kind} <= {*_TYPES}:
                # Mitsuba also reads every list as three entries.
                names = (
                    ("sides", "faces") if name in _INDICES else (f"#{position}", f"list{position}")
                )
                fields[-1] += [(names[0], _TYPES[sides], ()), (names[1], _TYPES[kind], (3,))]
            case ["property", kind, _] if fields and kind in _TYPES:
                fields[-1].append((f"field{position}", _TYPES[kind], ()))
            case ["end_header"]:
                is_complete = True
            case ["ply"] | ["comment", *_] | ["obj_info", *_] | []:
                pass
            case _:
                raise MeshError(f"its header has the unknown line {' '.join(words)[:80]!r}")
    if format_name not in _ORDERS:
        raise MeshError(f"its format is unknown: {format_name[:40]!r}")
    order = _ORDERS[format_name]
    try:
        rows = [np.dtype([(n, order + kind, size) for n, kind, size in f]) for f in fields]
    except ValueError:
        raise MeshError("a face lists its vertices twice") from None
    return format_name, [(*c, row) for c, row in zip(counts, rows, strict=True)], position


def _check_ascii(path: Path, position: int, elements: list[Element], vertices: int) -> None:
    words = path.read_bytes()[position:].split()
    first = 0
    for name, count, row in elements:
        sizes = [int(np.prod(row[field].shape)) for field in row.names or ()]
        width = sum(sizes)
        if first + count * width > len(words):
            raise MeshError(f"it is shorter than its {count} rows of {name!r}")
        if name == "face" and count and "faces" in (row.names or ()):
            offset = sum(sizes[: (row.names or ()).index("faces")])
            try:
                table = np.array(words[first : first + count * width], np.float64)
            except ValueError:
                raise MeshError("a face has values that are not numbers") from None
            _check_faces(table.reshape(count, width)[:, offset : offset + 3], vertices)
        first += count * width


def _check_faces(faces: npt.NDArray[np.generic], vertices: int) -> None:
    # Written so that NaN fails the comparison.
    if faces.size and not (faces.min() >= 0 and faces.max() < vertices):
        raise MeshError(
            f"its faces use vertices from {faces.min()} to {faces.max()}, of {vertices}"
        )


def check_serialized(path: Path, index: int) -> None:
    """Check mesh number `index` of a file in Mitsuba's own format. Raises MeshError."""
    data = path.read_bytes()
    try:
        version = struct.unpack_from("<2H", data)[1]
        has_wide_indices = version != 3
        count = struct.unpack_from("<I", data, len(data) - 4)[0]
        start = 0
        if index:
            size = 8 if has_wide_indices else 4
            start = int.from_bytes(data[-4 - size * (count - index) :][:size], "little")
        stream = zlib.decompressobj()
        mesh = stream.decompress(data[start + 4 :], MAX_UNPACKED)
        flags = struct.unpack_from("<I", mesh)[0]
        position = 4 if not has_wide_indices else mesh.index(b"\0", 4) + 1
        vertices, faces = struct.unpack_from("<2Q", mesh, position)
    except (struct.error, ValueError, zlib.error) as error:
        raise MeshError(str(error)) from None
    numbers = 3 + 3 * bool(flags & 1) + 2 * bool(flags & 2) + 3 * bool(flags & 8)
    position += 16 + vertices * numbers * (8 if flags & 0x2000 else 4)
    if vertices >= 2**32 or position + 12 * faces > len(mesh):
        raise MeshError(f"it is shorter than its {vertices} vertices and {faces} faces")
    _check_faces(np.frombuffer(mesh, "<u4", 3 * faces, position), vertices)
