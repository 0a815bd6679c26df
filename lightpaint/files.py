"""Writing files so that a reader never sees half of one; reading only what is a file."""

import os
import re
import shutil
import stat
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from lightpaint.errors import LightpaintError, OutputError

#: What the name of a folder begins with in which earlier results wait.
ASIDE = ".earlier."

#: Longest text that is read whole, in bytes.
MAX_TEXT = 2**26

#: Characters of what others say that an error repeats.
MAX_QUOTED = 400


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


def file_length(
    path: Path, what: str, error: type[LightpaintError], *, limit: int = MAX_TEXT
) -> int:
    """Length in bytes of what is at `path`; raises `error` unless it is a file, and no longer.

    Reading a device, a pipe or a socket might never end, so that this is asked before any of it
    is read. what: the kind of file that is expected.
    """
    article = "an" if what[0] in "aeiou" else "a"
    try:
        status = Path(path).stat()
    except (FileNotFoundError, NotADirectoryError):
        raise error(f"no such {what}: {path}") from None
    except (OSError, ValueError) as reason:  # a name too long, or with a NUL in it
        said = getattr(reason, "strerror", None) or reason
        raise error(f"cannot read {one_line(str(path))}: {said}") from None
    if stat.S_ISDIR(status.st_mode):
        raise error(f"{path} is a folder, not {article} {what}")
    if not stat.S_ISREG(status.st_mode):
        raise error(f"{path} is a device or a pipe, not {article} {what}")
    if status.st_size > limit:
        raise error(
            f"{path} is {status.st_size} bytes long: no {what} has more than {limit}, so it is not "
            "read"
        )
    return status.st_size


def read_bytes(
    path: Path, what: str, error: type[LightpaintError], *, limit: int = MAX_TEXT
) -> bytes:
    """The content of the file at `path`. Raises `error`, in one line, for all that prevents it."""
    file_length(path, what, error, limit=limit)
    try:
        with Path(path).open("rb") as file:
            data = file.read(limit + 1)
    except OSError as reason:
        raise error(f"cannot read {path}: {reason.strerror or reason}") from None
    if len(data) > limit:  # as of what a kernel makes up, and says is empty
        raise error(f"{path} has no end: no {what} has more than {limit} bytes")
    return data


def read_text(path: Path, what: str, error: type[LightpaintError], *, limit: int = MAX_TEXT) -> str:
    """The text of the UTF-8 file at `path`, without a byte-order mark.

    Raises `error`, in one line, for all that prevents it.
    """
    try:
        return read_bytes(path, what, error, limit=limit).decode("utf-8-sig")
    except UnicodeDecodeError as reason:
        raise error(
            f"{path} is not text in UTF-8: {reason.reason} at byte {reason.start}"
        ) from None


def one_line(text: str, *, limit: int = MAX_QUOTED) -> str:
    """What others say, as it may stand in an error: one line of no more than `limit`."""
    text = " ".join(text[: 4 * limit].split())
    text = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)
    return text if len(text) <= limit else f"{text[:limit]} …"


def first_line(said: str | BaseException, *, of: str | Path | None = None) -> str:
    """Of what a library says, or else that it says nothing.

    of: the file that it is about, which the error names already.
    """
    silent = "no reason given" if isinstance(said, str) else type(said).__name__
    line = next(iter(str(said).strip().splitlines()), silent)
    return line if of is None else unnamed(line, of)


def unnamed(said: str, path: str | Path) -> str:
    """`said` with `it` for the path of a file, in quotes or not, wherever that stands whole."""
    named = rf"""(?<![\w./\\-])(["']?){re.escape(str(path))}\1(?![\w/\\-])"""
    return re.sub(named, "it", said)


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
