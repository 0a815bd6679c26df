"""Pixels of steps and arrays of looks, in a session file or not yet written to it."""

import sqlite3
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from threading import RLock

from lightpaint.errors import PaintError
from lightpaint.paint.store.canvas_pixels import Pixels, Region
from lightpaint.paint.store.compression import unpack_patches
from lightpaint.paint.store.database import DAMAGE_ERRORS, damaged_error
from lightpaint.paint.store.lazy_arrays import PackedArray, PackedArrays, StoredPatch
from lightpaint.paint.store.session_rows import (
    answer_row,
    array_names,
    array_row,
    parse_place,
    pixels_row,
)
from lightpaint.paint.store.step_answers import StepAnswer
from lightpaint.storage.json_records import strict_json


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
                return array_names(self._database(), number)

    def look_array(self, number: int, name: str) -> PackedArray:
        """Return one array of a look, and read no other. Raises KeyError if there is none."""
        with self._lock:
            if number in self._unwritten_looks:
                return self._unwritten_looks[number][name]
            with self._as_damage():
                row = array_row(self._database(), number, name)
        if row is None:
            raise KeyError(name)
        return row

    def answer(self, step: int) -> StepAnswer | None:
        """Return the answer after a step; None without a readable one."""
        with self._lock:
            if step in self._unwritten_answers:
                return self._unwritten_answers[step]
            with suppress(PaintError, *DAMAGE_ERRORS):
                if (row := answer_row(self._database(), step)) is not None:
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
                    blobs = pixels_row(self._database(), step)
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
