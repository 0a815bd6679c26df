"""The targets that layers come to, kept in a session file so that it opens without their pixels.

They are stored twice, as they also follow from the steps: a row is used only if its digest is
right, if the step that it follows is still there, and if the current looks below the layers are
the same. Ids of steps are never used twice, so no other steps can lead to such a row. Anything else
is composed again.
"""

import hashlib
import json
import sqlite3
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.errors import PaintError
from lightpaint.paint.store.canvas_pixels import Pixels, Region
from lightpaint.paint.store.compression import pack_pixels, unpack_pixels
from lightpaint.paint.store.database import DAMAGE_ERRORS, transaction
from lightpaint.storage.json_records import strict_json

#: Version of the composition of layers: to be raised when layers come to other bits.
COMPOSITION_VERSION = 1

_TABLE = """
CREATE TABLE IF NOT EXISTS composition
(view INTEGER PRIMARY KEY, step INTEGER, about TEXT, pixels BLOB, digest BLOB)
"""

#: Bounds, mean and least coverage of a layer.
LayerValues = tuple[Region, float, float]

#: View, id of the step, all but the pixels as JSON, packed pixels, and the digest of these.
Row = tuple[int, int, str, bytes, bytes]


@dataclass(frozen=True, eq=False)
class StoredComposition:
    """The target of a view after some step.

    layers: of each layer, by id, what is known without its pixels. pixels: the target.
    """

    layers: Mapping[int, LayerValues]
    pixels: Pixels


def composition_rows(
    step: int, current_looks: Sequence[Floats], compositions: Sequence[StoredComposition]
) -> list[Row]:
    """Return the rows of the compositions of all views after a step."""
    rows: list[Row] = []
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
        rows.append((view, step, about, blob, _digest(_text(view, step, about), blob)))
    return rows


def store_compositions(database: sqlite3.Connection, *, rows: Sequence[Row]) -> None:
    """Replace the compositions by those of all views. Where that fails, nothing is lost."""
    with suppress(sqlite3.Error), transaction(database):
        database.execute(_TABLE)
        database.execute("DELETE FROM composition")
        database.executemany("INSERT INTO composition VALUES (?, ?, ?, ?, ?)", rows)


def read_compositions(
    database: sqlite3.Connection, current_looks: Sequence[Floats]
) -> tuple[int, list[StoredComposition]] | None:
    """Return the id of a step and the compositions of all views after it; None if there are none
    for these current looks.
    """
    with suppress(PaintError, *DAMAGE_ERRORS):
        query = "SELECT view, step, about, pixels, digest FROM composition ORDER BY view"
        rows: list[Row] = database.execute(query).fetchall()
        steps = {step for _, step, *_ in rows}
        if [view for view, *_ in rows] == list(range(len(current_looks))) and len(steps) == 1:
            pairs = zip(rows, current_looks, strict=True)
            return steps.pop(), [_read(row, look) for row, look in pairs]
    return None


def _read(row: Row, look: Floats) -> StoredComposition:
    """Return the composition in a row. Raises PaintError or DAMAGE_ERRORS for any other."""
    view, step, text, blob, digest = row
    about = strict_json(text)
    is_own = about["version"] == COMPOSITION_VERSION and about["size"] == [*look.shape[:2]]
    if not is_own or about["look"] != _look_text(look):
        raise PaintError("a composition on another look")
    if digest != _digest(_text(view, step, text), blob):
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


def _text(view: int, step: int, about: str) -> bytes:
    return f"{view} {step} {about}".encode()


def _digest(*parts: bytes | memoryview) -> bytes:
    digest = hashlib.blake2b(digest_size=16)
    for part in parts:
        digest.update(part)
    return digest.digest()
