"""Rows of a session file: how steps, looks and their pixels stand in its tables."""

import json
import sqlite3
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from lightpaint.errors import PaintError
from lightpaint.files import first_line
from lightpaint.paint.store.canvas_pixels import Region
from lightpaint.paint.store.compression import is_marked
from lightpaint.paint.store.history_steps import Patch
from lightpaint.paint.store.lazy_arrays import PackedArray, PackedArrays

#: A stored step: id, kind, label, fields and places, the last two as JSON.
StepRow = tuple[int, str, str, str, str]


def insert_step(
    database: sqlite3.Connection,
    *,
    row: StepRow,
    blobs: tuple[bytes, bytes] | None,
    last_kept: int,
) -> None:
    """Write a step after that of the id `last_kept`; later ones are cut off.

    blobs: its pixels before, and their change; None without any.
    """
    database.execute("DELETE FROM step WHERE id > ?", (last_kept,))
    database.execute("DELETE FROM pixels WHERE step > ?", (last_kept,))
    database.execute("DELETE FROM step_answer WHERE step > ?", (last_kept,))
    database.execute("INSERT INTO step VALUES (?, ?, ?, ?, ?)", row)
    if blobs is not None:
        database.execute("INSERT INTO pixels VALUES (?, ?, ?)", (row[0], *blobs))


def step_rows(database: sqlite3.Connection) -> list[StepRow]:
    """Return all steps in their order, without pixels."""
    query = "SELECT id, kind, label, fields, places FROM step ORDER BY id"
    return database.execute(query).fetchall()


def pixels_row(database: sqlite3.Connection, step: int) -> tuple[bytes, bytes] | None:
    """Return the pixels before a step, and their change; None if there are none."""
    query = "SELECT before, change FROM pixels WHERE step = ?"
    row: tuple[bytes, bytes] | None = database.execute(query, (step,)).fetchone()
    return row


def insert_answer(database: sqlite3.Connection, *, step: int, fields: str, picture: bytes) -> None:
    """Write the answer after a step in the place of an earlier one, unless the step was cut off."""
    database.execute(
        "INSERT OR REPLACE INTO step_answer SELECT ?, ?, ? WHERE ? = 0 OR EXISTS "
        "(SELECT 1 FROM step WHERE id = ?)",
        (step, fields, picture, step, step),
    )


def answer_row(database: sqlite3.Connection, step: int) -> tuple[str, bytes] | None:
    """Return the answer after a step, fields as JSON and picture; None if there is none."""
    query = "SELECT fields, picture FROM step_answer WHERE step = ?"
    row: tuple[str, bytes] | None = database.execute(query, (step,)).fetchone()
    return row


def read_position(database: sqlite3.Connection) -> int | None:
    """Return how many of the steps are done; None if that was never written."""
    row = database.execute("SELECT value FROM about WHERE name = 'position'").fetchone()
    return None if row is None else int(row[0])


def insert_look(
    database: sqlite3.Connection, *, number: int, fields: str, arrays: PackedArrays | None
) -> None:
    """Write a look in the place of that of its number. arrays: None to keep those it has."""
    database.execute("INSERT OR REPLACE INTO look VALUES (?, ?)", (number, fields))
    if arrays is not None:
        database.execute("DELETE FROM look_array WHERE look = ?", (number,))
        rows = [(number, name, *row) for name, row in arrays.items()]
        database.executemany("INSERT INTO look_array VALUES (?, ?, ?, ?, ?)", rows)


def delete_look(database: sqlite3.Connection, *, number: int) -> None:
    """Delete a look and its arrays."""
    database.execute("DELETE FROM look WHERE id = ?", (number,))
    database.execute("DELETE FROM look_array WHERE look = ?", (number,))


def look_rows(database: sqlite3.Connection) -> list[tuple[int, str]]:
    """Return number and fields, as JSON, of all looks, the oldest first."""
    return database.execute("SELECT id, fields FROM look ORDER BY id").fetchall()


def array_names(database: sqlite3.Connection, look: int) -> list[str]:
    """Return the names of a look's arrays, in order."""
    query = "SELECT name FROM look_array WHERE look = ? ORDER BY rowid"
    return [name for (name,) in database.execute(query, (look,))]


def array_row(database: sqlite3.Connection, look: int, name: str) -> PackedArray | None:
    """Return one array of a look; None if there is none."""
    query = "SELECT dtype, shape, data FROM look_array WHERE look = ? AND name = ?"
    row: PackedArray | None = database.execute(query, (look, name)).fetchone()
    return row


def places_json(patches: Sequence[Patch]) -> str:
    """Return the place of each patch as JSON, as `parse_place` reads it."""
    return json.dumps([_place(patch) for patch in patches])


def _place(patch: Patch) -> list[int]:
    place = [*map(int, (patch.view, *patch.region))]
    if patch.layer:
        return [*place, int(is_marked(patch)), patch.layer]
    return [*place, 1] if is_marked(patch) else place


class PatchPlace(NamedTuple):
    """The place of a stored patch. marked: whether it has "at least" marks."""

    view: int
    region: Region
    marked: bool
    layer: int


def parse_place(place: Sequence[int]) -> PatchPlace:
    """Return a place: view, region and, where they are not 0, marked and layer."""
    view, top, bottom, left, right, *rest = map(int, place)
    marked, layer = [*rest, 0, 0][:2]
    return PatchPlace(view, (top, bottom, left, right), bool(marked), layer)


def to_json(fields: Mapping[str, Any]) -> str:
    """Return fields as JSON. Raises PaintError for values that JSON cannot express."""
    try:
        return json.dumps(dict(fields), ensure_ascii=False, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise PaintError(f"this cannot be kept: {first_line(error)}") from None
