"""The page of the fields of JSON files, made of their schemas."""

import json
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path

from dataclass_schemas import Schema

#: Meanings of fields by file and path, where no docstring says the same.
MEANINGS: dict[str, dict[str, str]] = tomllib.loads(
    Path(__file__).with_name("field_meanings.toml").read_text("utf-8")
)

_HEAD = """# Fields of the files

These tables come from the code that reads and writes the files; the [JSON
schemas](index.rst) have the same for programs, with the fields that are required. `*` stands for a
name, `[]` for each entry of a list. Fields without a value are absent."""


def fields_of(schema: Schema, path: str = "") -> Iterator[tuple[str, Schema]]:
    """Return all fields of a schema, each with its path."""
    for name, value in schema.get("properties", {}).items():
        yield f"{path}{name}", value
        yield from fields_of(value, f"{path}{name}.")
    if isinstance(values := schema.get("additionalProperties"), dict):
        yield from fields_of(values, f"{path}*.")
    if isinstance(items := schema.get("items"), dict):
        yield from fields_of(items, f"{path.removesuffix('.')}[].")
    for kind in schema.get("anyOf", ()):
        yield from fields_of(kind, path)


def described(name: str, schema: Schema) -> Schema:
    """Return a schema with the meanings of its fields.

    Raises KeyError for a meaning of a field that the schema does not have.
    """
    meanings = dict(MEANINGS.get(name, {}))
    # Each field gets a record of its own; the builders of schemas share them.
    separate: Schema = json.loads(json.dumps(schema))
    for path, field in fields_of(separate):
        if path in meanings:
            field["description"] = meanings.pop(path)
    if meanings:
        raise KeyError(f"{name} has no field {', '.join(meanings)}")
    return separate


def field_page(files: Mapping[str, tuple[str, Schema]]) -> str:
    """Return the page of these files: what each is and its described schema, by name."""
    parts = [_HEAD]
    for subject, schema in files.values():
        rows = "".join(
            f"\n| `{path}` | {_kind(field)} | {_cell(field.get('description', ''))} |"
            for path, field in fields_of(schema)
        )
        table = f"| field | type | meaning |\n|---|---|---|{rows}"
        parts += [f"## {subject.replace('``', '`')}", table]
    return "\n\n".join(parts) + "\n"


def _cell(text: str) -> str:
    return text[:1].upper() + text[1:].replace("|", "\\|")


def _kind(schema: Schema) -> str:
    """Return the type of a field in words."""
    if "const" in schema:
        return f"`{schema['const']}`"
    if "enum" in schema:
        return ", ".join(f"`{value}`" for value in schema["enum"] if value not in ("", None))
    if "prefixItems" in schema:
        kinds = [_kind(x) for x in schema["prefixItems"]]
        return f"{len(kinds)} × {kinds[0]}" if len(set(kinds)) == 1 else ", ".join(kinds)
    if "anyOf" in schema:
        kinds = [_kind(x) for x in schema["anyOf"] if x.get("type") != "null"]
        return " or ".join(dict.fromkeys(filter(None, kinds)))
    names = schema.get("type", "")
    kinds = [names] if isinstance(names, str) else names
    return " or ".join(_WORDS[x] for x in kinds if x in _WORDS)


_WORDS = {
    "string": "text",
    "boolean": "true or false",
    "number": "number",
    "integer": "integer",
    "array": "list",
    "object": "object",
}
