"""Writes to a session file, which wait in memory if the disk refuses them.

A deleted file is written again with the next step, since the system keeps an open file. On a full
disk, pending writes stay in memory, in order, `unsaved` says so, and `flush` or the next step
writes them.
"""

import sqlite3
from collections.abc import Callable
from pathlib import Path

from lightpaint.errors import LightpaintError, PaintError
from lightpaint.files import first_line
from lightpaint.paint.store.database import file_id, open_database, rewrite, transaction
from lightpaint.paint.store.history_steps import Identity
from lightpaint.paint.store.session_rows import update_position

WriteJob = Callable[[sqlite3.Connection], object]


class WriteQueue:
    """The database of one session, and its pending writes, in order.

    Attributes:
        database: Open, with an exclusive lock on its file.
        identity: Identity of the painted views; None if not known yet.
        unsaved: Why the last steps are in memory only, in one line; None if all is written.
    """

    def __init__(self, path: Path | None, identity: Identity | None) -> None:
        self.database = open_database(path, identity)
        self.identity, self._path = identity, path
        self.unsaved: str | None = None
        self._file = None if path is None else path.absolute()  # also from elsewhere
        self._file_id = file_id(self._file)
        self._pending: list[WriteJob] = []

    def add(self, write: WriteJob) -> None:
        """Append a write, which `flush` carries out."""
        self._pending.append(write)

    def flush(self, position: int) -> str | None:
        """Carry out pending writes in one transaction. Returns why that is impossible, or None.

        position: number of steps that are done.
        """
        if not self._pending and self._is_file_there():
            return self.unsaved
        try:
            self._restore_file()
            with transaction(self.database):
                for write in self._pending:
                    write(self.database)
                update_position(self.database, position)
        except LightpaintError as error:
            self.unsaved = f"what was done last is in memory only: {error}"
            return self.unsaved
        except sqlite3.Error as error:
            self.unsaved = (
                f"what was done last is in memory only, since {self._path} cannot be written "
                f"({first_line(error)}): it is written as soon as there is room"
            )
            return self.unsaved
        self._pending, self.unsaved = [], None
        return None

    def close(self) -> str | None:
        """Release the file for other processes. Returns why pending writes are lost, or None."""
        unsaved = self.unsaved
        self._pending, self.unsaved = [], None  # closed again, there is nothing left to say
        self._file = self._file_id = None
        try:
            self.database.close()
        except sqlite3.Error as error:  # the next start merges the files beside it
            unsaved = unsaved or first_line(error)
        return unsaved

    def _is_file_there(self) -> bool:
        return file_id(self._file) == self._file_id

    def _restore_file(self) -> None:
        """Write the file again if it was deleted. Raises LightpaintError if that fails."""
        if self._file is None or self._is_file_there():
            return
        if file_id(self._file) is not None:
            raise PaintError(f"{self._path} is another file now: move that one away")
        self.database = rewrite(self.database, self._file, self.identity)
        self._file_id = file_id(self._file)
