"""Contents of a session file: rows of its tables, and arrays that are read on first use.

Pixels of steps and arrays of looks are in the file, or in memory until they are written.
"""

import json
import sqlite3
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from threading import RLock
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles
from lightpaint.errors import PaintError
from lightpaint.files import first_line
from lightpaint.paint.store.compression import is_marked, pack, unpack, unpack_patches
from lightpaint.paint.store.database import (
    APPLICATION,
    DAMAGE_ERRORS,
    InUseError,
    damaged_error,
    is_in_use,
)
from lightpaint.paint.store.history_steps import Patch, Pixels, Region
from lightpaint.paint.store.session_requests import SessionRequests
from lightpaint.storage.json_records import strict_json

#: A stored step: id, kind, label, fields and places, the last two as JSON.
StepRow = tuple[int, str, str, str, str]

#: Element types of a look's arrays.
DTYPES = ("float32", "float64", "float16", "uint8", "int16")

#: An array of a look: dtype, shape as JSON, data; and all of them by name.
PackedArray = tuple[str, str, bytes]
PackedArrays = dict[str, PackedArray]


def insert_step(
    database: sqlite3.Connection,
    *,
    row: StepRow,
    blobs: tuple[bytes, bytes] | None,
    last_kept: int,
) -> None:
    """Write a step after the step of the id `last_kept`; later ones are cut off.

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


def _pixels_row(database: sqlite3.Connection, step: int) -> tuple[bytes, bytes] | None:
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


def _answer_row(database: sqlite3.Connection, step: int) -> tuple[str, bytes] | None:
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
    """Write a look in the place of the look of its number. arrays: None to keep those it has."""
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


def _array_names(database: sqlite3.Connection, look: int) -> list[str]:
    """Return the names of a look's arrays, in order."""
    query = "SELECT name FROM look_array WHERE look = ? ORDER BY rowid"
    return [name for (name,) in database.execute(query, (look,))]


def _array_row(database: sqlite3.Connection, look: int, name: str) -> PackedArray | None:
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


class StoredPatch(Patch):
    """A patch in a file. read: returns its pixels before and after."""

    def __init__(
        self, view: int, layer: int, region: Region, read: Callable[[], tuple[Pixels, Pixels]]
    ) -> None:
        vars(self).update(view=view, layer=layer, region=region, _read=read)

    @property
    def before(self) -> Pixels:
        return self._pixels()[0]

    @property
    def after(self) -> Pixels:
        return self._pixels()[1]

    def _pixels(self) -> tuple[Pixels, Pixels]:
        pixels: tuple[Pixels, Pixels] = vars(self)["_read"]()
        return pixels


@dataclass(frozen=True, eq=False)
class StepAnswer:
    """The lighting after a step, as it was shown.

    weights: emission (3,) by name of light, under the master dimmer. places: of lights,
    as a text that is equal for equal places. picture: (h, w, 3) uint8, small, in display values.
    """

    weights: dict[str, tuple[float, ...]]
    places: str
    picture: npt.NDArray[np.uint8]

    def packed(self) -> tuple[str, bytes]:
        """Return JSON and bytes, which `unpacked` reads."""
        fields = {
            "weights": self.weights,
            "places": self.places,
            "shape": self.picture.shape,
        }
        return json.dumps(fields), pack(np.ascontiguousarray(self.picture))

    @classmethod
    def unpacked(cls, fields: str, picture: bytes) -> "StepAnswer":
        """Return what `packed` wrote. Raises PaintError, LookupError, TypeError or ValueError for
        anything else.
        """
        values = strict_json(fields)
        weights = {str(name): tuple(map(float, rgb)) for name, rgb in values["weights"].items()}
        shape = tuple(map(int, values["shape"]))
        pixels = np.asarray(unpack(picture, "uint8", shape))
        if pixels.ndim != 3 or any(len(rgb) != 3 for rgb in weights.values()):
            raise ValueError("no answer")
        return cls(weights, str(values["places"]), pixels)

    def weights_of(self, names: tuple[str, ...]) -> Doubles:
        """Return the weights (n, 3) of lights with these names; 0 for others."""
        return np.array([self.weights.get(name, (0.0, 0.0, 0.0)) for name in names], np.float64)


class StoredArrays:
    """Packed arrays of one session: in memory until they are written, and read from its file then.

    path: of the file, for errors. lock: held while the database is read. database: returns it.
    """

    def __init__(
        self, path: Path | None, lock: RLock, database: Callable[[], sqlite3.Connection]
    ) -> None:
        self._path, self._lock, self._database = path, lock, database
        self._unwritten_pixels: dict[int, tuple[bytes, bytes]] = {}  # by step
        self._unwritten_looks: dict[int, PackedArrays] = {}
        self._unwritten_answers: dict[int, StepAnswer] = {}  # by step
        # The step that was read last, since its patches are packed together.
        self._last_read: tuple[int, list[tuple[Pixels, Pixels]]] = (0, [])

    def keep_pixels(self, step: int, blobs: tuple[bytes, bytes]) -> None:
        """Keep the pixels before a step, and their change, until they are written."""
        self._last_read = 0, []
        self._unwritten_pixels[step] = blobs

    def keep_look(self, number: int, arrays: PackedArrays) -> None:
        """Keep the arrays of a look until they are written."""
        self._unwritten_looks[number] = arrays

    def drop_look(self, number: int) -> None:
        """Forget the arrays of a look that are not written."""
        self._unwritten_looks.pop(number, None)

    def keep_answer(self, step: int, answer: StepAnswer) -> None:
        """Keep the answer after a step until it is written."""
        self._unwritten_answers[step] = answer

    def release_written(self) -> None:
        """Free the memory, since all is written."""
        self._last_read = 0, []
        self._unwritten_pixels.clear()
        self._unwritten_looks.clear()
        self._unwritten_answers.clear()

    def patches(self, step: int, stored_places: str) -> tuple[StoredPatch, ...]:
        """Return the patches of a step, whose pixels are read when they are needed.

        stored_places: as `places_json` returns them.
        """
        stored = [parse_place(place) for place in strict_json(stored_places)]
        places = [(place.region, place.marked) for place in stored]
        return tuple(
            StoredPatch(
                place.view, place.layer, place.region, partial(self._read_pixels, step, places, k)
            )
            for k, place in enumerate(stored)
        )

    def look_names(self, number: int) -> list[str]:
        """Return the names of a look's arrays, in order."""
        with self._lock:
            if number in self._unwritten_looks:
                return list(self._unwritten_looks[number])
            with self._as_damage():
                return _array_names(self._database(), number)

    def look_array(self, number: int, name: str) -> PackedArray:
        """Return one array of a look, and read no other. Raises KeyError if there is none."""
        with self._lock:
            if number in self._unwritten_looks:
                return self._unwritten_looks[number][name]
            with self._as_damage():
                row = _array_row(self._database(), number, name)
        if row is None:
            raise KeyError(name)
        return row

    def answer(self, step: int) -> StepAnswer | None:
        """Return the answer after a step; None without a readable one."""
        with self._lock:
            if step in self._unwritten_answers:
                return self._unwritten_answers[step]
            with suppress(PaintError, *DAMAGE_ERRORS):
                if (row := _answer_row(self._database(), step)) is not None:
                    return StepAnswer.unpacked(*row)
        return None

    def _read_pixels(
        self, step: int, places: list[tuple[Region, bool]], k: int
    ) -> tuple[Pixels, Pixels]:
        """Return pixels before and after a step, at its place k. Raises PaintError if damaged."""
        with self._lock:
            if self._last_read[0] == step:
                return self._last_read[1][k]
            blobs = self._unwritten_pixels.get(step)
            if blobs is None:
                with self._as_damage():
                    blobs = _pixels_row(self._database(), step)
        if blobs is None:
            raise PaintError(f"a step that was cut off: {step}")
        with self._as_damage():
            pairs = unpack_patches(places, *blobs)
        self._last_read = step, pairs
        return pairs[k]

    @contextmanager
    def _as_damage(self) -> Iterator[None]:
        """Raise errors of reading as DamagedError."""
        try:
            yield
        except (PaintError, *DAMAGE_ERRORS) as error:
            raise damaged_error(self._path, error) from None


class LookArrays(Mapping[str, npt.NDArray[Any]]):
    """Arrays of one look in a file, by name."""

    def __init__(self, file: StoredArrays, number: int) -> None:
        self._file, self._number = file, number

    def matches(self, file: StoredArrays, number: int) -> bool:
        """Return whether these are the arrays of that look in that file."""
        return (self._file, self._number) == (file, number)

    def __getitem__(self, name: str) -> npt.NDArray[Any]:
        dtype, shape, data = self._file.look_array(self._number, name)
        if dtype not in DTYPES:
            raise PaintError(f"a damaged look: {dtype}")
        try:
            return np.asarray(unpack(data, dtype, tuple(map(int, strict_json(shape)))))
        except (TypeError, ValueError) as error:
            raise PaintError(f"a damaged look: {first_line(error)}") from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._file.look_names(self._number))

    def __len__(self) -> int:
        return len(self._file.look_names(self._number))


def pack_arrays(arrays: Mapping[str, npt.NDArray[Any]]) -> PackedArrays:
    """Return the arrays of a look, packed. Raises PaintError for an unexpected type."""
    packed = {}
    for name, array in arrays.items():
        if array.dtype.name not in DTYPES:
            raise PaintError(f"a look of {array.dtype.name}: expected {', '.join(DTYPES)}")
        packed[name] = (array.dtype.name, json.dumps(array.shape), pack(array))
    return packed


@dataclass(frozen=True)
class KeptLook:
    """A look of a session.

    drives: of the emitters of its lamps, by light, under the master dimmer; None if it was kept by
    a version that did not know them. requests: of its lights.
    """

    name: str
    drives: Mapping[str, Mapping[str, float]] | None
    requests: SessionRequests


def read_kept_looks(path: Path) -> list[KeptLook]:
    """Return the looks of a session, the oldest first, without proposals of observers.

    Raises PaintError for a file that is not a session, is damaged, or is open in a painter.
    """
    if not path.is_file():
        raise PaintError(f"no such session: {path}")
    try:
        with closing(_opened(path)) as database:
            [(application,)] = database.execute("PRAGMA application_id")
            if application != APPLICATION:
                raise PaintError(f"{path} is not a session of the painter")
            rows = database.execute("SELECT fields FROM look ORDER BY id").fetchall()
        looks = [_kept(strict_json(fields)) for (fields,) in rows]
    except DAMAGE_ERRORS as error:
        if isinstance(error, sqlite3.Error) and is_in_use(error):
            raise InUseError(f"{path} is in use: end the painter that has it open") from None
        raise PaintError(f"{path} is not a session of the painter, or damaged") from None
    return [look for look in looks if look is not None]


def _opened(path: Path) -> sqlite3.Connection:
    database = sqlite3.connect(f"{path.absolute().as_uri()}?mode=rw", uri=True, timeout=0)
    database.execute("PRAGMA trusted_schema = OFF")
    database.execute("PRAGMA query_only = ON")
    return database


def _kept(fields: Mapping[str, Any]) -> KeptLook | None:
    """Return a look; None for a proposal."""
    if fields.get("is_proposal"):
        return None
    drives = fields.get("drives")
    if drives is not None:
        drives = {
            str(light): {str(name): float(drive) for name, drive in values.items()}
            for light, values in drives.items()
        }
    return KeptLook(str(fields["name"]), drives, SessionRequests.of(fields.get("wishes", {})))
