"""Rows of a damaged database: readable rows, and the names of the others."""

import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

#: Errors raised by damaged pages, rows and values.
DAMAGE_ERRORS = (sqlite3.Error, ArithmeticError, AttributeError, LookupError, TypeError, ValueError)

#: Maximum number of rows of a damaged table that are tried one by one.
MAX_ROWS = 1_000_000

Row = Sequence[Any]


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


def row_numbers(old: sqlite3.Connection, *columns: tuple[str, str]) -> tuple[set[int], Losses]:
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


def readable_rows(old: sqlite3.Connection, query: str, *values: object) -> Iterator[Row]:
    """Yield rows until one cannot be read."""
    with suppress(sqlite3.Error):
        yield from old.execute(query, values)


def read_row(old: sqlite3.Connection, query: str, *values: object) -> Row | None:
    """Return one row; None if it does not exist or cannot be read."""
    with suppress(sqlite3.Error):
        row: Row | None = old.execute(query, values).fetchone()
        return row
    return None
