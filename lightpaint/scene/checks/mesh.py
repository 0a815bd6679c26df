"""Whether a mesh file is as long as it says, and its faces only name vertices that it has.

Mitsuba takes both on trust, and the process ends where they are not so. What it refuses by itself
(other faces than triangles, unknown types) is left to it.
"""

import struct
import zlib
from pathlib import Path

import numpy as np
import numpy.typing as npt

#: Longest head of a PLY, in bytes.
MAX_HEAD = 2**16
#: Longest mesh that is unpacked, in bytes.
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

#: Name, number of rows and the type of a row, of which `face` has a field `faces`.
Element = tuple[str, int, np.dtype[np.void]]


class MeshError(Exception):
    """What is wrong with a mesh, without the name of its file."""


def check_ply(path: Path) -> None:
    """Raises MeshError."""
    length = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(MAX_HEAD)
    form, elements, at = _ply_head(head)
    vertices = next((count for name, count, _ in elements if name == "vertex"), 0)
    if form == "ascii":
        _check_ascii(path, at, elements, vertices)
        return
    for name, count, row in elements:
        if at + count * row.itemsize > length:
            raise MeshError(f"it is shorter than its {count} rows of {name!r}")
        if name == "face" and count and "faces" in (row.names or ()):
            table = np.memmap(path, row, "r", at, (count,))
            # Other lists than of three Mitsuba refuses.
            if (table["sides"] == 3).all():
                _check_faces(table["faces"], vertices)
        at += count * row.itemsize


def _ply_head(head: bytes) -> tuple[str, list[Element], int]:
    """(format, elements, where the rows begin)."""
    form, at, found = "", 0, False
    counts: list[tuple[str, int]] = []
    fields: list[list[tuple[str, str, tuple[int, ...]]]] = []
    while not found:
        end = head.find(b"\n", at)
        if end < 0 or (at == 0 and head[:end].split() != [b"ply"]):
            raise MeshError("it does not have the head of a PLY")
        words = head[at:end].decode("latin-1").split()
        at = end + 1
        match words:
            case ["format", name, *_]:
                form = name
            case ["element", name, count] if count.isascii() and count.isdigit():
                counts.append((name, int(count[:20])))
                fields.append([])
            case ["property", "list", sides, kind, name] if fields and {sides, kind} <= {*_TYPES}:
                # As Mitsuba reads them, all lists have three entries.
                names = ("sides", "faces") if name in _INDICES else (f"#{at}", f"list{at}")
                fields[-1] += [(names[0], _TYPES[sides], ()), (names[1], _TYPES[kind], (3,))]
            case ["property", kind, _] if fields and kind in _TYPES:
                fields[-1].append((f"field{at}", _TYPES[kind], ()))
            case ["end_header"]:
                found = True
            case ["ply"] | ["comment", *_] | ["obj_info", *_] | []:
                pass
            case _:
                raise MeshError(f"its head has the line {' '.join(words)[:80]!r}")
    if form not in _ORDERS:
        raise MeshError(f"it is of no known format, {form[:40]!r}")
    order = _ORDERS[form]
    try:
        rows = [np.dtype([(n, order + kind, size) for n, kind, size in f]) for f in fields]
    except ValueError:
        raise MeshError("a face has its vertices twice") from None
    return form, [(*c, row) for c, row in zip(counts, rows, strict=True)], at


def _check_ascii(path: Path, at: int, elements: list[Element], vertices: int) -> None:
    words = path.read_bytes()[at:].split()
    first = 0
    for name, count, row in elements:
        sizes = [int(np.prod(row[field].shape)) for field in row.names or ()]
        width = sum(sizes)
        if first + count * width > len(words):
            raise MeshError(f"it is shorter than its {count} rows of {name!r}")
        if name == "face" and count and "faces" in (row.names or ()):
            behind = sum(sizes[: (row.names or ()).index("faces")])
            try:
                table = np.array(words[first : first + count * width], np.float64)
            except ValueError:
                raise MeshError("a face has something else than numbers") from None
            _check_faces(table.reshape(count, width)[:, behind : behind + 3], vertices)
        first += count * width


def _check_faces(faces: npt.NDArray[np.generic], vertices: int) -> None:
    # A comparison that NaN fails.
    if faces.size and not (faces.min() >= 0 and faces.max() < vertices):
        raise MeshError(
            f"its faces name vertices from {faces.min()} to {faces.max()}, of {vertices}"
        )


def check_serialized(path: Path, index: int) -> None:
    """Mesh number `index` of a file in Mitsuba's own format. Raises MeshError."""
    data = path.read_bytes()
    try:
        version = struct.unpack_from("<2H", data)[1]
        wide = version != 3
        count = struct.unpack_from("<I", data, len(data) - 4)[0]
        start = 0
        if index:
            size = 8 if wide else 4
            start = int.from_bytes(data[-4 - size * (count - index) :][:size], "little")
        stream = zlib.decompressobj()
        mesh = stream.decompress(data[start + 4 :], MAX_UNPACKED)
        flags = struct.unpack_from("<I", mesh)[0]
        at = 4 if not wide else mesh.index(b"\0", 4) + 1
        vertices, faces = struct.unpack_from("<2Q", mesh, at)
    except (struct.error, ValueError, zlib.error) as error:
        raise MeshError(str(error)) from None
    numbers = 3 + 3 * bool(flags & 1) + 2 * bool(flags & 2) + 3 * bool(flags & 8)
    at += 16 + vertices * numbers * (8 if flags & 0x2000 else 4)
    if vertices >= 2**32 or at + 12 * faces > len(mesh):
        raise MeshError(f"it is shorter than its {vertices} vertices and {faces} faces")
    _check_faces(np.frombuffer(mesh, "<u4", 3 * faces, at), vertices)
