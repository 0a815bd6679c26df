"""JSON schemas of the files and messages, made of the dataclasses that read and write them."""

import inspect
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import MISSING, fields, is_dataclass
from pathlib import Path
from types import NoneType
from typing import Any, Literal, get_args, get_origin, get_type_hints

import numpy as np

from lightpaint.batch.gallery.summary import SummaryRow
from lightpaint.batch.manifest.folder_names import SUMMARY_FORMAT
from lightpaint.lighting.answer.certificate import Certificate
from lightpaint.lighting.answer.light_setting import LightSetting
from lightpaint.lighting.answer.lighting import EmitterPlace, Lighting
from lightpaint.lighting.answer.lighting_file import FORMAT
from lightpaint.paint.protocol.events import EVENTS
from lightpaint.paint.protocol.requests import REQUESTS
from lightpaint.pipeline.results.result_folder import _Record
from lightpaint.placement.placement_record import PlacementRecord
from lightpaint.storage.json_records import UNIONS

Schema = dict[str, Any]

DIALECT = "https://json-schema.org/draft/2020-12/schema"

_PLAIN: dict[Any, Schema] = {
    Any: {},
    str: {"type": "string"},
    bool: {"type": "boolean"},
    float: {"type": "number"},
    int: {"type": "integer"},
    NoneType: {"type": "null"},
}


def schemas() -> dict[str, tuple[str, Schema]]:
    """Return each schema by its name, with what it is of."""
    return {
        "lighting": ("``lighting.json``, the answer", lighting_schema()),
        "result": ("``result.json``, what a folder holds", schema_of(_Record)),
        "summary": ("``summary.json``, the looks of a batch", summary_schema()),
        "places": (
            "``places.json``, moved and added lights of a batch or a painter",
            schema_of(PlacementRecord),
        ),
        "requests": ("what clients send to the painter", _messages(REQUESTS)),
        "events": ("what the painter sends to clients", _messages(EVENTS)),
    }


def lighting_schema() -> Schema:
    """Return the schema of lighting.json, whose lights and places stand under their names."""
    head = schema_of(Lighting)["properties"]
    light, place = schema_of(LightSetting, "name"), schema_of(EmitterPlace, "name")
    light["properties"]["photometry"] = {"type": "object"}
    key = {
        "type": "object",
        "properties": {
            "frame": {"type": "integer"},
            "target": {"type": "string"},
            "weights": {"type": "object", "additionalProperties": _list([_PLAIN[float]] * 3)},
        },
        "required": ["frame", "weights"],
    }
    properties = {
        "format": {"const": FORMAT},
        "lightpaint": {"type": "string"},
        **{name: head[name] for name in ("target", "scene_identity", "cd_per_unit", "up")},
        "lights": {"type": "object", "additionalProperties": light},
        "places": {"type": "object", "additionalProperties": place},
        "keys": {"type": "array", "items": key},
        "solve": schema_of(Certificate),
    }
    return {"type": "object", "properties": properties, "required": ["format", "lights"]}


def summary_schema() -> Schema:
    """Return the schema of summary.json, whose rows have no fields without a value."""
    row = {**schema_of(SummaryRow), "required": ["look", "state", "folder", "size"]}
    properties = {
        "format": {"const": SUMMARY_FORMAT},
        "lightpaint": {"type": "string"},
        "done": {"type": "integer"},
        "failed": {"type": "integer"},
        "looks": {"type": "array", "items": row},
    }
    return {"type": "object", "properties": properties, "required": list(properties)}


def schema_of(kind: Any, *left_out: str) -> Schema:
    """Return the schema of a dataclass, without the fields `left_out`.

    Arrays of messages are buffers beside the JSON (docs/protocol.md), and stand in no schema.
    """
    hints = get_type_hints(kind)
    shown = [x for x in fields(kind) if x.name not in left_out and not _is_array(hints[x.name])]
    required = [x.name for x in shown if x.default is MISSING and x.default_factory is MISSING]
    schema: Schema = {"type": "object"}
    if text := (inspect.getdoc(kind) or "").partition("\n\n")[0]:
        schema["description"] = " ".join(text.split())
    schema["properties"] = {x.name: _value(hints[x.name]) for x in shown}
    return {**schema, "required": required} if required else schema


def _is_array(kind: Any) -> bool:
    return get_origin(kind) is np.ndarray or any(map(_is_array, get_args(kind)))


def _value(kind: Any) -> Schema:
    """Return the schema of values of an annotation."""
    outer, inner = get_origin(kind), get_args(kind)
    if kind in _PLAIN:
        return dict(_PLAIN[kind])
    if outer is Literal:
        return {"enum": list(inner)}
    if outer in UNIONS:
        return {"anyOf": [_value(x) for x in inner]}
    if outer is Mapping or outer is dict:
        return {"type": "object", "additionalProperties": _value(inner[1])}
    if outer in (Sequence, list) or (outer is tuple and inner[-1:] == (...,)):
        return {"type": "array", "items": _value(inner[0])}
    if outer is tuple:
        return _list([_value(x) for x in inner])
    if isinstance(kind, type) and is_dataclass(kind):
        return schema_of(kind)
    if isinstance(kind, type) and issubclass(kind, str):
        return {"type": "string"}
    raise TypeError(f"no schema for {kind!r}")


def _list(values: list[Schema]) -> Schema:
    return {
        "type": "array",
        "prefixItems": values,
        "minItems": len(values),
        "maxItems": len(values),
    }


def _messages(kinds: Mapping[str, type[Any]]) -> Schema:
    """Return the schema of messages, by their kind."""
    messages = []
    for name, record in kinds.items():
        schema = schema_of(record)
        schema["properties"] = {"kind": {"const": name}, **schema["properties"]}
        schema["required"] = ["kind", *schema.get("required", [])]
        messages.append({"title": name, **schema})
    return {"oneOf": messages}


def write_schemas(folder: Path, extra: Path) -> None:
    """Write the page of the schemas into one new folder, and the schemas into another."""
    for place in (folder, extra):
        place.mkdir(parents=True)
    for name, (_, schema) in schemas().items():
        titled = {"$schema": DIALECT, "title": f"lightpaint {name}", **schema}
        text = json.dumps(titled, indent=1, ensure_ascii=False)
        (extra / f"{name}.schema.json").write_text(text + "\n", encoding="utf-8")
    (folder / "index.rst").write_text("\n".join(_page()) + "\n", encoding="utf-8")


def _page() -> Iterator[str]:
    yield from (
        "JSON schemas",
        "============",
        "",
        "The dataclasses that read and write these files give these schemas, in the dialect of",
        "2020-12. A field that a schema does not require may be absent. :doc:`/formats` says what",
        "each field means; :doc:`/protocol` does so for messages, whose arrays are buffers beside",
        "the JSON.",
        "",
        "Any validator of this dialect checks a file, such as the Python package jsonschema:",
        "",
        ".. code-block:: python",
        "",
        "   import json",
        "   from pathlib import Path",
        "",
        "   import jsonschema",
        "",
        '   schema = json.loads(Path("lighting.schema.json").read_text("utf-8"))',
        '   lighting = json.loads(Path("evening/lighting.json").read_text("utf-8"))',
        "   jsonschema.validate(lighting, schema)",
        "",
        ".. list-table::",
        "   :widths: 40 60",
        "",
    )
    for name, (subject, _) in schemas().items():
        yield f"   * - `{name}.schema.json <{name}.schema.json>`__"
        yield f"     - {subject}"
