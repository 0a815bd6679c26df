"""Writing files so that a reader never sees half of one; reading only what is a file."""

import errno
import os
import re
import shutil
import stat
import tempfile
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any, BinaryIO, TypeVar, cast

from lightpaint.errors import LightpaintError, OutputError
from lightpaint.screen import visible

#: Longest text that is read whole, in bytes; and how much of it at a time.
MAX_TEXT, PIECE = 2**26, 2**22

#: Seconds in which a file has to answer, which also a drive that has to wake up does.
PATIENCE_S = 30.0

_Made = TypeVar("_Made")

#: Longest name of a file, in bytes, on most systems; and what is put behind or before it here.
LONGEST_NAME = 255 - 32

#: Characters of what others say that an error repeats.
MAX_QUOTED = 400

#: How a folder is called in which a file is written: by the file, and as tempfile ends names.
_BESIDE = re.compile(r"\.(.+)\.[a-z0-9_]{8}")


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a path beside `path` to write to; it takes the place of `path` at the end.

    What was at `path` stays untouched if the block raises, is interrupted, the disk is full or the
    current ends. Raises OutputError, naming `path`, for whatever the system refuses.
    """
    path = Path(path)
    beside: Path | None = None
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        # A directory of its own keeps the file's true name, whose ending some writers obey.
        with tempfile.TemporaryDirectory(prefix=f".{path.name}.", dir=path.parent) as folder:
            beside = Path(folder) / path.name
            yield beside
            flush(beside)
            os.replace(beside, path)
    except OSError as error:
        reason = error.strerror or str(error)
        raise OutputError(f"cannot write {path}: {reason}") from error


def flush(path: Path) -> None:
    """Have the disk hold what was written to a file, before a name promises it.

    Else a rename may be on the disk sooner than what is renamed: when the current ends, the name
    then stands for an empty file, and what it stood for before is gone. Raises OSError.
    """
    with path.open("rb") as file:
        os.fsync(file.fileno())


def sweep(folder: Path) -> None:
    """Delete what stays in `folder` of writing to files there when a process was killed meanwhile.

    To be called where nobody else writes.
    """
    for path in folder.glob(".*"):
        name = _BESIDE.fullmatch(path.name)
        with suppress(OSError):
            if name and path.is_dir() and {x.name for x in path.iterdir()} <= {name[1]}:
                shutil.rmtree(path)


def write_bytes(path: Path, data: bytes) -> None:
    """Write `data` to `path`, whole or not at all."""
    with replacing(path) as beside:
        beside.write_bytes(data)


def write_text(path: Path, text: str) -> None:
    """Write `text` to `path` as UTF-8, whole or not at all."""
    write_bytes(path, text.encode("utf-8"))


def file_length(
    path: Path,
    what: str,
    error: type[LightpaintError],
    *,
    limit: int = MAX_TEXT,
    may_be_empty: bool = False,
) -> int:
    """Length in bytes of what is at `path`; raises `error` unless it is a file that can be read.

    Reading a device, a pipe or a socket might never end, so that this is asked before any of it
    is read. So might what a kernel makes up under /proc, which says that it is empty; and what is
    on a drive that is away does not begin. what: the kind of file that is expected.
    """
    article = "an" if what[0] in "aeiou" else "a"
    try:
        status, hollow = _in_time(lambda: _looked_at(Path(path), limit))
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
    if status.st_size == 0 and (_is_made_up(status) or not may_be_empty):
        raise error(f"{path} is empty, or only made up when it is read: expected {article} {what}")
    if hollow:
        raise error(
            f"{path} is {status.st_size} bytes long, and nearly all of it was never written"
        )
    return status.st_size


def _looked_at(path: Path, limit: int) -> tuple[os.stat_result, bool]:
    """What the system says of `path`, and whether a file of at most `limit` is hollow."""
    status = path.stat()
    may_be_read = stat.S_ISREG(status.st_mode) and 0 < status.st_size <= limit
    return status, may_be_read and _is_hollow(path, status.st_size)


def _is_made_up(status: os.stat_result) -> bool:
    """Whether it is a file only to look at, as under /proc."""
    return os.path.ismount("/proc") and status.st_dev == os.stat("/proc").st_dev


def _is_hollow(path: Path, size: int) -> bool:
    """Whether less than a thousandth of a long file was ever written: who reads it is long at it.

    Reads the first byte, to see whether it can be read at all.
    """
    with _opened(path) as file:
        file.read(1)
        if size <= MAX_TEXT:
            return False
        written = at = 0
        while 1000 * written < size:
            try:
                start = os.lseek(file.fileno(), at, os.SEEK_DATA)
            except OSError:  # there is no more
                return True
            at = os.lseek(file.fileno(), start, os.SEEK_HOLE)
            written += at - start
    return False


def _opened(path: Path) -> BinaryIO:
    # Should it have become a pipe meanwhile, nobody waits for who writes to it.
    return open(path, "rb", opener=lambda name, flags: os.open(name, flags | os.O_NONBLOCK))


def _first_piece(path: Path) -> tuple[BinaryIO, bytes]:
    file = _opened(path)
    return file, file.read(PIECE)


def in_time(work: Callable[[], _Made], patience_s: float, reason: str = "") -> _Made:
    """Return what `work` returns, or raise what it raises; TimeoutError if it does not end in time.

    patience_s: seconds to wait. reason: what the message of a TimeoutError adds. The work goes on
    in a thread of its own, which no one waits for at the end of the process.
    """
    answers: SimpleQueue[tuple[_Made | None, BaseException | None]] = SimpleQueue()

    def answer() -> None:
        try:
            answers.put((work(), None))
        except BaseException as error:
            answers.put((None, error))

    threading.Thread(target=answer, daemon=True).start()
    try:
        made, failure = answers.get(timeout=patience_s)
    except Empty:
        raise TimeoutError(errno.ETIMEDOUT, f"no answer within {patience_s:g} s{reason}") from None
    if failure is not None:
        raise failure
    return cast(_Made, made)


def _in_time(work: Callable[[], _Made]) -> _Made:
    """Return what `work` does with a file, `in_time`."""
    return in_time(work, PATIENCE_S, "; is it on a drive that is away?")


def read_bytes(
    path: Path,
    what: str,
    error: type[LightpaintError],
    *,
    limit: int = MAX_TEXT,
    may_be_empty: bool = False,
) -> bytes:
    """The content of the file at `path`. Raises `error`, in one line, for all that prevents it."""
    if file_length(path, what, error, limit=limit, may_be_empty=may_be_empty) == 0:
        return b""  # and is not asked for more, which might never come
    data = bytearray()
    try:
        file, piece = _in_time(lambda: _first_piece(path))
        with file:
            data += piece
            while len(piece) == PIECE and len(data) <= limit:
                data += (piece := _in_time(lambda: file.read(PIECE)))
    except OSError as reason:
        raise error(f"cannot read {path}: {reason.strerror or reason}") from None
    if len(data) > limit:  # as of what is still being written
        raise error(f"{path} has no end: no {what} has more than {limit} bytes")
    return bytes(data)


def read_text(path: Path, what: str, error: type[LightpaintError], **how: Any) -> str:
    """The text of the UTF-8 file at `path`, without a byte-order mark.

    how: as of `read_bytes`. Raises `error`, in one line, for all that prevents it.
    """
    try:
        return read_bytes(path, what, error, **how).decode("utf-8-sig")
    except UnicodeDecodeError as reason:
        raise error(
            f"{path} is not text in UTF-8: {reason.reason} at byte {reason.start}"
        ) from None


def is_name(text: str) -> bool:
    """Whether a file or a folder may be called `text`: one that is seen, and in no other folder."""
    if text in ("", ".", "..") or "/" in text or os.sep in text or visible(text) != text:
        return False
    return len(os.fsencode(text)) <= LONGEST_NAME


def one_line(text: str, *, limit: int = MAX_QUOTED) -> str:
    """What others say, as it may stand in an error: one line of no more than `limit`."""
    text = visible(" ".join(text[: 4 * limit].split()))
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


def called(path: Path) -> str:
    """A scene by its file, or by its folder where that is called as all are."""
    is_basis = path.name.endswith(".basis.exr")
    stem = path.name.removesuffix(".basis.exr") if is_basis else path.stem
    parent = path.absolute().parent.name
    return parent if stem == "scene" and parent else stem or path.name
