"""Recovery of a damaged session file: its readable contents are copied into a new one.

A faulty disk damages single pages. Every row is therefore read separately and checked completely,
pixels included; losses are named. The damaged file stays beside the new one.
"""

import json
import os
import shutil
import sqlite3
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import closing, suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from lightpaint.display_text import some_names
from lightpaint.errors import LightpaintError, OutputError, PaintError
from lightpaint.files import flush
from lightpaint.paint.store.compression import unpack, unpack_patches
from lightpaint.paint.store.database import (
    APPLICATION,
    DAMAGE_ERRORS,
    REFERENCE_TABLE,
    VERSION,
    DamagedError,
    damaged_error,
    free_name,
    open_database,
    transaction,
)
from lightpaint.paint.store.history_steps import Identity, name_in_view
from lightpaint.paint.store.session_requests import SessionRequests
from lightpaint.paint.store.stored_arrays import DTYPES, parse_place
from lightpaint.storage.json_records import read_record, strict_json

#: Maximum number of rows of a damaged table that are tried one by one.
MAX_ROWS = 1_000_000

Row = Sequence[Any]

#: Errors raised by rows that cannot be read, or that no session has.
UNREADABLE_ERRORS = (AssertionError, LightpaintError, *DAMAGE_ERRORS)

#: Bytes of a database's header, and of the longest file that is given its length again.
HEADER_BYTES, MAX_RESTORED_BYTES = 100, 2**36


@dataclass
class Losses:
    """Rows that could not be read, by their names, and whether there may be others that nobody can
    name.
    """

    names: list[str] = field(default_factory=list)
    may_be_more: bool = False

    def __bool__(self) -> bool:
        return bool(self.names) or self.may_be_more

    def text(self, named: str, kind: str) -> str:
        """Return the losses as text. named: rows with a name. kind: a plural noun for the rows."""
        if not self.names:
            return f"an unknown number of {kind}"
        return named + " and perhaps more" * self.may_be_more


def _row_numbers(old: sqlite3.Connection, *columns: tuple[str, str]) -> tuple[set[int], Losses]:
    """Return the numbers that rows have in any of these tables and columns; and whether there may
    be more, as no table can be read to its end.
    """
    all_numbers: set[int] = set()
    is_whole = []
    for table, column in columns:
        numbers, is_read = _numbers_in(old, table, column)
        all_numbers |= numbers
        is_whole.append(is_read)
    return all_numbers, Losses(may_be_more=not any(is_whole))


def _numbers_in(old: sqlite3.Connection, table: str, column: str) -> tuple[set[int], bool]:
    """Return the numbers of rows, read from both ends of a table that may be damaged in between;
    and whether it can be read from one end to the other.
    """
    query = f"SELECT {column} FROM {table} ORDER BY {column}"
    numbers, is_whole = set(), False
    for order in ("", " DESC"):
        try:
            for (x,) in old.execute(query + order):
                if type(x) is int:
                    numbers.add(x)
            is_whole = True
        except sqlite3.Error:  # a damaged page
            continue
    with suppress(sqlite3.Error):
        if len(numbers) > 1 and old.execute(f"PRAGMA integrity_check({table})").fetchone() != (
            "ok",
        ):
            numbers |= set(range(min(numbers), min(max(numbers), min(numbers) + MAX_ROWS)))
    return {x for x in numbers if _row_exists(old, table, column, x)}, is_whole


def _row_exists(old: sqlite3.Connection, table: str, column: str, number: int) -> bool:
    """Return whether there is such a row, or nobody can tell."""
    try:
        query = f"SELECT count(*) FROM {table} WHERE {column} = ?"
        [(count,)] = old.execute(query, (number,))
    except sqlite3.Error:
        return True
    return bool(count)


def _readable_rows(old: sqlite3.Connection, query: str, *values: object) -> Iterator[Row]:
    """Yield rows until one cannot be read."""
    with suppress(sqlite3.Error):
        yield from old.execute(query, values)


def _read_row(old: sqlite3.Connection, query: str, *values: object) -> Row | None:
    """Return one row; None if it does not exist or cannot be read."""
    with suppress(sqlite3.Error):
        row: Row | None = old.execute(query, values).fetchone()
        return row
    return None


def recover_or_raise(path: Path, identity: Identity | None, error: DamagedError | None) -> str:
    """Recover a session as `recover` does. Raises `error`, or an OutputError without one, where the
    system does not let it.
    """
    try:
        return recover(path, identity)
    except OSError as reason:
        text = f"cannot write beside {path}: {reason.strerror or reason}"
        raise error or OutputError(text) from None


def recover(path: Path, identity: Identity | None) -> str:
    """Replace the damaged session at `path` by its readable part; return the result in one line.

    Raises PaintError if nothing can be read, OutputError if the new file cannot be written; nothing
    is changed then.
    """
    with tempfile.TemporaryDirectory(dir=path.parent, prefix=f".{path.name}.") as folder:
        copy, new = Path(folder) / "damaged.db", Path(folder) / path.name
        for ending in ("", "-wal"):
            with suppress(FileNotFoundError):
                shutil.copy(f"{path}{ending}", f"{copy}{ending}")
        _restore_length(copy)
        lost = _copy_readable(copy, new, path, identity)
        flush(new)
        aside = free_name(path)
        os.link(path, aside)
        if os.path.exists(f"{path}-wal"):
            os.rename(f"{path}-wal", f"{aside}-wal")
        os.replace(new, path)
    losses = f"{', '.join(lost)} could not be read" if lost else "nothing that counts was lost"
    return (
        f"{path} was damaged: {losses}; all else is there, and the damaged file is kept as {aside}"
    )


def _restore_length(file: Path) -> None:
    """Give a database that was cut off its length again, of empty pages: SQLite reads none of a
    shorter one.
    """
    with file.open("r+b") as opened:
        header = opened.read(HEADER_BYTES)
        page_bytes = int.from_bytes(header[16:18], "big")
        length = page_bytes * int.from_bytes(header[28:32], "big")
        if file.stat().st_size < length <= MAX_RESTORED_BYTES:
            opened.truncate(length)


def _copy_readable(copy: Path, new: Path, path: Path, identity: Identity | None) -> list[str]:
    """Write the readable part of `copy` to `new`, and return the losses. path: for errors."""
    try:
        old = sqlite3.connect(copy, isolation_level=None)
        with closing(old):
            old.execute("PRAGMA locking_mode = EXCLUSIVE").fetchall()
            old.execute("PRAGMA trusted_schema = OFF")
            [(application,)] = old.execute("PRAGMA application_id")
            [(version,)] = old.execute("PRAGMA user_version")
            if application != APPLICATION or version != VERSION:
                raise PaintError("not of this version")
            stored_identity = _read_identity(old) or identity
            steps, lost_steps = _read_steps(old, stored_identity)
            looks, lost_looks = _read_looks(old)
            if stored_identity is None or not (steps or looks or not (lost_steps or lost_looks)):
                raise PaintError("nothing of it can be read")
            position = _read_position(old, [row[0][0] for row in steps])
            references = _read_references(old)
    except (sqlite3.Error, PaintError) as error:
        raise damaged_error(path, error) from None
    with closing(open_database(new, stored_identity)) as database, transaction(database):
        for row, pixels in steps:
            database.execute("INSERT INTO step VALUES (?, ?, ?, ?, ?)", row)
            if pixels is not None:
                database.execute("INSERT INTO pixels VALUES (?, ?, ?)", (row[0], *pixels))
        for row, arrays in looks:
            database.execute("INSERT INTO look VALUES (?, ?)", row)
            rows = [(row[0], *array) for array in arrays]
            database.executemany("INSERT INTO look_array VALUES (?, ?, ?, ?, ?)", rows)
        if references:
            database.execute(REFERENCE_TABLE)
            database.executemany("INSERT INTO reference VALUES (?, ?, ?, ?, ?)", references)
        values = [("position", position), ("identity", json.dumps(asdict(stored_identity)))]
        database.executemany("INSERT OR REPLACE INTO about VALUES (?, ?)", values)
    lost = []
    if lost_steps:
        count = len(lost_steps.names)
        lost.append(lost_steps.text(f"{count} step{'s' * (count > 1)}", "steps"))
    if lost_looks:
        names = lost_looks.names
        lost.append(
            lost_looks.text(f"the look{'s' * (len(names) > 1)} {some_names(names)}", "looks")
        )
    return lost


def _read_identity(old: sqlite3.Connection) -> Identity | None:
    with suppress(*UNREADABLE_ERRORS):
        [(text,)] = old.execute("SELECT value FROM about WHERE name = 'identity'")
        return read_record(Identity, strict_json(text))
    return None


def _read_position(old: sqlite3.Connection, ids: Sequence[int]) -> int:
    """Return how many of the readable steps are done."""
    with suppress(*UNREADABLE_ERRORS):
        [(position,)] = old.execute("SELECT value FROM about WHERE name = 'position'")
        numbers = [number for (number,) in _readable_rows(old, "SELECT id FROM step ORDER BY id")]
        if 0 <= int(position) <= len(numbers):
            done_numbers = set(numbers[: int(position)])
            return sum(number in done_numbers for number in ids)
    return len(ids)


def _read_steps(
    old: sqlite3.Connection, identity: Identity | None
) -> tuple[list[tuple[Row, Row | None]], Losses]:
    """Return rows of steps and their pixels, and numbers of those that cannot be read."""
    steps: list[tuple[Row, Row | None]] = []
    numbers, lost = _row_numbers(old, ("step", "id"), ("pixels", "step"))
    for number in numbers:
        row = _read_row(
            old, "SELECT id, kind, label, fields, places FROM step WHERE id = ?", number
        )
        pixels = _read_row(old, "SELECT before, change FROM pixels WHERE step = ?", number)
        try:
            _check_step(row, pixels, identity)
        except UNREADABLE_ERRORS:
            lost.names.append(str(number))
        else:
            assert row is not None
            steps.append((row, pixels))
    return sorted(steps, key=lambda step: int(step[0][0])), lost


def _check_step(row: Row | None, pixels: Row | None, identity: Identity | None) -> None:
    """Raise one of UNREADABLE_ERRORS unless the row is a valid step."""
    if row is None:
        raise ValueError("no row")
    _, kind, label, fields, places = row
    values, stored_places = strict_json(fields), strict_json(places)
    if not (isinstance(kind, str) and isinstance(label, str) and isinstance(values, dict)):
        raise TypeError("other values")
    for requests in (values["before"], values["after"]) if "before" in values else ():
        SessionRequests.of(requests).constraints()
    regions = []
    for view, (top, bottom, left, right), marked, _ in map(parse_place, stored_places):
        if not (0 <= top <= bottom and 0 <= left <= right and view >= 0):
            raise ValueError("no region")
        if identity is not None and view < len(identity.views):
            height, width = identity.views[view].size
            if bottom > height or right > width:
                raise ValueError("beyond the picture")
        regions.append(((top, bottom, left, right), marked))
    if regions:
        if pixels is None:
            raise ValueError("no pixels")
        unpack_patches(regions, *pixels)


def _read_looks(old: sqlite3.Connection) -> tuple[list[tuple[Row, list[Row]]], Losses]:
    """Return rows of looks and of their arrays, and names of those that cannot be read."""
    looks: list[tuple[Row, list[Row]]] = []
    numbers, lost = _row_numbers(old, ("look", "id"), ("look_array", "look"))
    for number in numbers:
        row = _read_row(old, "SELECT id, fields FROM look WHERE id = ?", number)
        name = f"of number {number}"
        arrays, unreadable = _read_arrays(old, number)
        try:
            assert row is not None
            name = str(strict_json(row[1])["name"])
            if unreadable - {name_in_view("thumbnail", k) for k in range(64)} or "weights" not in {
                array[0] for array in arrays
            }:
                raise ValueError("no picture")
            looks.append((row, arrays))
        except UNREADABLE_ERRORS:
            lost.names.append(name)
    return sorted(looks, key=lambda look: int(look[0][0])), lost


def _read_arrays(old: sqlite3.Connection, look: int) -> tuple[list[Row], set[str]]:
    """Return arrays of a look that can be read, and names of those that cannot."""
    arrays, unreadable = [], set()
    rows = _readable_rows(old, "SELECT rowid, name FROM look_array WHERE look = ?", look)
    for rowid, name in rows:
        query = "SELECT name, dtype, shape, data FROM look_array WHERE rowid = ?"
        array = _read_row(old, query, rowid)
        try:
            assert array is not None
            _, dtype, shape, data = array
            if dtype not in DTYPES:
                raise ValueError("no such type")
            unpack(data, dtype, tuple(map(int, strict_json(shape))))
            arrays.append(array)
        except UNREADABLE_ERRORS:
            unreadable.add(str(name))
    return arrays, unreadable


def _read_references(old: sqlite3.Connection) -> list[Row]:
    """Return the rows of references that can be read; nobody misses a lost one in the answer."""
    with suppress(*UNREADABLE_ERRORS):
        query = "SELECT id, name, dtype, shape, data FROM reference WHERE id = ?"
        numbers, _ = _row_numbers(old, ("reference", "id"))
        rows = [_read_row(old, query, number) for number in numbers]
        return [row for row in rows if row is not None]
    return []
