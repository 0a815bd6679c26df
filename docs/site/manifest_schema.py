"""The JSON schema of a batch's manifest, looks.toml, made of the checks that read it.

A check has the schema of the values that it takes. Only tables with keys of their own stand here.
"""

from collections.abc import Mapping
from typing import get_args

from dataclass_schemas import Schema

from lightpaint.batch.manifest.checks import CONSTRAINT_KEYS
from lightpaint.batch.manifest.keys import (
    DEFAULT_KEYS,
    FINAL_KEYS,
    HANDOVER_KEYS,
    LOOK_KEYS,
    SEQUENCE_KEYS,
    SETTINGS,
    SUBJECT_KEYS,
)
from lightpaint.colour import Preference
from lightpaint.lighting.constraints.constraint_table import LIGHT_KEYS
from lightpaint.validation import Check

_TEXT: Schema = {"type": "string", "minLength": 1}
_LEVEL: Schema = {"type": "number", "minimum": 0}
_EMISSION: Schema = {"type": "array", "items": _LEVEL, "minItems": 3, "maxItems": 3}


def manifest_schema() -> Schema:
    """Return the schema of a manifest, of its values in JSON."""
    look = _table(LOOK_KEYS, **_look_tables())
    look["description"] = f"A look, with one of {', '.join(SUBJECT_KEYS)}."
    sequence = _table(SEQUENCE_KEYS, **_step_tables())
    sequence["description"] = "Frames between looks, or along a path of sensors."
    properties = {
        "defaults": _table(DEFAULT_KEYS, **_look_tables()),
        "look": {"type": "array", "items": look, "minItems": 1},
        "sequence": {"type": "array", "items": {**sequence, "required": ["name", "through"]}},
    }
    return {**_closed(properties), "required": ["look"]}


def _look_tables() -> dict[str, Schema]:
    """Return the schemas of those keys of looks that are tables with keys of their own."""
    constraints = _closed(
        {
            "light": _table_of(_closed({key: {} for key in LIGHT_KEYS})),
            "tie": {"type": "array"},
            "prefer_current": _LEVEL,
            "prefer_emitters": {"enum": list(get_args(Preference))},
            "sparse": {"type": "integer", "minimum": 1},
            "start": _table_of(_EMISSION),
            "near": _LEVEL,
        }
    )
    if set(constraints["properties"]) != set(CONSTRAINT_KEYS):
        raise TypeError(f"the schema of constraints has other keys than {CONSTRAINT_KEYS}")
    return {
        "constraints": {"anyOf": [constraints, _TEXT]},
        "settings": _table(SETTINGS),
        **_step_tables(),
    }


def _step_tables() -> dict[str, Schema]:
    return {"render": _table(FINAL_KEYS), "export": _table(HANDOVER_KEYS)}


def _table(keys: Mapping[str, Check], **tables: Schema) -> Schema:
    """Return the schema of a table with some of these keys. tables: schemas of those that are
    tables with keys of their own.
    """
    return _closed(
        {
            key: {**tables.get(key, check.schema), "description": check.expectation}
            for key, check in keys.items()
        }
    )


def _table_of(values: Schema) -> Schema:
    return {"type": "object", "additionalProperties": values}


def _closed(properties: Mapping[str, Schema]) -> Schema:
    return {"type": "object", "properties": dict(properties), "additionalProperties": False}
