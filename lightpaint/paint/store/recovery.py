"""Recovery of a damaged session file: what can still be read is brought into a new one.

A disk that returns other bytes than it was given damages single pages. Every row is therefore read
by itself and checked as a whole, pixels included; what is lost is named. The damaged file stays
beside the new one.
"""

import json
import os
import shutil
import sqlite3
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import closing, suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any

from lightpaint.errors import LightpaintError, PaintError
from lightpaint.files import flush
from lightpaint.paint.store.compression import unpacked, unpacked_patch
from lightpaint.paint.store.database import (
    APPLICATION,
    VERSION,
    damaged,
    free_name,
    opened,
    transaction,
)
from lightpaint.paint.store.lazy_arrays import DTYPES
from lightpaint.paint.store.light_requests import Wishes
from lightpaint.paint.store.steps import Identity, of_view
from lightpaint.screen import some_names
from lightpaint.storage.json_records import read_record, strict_json

#: What comes of a value that is another than was written.
DAMAGES = (
    *(sqlite3.Error, ArithmeticError, AttributeError, IndexError, LookupError),
    *(LightpaintError, TypeError, ValueError),
)

#: Rows of a table that are asked for one by one.
MOST_ROWS = 1_000_000

Row = Sequence[Any]


def mended(path: Path, identity: Identity | None) -> str:
    """Put a new session in the place of the damaged one at `path`; what became of it, in one line.

    Raises PaintError where nothing of it can be read, and OutputError for a place that cannot be
    written; nothing is changed then.
    """
    with tempfile.TemporaryDirectory(dir=path.parent, prefix=f".{path.name}.") as folder:
        copy, new = Path(folder) / "damaged.db", Path(folder) / path.name
        for ending in ("", "-wal"):
            with suppress(FileNotFoundError):
                shutil.copy(f"{path}{ending}", f"{copy}{ending}")
        lost = _carried_over(copy, new, path, identity)
        flush(new)
        aside = free_name(path)
        os.link(path, aside)
        if os.path.exists(f"{path}-wal"):
            os.rename(f"{path}-wal", f"{aside}-wal")
        os.replace(new, path)
    what = f"{', '.join(lost)} could not be read" if lost else "nothing that counts was lost"
    return f"{path} was damaged: {what}; all else is there, and the damaged file is kept as {aside}"


def _carried_over(copy: Path, new: Path, path: Path, identity: Identity | None) -> list[str]:
    """Write what can be read of `copy` to `new`. Returns what was lost. path: for errors."""
    try:
        old = sqlite3.connect(copy, isolation_level=None)
        with closing(old):
            old.execute("PRAGMA locking_mode = EXCLUSIVE").fetchall()
            old.execute("PRAGMA trusted_schema = OFF")
            [(application,)] = old.execute("PRAGMA application_id")
            [(version,)] = old.execute("PRAGMA user_version")
            if (application, version) != (APPLICATION, VERSION):
                raise PaintError("not of this version")
            its = _identity(old) or identity
            steps, lost_steps = _steps(old, its)
            looks, lost_looks = _looks(old)
            if its is None or not (steps or looks or not (lost_steps or lost_looks)):
                raise PaintError("nothing of it can be read")
            position = _position(old, [row[0][0] for row in steps])
    except (sqlite3.Error, PaintError) as error:
        raise damaged(path, error) from None
    with closing(opened(new, its)) as database, transaction(database):
        for row, pixels in steps:
            database.execute("INSERT INTO step VALUES (?, ?, ?, ?, ?)", row)
            if pixels is not None:
                database.execute("INSERT INTO pixels VALUES (?, ?, ?)", (row[0], *pixels))
        for row, arrays in looks:
            database.execute("INSERT INTO look VALUES (?, ?)", row)
            rows = [(row[0], *array) for array in arrays]
            database.executemany("INSERT INTO look_array VALUES (?, ?, ?, ?, ?)", rows)
        about = [("position", position), ("identity", json.dumps(asdict(its)))]
        database.executemany("INSERT OR REPLACE INTO about VALUES (?, ?)", about)
    lost = [f"{len(lost_steps)} step{'s' * (len(lost_steps) > 1)}"] * bool(lost_steps)
    if lost_looks:
        lost.append(f"the look{'s' * (len(lost_looks) > 1)} {some_names(lost_looks)}")
    return lost


def _identity(old: sqlite3.Connection) -> Identity | None:
    with suppress(*DAMAGES):
        [(said,)] = old.execute("SELECT value FROM about WHERE name = 'identity'")
        return read_record(Identity, strict_json(said))
    return None


def _position(old: sqlite3.Connection, ids: Sequence[int]) -> int:
    """How many of the steps that are left are done."""
    with suppress(*DAMAGES):
        [(position,)] = old.execute("SELECT value FROM about WHERE name = 'position'")
        before = [number for (number,) in _read(old, "SELECT id FROM step ORDER BY id")]
        if 0 <= int(position) <= len(before):
            done = set(before[: int(position)])
            return sum(number in done for number in ids)
    return len(ids)


def _steps(
    old: sqlite3.Connection, identity: Identity | None
) -> tuple[list[tuple[Row, Row | None]], list[int]]:
    """Rows of steps and their pixels, and numbers of those that cannot be read."""
    found: list[tuple[Row, Row | None]] = []
    lost = []
    for number in _numbers(old, "step", "id") | _numbers(old, "pixels", "step"):
        row = _row(old, "SELECT id, kind, label, fields, places FROM step WHERE id = ?", number)
        pixels = _row(old, "SELECT before, change FROM pixels WHERE step = ?", number)
        try:
            _check_step(row, pixels, identity)
        except DAMAGES:
            lost.append(number)
        else:
            assert row is not None
            found.append((row, pixels))
    return sorted(found, key=lambda one: int(one[0][0])), lost


def _check_step(row: Row | None, pixels: Row | None, identity: Identity | None) -> None:
    """Raise one of DAMAGES unless it is a step as they are written."""
    if row is None:
        raise ValueError("no row")
    _, kind, label, fields, places = row
    told, where = strict_json(fields), strict_json(places)
    if not (isinstance(kind, str) and isinstance(label, str) and isinstance(told, dict)):
        raise TypeError("other values")
    if told:
        for its in (told["before"], told["after"]):
            Wishes.of(its).constraints()
    regions = []
    for view, top, bottom, left, right, *marked in where:
        if not (0 <= top <= bottom and 0 <= left <= right and view >= 0):
            raise ValueError("no region")
        if identity is not None and view < len(identity.views):
            height, width = identity.views[view].size
            if bottom > height or right > width:
                raise ValueError("beyond the picture")
        regions.append(((int(top), int(bottom), int(left), int(right)), bool(marked)))
    for k in range(len(regions)):
        if pixels is None:
            raise ValueError("no pixels")
        unpacked_patch(regions, k, *pixels)


def _looks(old: sqlite3.Connection) -> tuple[list[tuple[Row, list[Row]]], list[str]]:
    """Rows of looks and of their arrays, and names of those that cannot be read."""
    found: list[tuple[Row, list[Row]]] = []
    lost = []
    for number in _numbers(old, "look", "id") | _numbers(old, "look_array", "look"):
        row = _row(old, "SELECT id, fields FROM look WHERE id = ?", number)
        name = f"of number {number}"
        arrays, gone = _arrays(old, number)
        try:
            assert row is not None
            name = str(strict_json(row[1])["name"])
            if gone - {of_view("thumbnail", k) for k in range(64)} or "weights" not in {
                array[0] for array in arrays
            }:
                raise ValueError("no picture")
            found.append((row, arrays))
        except (AssertionError, *DAMAGES):
            lost.append(name)
    return sorted(found, key=lambda one: int(one[0][0])), lost


def _arrays(old: sqlite3.Connection, look: int) -> tuple[list[Row], set[str]]:
    """Arrays of a look that can be read, and names of those that cannot."""
    found, gone = [], set()
    rows = _read(old, "SELECT rowid, name FROM look_array WHERE look = ?", look)
    for rowid, name in rows:
        ask = "SELECT name, dtype, shape, data FROM look_array WHERE rowid = ?"
        array = _row(old, ask, rowid)
        try:
            assert array is not None
            _, dtype, shape, data = array
            if dtype not in DTYPES:
                raise ValueError("no such type")
            unpacked(data, dtype, tuple(map(int, strict_json(shape))))
            found.append(array)
        except (AssertionError, *DAMAGES):
            gone.add(str(name))
    return found, gone


def _numbers(old: sqlite3.Connection, table: str, column: str) -> set[int]:
    """Numbers of rows, from both ends of a table of which something is damaged in between."""
    ask = f"SELECT {column} FROM {table} ORDER BY {column}"
    found = {x for way in ("", " DESC") for (x,) in _read(old, ask + way) if type(x) is int}
    with suppress(sqlite3.Error):
        if len(found) > 1 and old.execute(f"PRAGMA integrity_check({table})").fetchone() != ("ok",):
            found |= set(range(min(found), min(max(found), min(found) + MOST_ROWS)))
    return {x for x in found if _is_there(old, table, column, x)}


def _is_there(old: sqlite3.Connection, table: str, column: str, number: int) -> bool:
    """Whether there is such a row, or nobody can tell."""
    try:
        ask = f"SELECT count(*) FROM {table} WHERE {column} = ?"
        [(count,)] = old.execute(ask, (number,))
    except sqlite3.Error:
        return True
    return bool(count)


def _read(old: sqlite3.Connection, ask: str, *given: object) -> Iterator[Row]:
    """Rows until one cannot be read."""
    with suppress(sqlite3.Error):
        yield from old.execute(ask, given)


def _row(old: sqlite3.Connection, ask: str, *given: object) -> Row | None:
    """One row; None where there is none, or it cannot be read."""
    with suppress(sqlite3.Error):
        row: Row | None = old.execute(ask, given).fetchone()
        return row
    return None
