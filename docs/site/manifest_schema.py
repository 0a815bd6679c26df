"""The JSON schema of a batch's manifest, looks.toml, made of the checks that read it.

A check is a function and the text of its expectation. The kind of a value stands here, by key; its
bounds are those of the text. A key of the code without a kind here ends the build.
"""

import re
from collections.abc import Iterable, Mapping
from types import NoneType
from typing import Any, get_args, get_type_hints

from dataclass_schemas import Schema, value_schema

from lightpaint.batch.manifest.checks import CONSTRAINT_KEYS
from lightpaint.batch.manifest.keys import (
    DEFAULT_KEYS,
    FINAL_KEYS,
    HANDOVER_KEYS,
    LIGHTING_STEPS,
    LOOK_KEYS,
    SEQUENCE_KEYS,
    SETTINGS,
    SUBJECT_KEYS,
    SWITCH,
    TEXT,
    TEXTS,
    Share,
    Space,
    Step,
)
from lightpaint.batch.manifest.variations import VARIATIONS
from lightpaint.lighting.constraints.constraints import LIGHT_KEYS
from lightpaint.pipeline.job.settings import Settings
from lightpaint.relit.export_formats import FORMS
from lightpaint.target.target_reader import Paint
from lightpaint.validation import MAX_LISTED, Check

_TEXT: Schema = {"type": "string", "minLength": 1}
_TEXTS: Schema = {"type": "array", "items": _TEXT, "minItems": 1, "maxItems": MAX_LISTED}
_WHOLE: Schema = {"type": "integer"}
_LEVEL: Schema = {"type": "number", "minimum": 0}
_EMISSION: Schema = {"type": "array", "items": _LEVEL, "minItems": 3, "maxItems": 3}

#: Bounds in the text of an expectation, and their keywords.
_BOUNDS = {
    r">= (\d[^\s,]*)": "minimum",
    r"at least (\S+)": "minimum",
    r"> (\d[^\s,]*)": "exclusiveMinimum",
    r"at most (\S+)": "maximum",
    r"less than (\S+)": "exclusiveMaximum",
}


def manifest_schema() -> Schema:
    """Return the schema of a manifest, of its values in JSON."""
    look = _table(LOOK_KEYS, _look_kinds())
    look["description"] = f"A look, with one of {', '.join(SUBJECT_KEYS)}."
    sequence = _table(SEQUENCE_KEYS, _sequence_kinds())
    sequence["description"] = "Frames between looks, or along a path of sensors."
    properties = {
        "defaults": _table(DEFAULT_KEYS, _look_kinds()),
        "look": {"type": "array", "items": look, "minItems": 1},
        "sequence": {"type": "array", "items": {**sequence, "required": ["name", "through"]}},
    }
    return {**_closed(properties), "required": ["look"]}


def _look_kinds() -> dict[str, Schema]:
    """Return the kinds of values of those keys of looks that are no texts or switches."""
    constraints = _closed(
        {
            "light": _table_of(_closed({key: {} for key in LIGHT_KEYS})),
            "tie": {"type": "array"},
            "prefer_current": _LEVEL,
            "sparse": {"type": "integer", "minimum": 1},
            "start": _table_of(_EMISSION),
            "near": _LEVEL,
        }
    )
    if set(constraints["properties"]) != set(CONSTRAINT_KEYS):
        raise TypeError(f"the schema of constraints has other keys than {CONSTRAINT_KEYS}")
    hints = get_type_hints(Settings)
    settings = {name: _bounded(_kind(hints[name]), Settings.expected[name]) for name in SETTINGS}
    texts_by_name = {**_table_of(_TEXT), "minProperties": 1}
    return {
        "sensor": {"anyOf": [_TEXT, _WHOLE]},
        "parameters": {**_table_of({"type": ["string", "number", "boolean"]}), "minProperties": 1},
        "groups": {**_table_of(_TEXTS), "minProperties": 1},
        "split": texts_by_name,
        "views": texts_by_name,
        "exposure": {"type": "number"},
        "paint": value_schema(Paint),
        "constraints": {"anyOf": [constraints, _TEXT]},
        "settings": _closed(settings),
        "want": _some_of(get_args(Step)),
        "variations": {**_some_of(VARIATIONS), "minItems": 0},
        "share": value_schema(Share),
        **_step_tables(),
    }


def _sequence_kinds() -> dict[str, Schema]:
    return {
        "through": _TEXTS,
        "frames": _WHOLE,
        "space": value_schema(Space),
        "want": _some_of(LIGHTING_STEPS),
        **_step_tables(),
    }


def _step_tables() -> dict[str, Schema]:
    return {
        "render": _table(FINAL_KEYS, {"spp": _WHOLE, "seed": _WHOLE}),
        "export": _table(HANDOVER_KEYS, {"to": _some_of(FORMS)}),
    }


def _table(keys: Mapping[str, Check], kinds: Mapping[str, Schema]) -> Schema:
    """Return the schema of a table with some of these keys. Raises KeyError for an unknown one."""
    known = {id(TEXT): _TEXT, id(TEXTS): _TEXTS, id(SWITCH): {"type": "boolean"}}
    return _closed(
        {
            key: _bounded(known[id(check)] if id(check) in known else kinds[key], check)
            for key, check in keys.items()
        }
    )


def _bounded(schema: Schema, check: Check) -> Schema:
    """Return a schema with the text of an expectation, and with the bounds in it."""
    text = check[1]
    if schema.get("type") not in ("integer", "number"):
        return {**schema, "description": text}
    bounds = {
        keyword: float(match[1]) if "." in match[1] or "e" in match[1] else int(match[1])
        for pattern, keyword in _BOUNDS.items()
        if (match := re.search(pattern, text))
    }
    return {**schema, "description": text, **bounds}


def _kind(hint: Any) -> Schema:
    """Return the schema of an annotation; TOML has nothing for None."""
    kinds = [kind for kind in get_args(hint) if kind is not NoneType]
    return value_schema(kinds[0] if NoneType in get_args(hint) else hint)


def _some_of(words: Iterable[str]) -> Schema:
    items = {"enum": [*words]}
    return {"type": "array", "items": items, "minItems": 1, "uniqueItems": True}


def _table_of(values: Schema) -> Schema:
    return {"type": "object", "additionalProperties": values}


def _closed(properties: Mapping[str, Schema]) -> Schema:
    return {"type": "object", "properties": dict(properties), "additionalProperties": False}
