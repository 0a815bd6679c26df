"""A manifest, `looks.toml`: its tables, with known keys and valid values; and a starter of one."""

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from lightpaint.basis import is_basis_file, is_light_groups
from lightpaint.batch.manifest.keys import (
    DEFAULT_KEYS,
    LIGHTING_STEPS,
    LOOK_KEYS,
    SEQUENCE_KEYS,
    SUBJECT_KEYS,
    Mistakes,
)
from lightpaint.errors import BatchError, OutputError
from lightpaint.files import check_files, one_line, read_text, write_text
from lightpaint.sentences import Hint
from lightpaint.storage.json_records import strict_toml
from lightpaint.validation import Check, a

#: Longest manifest that is read, in bytes.
MAX_BYTES = 2**22

TABLES: Mapping[str, Check] = {
    "defaults": a(dict, "a table, [defaults]"),
    "look": a(list, "tables, [[look]]"),
    "sequence": a(list, "tables, [[sequence]]"),
}

#: Tables whose keys in a look are merged with the defaults.
MERGED_TABLES = ("settings", "parameters", "render", "export")

#: Groups of keys: if a look has any key of a group, it replaces all defaults of that group.
REPLACED_GROUPS = (
    ("scene", "basis", "light_groups", "pattern"),
    ("sensor", "sensors"),
    ("template", "find_template"),
)

STARTER = """\
# Looks to be found in one go:  lightpaint batch {name} -o looks/
# docs/batch.md has all keys. Paths are relative to this file.

[defaults]
{source}

"""

#: What a first manifest wants of looks of a scene, and of those that nothing can be rendered for.
SCENE_DEFAULTS = """\
want = ["solve", "predict", "verify", "report"]  # "render": a final render; "export": for others

[defaults.settings]
quality = "preview"\
"""
BASIS_DEFAULTS = 'want = ["solve", "predict", "report"]  # "export": for others'


@dataclass(frozen=True)
class Table:
    """A table of a manifest. label: its name in errors. values: by key, all valid.

    unclear_keys: keys that are also there, but misspelt or with invalid values. Checks count them
    as present, so that they are not reported as missing as well.
    """

    label: str
    values: Mapping[str, Any]
    unclear_keys: frozenset[str] = frozenset()

    def has(self, *keys: str) -> bool:
        """Return whether any of these keys is given, with a valid value or not."""
        return any(key in self.values or key in self.unclear_keys for key in keys)


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

    Wrong keys and values are recorded as mistakes and left out of the tables.

    Raises BatchError for a file that is not TOML.
    """
    path = Path(path)
    text = read_text(path, "manifest", BatchError, limit=MAX_BYTES)
    try:
        data = strict_toml(text)
    except ValueError as error:
        raise BatchError(f"{path} is not TOML: {one_line(str(error))}") from None
    mistakes = Mistakes(str(path))
    valid_keys = mistakes.check_keys(data, TABLES, "")
    unclear_keys = mistakes.unclear_keys(data, TABLES, valid_keys)
    if "defaults" in unclear_keys:  # it may have had any key
        defaults = Table("defaults", {}, frozenset(DEFAULT_KEYS))
    else:
        defaults = _table(data.get("defaults", {}), DEFAULT_KEYS, "defaults", mistakes)
        if (
            "settings" in defaults.values
        ):  # reported once, not for each look that they are merged into
            valid = mistakes.settings(defaults.values["settings"], "defaults")
            defaults = replace(defaults, values={**defaults.values, "settings": valid})
    looks = _tables(data["look"] if "look" in valid_keys else [], LOOK_KEYS, "look", mistakes)
    sequence_tables = data["sequence"] if "sequence" in valid_keys else []
    sequences = _tables(sequence_tables, SEQUENCE_KEYS, "sequence", mistakes)
    if not data.get("look") and "look" not in unclear_keys:
        mistakes.add("", "it has no look: begin one with [[look]]")
    return Manifest(path, tuple(_merge(defaults, x) for x in looks), tuple(sequences), mistakes)


def _table(
    raw: Mapping[str, Any], keys: Mapping[str, Check], label: str, mistakes: Mistakes
) -> Table:
    """Return a table's valid values, and add errors to the mistakes."""
    valid_keys = mistakes.check_keys(raw, keys, label)
    values = {key: value for key, value in raw.items() if key in valid_keys}
    return Table(label, values, mistakes.unclear_keys(raw, keys, valid_keys))


def _tables(
    raw_tables: list[Any], keys: Mapping[str, Check], kind: str, mistakes: Mistakes
) -> list[Table]:
    """Return all tables of one kind."""
    tables = []
    for k, table in enumerate(raw_tables, start=1):
        label = f"{kind} {k}"
        if not isinstance(table, dict):
            mistakes.add(label, f"{one_line(repr(table))} is not a table: write [[{kind}]]")
            continue
        if name := _display_name(table):
            label = f"{kind} {name!r}"
        tables.append(_table(table, keys, label, mistakes))
    return tables


def _display_name(table: Mapping[str, Any]) -> str:
    """Return the name of a look as the manifest gives it; "" if it has none."""
    candidates = (table.get(key) for key in ("name", "painting", "lighting"))
    return next((name for name in candidates if isinstance(name, str) and name), "")


def _merge(defaults: Table, table: Table) -> Table:
    """Return a look merged over the defaults, tables of values key by key."""
    values, look, unclear_keys = dict(defaults.values), table.values, defaults.unclear_keys
    for keys in REPLACED_GROUPS:
        if table.has(*keys):
            values = {key: value for key, value in values.items() if key not in keys}
            unclear_keys = unclear_keys - set(keys)
    for key, value in look.items():
        if key in MERGED_TABLES and isinstance(values.get(key), dict):
            value = {**values[key], **value}
        if key == "constraints" and key in values:
            value = [values[key], value]
        values[key] = value
    # Default steps, tables and shares that a look of this kind cannot use are dropped.
    if "want" in values and "want" not in look and {"lighting", "lightings"} & set(look):
        values["want"] = [step for step in values["want"] if step in LIGHTING_STEPS] or list(
            LIGHTING_STEPS[:1]
        )
    if "share" not in look and {"lighting", "lightings"} & set(look):
        values.pop("share", None)
    for step in ("render", "export"):
        if step not in look and step not in values.get("want", ()):
            values.pop(step, None)
    still_unclear = {
        key for key in unclear_keys if key not in look or key in (*MERGED_TABLES, "constraints")
    }
    return Table(table.label, {**values, **_as_list(values)}, table.unclear_keys | still_unclear)


def _as_list(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return all given constraints as a list, the defaults' first."""
    requests = values.get("constraints", [])
    return {"constraints": requests if isinstance(requests, list) else [requests]}


def subject_keys(look: Mapping[str, Any]) -> list[str]:
    """Return which of SUBJECT_KEYS a look has."""
    return [key for key in SUBJECT_KEYS if key in look]


def write_starter_manifest(
    path: Path, scene: str, paintings: Sequence[str], *, force: bool = False
) -> None:
    """Write a manifest to `path` with a look for each painting of one scene, basis file or EXR of
    light groups.

    Raises BatchError if there is no painting, or a file does not exist, and OutputError if the
    manifest exists already.
    """
    if not paintings:
        raise BatchError("no painting to begin with: give the scene, then paintings")
    for file in (scene, *paintings):
        if not Path(file).is_file() and not (file == scene and is_light_groups(Path(scene))):
            raise BatchError(f"no such file: {file}")
    check_files([path], map(Path, (scene, *paintings)))
    if path.exists() and not force:
        raise OutputError(
            f"{path} is there: choose another name with ",
            Hint("folder"),
            ", or ",
            Hint("force", True),
        )
    base = path.parent
    if Path(scene).suffix.lower() != ".xml" and is_light_groups(Path(scene)):
        key, defaults = "light_groups", BASIS_DEFAULTS
    elif is_basis_file(Path(scene)):
        key, defaults = "basis", BASIS_DEFAULTS
    else:
        key, defaults = "scene", SCENE_DEFAULTS
    text = STARTER.format(name=path.name, source=f"{key} = {_quoted(scene, base)}\n{defaults}")
    write_text(
        path, text + "\n".join(f"[[look]]\npainting = {_quoted(x, base)}\n" for x in paintings)
    )


def _quoted(file: str, base: Path) -> str:
    """Return a path relative to `base` as TOML writes it, which is how JSON does."""
    return json.dumps(os.path.relpath(file, base), ensure_ascii=False).replace("\x7f", "\\u007f")
