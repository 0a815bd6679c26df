"""Small records that a session keeps in its file beside its history."""

import json
import sqlite3
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict
from functools import partial
from typing import Any, Generic, TypeVar

from lightpaint.errors import LightpaintError
from lightpaint.paint.store.store import Store
from lightpaint.storage.json_records import read_record, strict_json

_Record = TypeVar("_Record")


class StoredRecords(Generic[_Record]):
    """A list of dataclass records in one row of a session file.

    store: keeps them. name: of the row. kind: the dataclass.
    """

    def __init__(self, store: Store, name: str, kind: type[_Record]) -> None:
        self._store, self._name, self._kind = store, name, kind

    def read(self) -> list[_Record]:
        """Return the records; none if they cannot be read."""
        for (text,) in self._store.rows(f"SELECT value FROM about WHERE name = '{self._name}'"):
            with suppress(LightpaintError, ValueError, TypeError):
                return [read_record(self._kind, entry) for entry in strict_json(str(text))]
        return []

    def write(self, records: Sequence[_Record]) -> None:
        """Replace the records, now or once the file takes them."""
        entries: list[Any] = list(records)
        content = json.dumps([asdict(entry) for entry in entries], ensure_ascii=False)
        self._store.enqueue(partial(_write, name=self._name, content=content))


def _write(database: sqlite3.Connection, *, name: str, content: str) -> None:
    database.execute("INSERT OR REPLACE INTO about VALUES (?, ?)", (name, content))
