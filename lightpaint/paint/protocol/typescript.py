"""TypeScript types of the protocol's messages, with which the page's scripts are checked.

    python -m lightpaint.paint.protocol.typescript

writes `page/engine/messages.d.ts`, which is not kept with the sources.
"""

import inspect
from collections.abc import Mapping
from dataclasses import MISSING, Field, fields, is_dataclass
from pathlib import Path
from types import UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

import numpy as np

from lightpaint.arrays import RGB
from lightpaint.paint.layers.layer_stack import Layer
from lightpaint.paint.protocol import Event, Request, answer_parts, message_parts
from lightpaint.paint.store.history_steps import Region

#: The file of types, beside the scripts that use them.
FILE = Path(__file__).parents[1] / "page" / "engine" / "messages.d.ts"

HEADER = """// Made by `python -m lightpaint.paint.protocol.typescript` of the dataclasses.

/** An array; float16 is the bits of halves in a Uint16Array.  */
export interface Picture {
  data: Uint8Array | Int16Array | Uint16Array | Float32Array | Float64Array;
  shape: number[];
}
export type RGB = [number, number, number];
/** Rows and columns of the picture, ends not included. */
export type Region = [top: number, bottom: number, left: number, right: number];
"""

#: Python aliases that have names of their own in TypeScript.
ALIASES = {RGB: "RGB", Region: "Region"}

PRIMITIVES = {str: "string", int: "number", float: "number", bool: "boolean", type(None): "null"}


def declarations() -> str:
    """Return the whole file."""
    records = [
        record
        for module in (message_parts, answer_parts)
        for record in vars(module).values()
        if _is_record_of(record, module)
    ]
    blocks = [HEADER, *(_interface(record, is_request=False) for record in records)]
    blocks += [_interface(record, is_request=False) for record in Event.kinds.values()]
    blocks += [_interface(record, is_request=True) for record in Request.kinds.values()]
    for name, comment, kinds in (
        ("Events", "Events from the session, by kind.", Event.kinds),
        ("Requests", "Fields of clients' requests, by kind.", Request.kinds),
    ):
        rows = "".join(f"  {kind}: {record.__name__};\n" for kind, record in kinds.items())
        blocks.append(f"/** {comment} */\nexport interface {name} {{\n{rows}}}\n")
    blocks.append("export type AnyEvent = Events[keyof Events];\n")
    return "\n".join(blocks)


def _is_record_of(value: Any, module: Any) -> bool:
    names = (module.__name__, Layer.__module__)
    return is_dataclass(value) and getattr(value, "__module__", "") in names


def _interface(record: type[Any], *, is_request: bool) -> str:
    """Return one interface. is_request: whether fields with a default may be left out."""
    hints = get_type_hints(record)
    arrays = [
        f"{one.name}{'?' if _is_optional(one) else ''}: Picture"
        for one in fields(record)
        if is_array(hints[one.name])
    ]
    lines = [f"  {name}: {kind};\n" for name, kind in field_types(record, is_request=is_request)]
    if record.__name__ in {one.__name__ for one in Event.kinds.values()}:
        lines.insert(0, f"  kind: '{record.kind}';\n  reply?: number;\n")
        lines.append(f"  arrays: {{ {'; '.join(arrays)} }};\n")
    comment_lines = (inspect.getdoc(record) or "").replace("*/", "* /").split("\n")
    comment = "/**\n" + "".join(f" * {line}".rstrip() + "\n" for line in comment_lines) + " */\n"
    return f"{comment}export interface {record.__name__} {{\n{''.join(lines)}}}\n"


def field_types(record: type[Any], *, is_request: bool = True) -> list[tuple[str, str]]:
    """Return name and type of each field that is not an array; `name?` for an optional one.

    is_request: whether fields with a default are optional.
    """
    hints, types = get_type_hints(record), []
    for entry in fields(record):
        if is_array(hints[entry.name]):
            continue
        is_event = record in Event.kinds.values() or not is_request
        is_optional = _is_optional(entry) or (not is_event and _has_default(entry))
        # Omitted if None; a request may give null nevertheless.
        hint = _without_none(hints[entry.name]) if _is_optional(entry) else hints[entry.name]
        types.append((f"{entry.name}?" if is_optional else entry.name, typescript_type(hint)))
    return types


def typescript_type(hint: Any) -> str:
    """Return the TypeScript type of a field's annotation."""
    if hint in ALIASES:
        return ALIASES[hint]
    outer, inner = get_origin(hint), get_args(hint)
    if hint in PRIMITIVES:
        return PRIMITIVES[hint]
    if outer is Literal:
        return " | ".join(f"'{value}'" for value in inner)
    if outer in (UnionType, Union):  # the latter has a literal
        return " | ".join(map(typescript_type, inner))
    if outer is tuple and inner[-1] is ...:
        item = typescript_type(inner[0])
        return f"({item})[]" if " | " in item and not item.endswith(">") else f"{item}[]"
    if outer is tuple:
        return f"[{', '.join(map(typescript_type, inner))}]"
    if outer is Mapping:
        return f"Record<{typescript_type(inner[0])}, {typescript_type(inner[1])}>"
    if hint in Event.kinds.values():  # nested messages have no kind
        return f"Omit<{hint.__name__}, 'kind' | 'arrays'>"
    return "any" if hint is Any else str(hint.__name__)


def is_array(hint: Any) -> bool:
    """Return whether an annotation is an array, or may be one."""
    return any(get_origin(one) is np.ndarray for one in (hint, *get_args(hint)))


def _without_none(hint: Any) -> Any:
    """Return `X` of `X | None`."""
    members = [one for one in get_args(hint) if one is not type(None)]
    union = members[0]
    for one in members[1:]:
        union = union | one
    return union


def _is_optional(entry: Field[Any]) -> bool:
    return bool(entry.metadata.get("is_optional"))


def _has_default(entry: Field[Any]) -> bool:
    return entry.default is not MISSING or entry.default_factory is not MISSING


if __name__ == "__main__":
    FILE.write_text(declarations(), encoding="utf-8")
