"""Write files so that no reader ever sees half of one; check and quote their names."""

import os
import re
import shutil
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from lightpaint.display_text import visible
from lightpaint.errors import OutputError
from lightpaint.sentences import Hint, Sentence

#: Longest name of a file, in bytes: most systems allow 255, and suffixes are added here.
LONGEST_NAME = 255 - 32

#: Longest foreign text that an error quotes, in characters.
MAX_QUOTED = 400

#: Name of the temporary folder that a file is written in: `.NAME.`, then tempfile's suffix.
_TEMPORARY_FOLDER = re.compile(r"\.(.+)\.[a-z0-9_]{8}")


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
