"""The session file: each step is written when `append` returns, and survives a crash.

It is a SQLite database in WAL mode, and no journal of our own. A process or a machine that stops in
the middle of a write leaves the last whole step; SQLite has been tested for that far more than a
file format of ours would be. Undo cuts the tail off in one transaction with the step that replaces
it; looks are renamed and deleted, and their room is used again or given back; and of a long history
only labels are read at a start, since labels and pixels stand in two tables. An append-only journal
would need all of that built.

Pixels are stored packed (`compression.py`) and read when they are needed, so that an unlimited
history takes no memory.
"""

import sqlite3
from collections.abc import Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from threading import RLock
from typing import Any

from lightpaint.arrays import Floats
from lightpaint.errors import OutputError, PaintError
from lightpaint.paint.store.compression import pack_patches
from lightpaint.paint.store.database import (
    DAMAGE_ERRORS,
    DamagedError,
    WriteJob,
    WriteQueue,
    check_pages,
    damaged_error,
    identify,
)
from lightpaint.paint.store.history_steps import Identity, Step, StoredLook
from lightpaint.paint.store.recovery import recover_or_raise
from lightpaint.paint.store.stored_arrays import (
    LookArrays,
    StepAnswer,
    StoredArrays,
    delete_look,
    insert_answer,
    insert_look,
    insert_step,
    look_rows,
    pack_arrays,
    places_json,
    read_position,
    step_rows,
    to_json,
)
from lightpaint.paint.store.stored_compositions import (
    StoredComposition,
    composition_rows,
    read_compositions,
    store_compositions,
)
from lightpaint.storage.json_records import strict_json


class Store:
    """Steps and looks of one session, in memory and in a file.

    Attributes:
        path: The file; None for a session in memory only.
        identity: Identity of the painted views.
        steps: All, in order, including undone ones; `append` cuts these off. Their pixels are read
            from the file when they are needed. Read-only.
        position: How many of them are done.
        remarks: On the file: its parts that could not be read.
    """

    def __init__(self, path: Path | None, identity: Identity | None) -> None:
        self.path, self.identity = path, identity
        self.steps: list[Step] = []
        self.position = 0
        self._lock = RLock()
        self._looks: dict[int, StoredLook] = {}
        self._ids: list[int] = []  # of the steps; they only grow
        self._last = 0  # id of the last step there ever was
        self._arrays = StoredArrays(path, self._lock, lambda: self._database)
        self.remarks: list[str] = []
        try:
            self._open_file()
        except DamagedError as error:
            if path is None or not path.is_file():
                raise
            self.remarks.append(recover_or_raise(path, identity, error))
            self._open_file()

    @classmethod
    def open(cls, path: Path, identity: Identity | None) -> "Store":
        """Open the session at `path`, or create it, for this process alone.

        identity: None if not known yet (`set_identity`).

        Raises PaintError if another process has it open, if it is damaged, or if its lights or size
        differ; OutputError if it cannot be written.
        """
        return cls(path, identity)

    def _open_file(self) -> None:
        """Open the file, and read all of it but pixels. Raises DamagedError, and others."""
        self._queue = WriteQueue(self.path, self.identity)
        self.steps.clear()
        self._ids.clear()
        self._looks.clear()
        try:
            check_pages(self._database)
            self._read_all()
        except DAMAGE_ERRORS as error:
            self._database.close()
            raise damaged_error(self.path, error) from None
        except BaseException:
            self._database.close()
            raise

    @property
    def _database(self) -> sqlite3.Connection:
        """The database, which another takes the place of when its file is written again."""
        return self._queue.database

    @property
    def unsaved(self) -> str | None:
        """Why the last steps are in memory only, in one line; None if all is written."""
        return self._queue.unsaved

    def recover(self) -> str:
        """Continue with the readable part of the file, which turned out to be damaged.

        Returns the losses in one line, which is also among the remarks. Raises PaintError if
        recovery is impossible.
        """
        with self._lock:
            if self.path is None or self.flush() is not None:
                raise PaintError(f"{self.path} is damaged")
            self._database.close()
            try:
                result = recover_or_raise(self.path, self.identity, None)
            finally:
                self._open_file()
            self.remarks.append(result)
            return result

    def set_identity(self, identity: Identity) -> None:
        """Set the identity, unknown when the file was opened. Raises PaintError if the file has
        another.
        """
        with self._lock:
            identify(self._database, self.path, identity)
            self.identity = self._queue.identity = identity

    def append(self, step: Step) -> None:
        """Append `step` after those that are done; undone steps are cut off."""
        with self._lock:
            patches = step.patches
            fields, places = to_json(step.fields), places_json(patches)
            blobs = pack_patches(patches) if patches else None
            del self.steps[self.position :], self._ids[self.position :]
            last_kept = self._ids[-1] if self._ids else 0
            self._last = number = self._last + 1
            if blobs is not None:
                self._arrays.keep_pixels(number, blobs)
            self.steps.append(self._make_step(number, step.kind, step.label, fields, places))
            self._ids.append(number)
            self.position += 1

            row = (number, step.kind, step.label, fields, places)
            self.enqueue(partial(insert_step, row=row, blobs=blobs, last_kept=last_kept))

    def move_to(self, position: int) -> None:
        """Undo or redo steps: `position` of them are done."""
        with self._lock:
            if not 0 <= position <= len(self.steps):
                raise PaintError(f"no step {position}: there are {len(self.steps)}")
            self.position = position
            self.enqueue(lambda _: None)

    @property
    def step_ids(self) -> tuple[int, ...]:
        """Ids of all steps, in order: positive, and growing."""
        return tuple(self._ids)

    @property
    def last_id(self) -> int:
        """Id of the last step that is done; 0 before the first."""
        return self._ids[self.position - 1] if self.position else 0

    def put_answer(self, answer: StepAnswer) -> None:
        """Keep the answer after the last step that is done.

        It is written with what is written next: a session that ends before that lacks it.
        """
        with self._lock:
            self._arrays.keep_answer(self.last_id, answer)
            fields, picture = answer.packed()
            self._queue.add(
                partial(insert_answer, step=self.last_id, fields=fields, picture=picture)
            )

    def answer(self, step: int) -> StepAnswer | None:
        """Return the answer after a step by its id, 0 for the beginning; None without one."""
        return self._arrays.answer(step)

    @property
    def has_file(self) -> bool:
        """True if there is a file."""
        return self.path is not None

    def looks(self) -> list[StoredLook]:
        """Return all looks, the oldest first; their arrays are read when they are needed."""
        with self._lock:
            return list(self._looks.values())

    def put_look(self, look: StoredLook) -> None:
        """Keep a look, replacing the one of its number if there is one."""
        with self._lock:
            fields, arrays = to_json(look.fields), look.arrays
            number, blobs = look.id, None
            if not (isinstance(arrays, LookArrays) and arrays.matches(self._arrays, number)):
                blobs = pack_arrays(arrays)
                self._arrays.keep_look(number, blobs)
            self._looks[number] = self._make_look(number, fields)
            self.enqueue(partial(insert_look, number=number, fields=fields, arrays=blobs))

    def drop_look(self, number: int) -> None:
        """Forget a look. Raises PaintError if there is none of that number."""
        with self._lock:
            if self._looks.pop(number, None) is None:
                raise PaintError(f"no look {number}")
            self._arrays.drop_look(number)
            self.enqueue(partial(delete_look, number=number))

    def put_compositions(
        self,
        step: int,
        current_looks: Sequence[Floats],
        compositions: Sequence[StoredComposition],
    ) -> None:
        """Keep the compositions of all views after the step of an id, if the file takes them."""
        rows = composition_rows(step, current_looks, compositions)
        with self._lock:
            if self.has_file and self.flush() is None:
                store_compositions(self._database, rows=rows)

    def compositions(
        self, current_looks: Sequence[Floats]
    ) -> tuple[int, list[StoredComposition]] | None:
        """Return how many steps are done in the compositions that are kept, and these, by view.

        None if there are none for these current looks, or they are not of steps that are done.
        """
        with self._lock:
            found = read_compositions(self._database, current_looks)
            ids = [0, *self._ids[: self.position]]
            return (ids.index(found[0]), found[1]) if found and found[0] in ids else None

    def flush(self) -> str | None:
        """Write the steps that are in memory only. Returns why that is not possible, or None."""
        with self._lock:
            if self._queue.flush(self.position) is None:
                self._arrays.release_written()
            return self.unsaved

    def close(self) -> None:
        """Write the remaining steps, and release the file for other processes.

        Raises OutputError if something cannot be written; it is lost then.
        """
        with self._lock:
            self.flush()
            unsaved = self._queue.close()
        if unsaved is not None:
            raise OutputError(f"the last steps are lost: {unsaved}")

    def __enter__(self) -> "Store":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def enqueue(self, write: WriteJob) -> None:
        """Write what steps and looks do not have, now or once the file takes it."""
        with self._lock:
            self._queue.add(write)
            self.flush()

    def rows(self, query: str) -> list[tuple[Any, ...]]:
        """Return the rows of a query; none if they cannot be read."""
        with self._lock, suppress(*DAMAGE_ERRORS):
            return self._database.execute(query).fetchall()
        return []

    def _read_all(self) -> None:
        """Read all of the file but pixels."""
        for row in step_rows(self._database):
            self.steps.append(self._make_step(*row))
            self._ids.append(row[0])
        self._last = self._ids[-1] if self._ids else 0
        position = read_position(self._database)
        self.position = len(self.steps) if position is None else min(position, len(self.steps))
        for number, fields in look_rows(self._database):
            self._looks[number] = look = self._make_look(number, fields)
            if not isinstance(look.fields["name"], str):
                raise TypeError("a look without a name")

    def _make_step(self, number: int, kind: str, label: str, fields: str, places: str) -> Step:
        patches = self._arrays.patches(number, places)
        return Step(str(kind), str(label), strict_json(fields), patches)

    def _make_look(self, number: int, fields: str) -> StoredLook:
        return StoredLook(number, strict_json(fields), LookArrays(self._arrays, number))


class MemoryStore(Store):
    """A session without a file, for notebooks and tests."""

    def __init__(self, identity: Identity | None = None) -> None:
        super().__init__(None, identity)
