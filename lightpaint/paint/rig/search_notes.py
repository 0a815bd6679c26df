"""Notes on searches for places of lights: what was tried, and what came of it, kept in the session.

They stand in the history beside its steps. A search that finds nothing changes nothing, so it is no
step; without a note, nobody would know later that it was tried.
"""

import json
import sqlite3
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict
from functools import partial

from lightpaint.errors import LightpaintError
from lightpaint.paint.protocol import SearchInfo
from lightpaint.paint.store.store import Store
from lightpaint.storage.json_records import read_record, strict_json

#: Name of the row with the notes in the session file, and how many of them are kept.
ROW, MAX_NOTES = "searches", 200


class SearchNotes:
    """The notes of a session. store: keeps them."""

    def __init__(self, store: Store) -> None:
        self._store, self._notes = store, list[SearchInfo]()
        for (text,) in store.rows(f"SELECT value FROM about WHERE name = '{ROW}'"):
            with suppress(LightpaintError, ValueError, TypeError):
                self._notes = [read_record(SearchInfo, entry) for entry in strict_json(str(text))]

    def add(self, title: str, text: str, tried: Sequence[str], seconds: float) -> SearchInfo:
        """Keep a note on a search that has just ended, after the step that is the last one now.

        title: what was searched for. text: what came of it. tried: sentences on what was tried.
        """
        number = max((note.id for note in self._notes), default=0) + 1
        stamp, after = time.time(), self._store.last_id
        note = SearchInfo(number, after, title, text, tuple(tried), stamp, round(seconds, 1))
        self._notes = [*self._notes, note][-MAX_NOTES:]
        content = json.dumps([asdict(note) for note in self._notes], ensure_ascii=False)
        self._store.enqueue(partial(_write, content=content))
        return note

    def listed(self) -> tuple[SearchInfo, ...]:
        """Return the notes whose step still exists, the oldest first."""
        ids = {0, *self._store.step_ids}
        return tuple(note for note in self._notes if note.after in ids)


def _write(database: sqlite3.Connection, *, content: str) -> None:
    database.execute("INSERT OR REPLACE INTO about VALUES (?, ?)", (ROW, content))
