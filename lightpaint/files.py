"""Writing files so that a reader never sees half of one; reading only what is a file."""

import os
import stat
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from lightpaint.errors import LightpaintError, OutputError

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


def first_line(said: str | BaseException) -> str:
    """Of what a library says, or else that it says nothing."""
    silent = "no reason given" if isinstance(said, str) else type(said).__name__
    return next(iter(str(said).strip().splitlines()), silent)


def check_writable(folder: Path) -> None:
    """Raise OutputError unless files can be made in `folder`, or it and files in it.

    Called before long work, so that an hour of rendering never ends at a closed door.
    """
    check_name(folder)
    try:
        if ".." in folder.parts:  # through something that is not there it leads nowhere
            last = len(folder.parts) - folder.parts[::-1].index("..")
            Path(*folder.parts[:last]).stat()
        there = next(f for f in (folder, *folder.absolute().parents) if f.exists())
        with tempfile.TemporaryFile(dir=there):
            pass
    except OSError as error:
        raise OutputError(f"cannot write into {folder}: {error.strerror or error}") from error


def check_files(files: Iterable[Path], reads: Iterable[Path]) -> None:
    """Raise OutputError unless `files` can be written, and none of them is one of `reads`.

    Whatever a command reads it never writes over, by whatever name or link it is known.
    """
    known: dict[tuple[int, int], Path] = {}
    for path in reads:
        with suppress(OSError):
            known[_inode(path)] = path
    for file in files:
        check_name(file)
        if file.is_dir():
            raise OutputError(f"{file} is a folder, where a file is to be written: move it away")
        with suppress(OSError):
            if _inode(file) in known:
                raise OutputError(
                    f"{file} is read by this command, and would be written over: write to another "
                    "place (folder=...)"
                )


def check_name(path: Path) -> None:
    """Raise OutputError for a name that is not UTF-8, which not all that writes can write to."""
    if not is_utf_8(path):
        raise OutputError(
            f"{one_line(str(path))} is not a name in UTF-8: choose another (folder=...)"
        )


def is_utf_8(path: Path) -> bool:
    """Whether its name is; bytes that are not stand in Python's text as halves of pairs."""
    return not any("\ud800" <= character <= "\udfff" for character in str(path))


def _inode(path: Path) -> tuple[int, int]:
    status = path.stat()
    return status.st_dev, status.st_ino
