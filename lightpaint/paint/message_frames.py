"""Messages between page and session as JSON and bytes.

A message is an object of JSON, whose `kind` names it, and a list of buffers. In a notebook the two
travel separately; on a socket they are one binary frame:

    uint32 length of the JSON, little endian | JSON | padding to 8 bytes | buffers, each padded

`buffers` in the JSON describes them: `[{"name": ..., "dtype": ..., "shape": [...]}, ...]`.
"""

import json
import math
import struct
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.errors import PaintError
from lightpaint.files import one_line
from lightpaint.paint.protocol import VERSION, Request
from lightpaint.paint.protocol.base import DTYPES
from lightpaint.storage.json_records import read_record, strict_json

#: Maximum size in bytes of a frame, and of the JSON in it.
MAX_FRAME, MAX_TEXT = 2**28, 2**20

#: Maximum length of a text in a message, in characters, and of a list or an object.
MAX_CHARACTERS, MAX_VALUES = 1000, 4096


def to_frame(content: Mapping[str, Any], buffers: Sequence[bytes]) -> bytes:
    """Return JSON and buffers as one binary frame."""
    # Python represents file names that are not UTF-8 by lone surrogates.
    text = json.dumps(content, ensure_ascii=False, allow_nan=False).encode("utf-8", "replace")
    parts = [struct.pack("<I", len(text)), text, b"\0" * (-(4 + len(text)) % 8)]
    for buffer in buffers:
        parts += [buffer, b"\0" * (-len(buffer) % 8)]
    return b"".join(parts)


def from_frame(frame: bytes) -> tuple[dict[str, Any], list[memoryview]]:
    """Return the JSON and buffers of a binary frame. Raises PaintError for anything else."""
    if len(frame) > MAX_FRAME:
        raise PaintError(f"a frame of {len(frame)} bytes: at most {MAX_FRAME} are taken")
    if len(frame) < 4:
        raise PaintError("a frame without a message")
    (length,) = struct.unpack_from("<I", frame)
    if length > min(MAX_TEXT, len(frame) - 4):
        raise PaintError(f"a frame that speaks of {length} bytes of JSON and has fewer")
    text = bytes(frame[4 : 4 + length])
    try:
        content = strict_json(text.decode())
    except (ValueError, UnicodeDecodeError) as error:
        raise PaintError(one_line(f"a message that is not JSON: {error}")) from None
    if not isinstance(content, dict):
        raise PaintError("a message that is not an object")
    view, position, buffers = memoryview(frame), 4 + length + -(4 + length) % 8, []
    for shape, kind in _buffer_types(content):
        size = math.prod(shape) * np.dtype(kind).itemsize
        if position + size > len(frame):
            raise PaintError("a frame that is shorter than its buffers")
        buffers.append(view[position : position + size])
        position += size + -size % 8
    return content, buffers


def is_other_version(content: Mapping[str, Any]) -> bool:
    """Return whether this is the first message of a page of another version."""
    version = content.get("version")
    return (
        content.get("kind") in ("hello", "observe") and type(version) is int and version != VERSION
    )


def parse_request(
    content: Mapping[str, Any], buffers: Sequence[bytes | memoryview]
) -> tuple[int, Request, dict[str, npt.NDArray[Any]]]:
    """Return the number, the message and the arrays of a request.

    The arrays are finite and read-only. Raises PaintError for anything else.
    """
    kind, seq = content.get("kind"), content.get("seq")
    if not (isinstance(kind, str) and kind in Request.kinds):
        raise PaintError(f"no message is called {str(kind)[:40]!r}")
    if not (type(seq) is int and 0 <= seq < 2**53):
        raise PaintError("a message without its number")
    plain = {k: v for k, v in content.items() if k not in ("kind", "seq", "buffers")}
    _check_lengths(kind, plain)
    try:
        request = read_record(Request.kinds[kind], plain)
    except ValueError as error:
        raise PaintError(one_line(f"{kind}: {error}")) from None
    buffer_types = _buffer_types(content)
    if len(buffer_types) != len(buffers):
        raise PaintError(f"{kind}: {len(buffers)} buffers, not {len(buffer_types)} as it says")
    arrays = {}
    for description, (shape, dtype), buffer in zip(
        content.get("buffers", ()), buffer_types, buffers, strict=True
    ):
        if len(buffer) != math.prod(shape) * np.dtype(dtype).itemsize:
            raise PaintError(f"{kind}: {len(buffer)} bytes are not an array of shape {list(shape)}")
        array = np.frombuffer(buffer, dtype).reshape(shape)
        if array.dtype.kind == "f" and not np.isfinite(array).all():
            raise PaintError(f"{kind}: {description['name']} holds NaN or Inf")
        array.flags.writeable = False
        arrays[description["name"]] = array
    return seq, request, arrays


def _check_lengths(kind: str, value: Any) -> None:
    """Raise PaintError for longer texts or lists than any page sends."""
    if isinstance(value, str) and len(value) > MAX_CHARACTERS:
        raise PaintError(
            f"{kind}: a text of {len(value)} characters, and at most {MAX_CHARACTERS} are taken"
        )
    if isinstance(value, list | dict):
        if len(value) > MAX_VALUES:
            raise PaintError(
                f"{kind}: a list of {len(value)} values, and at most {MAX_VALUES} are taken"
            )
        for item in [*value, *value.values()] if isinstance(value, dict) else value:
            _check_lengths(kind, item)


def _buffer_types(content: Mapping[str, Any]) -> list[tuple[tuple[int, ...], str]]:
    """Return shape and dtype of each buffer that a message lists."""
    listed, types, names = content.get("buffers", []), [], set[str]()
    if not (isinstance(listed, list) and len(listed) <= 16):
        raise PaintError("buffers are a list of at most 16")
    for description in listed:
        if not (isinstance(description, dict) and isinstance(description.get("name"), str)):
            raise PaintError("a buffer without a name")
        if description["name"] in names:
            raise PaintError(f"two buffers are called {description['name'][:40]!r}")
        names.add(description["name"])
        shape, dtype = description.get("shape"), description.get("dtype")
        if not (isinstance(dtype, str) and dtype in DTYPES):
            raise PaintError(f"a buffer of {str(dtype)[:40]!r}: expected {', '.join(DTYPES)}")
        is_shape = isinstance(shape, list) and len(shape) <= 4
        if not (is_shape and all(type(n) is int and 0 <= n <= 2**16 for n in shape or ())):
            raise PaintError(f"a buffer of shape {str(shape)[:40]}")
        types.append((tuple(shape or ()), DTYPES[dtype]))
    return types
