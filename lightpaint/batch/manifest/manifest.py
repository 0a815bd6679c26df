"""A manifest as it stands, `looks.toml`: its tables, with keys and values that mean something."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from lightpaint.batch.manifest.keys import DEFAULTS, GIVEN, LOOK, SEQUENCE, SUBJECTS, Mistakes
from lightpaint.errors import BatchError
from lightpaint.files import one_line, read_text
from lightpaint.storage.json_records import strict_toml
from lightpaint.validation import Check, a

#: Longest manifest that is read, in bytes; and its tables.
MAX_BYTES = 2**22

TABLES: Mapping[str, Check] = {
    "defaults": a(dict, "a table, [defaults]"),
    "look": a(list, "tables, [[look]]"),
    "sequence": a(list, "tables, [[sequence]]"),
}

#: Tables of which a look's own keys stand beside those by default.
JOINED = ("settings", "parameters", "render", "export")

#: Keys that say what a look is of: a look's own replace all of those by default.
PLACES = ("scene", "basis", "light_groups", "pattern"), ("sensor", "sensors")


@dataclass(frozen=True)
class Table:
    """A table of a manifest. where: what errors call it. said: its keys, with values that will do.

    unclear: keys that somebody gave as well, wrongly or misspelt. Nothing is known of their values,
    but that they lack would be untrue.
    """

    where: str
    said: Mapping[str, Any]
    unclear: frozenset[str] = frozenset()

    def has(self, *keys: str) -> bool:
        """Return whether any of these keys was given, whatever its value."""
        return any(key in self.said or key in self.unclear for key in keys)


@dataclass(frozen=True)
class Manifest:
    """Contents of a manifest. looks: with the defaults in them.

    path: of the file, relative to whose folder all its paths are.
    """

    path: Path
    looks: tuple[Table, ...]
    sequences: tuple[Table, ...]
    mistakes: Mistakes

    @property
    def folder(self) -> Path:
        """What its paths are relative to."""
        return self.path.parent


def read_manifest(path: str | Path) -> Manifest:
    """Read `looks.toml` (docs/batch.md).

    What is wrong with keys and values is among its mistakes, and left out of its tables.

    Raises BatchError for what is no TOML at all.
    """
    path = Path(path)
    text = read_text(path, "manifest", BatchError, limit=MAX_BYTES)
    try:
        data = strict_toml(text)
    except ValueError as error:
        raise BatchError(f"{path} is not TOML: {one_line(str(error))}") from None
    mistakes = Mistakes(str(path))
    right = mistakes.keys(data, TABLES, "")
    unclear = mistakes.unclear(data, TABLES, right)
    if "defaults" in unclear:  # which may have had any of its keys
        defaults = Table("defaults", {}, frozenset(DEFAULTS))
    else:
        defaults = _table(data.get("defaults", {}), DEFAULTS, "defaults", mistakes)
        if "settings" in defaults.said:  # said once, and not of each look that they are merged into
            known = mistakes.settings(defaults.said["settings"], "defaults")
            defaults = replace(defaults, said={**defaults.said, "settings": known})
    looks = _tables(data["look"] if "look" in right else [], LOOK, "look", mistakes)
    given = data["sequence"] if "sequence" in right else []
    sequences = _tables(given, SEQUENCE, "sequence", mistakes)
    if not data.get("look") and "look" not in unclear:
        mistakes.add("", "it has no look: begin one with [[look]]")
    return Manifest(path, tuple(_merged(defaults, x) for x in looks), tuple(sequences), mistakes)


def _table(
    given: Mapping[str, Any], known: Mapping[str, Check], where: str, mistakes: Mistakes
) -> Table:
    """Return what a table says; what is wrong is added to the mistakes."""
    right = mistakes.keys(given, known, where)
    said = {key: value for key, value in given.items() if key in right}
    return Table(where, said, mistakes.unclear(given, known, right))


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
        if called := _called(table):
            where = f"{what} {called!r}"
        tables.append(_table(table, known, where, mistakes))
    return tables


def _called(table: Mapping[str, Any]) -> str:
    """Return what a person knows a look by, as it stands in the manifest; "" where nothing does."""
    named = (table.get(key) for key in ("name", "painting", "lighting"))
    return next((name for name in named if isinstance(name, str) and name), "")


def _merged(defaults: Table, table: Table) -> Table:
    """Return a look over the defaults; of tables of values each key by itself."""
    said, look, unclear = dict(defaults.said), table.said, defaults.unclear
    for keys in PLACES:
        if table.has(*keys):
            said = {key: value for key, value in said.items() if key not in keys}
            unclear = unclear - set(keys)
    for key, value in look.items():
        if key in JOINED and isinstance(said.get(key), dict):
            value = {**said[key], **value}
        if key == "constraints" and key in said:
            value = [said[key], value]
        said[key] = value
    _leave_idle(said, look)
    left = {key for key in unclear if key not in look or key in (*JOINED, "constraints")}
    return Table(table.where, {**said, **_listed(said)}, table.unclear | left)


def _leave_idle(said: dict[str, Any], look: Mapping[str, Any]) -> None:
    """Take out what is wanted by default, and a look like this has no use of."""
    if "want" in said and "want" not in look and {"lighting", "lightings"} & set(look):
        said["want"] = [step for step in said["want"] if step in GIVEN] or list(GIVEN[:1])
    for step in ("render", "export"):
        if step not in look and step not in said.get("want", ()):
            said.pop(step, None)


def _listed(said: Mapping[str, Any]) -> dict[str, Any]:
    """Constraints as a list of what was said, the defaults' first."""
    asked = said.get("constraints", [])
    return {"constraints": asked if isinstance(asked, list) else [asked]}


def subject(look: Mapping[str, Any]) -> list[str]:
    """Which of SUBJECTS a look says."""
    return [key for key in SUBJECTS if key in look]
