"""The cache folder, and the check that a file in it was written by this program.

A file there is listed, read or deleted only if its name follows our patterns, it contains the mark
of our formats, and its owner is trusted. So nobody loses files by naming a work folder as the
cache.
"""

import os
import re
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from platformdirs import user_cache_path

from lightpaint.display_text import some_names
from lightpaint.errors import OutputError
from lightpaint.files import write_text

#: Environment variable that overrides the default folder in the user's cache.
VARIABLE = "LIGHTPAINT_CACHE"

#: Suffixes of a basis and of the files beside it: its denoised planes, facts about its scene, and
#: the exact sums of a basis to which samples are still to be added.
SUFFIX, DENOISED_SUFFIX, FACTS_SUFFIX = ".basis.exr", ".clean.npz", ".known.json"
SUMS_SUFFIX = ".sums.npz"
#: Folder for parts of bases that are being rendered.
PARTS = "parts"

BASIS_NAME = re.compile(r"[0-9a-f]{32}\.basis\.exr")
COMPANION_NAME = re.compile(
    r"([0-9a-f]{32})(?:\.clean\.npz|\.[0-9a-f]{32}\.known\.json|\.[0-9a-f]{32}\.sums\.npz)"
)
#: Pattern of the temporary folders that `files.replacing` creates.
LEFTOVER_NAME = re.compile(r"\.([0-9a-f]{32}\.(?:[0-9a-f.]+\.)?[a-z]+\.[a-z]+)\.[a-z0-9_]{8}")

#: Marks a cache folder, by a convention that backup programs know: https://bford.info/cachedir
TAG = "CACHEDIR.TAG"
TAG_TEXT = """Signature: 8a477f597d28d172789f06886806bc55
# This file is a cache directory tag created by lightpaint, which keeps rendered bases here.
# All of this folder may be deleted at any time.
"""

#: Mark at or near the beginning of each kind of file, and the bytes within which it must appear.
MARKS = {
    SUFFIX: b"lightpaint-basis",
    DENOISED_SUFFIX: b"made_of.npy",
    FACTS_SUFFIX: b'"lightpaint-known',
    SUMS_SUFFIX: b"sums_a.npy",
}
MARK_WITHIN = {SUFFIX: 2**20, DENOISED_SUFFIX: 2**8, FACTS_SUFFIX: 2**8, SUMS_SUFFIX: 2**8}

#: Number of foreign files that an error message names, and number of files that are inspected.
NAMES_SHOWN, NAMES_READ = 3, 100_000


def folder() -> Path:
    """Return the folder in which bases are cached.

    Raises OutputError if LIGHTPAINT_CACHE names a folder that contains other files and was not
    created by this program.
    """
    named_folder = os.environ.get(VARIABLE)
    if not named_folder:
        return user_cache_path("lightpaint") / "bases"
    path = Path(named_folder)
    if foreign := _foreign_names(path):
        raise OutputError(
            f"{VARIABLE} names {path}, which has other files in it ({some_names(foreign)}): name a "
            "folder that is new or empty, where bases may be kept and deleted"
        )
    return path


def mark_folder() -> None:
    """Mark the folder as ours, unless it is marked already. Raises OutputError."""
    tag = folder() / TAG
    if not tag.exists():
        write_text(tag, TAG_TEXT)


def is_own(path: Path) -> bool:
    """Return whether the file at `path` was written by this program and has a trusted owner."""
    ending = next((end for end in MARKS if path.name.endswith(end)), None)
    if ending is None:
        return False
    try:
        # Another user's file may be a link, or a pipe that never ends.
        with open(path, "rb", opener=lambda name, flags: os.open(name, flags | os.O_NONBLOCK)) as f:
            status = os.fstat(f.fileno())
            return is_trusted_owner(status) and MARKS[ending] in f.read(MARK_WITHIN[ending])
    except OSError:
        return False


def is_trusted_owner(status: os.stat_result) -> bool:
    """Return whether a file or folder belongs to the current user or to root."""
    return not hasattr(os, "geteuid") or status.st_uid in (os.geteuid(), 0)


def companions_of(path: Path) -> list[Path]:
    """Return the files derived from the basis at `path`."""
    name = path.name.removesuffix(SUFFIX)
    return [companion for companion, stem in _companions() if stem == name]


def delete_orphans(unused_s: float = 0.0) -> int:
    """Delete derived files whose basis is gone and which were not used for `unused_s` seconds.
    Returns the number of bytes freed.
    """
    freed_bytes = 0
    for path, name in _companions():
        with suppress(OSError):
            status = path.stat()
            is_alone = not path.with_name(name + SUFFIX).exists()
            if is_alone and time.time() - status.st_mtime >= unused_s:
                path.unlink()
                freed_bytes += status.st_size
    return freed_bytes


def _companions() -> list[tuple[Path, str]]:
    """Return the files derived from bases, each with the stem of its basis."""
    matches = ((path, COMPANION_NAME.fullmatch(path.name)) for path in folder().glob("*"))
    return [(path, match[1]) for path, match in matches if match is not None and is_own(path)]


def _foreign_names(path: Path) -> list[str]:
    """Return some foreign names in the folder; none if it is ours or new, or contains only hidden
    files.
    """
    with suppress(OSError):
        if "created by lightpaint" in (path / TAG).read_text("utf-8", "replace")[:1000]:
            return []
    names: list[str] = []
    with suppress(OSError):
        for name in _names_in(path):
            if not (name.startswith(".") or _is_own_name(name)):
                names.append(name)
            if len(names) == NAMES_SHOWN:
                break
    return names


def _is_own_name(name: str) -> bool:
    kinds = (BASIS_NAME, COMPANION_NAME)
    return name in (PARTS, TAG) or any(kind.fullmatch(name) for kind in kinds)


def _names_in(path: Path) -> Iterator[str]:
    with os.scandir(path) as entries:
        for entry, _ in zip(entries, range(NAMES_READ), strict=False):
            yield entry.name
