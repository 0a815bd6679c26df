"""The SQLite database of a session, opened by one process alone, and the writes that wait.

The lock is the system's on the open file (`locking_mode = EXCLUSIVE`): it ends with its process,
however that ends, and leaves nothing behind that somebody would have to remove.

Writes wait in memory if the disk refuses them. A deleted file is written again with the next step,
since the system keeps an open file. On a full disk, pending writes stay in memory, in order,
`unsaved` says so, and `flush` or the next step writes them.
"""

import json
import os
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict
from pathlib import Path

from lightpaint.basis import joined_texels
from lightpaint.display_text import some_names
from lightpaint.errors import LightpaintError, OutputError, PaintError
from lightpaint.files import file_length, first_line, flush
from lightpaint.paint.store.history_steps import Identity, ViewIdentity
from lightpaint.sentences import Hint, Remedy, Sentence
from lightpaint.storage.json_records import read_record, strict_json

#: Name of a session's file, in its folder.
SESSION_FILE = "session.db"

#: "lpnt", which marks a file as a session, and the version of its tables.
APPLICATION, VERSION = 0x6C706E74, 3

#: Free pages (of 16 KiB) returned to the disk at a start: 64 MB, in a moment.
VACUUM_PAGES = 4096

#: FULL: committed data survive a power failure.
SYNCHRONOUS = "FULL"

TABLES = """
CREATE TABLE about (name TEXT PRIMARY KEY, value) WITHOUT ROWID;
CREATE TABLE step (id INTEGER PRIMARY KEY, kind TEXT, label TEXT, fields TEXT, places TEXT);
CREATE TABLE pixels (step INTEGER PRIMARY KEY, before BLOB, change BLOB);
CREATE TABLE look (id INTEGER PRIMARY KEY, fields TEXT);
CREATE TABLE look_array (look INTEGER, name TEXT, dtype TEXT, shape TEXT, data BLOB);
"""

#: Answers after steps, with small pictures. A session can do without, so files may lack it.
ANSWER_TABLE = """
CREATE TABLE IF NOT EXISTS step_answer (step INTEGER PRIMARY KEY, fields TEXT, picture BLOB)
"""

#: References. Only files that have some have this.
REFERENCE_TABLE = """
CREATE TABLE IF NOT EXISTS reference
(id INTEGER PRIMARY KEY, name TEXT, dtype TEXT, shape TEXT, data BLOB)
"""

#: Errors raised by damaged pages, rows and values.
DAMAGE_ERRORS = (sqlite3.Error, ArithmeticError, AttributeError, LookupError, TypeError, ValueError)

_DAMAGED = (sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB)

#: Longest session in bytes.
MAX_SESSION = 2**44

WriteJob = Callable[[sqlite3.Connection], object]


def open_database(path: Path | None, identity: Identity | None) -> sqlite3.Connection:
    """Return the database at `path`, made if there is none, for this process alone; None: in
    memory.

    Raises PaintError for one that is in use, damaged, or of other lights or another size than
    `identity`; OutputError for a place that cannot be written.
    """
    with _translated_errors(path):
        if path is not None:
            path.parent.mkdir(parents=True, exist_ok=True)
            # A pipe may never answer, and a copy of a sparse file fills the disk.
            if path.exists() and not path.is_dir():
                file_length(path, "session", PaintError, limit=MAX_SESSION, may_be_empty=True)
        database = sqlite3.connect(
            path or ":memory:", timeout=0, isolation_level=None, check_same_thread=False
        )
        try:
            _prepare(database, path, identity)
        except BaseException:
            database.close()
            raise
    return database


def _prepare(database: sqlite3.Connection, path: Path | None, identity: Identity | None) -> None:
    database.execute("PRAGMA locking_mode = EXCLUSIVE")  # WAL needs no shared memory then
    database.execute("PRAGMA trusted_schema = OFF")  # tables that others made may not call anything
    [(tables,)] = database.execute("SELECT count(*) FROM sqlite_schema")
    if not tables:  # of a file that has some these would be written again, perhaps to a full disk
        database.execute("PRAGMA page_size = 16384")
        database.execute("PRAGMA auto_vacuum = INCREMENTAL")
    database.execute("PRAGMA journal_mode = WAL").fetchall()
    database.execute(f"PRAGMA synchronous = {SYNCHRONOUS}")
    with transaction(database):
        [(application,)] = database.execute("PRAGMA application_id")
        [(version,)] = database.execute("PRAGMA user_version")
        [(tables, has_answers)] = database.execute(
            "SELECT count(*), sum(name = 'step_answer') FROM sqlite_schema"
        )
        if not tables:
            for statement in filter(str.strip, TABLES.split(";")):
                database.execute(statement)
            database.execute(f"PRAGMA application_id = {APPLICATION}")
            database.execute(f"PRAGMA user_version = {VERSION}")
        elif application != APPLICATION:
            raise PaintError(f"{path} is not a session of the painter: ", START_AFRESH)
        elif version != VERSION:
            raise PaintError(
                f"{path} was written by another version of lightpaint (format {version}, not "
                f"{VERSION}): ",
                START_AFRESH,
            )
        if not has_answers:
            database.execute(ANSWER_TABLE)
        if identity is not None:
            _check_identity(database, path, identity)
            _store_identity(database, json.dumps(asdict(identity)))
    with suppress(sqlite3.OperationalError):  # on a full disk
        # A row for each page, which only a script takes all of.
        database.executescript(f"PRAGMA incremental_vacuum({VACUUM_PAGES})")


def identify(database: sqlite3.Connection, path: Path | None, identity: Identity) -> None:
    """Store the identity of an open database. Raises PaintError for one of something else."""
    with _translated_errors(path), transaction(database):
        _check_identity(database, path, identity)
        _store_identity(database, json.dumps(asdict(identity)))


def _store_identity(database: sqlite3.Connection, identity: str) -> None:
    """Store the identity; nothing is written if it is there already, as the disk may be full."""
    if (identity,) not in database.execute("SELECT value FROM about WHERE name = 'identity'"):
        database.execute("INSERT OR REPLACE INTO about VALUES ('identity', ?)", (identity,))


#: Remedies for a file that cannot be the session.
OTHER_FOLDER = Remedy("choose another folder (", Hint("folder"), ")")
START_AFRESH = Remedy(
    OTHER_FOLDER, ", or start afresh, which keeps it under another name (", Hint("new", True), ")"
)


def _check_identity(database: sqlite3.Connection, path: Path | None, identity: Identity) -> None:
    """Raise PaintError for a session of something else."""
    for (text,) in database.execute("SELECT value FROM about WHERE name = 'identity'"):
        stored = read_record(Identity, strict_json(text))
        if len(stored.views) > len(identity.views):
            raise PaintError(
                f"{path} is a session of {len(stored.views)} views, and this is of "
                f"{len(identity.views)}: ",
                START_AFRESH,
            )
        # Views may have come after those that it has.
        for old, new in zip(stored.views, identity.views, strict=False):
            _check_view(path, identity.scene, old, new)
        if stored.lights != identity.lights:
            old_names, names = map(joined_texels, (stored.lights, identity.lights))
            raise PaintError(
                f"{path} is a session of the lights {some_names(old_names)}, and "
                f"{identity.scene} has {some_names(names)}: ",
                START_AFRESH,
            )


def _check_view(path: Path | None, scene: str, stored: ViewIdentity, current: ViewIdentity) -> None:
    if stored.size != current.size:
        raise PaintError(
            f"{path} is a session of {stored.size[1]}x{stored.size[0]} pixels, and {scene} has "
            f"{current.size[1]}x{current.size[0]}: ",
            START_AFRESH,
        )
    if stored.sensor and current.sensor and stored.sensor != current.sensor:
        raise PaintError(
            f"{path} is a session of the view through {stored.sensor}, and this is through "
            f"{current.sensor}: ",
            START_AFRESH,
        )


@contextmanager
def transaction(database: sqlite3.Connection) -> Iterator[None]:
    """Write all of the block durably, or nothing."""
    database.execute("BEGIN IMMEDIATE")
    try:
        yield
        database.execute("COMMIT")
    except BaseException:
        if database.in_transaction:  # of a full disk SQLite has gone back itself
            database.execute("ROLLBACK")
        raise


@contextmanager
def _translated_errors(path: Path | None) -> Iterator[None]:
    """Translate whatever prevents the opening into one line."""
    try:
        yield
    except sqlite3.Error as error:
        raise _sqlite_error(path, error) from None
    except OSError as error:
        raise OutputError(f"cannot write {path}: {error.strerror or error}") from None
    except (ArithmeticError, KeyError, TypeError, ValueError) as error:
        raise damaged_error(path, error) from None


class DamagedError(PaintError):
    """An error of a damaged session file."""


class InUseError(PaintError):
    """An error of a session file that another process has open."""


def damaged_error(path: Path | None, error: Exception) -> DamagedError:
    """Return the error for a session that cannot be read."""
    return DamagedError(f"{path} is damaged ({first_line(error)}): ", START_AFRESH)


def is_in_use(error: sqlite3.Error) -> bool:
    """Return whether an error says that another process has the file open."""
    code = getattr(error, "sqlite_errorcode", 0) & 0xFF
    return code in (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED)


def _sqlite_error(path: Path | None, error: sqlite3.Error) -> LightpaintError:
    code = getattr(error, "sqlite_errorcode", 0) & 0xFF
    if is_in_use(error):
        return InUseError(
            f"{path} is in use: another lightpaint paints there; end that one, or ", OTHER_FOLDER
        )
    if code in _DAMAGED or not isinstance(error, sqlite3.OperationalError):
        return damaged_error(path, error)
    return OutputError(f"cannot write {path}: {first_line(error)}")


def file_id(path: Path | None) -> tuple[int, int] | None:
    """Return the system's own identity of a file; None if there is none."""
    try:
        status = None if path is None else path.stat()
    except OSError:
        return None
    return None if status is None else (status.st_dev, status.st_ino)


def _rewrite(
    database: sqlite3.Connection, path: Path, identity: Identity | None
) -> sqlite3.Connection:
    """Write an open database whose file was removed to `path` again; the old one is closed.

    The system keeps a file that somebody has open. Raises LightpaintError where it cannot be
    written; the old one is open then.
    """
    temporary = path.with_name(f".{path.name}.new")
    with _translated_errors(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary.unlink(missing_ok=True)
        try:
            database.execute("VACUUM INTO ?", (str(temporary),))
            flush(temporary)
            os.replace(temporary, path)
        except BaseException:
            temporary.unlink(missing_ok=True)
            raise
    database.close()  # before its place is taken, since closing removes files named like its log
    return open_database(path, identity)


def free_name(path: Path) -> Path:
    """Return the first name that no earlier session at `path` was kept under."""
    number = 1
    while (aside := path.with_name(f"{path.stem}-{number}{path.suffix}")).exists():
        number += 1
    return aside


def check_pages(database: sqlite3.Connection) -> None:
    """Raise sqlite3.Error for damaged pages of an open database."""
    [(verdict,)] = database.execute("PRAGMA quick_check(1)")
    if verdict != "ok":
        raise sqlite3.DatabaseError(verdict)


def set_aside(path: Path) -> Path | None:
    """Give the session at `path` another name. Returns the name; None if there is no session.

    Raises PaintError if another process has it open, OutputError if it cannot be renamed.
    """
    if not path.exists():
        return None
    try:
        open_database(path, None).close()  # merges the log that its last process left beside it
    except InUseError:
        raise
    except PaintError:
        pass  # a damaged one gets another name, too
    aside = free_name(path)
    try:
        for ending in ("-wal", "-journal", ""):  # of one that is damaged
            if os.path.exists(f"{path}{ending}"):
                os.rename(f"{path}{ending}", f"{aside}{ending}")
    except OSError as error:
        raise OutputError(f"cannot rename {path}: {error.strerror or error}") from None
    return aside


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
                self.database.execute(
                    "INSERT OR REPLACE INTO about VALUES (?, ?)", ("position", position)
                )
        except LightpaintError as error:
            self.unsaved = Sentence("what was done last is in memory only: ", error)
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
        self.database = _rewrite(self.database, self._file, self.identity)
        self._file_id = file_id(self._file)
