"""The looks of a session's file, read by another program than the painter."""

import sqlite3
from collections.abc import Mapping
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lightpaint.errors import PaintError
from lightpaint.paint.store.database import APPLICATION, DAMAGE_ERRORS, InUseError, is_in_use
from lightpaint.paint.store.session_requests import SessionRequests
from lightpaint.storage.json_records import strict_json


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
