"""Read regular files only, of a limited length, within a limited time."""

import errno
import os
import stat
import threading
from collections.abc import Callable
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any, BinaryIO, TypeVar, cast

from lightpaint.errors import LightpaintError
from lightpaint.files import one_line

#: Longest text that is read, and the size of the chunks it is read in, both in bytes.
MAX_TEXT, CHUNK = 2**26, 2**22

#: Seconds in which a file must answer; a sleeping drive wakes up in less.
FILE_TIMEOUT_S = 30.0

_Result = TypeVar("_Result")


def file_length(
    path: Path,
    kind: str,
    error: type[LightpaintError],
    *,
    limit: int = MAX_TEXT,
    may_be_empty: bool = False,
) -> int:
    """Return the length in bytes of the file at `path`; raise `error` unless it can be read.

    Reading a device, a pipe or a socket might never end, so this comes before any reading. Files
    under /proc, which claim to be empty, might not end either; a file on a drive that is away never
    begins. kind: of file that is expected.
    """
    article = "an" if kind[0] in "aeiou" else "a"
    try:
        status, is_sparse = _call_in_time(lambda: _stat(Path(path), limit))
    except (FileNotFoundError, NotADirectoryError):
        raise error(f"no such {kind}: ", path) from None
    except (OSError, ValueError) as reason:  # a name too long, or with a NUL in it
        detail = getattr(reason, "strerror", None) or reason
        raise error(f"cannot read {one_line(str(path))}: {detail}") from None
    if stat.S_ISDIR(status.st_mode):
        raise error(path, f" is a folder, not {article} {kind}: name the file in it")
    if not stat.S_ISREG(status.st_mode):
        raise error(path, f" is a device or a pipe, not {article} {kind}")
    if status.st_size > limit:
        raise error(
            path,
            f" is {status.st_size} bytes long: no {kind} has more than {limit}, so it is not read",
        )
    if status.st_size == 0 and (_is_virtual(status) or not may_be_empty):
        raise error(path, f" is empty, or only made up when it is read: expected {article} {kind}")
    if is_sparse:
        raise error(
            path, f" is {status.st_size} bytes long, and nearly all of it was never written"
        )
    return status.st_size


def _stat(path: Path, limit: int) -> tuple[os.stat_result, bool]:
    """Return the status of `path`, and whether a file of at most `limit` bytes is sparse."""
    status = path.stat()
    may_be_read = stat.S_ISREG(status.st_mode) and 0 < status.st_size <= limit
    return status, may_be_read and _is_sparse(path, status.st_size)


def _is_virtual(status: os.stat_result) -> bool:
    """Return True for a file that the kernel makes up, as under /proc."""
    return os.path.ismount("/proc") and status.st_dev == os.stat("/proc").st_dev


def _is_sparse(path: Path, size: int) -> bool:
    """Return True if less than a thousandth of a long file was ever written.

    Such a file takes long to read and holds nothing. The first byte is read in any case, to see
    whether the file can be read at all.
    """
    with _open(path) as file:
        file.read(1)
        if size <= MAX_TEXT:
            return False
        written = position = 0
        while 1000 * written < size:
            try:
                start = os.lseek(file.fileno(), position, os.SEEK_DATA)
            except OSError:  # end of the file
                return True
            position = os.lseek(file.fileno(), start, os.SEEK_HOLE)
            written += position - start
    return False


def _open(path: Path) -> BinaryIO:
    # Should it have become a pipe meanwhile, opening it does not wait for a writer.
    return open(path, "rb", opener=lambda name, flags: os.open(name, flags | os.O_NONBLOCK))


def _read_first_chunk(path: Path) -> tuple[BinaryIO, bytes]:
    file = _open(path)
    return file, file.read(CHUNK)


def call_with_timeout(work: Callable[[], _Result], timeout_s: float, reason: str = "") -> _Result:
    """Return the result of `work` or raise its error; raise TimeoutError if it takes too long.

    timeout_s: seconds to wait. reason: text to add to the message of a TimeoutError. The work goes
    on in a daemon thread, for which the process does not wait at its end.
    """
    answers: SimpleQueue[tuple[_Result | None, BaseException | None]] = SimpleQueue()

    def answer() -> None:
        try:
            answers.put((work(), None))
        except BaseException as error:
            answers.put((None, error))

    threading.Thread(target=answer, daemon=True).start()
    try:
        result, failure = answers.get(timeout=timeout_s)
    except Empty:
        raise TimeoutError(errno.ETIMEDOUT, f"no answer within {timeout_s:g} s{reason}") from None
    if failure is not None:
        raise failure
    return cast(_Result, result)


def _call_in_time(work: Callable[[], _Result]) -> _Result:
    """Return the result of work on a file, within FILE_TIMEOUT_S."""
    return call_with_timeout(work, FILE_TIMEOUT_S, "; is it on a drive that is away?")


def read_bytes(
    path: Path,
    kind: str,
    error: type[LightpaintError],
    *,
    limit: int = MAX_TEXT,
    may_be_empty: bool = False,
) -> bytes:
    """Return the content of the file at `path`. Raises `error`, in one line, if anything prevents
    it.
    """
    if file_length(path, kind, error, limit=limit, may_be_empty=may_be_empty) == 0:
        return b""  # and is not read: a read might never return
    data = bytearray()
    try:
        file, chunk = _call_in_time(lambda: _read_first_chunk(path))
        with file:
            data += chunk
            while len(chunk) == CHUNK and len(data) <= limit:
                data += (chunk := _call_in_time(lambda: file.read(CHUNK)))
    except OSError as reason:
        raise error("cannot read ", path, f": {reason.strerror or reason}") from None
    if len(data) > limit:  # it has grown since: somebody is still writing it
        raise error(path, f" has no end: no {kind} has more than {limit} bytes")
    return bytes(data)


def read_text(path: Path, kind: str, error: type[LightpaintError], **options: Any) -> str:
    """Return the text of the UTF-8 file at `path`, without a byte-order mark.

    options: as in `read_bytes`. Raises `error`, in one line, for all that prevents it.
    """
    try:
        return read_bytes(path, kind, error, **options).decode("utf-8-sig")
    except UnicodeDecodeError as reason:
        raise error(
            path, f" is not text in UTF-8: {reason.reason} at byte {reason.start}"
        ) from None
