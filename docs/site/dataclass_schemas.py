"""JSON schemas of dataclasses, and of the values of their annotations."""

from collections.abc import Mapping, Sequence
from dataclasses import MISSING, fields, is_dataclass
from types import NoneType
from typing import Any, Literal, get_args, get_origin, get_type_hints

import numpy as np
from docstring_fields import described_fields

from lightpaint.storage.json_records import UNIONS

Schema = dict[str, Any]

_PLAIN: dict[Any, Schema] = {
    Any: {},
    str: {"type": "string"},
    bool: {"type": "boolean"},
    float: {"type": "number"},
    int: {"type": "integer"},
    NoneType: {"type": "null"},
}


def schema_of(kind: Any, *left_out: str) -> Schema:
    """Return the schema of a dataclass, described by its docstring, without the fields `left_out`.

    Arrays of messages are buffers beside the JSON (docs/protocol.md), and stand in no schema.
    """
    hints = get_type_hints(kind)
    shown = [x for x in fields(kind) if x.name not in left_out and not _is_array(hints[x.name])]
    required = [x.name for x in shown if x.default is MISSING and x.default_factory is MISSING]
    schema: Schema = {"type": "object"}
    text, meanings = described_fields(kind)
    if text:
        schema["description"] = text[0]
    schema["properties"] = {
        x.name: value_schema(hints[x.name])
        | ({"description": meanings[x.name]} if x.name in meanings else {})
        for x in shown
    }
    return {**schema, "required": required} if required else schema


def _is_array(kind: Any) -> bool:
    return get_origin(kind) is np.ndarray or any(map(_is_array, get_args(kind)))


def value_schema(kind: Any) -> Schema:
    """Return the schema of values of an annotation."""
    outer, inner = get_origin(kind), get_args(kind)
    if kind in _PLAIN:
        return dict(_PLAIN[kind])
    if outer is Literal:
        return {"enum": list(inner)}
    if outer in UNIONS:
        return {"anyOf": [value_schema(x) for x in inner]}
    if outer is Mapping or outer is dict:
        return {"type": "object", "additionalProperties": value_schema(inner[1])}
    if outer in (Sequence, list) or (outer is tuple and inner[-1:] == (...,)):
        return {"type": "array", "items": value_schema(inner[0])}
    if outer is tuple:
        return list_of([value_schema(x) for x in inner])
    if isinstance(kind, type) and is_dataclass(kind):
        return schema_of(kind)
    if isinstance(kind, type) and issubclass(kind, str):
        return {"type": "string"}
    raise TypeError(f"no schema for {kind!r}")


def list_of(values: list[Schema]) -> Schema:
    return {
        "type": "array",
        "prefixItems": values,
        "minItems": len(values),
        "maxItems": len(values),
    }
