"""What page and session say to each other: typed messages, with arrays beside them.

A message is an object of JSON, whose `kind` names it, and a list of buffers. In a notebook the
two travel as they are; on a socket they are one binary frame:

    uint32 length of the JSON, little endian | JSON | padding to 8 bytes | buffers, each padded

`buffers` in the JSON says what they are: `[{"name": ..., "dtype": ..., "shape": [...]}, ...]`.

The page numbers its messages (`seq`), and every one of them is answered by one that gives the
number back (`reply`), errors included: the page keeps one stroke in flight, and the newest wins.
Lights and objects are known by their place in what `state` lists. A region is rows and columns of
the picture, `[top, bottom, left, right]`, the ends not included. Colours are linear Rec.709.

Pictures are fetched, and not sent: `resources` in `state` and `renewed` say which there are.
"""

import json
import math
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from lightpaint.errors import PaintError
from lightpaint.files import one_line
from lightpaint.records import read_record, strict_json

#: Of this protocol; a page of another one is told to load itself anew.
VERSION = 1

#: Longest frame that is read, in bytes, and longest JSON in it.
MAX_FRAME, MAX_TEXT = 2**28, 2**20

#: What buffers may hold.
DTYPES = {"float16": "<f2", "float32": "<f4", "float64": "<f8", "int16": "<i2", "uint8": "|u1"}

Arrays = Mapping[str, npt.NDArray[Any]]
Region: TypeAlias = tuple[int, int, int, int]


@dataclass(frozen=True)
class Hello:
    """The first message of a page, and again after a dropped connection. Answered by `state`, or
    by `waiting` while there is no picture yet; `state` then comes as soon as there is one.
    """

    version: int


@dataclass(frozen=True)
class Paint:
    """Pixels under the brush; with arrays `image` (rows, columns, 3) float32 and `importance`
    (rows, columns) float32. Answered by `answer`.

    stroke: number of the stroke, which the page counts. done: whether the brush has left the
    picture with it: only then is the stroke kept. label: what undo calls it.
    """

    stroke: int
    region: Region
    done: bool = False
    label: str = "stroke"


@dataclass(frozen=True)
class Drop:
    """Forget the stroke that is not done. Answered by `patch`."""

    stroke: int


@dataclass(frozen=True)
class Undo:
    """Take the last step back, of paint or of what is asked. Answered by `patch`."""


@dataclass(frozen=True)
class Redo:
    """Do again what was taken back. Answered by `patch`."""


@dataclass(frozen=True)
class Ask:
    """What is asked of one light from now on; nothing frees it. Answered by `answer`.

    asked: keys and values as in a lights file: lock, off, limits, color, kelvin, duv, primaries.
    done: whether it is kept; false while a slider moves.
    """

    light: int
    asked: Mapping[str, Any]
    done: bool = True


@dataclass(frozen=True)
class Tie:
    """Which lights are on one dimmer: all such groups, of names. Answered by `answer`."""

    ties: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class Set:
    """How the painting is answered, as of `Fit`. Answered by `answer`.

    values: of hold, space, colors, literal, prefer_current, sparse; null for what follows from
    the painting.
    """

    values: Mapping[str, Any]


@dataclass(frozen=True)
class SaveLook:
    """Keep painting and answer under a name. Answered by `looks`."""

    name: str


@dataclass(frozen=True)
class LoadLook:
    """Go on from a look; a step that can be undone. Answered by `patch`."""

    look: int


@dataclass(frozen=True)
class RenameLook:
    """Answered by `looks`."""

    look: int
    name: str


@dataclass(frozen=True)
class CopyLook:
    """Answered by `looks`."""

    look: int


@dataclass(frozen=True)
class MixLooks:
    """Keep what lies between two looks: a look whose lights are held at the share `part` of the way
    from the first to the second. Answered by `looks`.
    """

    first: int
    second: int
    part: float
    name: str


@dataclass(frozen=True)
class DropLook:
    """Answered by `looks`."""

    look: int


@dataclass(frozen=True)
class Export:
    """Write results to the folder of the session. Answered by `exported`."""

    what: tuple[Literal["target", "lighting", "relit", "report"], ...]


@dataclass(frozen=True)
class Verify:
    """Render the answer, or stop that. Answered by `progress`, later by `verified`."""

    run: bool = True


@dataclass(frozen=True)
class Explain:
    """Why it is not closer: answered by `explained`, with the picture `beyond`."""


@dataclass(frozen=True)
class TakeOver:
    """Go on here, and not on the page that has the session. Answered by `state`."""


@dataclass(frozen=True)
class Fetch:
    """Where there is no HTTP: answered by `fetched`, with the picture as its array."""

    name: str


#: What a page may say, by kind.
Said = (
    Hello
    | Paint
    | Drop
    | Undo
    | Redo
    | Ask
    | Tie
    | Set
    | SaveLook
    | LoadLook
    | RenameLook
    | CopyLook
    | MixLooks
    | DropLook
    | Export
    | Verify
    | Explain
    | TakeOver
    | Fetch
)

KINDS: Mapping[str, type[Any]] = {
    "hello": Hello,
    "paint": Paint,
    "drop": Drop,
    "undo": Undo,
    "redo": Redo,
    "ask": Ask,
    "tie": Tie,
    "set": Set,
    "save_look": SaveLook,
    "load_look": LoadLook,
    "rename_look": RenameLook,
    "copy_look": CopyLook,
    "mix_looks": MixLooks,
    "drop_look": DropLook,
    "export": Export,
    "verify": Verify,
    "explain": Explain,
    "take_over": TakeOver,
    "fetch": Fetch,
}


@dataclass(frozen=True)
class Message:
    """One message of a session to its page: kind, fields for the JSON, arrays."""

    kind: str
    fields: Mapping[str, Any] = field(default_factory=dict)
    arrays: Arrays = field(default_factory=dict)

    def content(self, reply: int | None = None) -> dict[str, Any]:
        """The JSON of it. reply: number of what it answers."""
        made: dict[str, Any] = {"kind": self.kind, **_plain(self.fields)}
        if reply is not None:
            made["reply"] = reply
        made["buffers"] = [
            {"name": name, "dtype": _dtype(array), "shape": list(array.shape)}
            for name, array in self.arrays.items()
        ]
        return made

    def buffers(self) -> list[bytes]:
        """The arrays as bytes, little endian, in order."""
        return [
            np.ascontiguousarray(array, DTYPES[_dtype(array)]).tobytes()
            for array in self.arrays.values()
        ]


def to_frame(content: Mapping[str, Any], buffers: Sequence[bytes]) -> bytes:
    """One binary frame."""
    # Names of files that are not UTF-8 stand in Python's text as halves of pairs.
    text = json.dumps(content, ensure_ascii=False, allow_nan=False).encode("utf-8", "replace")
    parts = [struct.pack("<I", len(text)), text, b"\0" * (-(4 + len(text)) % 8)]
    for buffer in buffers:
        parts += [buffer, b"\0" * (-len(buffer) % 8)]
    return b"".join(parts)


def of_frame(frame: bytes) -> tuple[dict[str, Any], list[memoryview]]:
    """JSON and buffers of a binary frame. Raises PaintError for what is none."""
    if len(frame) > MAX_FRAME:
        raise PaintError(f"a frame of {len(frame)} bytes: at most {MAX_FRAME} are taken")
    if len(frame) < 4:
        raise PaintError("a frame without a message")
    (length,) = struct.unpack_from("<I", frame)
    if length > min(MAX_TEXT, len(frame) - 4):
        raise PaintError(f"a frame that speaks of {length} bytes of JSON and has fewer")
    content = _json(bytes(frame[4 : 4 + length]))
    rest, at, buffers = memoryview(frame), 4 + length + -(4 + length) % 8, []
    for shape, kind in _described(content):
        size = math.prod(shape) * np.dtype(kind).itemsize
        if at + size > len(frame):
            raise PaintError("a frame that is shorter than its buffers")
        buffers.append(rest[at : at + size])
        at += size + -size % 8
    return content, buffers


def said_of(
    content: Mapping[str, Any], buffers: Sequence[bytes | memoryview]
) -> tuple[int, Said, dict[str, npt.NDArray[Any]]]:
    """What a page says: its number, the message, its arrays. Raises PaintError for anything else.

    The arrays are finite, and cannot be written to.
    """
    kind, seq = content.get("kind"), content.get("seq")
    if not (isinstance(kind, str) and kind in KINDS):
        raise PaintError(f"no message is called {str(kind)[:40]!r}")
    if not (type(seq) is int and 0 <= seq < 2**53):
        raise PaintError("a message without its number")
    plain = {k: v for k, v in content.items() if k not in ("kind", "seq", "buffers")}
    try:
        said = read_record(KINDS[kind], plain)
    except ValueError as error:
        raise PaintError(one_line(f"{kind}: {error}")) from None
    described = _described(content)
    if len(described) != len(buffers):
        raise PaintError(f"{kind}: {len(buffers)} buffers, not {len(described)} as it says")
    arrays = {}
    for about, (shape, dtype), buffer in zip(
        content.get("buffers", ()), described, buffers, strict=True
    ):
        if len(buffer) != math.prod(shape) * np.dtype(dtype).itemsize:
            raise PaintError(f"{kind}: {len(buffer)} bytes are no array of shape {list(shape)}")
        array = np.frombuffer(buffer, dtype).reshape(shape)
        if array.dtype.kind == "f" and not np.isfinite(array).all():
            raise PaintError(f"{kind}: {about['name']} holds NaN or Inf")
        array.flags.writeable = False
        arrays[about["name"]] = array
    return seq, said, arrays


def _json(text: bytes) -> dict[str, Any]:
    try:
        content = strict_json(text.decode())
    except (ValueError, UnicodeDecodeError) as error:
        raise PaintError(one_line(f"a message that is no JSON: {error}")) from None
    if not isinstance(content, dict):
        raise PaintError("a message that is no object")
    return content


def _described(content: Mapping[str, Any]) -> list[tuple[tuple[int, ...], str]]:
    """Shape and dtype of each buffer that a message speaks of."""
    listed, found, names = content.get("buffers", []), [], set[str]()
    if not (isinstance(listed, list) and len(listed) <= 16):
        raise PaintError("buffers are a list of at most 16")
    for about in listed:
        if not (isinstance(about, dict) and isinstance(about.get("name"), str)):
            raise PaintError("a buffer without a name")
        if about["name"] in names:
            raise PaintError(f"two buffers are called {about['name'][:40]!r}")
        names.add(about["name"])
        shape, dtype = about.get("shape"), about.get("dtype")
        if not (isinstance(dtype, str) and dtype in DTYPES):
            raise PaintError(f"a buffer of {str(dtype)[:40]!r}: expected {', '.join(DTYPES)}")
        is_shape = isinstance(shape, list) and len(shape) <= 4
        if not (is_shape and all(type(n) is int and 0 <= n <= 2**16 for n in shape or ())):
            raise PaintError(f"a buffer of shape {str(shape)[:40]}")
        found.append((tuple(shape or ()), DTYPES[dtype]))
    return found


def _dtype(array: npt.NDArray[Any]) -> str:
    name = array.dtype.name
    return name if name in DTYPES else {"bool": "uint8"}.get(name, "float32")


def _plain(value: Any) -> Any:
    """Without what JSON has no word for: NaN and Inf are null."""
    if isinstance(value, Mapping):
        return {str(key): _plain(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
