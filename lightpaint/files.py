"""Writing files so that a reader never sees half of one."""

import os
import shutil
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from lightpaint.errors import OutputError

#: What the name of a folder begins with in which earlier results wait.
ASIDE = ".earlier."


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a path beside `path` to write to; it takes the place of `path` at the end.

    What was at `path` stays untouched if the block raises, is interrupted or the disk
    is full. Raises OutputError, naming `path`, for whatever the system refuses.
    """
    path = Path(path)
    beside: Path | None = None
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        # A directory of its own keeps the file's true name, whose ending some writers obey.
        with tempfile.TemporaryDirectory(prefix=f".{path.name}.", dir=path.parent) as folder:
            beside = Path(folder) / path.name
            yield beside
            os.replace(beside, path)
    except OSError as error:
        reason = error.strerror or str(error)
        raise OutputError(f"cannot write {path}: {reason}") from error


def write_bytes(path: Path, data: bytes) -> None:
    """Write `data` to `path`, whole or not at all."""
    with replacing(path) as beside:
        beside.write_bytes(data)


def write_text(path: Path, text: str) -> None:
    """Write `text` to `path` as UTF-8, whole or not at all."""
    write_bytes(path, text.encode("utf-8"))


@contextmanager
def restoring(folder: Path, files: Iterable[Path]) -> Iterator[None]:
    """Move `files`, all below `folder`, out of the way of those that the block writes.

    If it raises or is interrupted, they are put back, and what it has made of them is deleted.
    Moving takes no space, so that they survive a full disk.
    """
    files = list(dict.fromkeys(file.relative_to(folder) for file in files))
    there = [file for file in files if (folder / file).is_file()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        aside = Path(tempfile.mkdtemp(prefix=ASIDE, dir=folder))
    except OSError as error:
        raise OutputError(f"cannot write into {folder}: {error.strerror or error}") from error
    try:
        _move(there, folder, aside)
        yield
    except BaseException:
        moved = [file for file in there if (aside / file).is_file()]
        for file in files:
            if file in moved or file not in there:
                (folder / file).unlink(missing_ok=True)
        _move(moved, aside, folder)
        shutil.rmtree(aside, ignore_errors=True)
        with suppress(OSError):
            folder.rmdir()  # if nothing was in it before
        raise
    # With what a killed process could not put back: this result takes its place as well.
    for old in folder.glob(f"{ASIDE}*"):
        shutil.rmtree(old, ignore_errors=True)


def _move(files: Iterable[Path], source: Path, target: Path) -> None:
    try:
        for file in files:
            (target / file).parent.mkdir(parents=True, exist_ok=True)
            os.replace(source / file, target / file)
    except OSError as error:
        reason = error.strerror or error
        raise OutputError(f"cannot move {source / file} to {target}: {reason}") from error


def check_writable(folder: Path) -> None:
    """Raise OutputError unless files can be made in `folder`, or it and files in it.

    Called before long work, so that an hour of rendering never ends at a closed door.
    """
    try:
        there = next(f for f in (folder, *folder.absolute().parents) if f.exists())
        with tempfile.TemporaryFile(dir=there):
            pass
    except OSError as error:
        raise OutputError(f"cannot write into {folder}: {error.strerror or error}") from error
