"""A manifest as it stands, `looks.toml`: its tables, with keys and values that mean something."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lightpaint.batch.keys import DEFAULTS, GIVEN, LOOK, SEQUENCE, SUBJECTS, Mistakes
from lightpaint.errors import BatchError
from lightpaint.expected import Check, a
from lightpaint.files import one_line, read_text

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
class Manifest:
    """What stands there. looks: with the defaults in them; and what errors call each.

    path: of the file, relative to whose folder all its paths are.
    """

    path: Path
    looks: tuple[tuple[str, Mapping[str, Any]], ...]
    sequences: tuple[tuple[str, Mapping[str, Any]], ...]
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
        data = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise BatchError(f"{path} is not TOML: {one_line(str(error))}") from None
    mistakes = Mistakes(str(path))
    right = mistakes.keys(data, TABLES, "")
    defaults = data["defaults"] if "defaults" in right else {}
    known = mistakes.keys(defaults, DEFAULTS, "defaults")
    defaults = {key: value for key, value in defaults.items() if key in known}
    # Of what defaults with mistakes lead to nothing is said.
    is_clear = not mistakes.found
    looks = _tables(data["look"] if "look" in right else [], LOOK, "look", mistakes)
    merged = tuple((where, _merged(defaults, look)) for where, look in looks)
    given = data["sequence"] if "sequence" in right else []
    sequences = _tables(given, SEQUENCE, "sequence", mistakes)
    if not data.get("look") and is_clear:
        mistakes.add("", "it has no look: begin one with [[look]]")
    return Manifest(path, merged if is_clear else (), sequences if is_clear else (), mistakes)


def _tables(
    given: list[Any], known: Mapping[str, Check], what: str, mistakes: Mistakes
) -> tuple[tuple[str, Mapping[str, Any]], ...]:
    """What errors call each table, and its keys that are as expected."""
    tables = []
    for k, table in enumerate(given, start=1):
        where = f"{what} {k}"
        if not isinstance(table, dict):
            mistakes.add(where, f"{one_line(repr(table))} is no table: write [[{what}]]")
            continue
        if isinstance(called := _called(table), str):
            where = f"{what} {called!r}"
        right = mistakes.keys(table, known, where)
        if len(right) == len(table):  # of a table with mistakes nothing more is asked
            tables.append((where, {key: table[key] for key in table}))
    return tuple(tables)


def _called(table: Mapping[str, Any]) -> Any:
    """What a person knows a look by."""
    return next((table[key] for key in ("name", "painting", "lighting") if key in table), None)


def _merged(defaults: Mapping[str, Any], look: Mapping[str, Any]) -> dict[str, Any]:
    """`look` over the defaults; of tables of values each key by itself."""
    said = dict(defaults)
    for keys in PLACES:
        if any(key in look for key in keys):
            said = {key: value for key, value in said.items() if key not in keys}
    for key, value in look.items():
        if key in JOINED and isinstance(said.get(key), dict):
            value = {**said[key], **value}
        if key == "constraints" and key in said:
            value = [said[key], value]
        said[key] = value
    _leave_idle(said, look)
    return {**said, **_listed(said)}


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
