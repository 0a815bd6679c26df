"""Types of the protocol's messages for TypeScript, as the page's scripts are checked with them.

    python -m lightpaint.paint.protocol.typescript

writes `page/engine/messages.d.ts` anew after a change of the dataclasses.
"""

import inspect
from collections.abc import Mapping
from dataclasses import MISSING, Field, fields, is_dataclass
from pathlib import Path
from types import UnionType
from typing import Any, Literal, get_args, get_origin, get_type_hints

import numpy as np

from lightpaint.arrays import RGB
from lightpaint.paint.protocol import events, message_parts, requests
from lightpaint.paint.store.canvas_pixels import Region

#: Where the types lie, beside the scripts that use them.
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
    records = [one for one in vars(message_parts).values() if _is_record_of(one, message_parts)]
    made = [HEADER, *(_interface(one, is_request=False) for one in records)]
    made += [_interface(one, is_request=False) for one in events.EVENTS.values()]
    made += [_interface(one, is_request=True) for one in requests.REQUESTS.values()]
    for name, what, kinds in (
        ("Events", "Events from the session, by kind.", events.EVENTS),
        ("Requests", "Fields of clients' requests, by kind.", requests.REQUESTS),
    ):
        rows = "".join(f"  {kind}: {one.__name__};\n" for kind, one in kinds.items())
        made.append(f"/** {what} */\nexport interface {name} {{\n{rows}}}\n")
    made.append("export type AnyEvent = Events[keyof Events];\n")
    return "\n".join(made)


def _is_record_of(value: Any, module: Any) -> bool:
    return is_dataclass(value) and getattr(value, "__module__", "") == module.__name__


def _interface(record: type[Any], *, is_request: bool) -> str:
    """Return one interface. is_request: whether fields with a default may be left out."""
    hints = get_type_hints(record)
    found = [one.name for one in fields(record) if get_origin(hints[one.name]) is np.ndarray]
    arrays = [f"{name}: Picture" for name in found]
    lines = [f"  {name}: {kind};\n" for name, kind in field_types(record, is_request=is_request)]
    if record.__name__ in {one.__name__ for one in events.EVENTS.values()}:
        lines.insert(0, f"  kind: '{record.kind}';\n  reply?: number;\n")
        lines.append(f"  arrays: {{ {'; '.join(arrays)} }};\n")
    said = (inspect.getdoc(record) or "").replace("*/", "* /").split("\n")
    comment = "/**\n" + "".join(f" * {line}".rstrip() + "\n" for line in said) + " */\n"
    return f"{comment}export interface {record.__name__} {{\n{''.join(lines)}}}\n"


def field_types(record: type[Any], *, is_request: bool = True) -> list[tuple[str, str]]:
    """Return name and type of each field that is no array; `name?` for one that may be left out.

    is_request: whether those with a default may.
    """
    hints, made = get_type_hints(record), []
    for one in fields(record):
        if get_origin(hints[one.name]) is np.ndarray:
            continue
        is_told = record in events.EVENTS.values() or not is_request
        may_lack = _is_optional(one) or (not is_told and _has_default(one))
        # Left out where it is None; a request may give null all the same.
        hint = _without_none(hints[one.name]) if _is_optional(one) else hints[one.name]
        made.append((f"{one.name}?" if may_lack else one.name, typescript_type(hint)))
    return made


def typescript_type(hint: Any) -> str:
    """Return the TypeScript type of a field's annotation."""
    if hint in ALIASES:
        return ALIASES[hint]
    outer, inner = get_origin(hint), get_args(hint)
    if hint in PRIMITIVES:
        return PRIMITIVES[hint]
    if outer is Literal:
        return " | ".join(f"'{value}'" for value in inner)
    if outer is UnionType:
        return " | ".join(map(typescript_type, inner))
    if outer is tuple and inner[-1] is ...:
        item = typescript_type(inner[0])
        return f"({item})[]" if " | " in item and not item.endswith(">") else f"{item}[]"
    if outer is tuple:
        return f"[{', '.join(map(typescript_type, inner))}]"
    if outer is Mapping:
        return f"Record<{typescript_type(inner[0])}, {typescript_type(inner[1])}>"
    if hint in events.EVENTS.values():  # within another message it has no kind of its own
        return f"Omit<{hint.__name__}, 'kind' | 'arrays'>"
    return "any" if hint is Any else str(hint.__name__)


def _without_none(hint: Any) -> Any:
    """Return `X` of `X | None`."""
    kept = [one for one in get_args(hint) if one is not type(None)]
    made = kept[0]
    for one in kept[1:]:
        made = made | one
    return made


def _is_optional(one: Field[Any]) -> bool:
    return bool(one.metadata.get("is_optional"))


def _has_default(one: Field[Any]) -> bool:
    return one.default is not MISSING or one.default_factory is not MISSING


if __name__ == "__main__":
    FILE.write_text(declarations(), encoding="utf-8")
