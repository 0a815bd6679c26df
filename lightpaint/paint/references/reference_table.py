"""The references of a session: read from files, and kept in its own beside steps and looks."""

import json
import sqlite3
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Floats
from lightpaint.colour import ViewTransform, choose_exposure
from lightpaint.errors import ImageError, PaintError
from lightpaint.images import formats, read_picture, resampled
from lightpaint.paint.store.compression import pack, unpack
from lightpaint.paint.store.database import DAMAGE_ERRORS, REFERENCE_TABLE
from lightpaint.paint.store.session_file import Store
from lightpaint.storage.json_records import strict_json

#: Pixels of the longer side of a reference that is kept; larger ones are reduced.
MAX_SIDE = 1280

#: Largest light of a reference that is kept, where display white is 1.
MAX_LIGHT = 1000.0

#: Formats of references that no painting has, by the first bytes of a file.
FURTHER_KINDS = {b"#?": "hdr", b"RIFF": "webp"}

#: Display values (h, w, 3) uint8; of files of light, light float16, whose display white is 1.
ReferencePixels = npt.NDArray[Any]

#: Most references that a session keeps, and characters of a name.
MAX_REFERENCES, MAX_NAME_LENGTH = 12, 60


def read_reference(path: Path, transform: ViewTransform) -> ReferencePixels:
    """Return the picture in a file, over black, at most MAX_SIDE pixels long.

    transform: by which the session shows light. Raises ImageError, in one line that names the file.
    """
    head = formats.head_of(path, 4)
    kind = next((kind for mark, kind in FURTHER_KINDS.items() if head.startswith(mark)), None)
    picture = read_picture(path, transform=transform, kind=kind)
    light = picture.image
    if picture.alpha is not None:
        light = light * np.clip(picture.alpha, 0, 1)[..., None]
    light = np.maximum(_reduced(light), 0)
    if not light.any():
        raise ImageError(path, " is black: choose a picture with light in it")
    if picture.codes is not None:
        return np.asarray(np.round(255 * transform.encode(light)), np.uint8)
    exposed = light * 2.0 ** choose_exposure(light)
    return np.asarray(np.minimum(exposed, MAX_LIGHT), np.float16)


def _reduced(light: Floats) -> Floats:
    height, width = light.shape[:2]
    factor = MAX_SIDE / max(height, width)
    if factor >= 1:
        return light
    return resampled(light, (max(1, round(height * factor)), max(1, round(width * factor))))


@dataclass(frozen=True, eq=False)
class Reference:
    """A picture that shows which light is wanted. pixels: as `read_reference` returns them."""

    id: int
    name: str
    pixels: ReferencePixels


class ReferenceTable:
    """The references of a session, the oldest first. Updated in place.

    store: of the session; a file without readable references has none. transform: by which the
    session shows light.
    """

    def __init__(self, store: Store, transform: ViewTransform) -> None:
        self._store, self._transform = store, transform
        self._references: dict[int, Reference] = {}
        for number, *row in store.rows("SELECT id, name, dtype, shape, data FROM reference"):
            with suppress(PaintError, *DAMAGE_ERRORS):
                self._references[number] = _read(number, *row)
        self._last_id = max(self._references, default=0)

    def __iter__(self) -> Iterator[Reference]:
        return iter(self._references.values())

    def __getitem__(self, number: int) -> Reference:
        """Return a reference by its id. Raises PaintError if there is none."""
        if number not in self._references:
            raise PaintError(f"there is no reference {number}")
        return self._references[number]

    def light(self, reference: Reference) -> Floats:
        """Return the light (h, w, 3) of a reference, at the exposure of the session."""
        pixels, transform = reference.pixels, self._transform
        if pixels.dtype == np.uint8:
            return np.asarray(transform.decode(pixels / np.float32(255)), np.float32)
        return np.asarray(pixels.astype(np.float32) / 2.0**transform.stops, np.float32)

    def picture(self, reference: Reference) -> ReferencePixels:
        """Return a reference as the session shows it, (h, w, 3) uint8."""
        if reference.pixels.dtype == np.uint8:
            return reference.pixels
        return np.round(255 * self._transform.encode(self.light(reference))).astype(np.uint8)

    def check_room(self) -> None:
        """Raise PaintError if there is no room for another reference."""
        if len(self._references) >= MAX_REFERENCES:
            raise PaintError(f"{MAX_REFERENCES} references are kept: remove one of them first")

    def add(self, name: str, pixels: ReferencePixels) -> Reference:
        """Keep a reference. Raises PaintError if there are too many."""
        self.check_room()
        self._last_id += 1
        reference = Reference(self._last_id, name[:MAX_NAME_LENGTH], pixels)
        self._references[reference.id] = reference
        shape = json.dumps(pixels.shape)
        row = (reference.id, reference.name, pixels.dtype.name, shape, pack(pixels))
        self._store.enqueue(partial(_insert, row=row))
        return reference

    def drop(self, number: int) -> None:
        """Forget a reference. Raises PaintError if there is none of that id."""
        del self._references[self[number].id]
        self._store.enqueue(partial(_delete, number=number))


def _read(number: int, name: str, dtype: str, shape: str, data: bytes) -> Reference:
    height, width, channels = map(int, strict_json(shape))
    if dtype not in ("uint8", "float16") or channels != 3:
        raise ValueError("no picture")
    return Reference(int(number), str(name), unpack(data, dtype, (height, width, channels)))


def _insert(database: sqlite3.Connection, *, row: tuple[int, str, str, str, bytes]) -> None:
    database.execute(REFERENCE_TABLE)
    database.execute("INSERT OR REPLACE INTO reference VALUES (?, ?, ?, ?, ?)", row)


def _delete(database: sqlite3.Connection, *, number: int) -> None:
    database.execute("DELETE FROM reference WHERE id = ?", (number,))
