"""JSON schemas of the files and messages, made of the dataclasses that read and write them."""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from dataclass_schemas import Schema, list_of, schema_of
from field_pages import described, field_page
from manifest_schema import manifest_schema
from report_schema import report_schema

from lightpaint.basis.light_basis import Origin
from lightpaint.basis.lights import BasisLight
from lightpaint.batch.gallery.summary import SummaryRow
from lightpaint.batch.manifest.file_names import SUMMARY_FORMAT
from lightpaint.colour.lamp import Lamp
from lightpaint.lighting.answer.certificate import Certificate
from lightpaint.lighting.answer.lighting import EmitterPlace, Lighting, LightSetting
from lightpaint.lighting.answer.lighting_file import FORMAT
from lightpaint.paint.protocol import Event, Request
from lightpaint.pipeline.result_folder import _Record
from lightpaint.placement.light_changes import PlacementRecord
from lightpaint.relit.export import fixtures

DIALECT = "https://json-schema.org/draft/2020-12/schema"


#: What other pages describe field by field: batches, exports, and messages of the painter.
DESCRIBED_ELSEWHERE = ("manifest", "fixtures", "requests", "events")


def schemas() -> dict[str, tuple[str, Schema]]:
    """Return each schema by its name, with the file or message that it describes."""
    files = {
        "manifest": ("``looks.toml``, the manifest of a batch", manifest_schema()),
        "lighting": ("``lighting.json``, the answer", lighting_schema()),
        "report": ("``report.json``, the numbers of a report", report_schema()),
        "result": ("``result.json``, what a folder holds", schema_of(_Record)),
        "summary": ("``summary.json``, the looks of a batch", summary_schema()),
        "places": (
            "``places.json``, moved and added lights of a batch or a painter",
            schema_of(PlacementRecord),
        ),
        "fixtures": ("``fixtures.json``, an answer for consoles", fixtures_schema()),
        "origin": ("``lightpaint.origin``, an attribute of a basis", schema_of(Origin)),
        "light": ("``lightpaint.light``, an attribute of a basis", schema_of(BasisLight)),
        "requests": ("what clients send to the painter", _messages(Request.kinds)),
        "events": ("what the painter sends to clients", _messages(Event.kinds)),
    }
    return {name: (subject, described(name, schema)) for name, (subject, schema) in files.items()}


def lighting_schema() -> Schema:
    """Return the schema of lighting.json, whose lights and places stand under their names."""
    head = schema_of(Lighting)["properties"]
    light, place = schema_of(LightSetting, "name"), schema_of(EmitterPlace, "name")
    light["properties"]["photometry"] = {"type": "object"}
    # The fields of its lamp stand beside its own.
    del light["properties"]["lamp"]
    # Drives stand for the mix, and lamps for their emitters.
    for name in ("mix", "mix_errors", "part_of"):
        del light["properties"][name]
    light["properties"]["is_spectral"] = {"type": "boolean"}
    light["properties"] |= schema_of(Lamp)["properties"]
    drives = {"type": "object", "additionalProperties": {"type": "number"}}
    errors = {"type": "object", "additionalProperties": {"type": ["number", "null"]}}
    light["properties"] |= {"drives": drives, "drive_errors": errors}
    light["properties"] |= {"slot": {"type": "string"}, "slot_delta_e": {"type": "number"}}
    rgb = list_of([{"type": "number"}] * 3)
    key = {
        "type": "object",
        "properties": {
            "frame": {"type": "integer"},
            "target": {"type": "string"},
            "weights": {"type": "object", "additionalProperties": rgb},
        },
        "required": ["frame", "weights"],
    }
    properties = {
        "format": {"const": FORMAT},
        "lightpaint": {"type": "string"},
        **{
            name: head[name]
            for name in ("target", "scene_identity", "cd_per_unit", "up", "observer")
        },
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


def fixtures_schema() -> Schema:
    """Return the schema of fixtures.json."""
    rows = {"type": "array", "items": schema_of(fixtures.Fixture)}
    frame = {"frame": {"type": "integer"}, "fixtures": rows}
    properties = {
        "format": {"const": fixtures.FORMAT},
        "lightpaint": {"type": "string"},
        "target": {"type": "string"},
        "cd_per_unit": {"type": ["number", "null"]},
        "fixtures": rows,
        "frames": {"type": "array", "items": {"type": "object", "properties": frame}},
    }
    required = [name for name in properties if name != "frames"]
    return {"type": "object", "properties": properties, "required": required}


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
    files = {name: value for name, value in schemas().items() if name not in DESCRIBED_ELSEWHERE}
    (folder / "fields.md").write_text(field_page(files), encoding="utf-8")


def _page() -> Iterator[str]:
    yield from (
        "JSON schemas",
        "============",
        "",
        "The code that reads and writes these files gives these schemas, in the dialect of",
        "2020-12. A field that a schema does not require may be absent. :doc:`fields` lists the",
        "same for people; :doc:`/messages/index` does so for messages, whose arrays are buffers",
        "beside the JSON. :doc:`/formats` and :doc:`/batch` explain the files.",
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
        "A manifest is TOML, which ``tomllib.loads`` turns into such values. Editors that complete",
        "and check TOML do so by the schema named in its first line,",
        "``#:schema ./manifest.schema.json``. ``lightpaint batch --dry-run`` finds more: keys that",
        "contradict each other, and files that do not exist.",
        "",
        ".. list-table::",
        "   :widths: 40 60",
        "",
    )
    for name, (subject, _) in schemas().items():
        yield f"   * - `{name}.schema.json <{name}.schema.json>`__"
        yield f"     - {subject}"
    yield from ("", ".. toctree::", "   :hidden:", "", "   fields")
