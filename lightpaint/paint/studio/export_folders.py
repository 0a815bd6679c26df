"""Folders of exports that have a name: each export gets a new one, so none replaces another."""

import re
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path

from lightpaint.display_text import visible
from lightpaint.errors import OutputError, PaintError
from lightpaint.files import one_line

#: Folders of named exports and of final renders, in the folder of the session.
EXPORTS, RENDERS = "exports", "renders"

#: Longest name of an export, in bytes; a number and suffixes are added to it.
MAX_NAME_BYTES = 160

#: Characters that a name of a folder cannot have on some system.
_FORBIDDEN = re.compile(r'[/\\:*?"<>|]')


def folder_name(name: str) -> str:
    """Return a name for a folder on any system. Raises PaintError if nothing of `name` is left.

    Slashes and the like become hyphens. Points and spaces at both ends are left out, since they
    hide a folder on some systems and are lost on others.
    """
    text = "".join(x for x in " ".join(name.split()) if visible(x) == x)
    text = _FORBIDDEN.sub("-", text).strip(". ")
    text = text.encode()[:MAX_NAME_BYTES].decode(errors="ignore").rstrip(". ")
    if not text.strip("-"):
        raise PaintError(
            f"{one_line(name)!r} cannot be the name of a folder: give this export another name"
        )
    return text


@contextmanager
def new_folder(parent: Path, name: str) -> Iterator[Path]:
    """Yield a new folder in `parent` for the files of an export.

    name: as given; a number follows it if that folder exists: `evening`, `evening 2`. A folder
    without files is deleted at the end. Raises PaintError as `folder_name` does, and OutputError
    if no folder can be made.
    """
    folder = _make_folder(parent, folder_name(name))
    try:
        yield folder
    finally:
        with suppress(OSError):  # raised for a folder with files
            folder.rmdir()
            parent.rmdir()


def _make_folder(parent: Path, name: str) -> Path:
    """Make and return the first folder of that name and a number that nobody has made yet."""
    for number in count(1):
        folder = parent / (name if number == 1 else f"{name} {number}")
        try:
            folder.mkdir(parents=True)
        except FileExistsError:
            continue
        except OSError as error:
            raise OutputError(f"cannot make {folder}: {error.strerror}") from None
        return folder
    raise AssertionError
