"""Files: written so that no reader ever sees half of one, read only if regular, of a limited length
and within a limited time; and their names, checked and quoted.
"""

import _thread
import errno
import os
import re
import shutil
import stat
import tempfile
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any, BinaryIO, TypeVar, cast

from lightpaint.display_text import visible
from lightpaint.errors import LightpaintError, OutputError
from lightpaint.sentences import Hint, Sentence

#: Longest name of a file, in bytes: most systems allow 255, and suffixes are added here.
LONGEST_NAME = 255 - 32

#: Longest foreign text that an error quotes, in characters.
MAX_QUOTED = 400

#: Name of the temporary folder that a file is written in: `.NAME.`, then tempfile's suffix.
_TEMPORARY_FOLDER = re.compile(r"\.(.+)\.[a-z0-9_]{8}")

#: Longest text that is read, and the size of the chunks it is read in, both in bytes.
MAX_TEXT, CHUNK = 2**26, 2**22

#: Seconds in which a file must answer; a sleeping drive wakes up in less.
FILE_TIMEOUT_S = 30.0

#: Seconds in which a thread begins, however busy the machine is.
THREAD_START_S = 30.0

_Result = TypeVar("_Result")


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a path beside `path` to write to; the file written there replaces `path` at the end.

    The file at `path` stays as it was if the block raises or is interrupted, the disk fills up or
    the power fails. Raises OutputError, naming `path`, for every refusal of the system.
    """
    path = Path(path)
    temporary: Path | None = None
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        # In a folder of its own the file keeps its true name, whose suffix some writers obey.
        with tempfile.TemporaryDirectory(prefix=f".{path.name}.", dir=path.parent) as folder:
            temporary = Path(folder) / path.name
            yield temporary
            flush(temporary)
            os.replace(temporary, path)
    except OSError as error:
        reason = error.strerror or str(error)
        raise OutputError("cannot write ", path, f": {reason}") from error


def flush(path: Path) -> None:
    """Flush a file to the disk before it is renamed.

    Otherwise the rename may reach the disk before the content: after a power failure the name then
    stands for an empty file, and the earlier content is lost. Raises OSError.
    """
    with path.open("rb") as file:
        os.fsync(file.fileno())


def sweep(folder: Path) -> None:
    """Delete the temporary folders that killed processes left in `folder`.

    Call it only while nobody else writes there.
    """
    for path in folder.glob(".*"):
        name = _TEMPORARY_FOLDER.fullmatch(path.name)
        with suppress(OSError):
            if name and path.is_dir() and {x.name for x in path.iterdir()} <= {name[1]}:
                shutil.rmtree(path)


def write_bytes(path: Path, data: bytes) -> None:
    """Write `data` to `path`, all of it or nothing."""
    with replacing(path) as temporary:
        temporary.write_bytes(data)


def write_text(path: Path, text: str) -> None:
    """Write `text` to `path` as UTF-8, all of it or nothing."""
    write_bytes(path, text.encode("utf-8"))


def is_name(text: str) -> bool:
    """Return True if `text` can be the name of a file or folder, visible and in no other folder."""
    if text in ("", ".", "..") or "/" in text or os.sep in text or visible(text) != text:
        return False
    return len(os.fsencode(text)) <= LONGEST_NAME


def one_line(text: str, *, limit: int = MAX_QUOTED) -> str:
    """Return foreign text as an error may quote it: one line of at most `limit` characters."""
    if isinstance(text, Sentence):
        whole = text.mapped(lambda part: visible(re.sub(r"\s+", " ", part)))
        return whole if len(whole) <= limit else whole.shortened(limit) + " …"
    text = visible(" ".join(text[: 4 * limit].split()))
    return text if len(text) <= limit else f"{text[:limit]} …"


def first_line(text: str | BaseException, *, path: str | Path | None = None) -> str:
    """Return the first line of a library's message, or a stand-in if it is empty.

    path: the file that the message is about: it becomes `it`, since our own error names it.
    """
    silent = "no reason given" if isinstance(text, str) else type(text).__name__
    line = next(iter(str(text).strip().splitlines()), silent)
    return line if path is None else without_path(line, path)


def without_path(text: str, path: str | Path) -> str:
    """Return `text` with `it` in place of the path of a file, quoted or not, wherever that stands
    whole.
    """
    pattern = rf"""(?<![\w./\\-])(["']?){re.escape(str(path))}\1(?![\w/\\-])"""
    return re.sub(pattern, "it", text)


def check_writable(folder: Path) -> None:
    """Raise OutputError unless files can be made in `folder`, which may not exist yet.

    Call it before long work, so that an hour of rendering does not end with a failure to write.
    """
    check_name(folder)
    try:
        if ".." in folder.parts:  # `..` below a missing folder leads nowhere
            last = len(folder.parts) - folder.parts[::-1].index("..")
            Path(*folder.parts[:last]).stat()
        existing_folder = next(f for f in (folder, *folder.absolute().parents) if f.exists())
        with tempfile.TemporaryFile(dir=existing_folder):
            pass
    except OSError as error:
        raise OutputError("cannot write into ", folder, f": {error.strerror or error}") from error


def check_files(files: Iterable[Path], inputs: Iterable[Path]) -> None:
    """Raise OutputError unless `files` can be written, and none of them is one of `reads`.

    A command never overwrites a file that it reads, under whatever name or link.
    """
    by_identity: dict[tuple[int, int], Path] = {}
    for path in inputs:
        with suppress(OSError):
            by_identity[_inode(path)] = path
    for file in files:
        check_name(file)
        if file.is_dir():
            raise OutputError(file, " is a folder, but a file is to be written there: move it away")
        with suppress(OSError):
            if _inode(file) in by_identity:
                raise OutputError(
                    file,
                    " is an input of this command, which would overwrite it: write to "
                    "another place (",
                    Hint("folder"),
                    ")",
                )


def check_name(path: Path) -> None:
    """Raise OutputError for a name that is not UTF-8: not all libraries can write to one."""
    if not is_utf_8(path):
        raise OutputError(
            f"the name {one_line(str(path))} is not UTF-8: choose another (", Hint("folder"), ")"
        )


def is_utf_8(path: Path) -> bool:
    """Return True if the name of `path` is UTF-8; Python keeps other bytes as lone surrogates."""
    return not any("\ud800" <= character <= "\udfff" for character in str(path))


def _inode(path: Path) -> tuple[int, int]:
    status = path.stat()
    return status.st_dev, status.st_ino


def scene_name(path: Path) -> str:
    """Return the name of a scene's file, or of its folder if the file is `scene.xml`."""
    is_basis = path.name.endswith(".basis.exr")
    stem = path.name.removesuffix(".basis.exr") if is_basis else path.stem
    parent = path.absolute().parent.name
    return parent if stem == "scene" and parent else stem or path.name


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
    if status.st_size == 0 and _is_virtual(status):
        raise error(path, f" is made up by the system as it is read, and not {article} {kind}")
    if status.st_size == 0 and not may_be_empty:
        raise error(path, f" is empty: expected {article} {kind}")
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
    on in a thread for which the process does not wait at its end. Raises RuntimeError without the
    memory for one.
    """
    answers: SimpleQueue[tuple[_Result | None, BaseException | None]] = SimpleQueue()
    begun: SimpleQueue[None] = SimpleQueue()

    def answer() -> None:
        begun.put(None)
        try:
            answers.put((work(), None))
        except BaseException as error:
            answers.put((None, error))

    # `Thread.start` waits for ever for a thread that lacks the memory for its first step.
    _thread.start_new_thread(answer, ())
    try:
        begun.get(timeout=THREAD_START_S)
    except Empty:
        raise RuntimeError("can't start new thread") from None
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
