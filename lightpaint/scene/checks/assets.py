"""Checks of the files that a scene refers to, before Mitsuba reads them.

Mitsuba's own readers wait forever for a pipe, crash on a damaged OpenEXR file or mesh, and allocate
as much memory as a header declares.
"""

import struct
from pathlib import Path
from typing import Any

from lightpaint.errors import ImageError, SceneError
from lightpaint.file_reading import file_length
from lightpaint.files import one_line
from lightpaint.images.formats.exr import read_parts
from lightpaint.scene.checks.mesh import MeshError, check_ply, check_serialized

#: Maximum size in bytes of a file that is read.
MAX_ASSET = 2**32

#: A picture is not decoded if its declared size in bytes, at four per pixel, exceeds both MAX_BYTES
#: and MAX_COMPRESSION times the size of its file.
MAX_BYTES = 2**29
MAX_COMPRESSION = 1000


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
            read_parts(path)
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
