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

import hashlib
import json
import sqlite3
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from threading import RLock
from typing import Any, Generic, TypeVar

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.errors import LightpaintError, OutputError, PaintError
from lightpaint.paint.store import stored_arrays
from lightpaint.paint.store.compression import pack_patches, pack_pixels, unpack_pixels
from lightpaint.paint.store.database import (
    DAMAGE_ERRORS,
    DamagedError,
    WriteJob,
    WriteQueue,
    check_pages,
    damaged_error,
    identify,
    transaction,
)
from lightpaint.paint.store.history_steps import Identity, Pixels, Region, Step, StoredLook
from lightpaint.paint.store.recovery import recover_or_raise
from lightpaint.storage.json_records import read_record, strict_json

#: Version of the composition of layers: to be raised when layers come to other bits.
COMPOSITION_VERSION = 1

_COMPOSITION_TABLE = """
CREATE TABLE IF NOT EXISTS composition
(view INTEGER PRIMARY KEY, step INTEGER, about TEXT, pixels BLOB, digest BLOB)
"""

#: Bounds, mean and least coverage of a layer.
LayerValues = tuple[Region, float, float]

#: View, id of the step, all but the pixels as JSON, packed pixels, and the digest of these.
CompositionRow = tuple[int, int, str, bytes, bytes]

_Record = TypeVar("_Record")


@dataclass(frozen=True, eq=False)
class StoredComposition:
    """The target of a view after some step, kept so that a file opens without pixels of layers.

    layers: of each layer, by id, what is known without its pixels. pixels: the target.

    It is stored twice, as it also follows from the steps: a row is used only if its digest is
    right, if the step that it follows is still there, and if the current look below the layers is
    the same. Ids of steps are never used twice, so no other steps can lead to such a row. Anything
    else is composed again.
    """

    layers: Mapping[int, LayerValues]
    pixels: Pixels


def _composition_rows(
    step: int, current_looks: Sequence[Floats], compositions: Sequence[StoredComposition]
) -> list[CompositionRow]:
    """Return the rows of the compositions of all views after a step."""
    rows: list[CompositionRow] = []
    for view, (look, composition) in enumerate(zip(current_looks, compositions, strict=True)):
        pixels = composition.pixels
        about = json.dumps(
            {
                "version": COMPOSITION_VERSION,
                "look": _look_text(look),
                "size": [*pixels.importance.shape],
                "marked": pixels.at_least is not None,
                "layers": {str(n): values for n, values in composition.layers.items()},
            }
        )
        blob = pack_pixels(pixels)
        rows.append((view, step, about, blob, _digest(_digested_text(view, step, about), blob)))
    return rows


def _store_compositions(database: sqlite3.Connection, *, rows: Sequence[CompositionRow]) -> None:
    """Replace the compositions by the compositions of all views. Where that fails, nothing is
    lost."""
    with suppress(sqlite3.Error), transaction(database):
        database.execute(_COMPOSITION_TABLE)
        database.execute("DELETE FROM composition")
        database.executemany("INSERT INTO composition VALUES (?, ?, ?, ?, ?)", rows)


def _read_compositions(
    database: sqlite3.Connection, current_looks: Sequence[Floats]
) -> tuple[int, list[StoredComposition]] | None:
    """Return the id of a step and the compositions of all views after it; None if there are none
    for these current looks.
    """
    with suppress(PaintError, *DAMAGE_ERRORS):
        query = "SELECT view, step, about, pixels, digest FROM composition ORDER BY view"
        rows: list[CompositionRow] = database.execute(query).fetchall()
        steps = {step for _, step, *_ in rows}
        if [view for view, *_ in rows] == list(range(len(current_looks))) and len(steps) == 1:
            pairs = zip(rows, current_looks, strict=True)
            return steps.pop(), [_read_composition(row, look) for row, look in pairs]
    return None


def _read_composition(row: CompositionRow, look: Floats) -> StoredComposition:
    """Return the composition in a row. Raises PaintError or DAMAGE_ERRORS for any other."""
    view, step, text, blob, digest = row
    about = strict_json(text)
    is_own = about["version"] == COMPOSITION_VERSION and about["size"] == [*look.shape[:2]]
    if not is_own or about["look"] != _look_text(look):
        raise PaintError("a composition on another look")
    if digest != _digest(_digested_text(view, step, text), blob):
        raise PaintError("a damaged composition")
    height, width = look.shape[:2]
    layers = {
        int(number): ((top, bottom, left, right), float(mean), float(least))
        for number, ((top, bottom, left, right), mean, least) in about["layers"].items()
    }
    pixels = unpack_pixels(blob, (0, height, 0, width), marked=bool(about["marked"]))
    return StoredComposition(layers, pixels)


def _look_text(look: Floats) -> str:
    return _digest(np.ascontiguousarray(look, np.float32).data).hex()


def _digested_text(view: int, step: int, about: str) -> bytes:
    return f"{view} {step} {about}".encode()


def _digest(*parts: bytes | memoryview) -> bytes:
    digest = hashlib.blake2b(digest_size=16)
    for part in parts:
        digest.update(part)
    return digest.digest()


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
        self._arrays = stored_arrays.StoredArrays(path, self._lock, lambda: self._database)
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
            fields, places = stored_arrays.to_json(step.fields), stored_arrays.places_json(patches)
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
            self.enqueue(
                partial(stored_arrays.insert_step, row=row, blobs=blobs, last_kept=last_kept)
            )

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

    def put_answer(self, answer: stored_arrays.StepAnswer) -> None:
        """Keep the answer after the last step that is done.

        It is written with what is written next: a session that ends before that lacks it.
        """
        with self._lock:
            self._arrays.keep_answer(self.last_id, answer)
            fields, picture = answer.packed()
            self._queue.add(
                partial(
                    stored_arrays.insert_answer, step=self.last_id, fields=fields, picture=picture
                )
            )

    def answer(self, step: int) -> stored_arrays.StepAnswer | None:
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
            fields, arrays = stored_arrays.to_json(look.fields), look.arrays
            number, blobs = look.id, None
            if not (
                isinstance(arrays, stored_arrays.LookArrays)
                and arrays.matches(self._arrays, number)
            ):
                blobs = stored_arrays.pack_arrays(arrays)
                self._arrays.keep_look(number, blobs)
            self._looks[number] = self._make_look(number, fields)
            self.enqueue(
                partial(stored_arrays.insert_look, number=number, fields=fields, arrays=blobs)
            )

    def drop_look(self, number: int) -> None:
        """Forget a look. Raises PaintError if there is none of that number."""
        with self._lock:
            if self._looks.pop(number, None) is None:
                raise PaintError(f"no look {number}")
            self._arrays.drop_look(number)
            self.enqueue(partial(stored_arrays.delete_look, number=number))

    def put_compositions(
        self,
        step: int,
        current_looks: Sequence[Floats],
        compositions: Sequence[StoredComposition],
    ) -> None:
        """Keep the compositions of all views after the step of an id, if the file takes them."""
        rows = _composition_rows(step, current_looks, compositions)
        with self._lock:
            if self.has_file and self.flush() is None:
                _store_compositions(self._database, rows=rows)

    def compositions(
        self, current_looks: Sequence[Floats]
    ) -> tuple[int, list[StoredComposition]] | None:
        """Return how many steps are done in the compositions that are kept, and these, by view.

        None if there are none for these current looks, or they are not of steps that are done.
        """
        with self._lock:
            found = _read_compositions(self._database, current_looks)
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
        for row in stored_arrays.step_rows(self._database):
            self.steps.append(self._make_step(*row))
            self._ids.append(row[0])
        self._last = self._ids[-1] if self._ids else 0
        position = stored_arrays.read_position(self._database)
        self.position = len(self.steps) if position is None else min(position, len(self.steps))
        for number, fields in stored_arrays.look_rows(self._database):
            self._looks[number] = look = self._make_look(number, fields)
            if not isinstance(look.fields["name"], str):
                raise TypeError("a look without a name")

    def _make_step(self, number: int, kind: str, label: str, fields: str, places: str) -> Step:
        patches = self._arrays.patches(number, places)
        return Step(str(kind), str(label), strict_json(fields), patches)

    def _make_look(self, number: int, fields: str) -> StoredLook:
        return StoredLook(
            number, strict_json(fields), stored_arrays.LookArrays(self._arrays, number)
        )


class MemoryStore(Store):
    """A session without a file, for notebooks and tests."""

    def __init__(self, identity: Identity | None = None) -> None:
        super().__init__(None, identity)


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
        self._store.enqueue(partial(_write_record, name=self._name, content=content))


def _write_record(database: sqlite3.Connection, *, name: str, content: str) -> None:
    database.execute("INSERT OR REPLACE INTO about VALUES (?, ?)", (name, content))
