"""Files that appear in a folder together: after any kill it gets all earlier ones, or all new ones.

New files are written to a hidden folder beside the true one, which is left as it is meanwhile. At
the end a journal is written, and the files are moved, one by one, in less than a millisecond. A
kill in just that time leaves a mixture, until `finish` does what the journal says when the folder
is next used.
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
from pathlib import Path

from lightpaint.errors import LightpaintError, OutputError
from lightpaint.files import MAX_TEXT, flush, read_text, write_text
from lightpaint.signals import interruptible_between_pieces
from lightpaint.storage.json_records import read_record, strict_json
from lightpaint.storage.linux_calls import is_mounted

#: In the names of hidden folders, `.evening.lightpaint-1a2b3c4d` beside `evening`.
MARK = ".lightpaint-"

#: What is still to be done, in a hidden folder.
JOURNAL = ".lightpaint.json"

#: Seconds after which a hidden folder is nobody's, where disks know no locks.
LEFTOVER_S = 86_400.0


@dataclass(frozen=True)
class _Journal:
    """What is still to be done for a folder, by names relative to it.

    move: files to bring there from the hidden folder. gone: files to delete there.
    """

    move: tuple[str, ...] = ()
    gone: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name in (*self.move, *self.gone):
            if not is_below(name):
                raise ValueError(f"{name!r} is no name of a file in the folder")


def is_below(name: str) -> bool:
    """Whether a relative name stays in its folder."""
    return not Path(name).is_absolute() and ".." not in Path(name).parts


@contextmanager
def staged(folder: Path, gone: Iterable[Path] = ()) -> Iterator[Path]:
    """Yield a hidden folder to write to; what is in it then appears in `folder`, all at once.

    If the block raises, or the process is killed, `folder` is as it was. Files in it of other names
    stay. The hidden folder has the same place among others, so that relative paths from it hold.

    Args:
        folder: Need not be there.
        gone: Files in it that are deleted when the others appear.

    Raises:
        OutputError: For whatever the system refuses; like all errors of the block it speaks of
            `folder`, not of the hidden one.
    """
    real = Path(os.path.realpath(folder))
    finish(folder)
    made = [parent for parent in real.parents if not parent.exists()]
    try:
        stage, lock = _hidden_folder(folder)
    except OSError as error:
        raise OutputError(f"cannot write into {folder}: {error.strerror or error}") from error
    try:
        yield stage
        _flush(stage)
        with interruptible_between_pieces():
            _publish(stage, folder, {file.relative_to(folder).as_posix() for file in gone})
    except BaseException as error:
        with interruptible_between_pieces():
            _give_up(stage, made)
        if isinstance(error, LightpaintError):
            raise type(error)(str(error).replace(str(stage), str(folder))) from error
        raise
    finally:
        os.close(lock)


def finish(folder: Path) -> None:
    """Do what killed runs have left to do in `folder`, and delete what else they left beside it."""
    real = Path(os.path.realpath(folder))
    for stage in _hidden_folders(real):
        with suppress(OSError):
            _finish_stage(stage, real)


def _hidden_folder(folder: Path) -> tuple[Path, int]:
    """A new one for `folder`, and the descriptor that holds a lock on it.

    It lies beside it or, where nothing can be moved between the two, in it.
    """
    real = Path(os.path.realpath(folder))
    # As it was spelled, unless the name says nothing of the place.
    odd = folder.is_symlink() or folder.name == "" or ".." in folder.parts
    place = real if odd else folder
    place.parent.mkdir(parents=True, exist_ok=True)
    stage = place.parent / f".{place.name}{MARK}{secrets.token_hex(4)}"
    if real.exists() and (is_mounted(real) or not os.access(place.parent, os.W_OK)):
        stage = folder / f"{MARK}{secrets.token_hex(4)}"
    stage.mkdir()
    lock = os.open(stage, os.O_RDONLY | os.O_DIRECTORY)
    with suppress(OSError):
        fcntl.flock(lock, fcntl.LOCK_EX)
    return stage, lock


def _give_up(stage: Path, made: Iterable[Path]) -> None:
    """Delete `stage`, unless something in it is still to be moved, and folders `made` for it."""
    if _journal_in(stage) is None:
        shutil.rmtree(stage, ignore_errors=True)
    for parent in made:
        with suppress(OSError):
            parent.rmdir()


def _hidden_folders(real: Path) -> list[Path]:
    """Those for `real` that there are."""
    beside, begin = real.parent, f".{real.name}{MARK}"
    found: list[Path] = []
    for place, start in ((beside, begin), (real, MARK)):
        with suppress(OSError):
            found += [place / name for name in os.listdir(place) if name.startswith(start)]
    return [path for path in found if path.is_dir() and not path.is_symlink()]


def _files_in(folder: Path) -> set[str]:
    """Names relative to `folder` of all that is no folder in it, hidden or not."""
    return {
        (Path(top) / name).relative_to(folder).as_posix()
        for top, folders, files in os.walk(folder)
        for name in (*files, *(x for x in folders if (Path(top) / x).is_symlink()))
    }


def _flush(stage: Path) -> None:
    """Have the disk hold what was written, before names promise it."""
    for name in _files_in(stage):
        flush(stage / name)


def _publish(stage: Path, folder: Path, gone: set[str]) -> None:
    """Bring all that is in `stage` to `folder`, and delete there what is `gone`."""
    real, new = Path(os.path.realpath(folder)), _files_in(stage)
    try:
        if not real.exists() and stage.parent.samefile(real.parent):
            os.rename(stage, real)
            return
        _write_journal(stage, _Journal(tuple(sorted(new)), tuple(sorted(gone - new))))
        _finish_stage(stage, real, is_mine=True)
    except OSError as error:
        raise OutputError(f"cannot write into {folder}: {error.strerror or error}") from error


def _finish_stage(stage: Path, real: Path, *, is_mine: bool = False) -> None:
    """Bring to `real` what a journal in `stage` names, or nothing, and delete `stage`.

    is_mine: whether it is this process that holds the lock.
    """
    if not (is_mine or _is_left(stage)):
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
                    folder.rmdir()  # if nothing else is in it
    shutil.rmtree(stage, ignore_errors=True)


def _write_journal(folder: Path, journal: _Journal) -> None:
    write_text(folder / JOURNAL, json.dumps(asdict(journal)))


def _journal_in(folder: Path) -> _Journal | None:
    """None where there is none, or one that nobody of ours wrote."""
    try:
        text = read_text(folder / JOURNAL, "journal", OutputError, limit=MAX_TEXT)
        return read_record(_Journal, strict_json(text))
    except (LightpaintError, ValueError):
        return None


def _is_left(folder: Path) -> bool:
    """Whether no process is at work there any more."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        return True
    except BlockingIOError:
        return False
    except OSError:  # a disk that knows no locks
        return time.time() - folder.stat().st_mtime > LEFTOVER_S
    finally:
        os.close(descriptor)
