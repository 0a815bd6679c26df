"""A manifest, `looks.toml`: its tables, with known keys and valid values."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from lightpaint.batch.manifest.keys import (
    DEFAULT_KEYS,
    LIGHTING_STEPS,
    LOOK_KEYS,
    SEQUENCE_KEYS,
    SUBJECT_KEYS,
    Mistakes,
)
from lightpaint.errors import BatchError
from lightpaint.file_reading import read_text
from lightpaint.files import one_line
from lightpaint.storage.json_records import strict_toml
from lightpaint.validation import Check, a

#: Longest manifest that is read, in bytes; and its tables.
MAX_BYTES = 2**22

TABLES: Mapping[str, Check] = {
    "defaults": a(dict, "a table, [defaults]"),
    "look": a(list, "tables, [[look]]"),
    "sequence": a(list, "tables, [[sequence]]"),
}

#: Tables whose keys in a look are merged with the defaults.
MERGED_TABLES = ("settings", "parameters", "render", "export")

#: Groups of keys of which a look's own replace all defaults.
SOURCE_GROUPS = ("scene", "basis", "light_groups", "pattern"), ("sensor", "sensors")


@dataclass(frozen=True)
class Table:
    """A table of a manifest. where: its name in errors. values: by key, all valid.

    unclear: keys that were also given, but wrongly or misspelt. Their values are unknown, but to
    report them as missing would be wrong.
    """

    where: str
    values: Mapping[str, Any]
    unclear: frozenset[str] = frozenset()

    def has(self, *keys: str) -> bool:
        """Return whether any of these keys was given, whatever its value."""
        return any(key in self.values or key in self.unclear for key in keys)


@dataclass(frozen=True)
class Manifest:
    """Contents of a manifest. looks: merged with the defaults.

    path: of the file; its folder is the base of all paths in it.
    """

    path: Path
    looks: tuple[Table, ...]
    sequences: tuple[Table, ...]
    mistakes: Mistakes

    @property
    def folder(self) -> Path:
        """Base of the manifest's relative paths."""
        return self.path.parent


def read_manifest(path: str | Path) -> Manifest:
    """Read `looks.toml` (docs/batch.md).

    Errors in keys and values are among its mistakes, and left out of its tables.

    Raises BatchError for a file that is not TOML.
    """
    path = Path(path)
    text = read_text(path, "manifest", BatchError, limit=MAX_BYTES)
    try:
        data = strict_toml(text)
    except ValueError as error:
        raise BatchError(f"{path} is not TOML: {one_line(str(error))}") from None
    mistakes = Mistakes(str(path))
    right = mistakes.check_keys(data, TABLES, "")
    unclear = mistakes.unclear_keys(data, TABLES, right)
    if "defaults" in unclear:  # which may have had any of its keys
        defaults = Table("defaults", {}, frozenset(DEFAULT_KEYS))
    else:
        defaults = _table(data.get("defaults", {}), DEFAULT_KEYS, "defaults", mistakes)
        if (
            "settings" in defaults.values
        ):  # said once, and not of each look that they are merged into
            known = mistakes.settings(defaults.values["settings"], "defaults")
            defaults = replace(defaults, values={**defaults.values, "settings": known})
    looks = _tables(data["look"] if "look" in right else [], LOOK_KEYS, "look", mistakes)
    given = data["sequence"] if "sequence" in right else []
    sequences = _tables(given, SEQUENCE_KEYS, "sequence", mistakes)
    if not data.get("look") and "look" not in unclear:
        mistakes.add("", "it has no look: begin one with [[look]]")
    return Manifest(path, tuple(_merge(defaults, x) for x in looks), tuple(sequences), mistakes)


def _table(
    given: Mapping[str, Any], known: Mapping[str, Check], where: str, mistakes: Mistakes
) -> Table:
    """Return a table's valid values; errors are added to the mistakes."""
    right = mistakes.check_keys(given, known, where)
    values = {key: value for key, value in given.items() if key in right}
    return Table(where, values, mistakes.unclear_keys(given, known, right))


def _tables(
    given: list[Any], known: Mapping[str, Check], what: str, mistakes: Mistakes
) -> list[Table]:
    """Return all tables of one kind."""
    tables = []
    for k, table in enumerate(given, start=1):
        where = f"{what} {k}"
        if not isinstance(table, dict):
            mistakes.add(where, f"{one_line(repr(table))} is no table: write [[{what}]]")
            continue
        if called := _display_name(table):
            where = f"{what} {called!r}"
        tables.append(_table(table, known, where, mistakes))
    return tables


def _display_name(table: Mapping[str, Any]) -> str:
    """Return the name of a look as it stands in the manifest; "" where it has none."""
    named = (table.get(key) for key in ("name", "painting", "lighting"))
    return next((name for name in named if isinstance(name, str) and name), "")


def _merge(defaults: Table, table: Table) -> Table:
    """Return a look merged over the defaults; tables of values are merged key by key."""
    values, look, unclear = dict(defaults.values), table.values, defaults.unclear
    for keys in SOURCE_GROUPS:
        if table.has(*keys):
            values = {key: value for key, value in values.items() if key not in keys}
            unclear = unclear - set(keys)
    for key, value in look.items():
        if key in MERGED_TABLES and isinstance(values.get(key), dict):
            value = {**values[key], **value}
        if key == "constraints" and key in values:
            value = [values[key], value]
        values[key] = value
    _drop_unused(values, look)
    left = {key for key in unclear if key not in look or key in (*MERGED_TABLES, "constraints")}
    return Table(table.where, {**values, **_as_list(values)}, table.unclear | left)


def _drop_unused(values: dict[str, Any], look: Mapping[str, Any]) -> None:
    """Drop default steps and tables that a look of this kind cannot use."""
    if "want" in values and "want" not in look and {"lighting", "lightings"} & set(look):
        values["want"] = [step for step in values["want"] if step in LIGHTING_STEPS] or list(
            LIGHTING_STEPS[:1]
        )
    for step in ("render", "export"):
        if step not in look and step not in values.get("want", ()):
            values.pop(step, None)


def _as_list(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return constraints as a list of all that were given, the defaults' first."""
    requests = values.get("constraints", [])
    return {"constraints": requests if isinstance(requests, list) else [requests]}


def subject_keys(look: Mapping[str, Any]) -> list[str]:
    """Return which of SUBJECT_KEYS a look has."""
    return [key for key in SUBJECT_KEYS if key in look]
