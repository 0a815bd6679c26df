"""Publishes several files in a folder together: after any kill it has all old files or all new
ones.

New files are written to a hidden folder beside the real one, which stays unchanged meanwhile. At
the end a journal is written, and the files are moved one by one, in less than a millisecond. If the
process is killed during that time, the folder is left mixed until `finish` completes the journal
when it is next used.
"""

import fcntl
import json
import os
import secrets
import shutil
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path

from lightpaint.errors import LightpaintError, OutputError
from lightpaint.files import MAX_TEXT, flush, read_text, write_text
from lightpaint.sentences import Datum
from lightpaint.signals import interruptible_between_pieces
from lightpaint.storage.json_records import read_record, strict_json

#: Part of the names of hidden folders: `.evening.lightpaint-1a2b3c4d` beside `evening`.
MARK = ".lightpaint-"

#: Name of the journal in a hidden folder.
JOURNAL = ".lightpaint.json"

#: Age in seconds from which a hidden folder counts as abandoned, on file systems without locks.
LEFTOVER_S = 86_400.0


@dataclass(frozen=True)
class _Journal:
    """The moves and deletions that a folder still needs, by names relative to it.

    move: files to move there from the hidden folder. gone: files to delete there.
    """

    move: tuple[str, ...] = ()
    gone: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name in (*self.move, *self.gone):
            if not is_below(name):
                raise ValueError(f"{name!r} is not the name of a file in the folder")


def is_below(name: str) -> bool:
    """Return True if a relative name does not lead out of its folder."""
    return not Path(name).is_absolute() and ".." not in Path(name).parts


@contextmanager
def staged(folder: Path, gone: Iterable[Path] = ()) -> Iterator[Path]:
    """Yield a hidden folder to write to; afterwards its files appear in `folder`, all at once.

    If the block raises, or the process is killed, `folder` stays unchanged. Files with other names
    stay in it. The hidden folder is a sibling of `folder`, so relative paths are valid from both.

    Args:
        folder: The folder to publish to, which need not exist.
        gone: Files in it to delete when the new ones appear.

    Raises:
        OutputError: For any error of the system. Its message, like the messages of all errors in
            the block, names `folder` rather than the hidden folder.
    """
    real = Path(os.path.realpath(folder))
    finish(folder)
    missing_parents = [parent for parent in real.parents if not parent.exists()]
    try:
        stage, lock = _make_hidden_folder(folder)
    except OSError as error:
        raise OutputError("cannot write into ", folder, f": {error.strerror or error}") from error
    try:
        yield stage
        _flush(stage)
        with interruptible_between_pieces():
            _publish(stage, folder, {file.relative_to(folder).as_posix() for file in gone})
    except BaseException as error:
        with interruptible_between_pieces():
            _discard(stage, missing_parents)
        if isinstance(error, LightpaintError):
            raise type(error)(error.sentence.spelled(partial(_renamed, stage, folder))) from error
        raise
    finally:
        os.close(lock)


def _renamed(stage: Path, folder: Path, datum: Datum) -> str | None:
    """Return the place in `folder` of a file in the hidden folder; None for other data."""
    if not isinstance(datum, Path) or not datum.is_relative_to(stage):
        return None
    name = datum.relative_to(stage)
    return os.path.join(folder, name) if name.parts else str(folder)


def finish(folder: Path) -> None:
    """Complete what killed processes left unfinished in `folder`, and delete their hidden
    folders.
    """
    real = Path(os.path.realpath(folder))
    for stage in _hidden_folders(real):
        with suppress(OSError):
            _finish_stage(stage, real)


def _make_hidden_folder(folder: Path) -> tuple[Path, int]:
    """Create a hidden folder for `folder`. Returns it with a descriptor that holds its lock.

    It lies beside `folder`, or inside it if files cannot be moved between the two.
    """
    real = Path(os.path.realpath(folder))
    # Use the path as given, unless it is indirect.
    is_indirect = folder.is_symlink() or folder.name == "" or ".." in folder.parts
    place = real if is_indirect else folder
    place.parent.mkdir(parents=True, exist_ok=True)
    stage = place.parent / f".{place.name}{MARK}{secrets.token_hex(4)}"
    if real.exists() and (is_mounted(real) or not os.access(place.parent, os.W_OK)):
        stage = folder / f"{MARK}{secrets.token_hex(4)}"
    stage.mkdir()
    lock = os.open(stage, os.O_RDONLY | os.O_DIRECTORY)
    with suppress(OSError):
        fcntl.flock(lock, fcntl.LOCK_EX)
    return stage, lock


def _discard(stage: Path, parents: Iterable[Path]) -> None:
    """Delete the parents that were created for `stage`, and `stage` itself unless it still has
    files to move.
    """
    if _journal_in(stage) is None:
        shutil.rmtree(stage, ignore_errors=True)
    for parent in parents:
        with suppress(OSError):
            parent.rmdir()


def _hidden_folders(real: Path) -> list[Path]:
    """Return the existing hidden folders of `real`."""
    parent, prefix = real.parent, f".{real.name}{MARK}"
    folders: list[Path] = []
    for place, start in ((parent, prefix), (real, MARK)):
        with suppress(OSError):
            folders += [place / name for name in os.listdir(place) if name.startswith(start)]
    return [path for path in folders if path.is_dir() and not path.is_symlink()]


def _files_in(folder: Path) -> set[str]:
    """Return the names, relative to `folder`, of all files in it, including hidden ones."""
    return {
        (Path(top) / name).relative_to(folder).as_posix()
        for top, folders, files in os.walk(folder)
        for name in (*files, *(x for x in folders if (Path(top) / x).is_symlink()))
    }


def _flush(stage: Path) -> None:
    """Flush all files in `stage` to disk before they are renamed."""
    for name in _files_in(stage):
        flush(stage / name)


def _publish(stage: Path, folder: Path, gone: set[str]) -> None:
    """Move everything in `stage` to `folder`, and delete the files `gone` there."""
    real, new = Path(os.path.realpath(folder)), _files_in(stage)
    try:
        if not real.exists() and stage.parent.samefile(real.parent):
            os.rename(stage, real)
            return
        _write_journal(stage, _Journal(tuple(sorted(new)), tuple(sorted(gone - new))))
        _finish_stage(stage, real, is_mine=True)
    except OSError as error:
        raise OutputError("cannot write into ", folder, f": {error.strerror or error}") from error


def _finish_stage(stage: Path, real: Path, *, is_mine: bool = False) -> None:
    """Complete the journal in `stage`, if there is one, and delete `stage`.

    is_mine: whether this process holds its lock.
    """
    if not (is_mine or _is_abandoned(stage)):
        return
    journal = _journal_in(stage)
    if journal is not None:
        for name in journal.move:
            if os.path.lexists(stage / name):
                (real / name).parent.mkdir(parents=True, exist_ok=True)
                os.replace(stage / name, real / name)
        for name in journal.gone:
            (real / name).unlink(missing_ok=True)
            with suppress(OSError):
                if (folder := (real / name).parent) != real:
                    folder.rmdir()  # only if empty
    shutil.rmtree(stage, ignore_errors=True)


def _write_journal(folder: Path, journal: _Journal) -> None:
    write_text(folder / JOURNAL, json.dumps(asdict(journal)))


def _journal_in(folder: Path) -> _Journal | None:
    """Return the journal in `folder`; None if it is missing or invalid."""
    try:
        text = read_text(folder / JOURNAL, "journal", OutputError, limit=MAX_TEXT)
        return read_record(_Journal, strict_json(text))
    except (LightpaintError, ValueError):
        return None


def _is_abandoned(folder: Path) -> bool:
    """Return True if no process uses this folder any more."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        return True
    except BlockingIOError:
        return False
    except OSError:  # a file system without locks
        return time.time() - folder.stat().st_mtime > LEFTOVER_S
    finally:
        os.close(descriptor)


def is_mounted(folder: Path) -> bool:
    """Return True if `folder`, a real path, is a mount point or the root of a disk."""
    if os.path.ismount(folder):
        return True
    with suppress(OSError):
        # Only this file shows a bind mount from the same disk. It writes blanks as \040.
        for line in Path("/proc/self/mountinfo").read_text("utf-8", "surrogateescape").splitlines():
            if line.split()[4].replace("\\040", " ") == str(folder):
                return True
    return False
