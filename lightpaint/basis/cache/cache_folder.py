"""The folder that bases are kept in, and which of its files are this program's own.

The cache lists, reads and deletes only files with our own kind of name, the signature of our own
formats, and a trusted owner. So a user who names a work folder as the cache loses nothing.
"""

import os
import re
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from platformdirs import user_cache_path

from lightpaint.errors import OutputError
from lightpaint.files import write_text
from lightpaint.screen import some_names

#: Names the folder, where it is not that of the user's cache.
VARIABLE = "LIGHTPAINT_CACHE"

#: Suffix of a basis, and of the files beside it: its denoised planes, facts about its scene, and
#: the exact sums of one to which samples are still to be added.
SUFFIX, DENOISED_SUFFIX, FACTS_SUFFIX = ".basis.exr", ".clean.npz", ".known.json"
SUMS_SUFFIX = ".sums.npz"
#: Folder of the parts of bases that are being rendered.
PARTS = "parts"

BASIS_NAME = re.compile(r"[0-9a-f]{32}\.basis\.exr")
COMPANION_NAME = re.compile(
    r"([0-9a-f]{32})(?:\.clean\.npz|\.[0-9a-f]{32}\.known\.json|\.[0-9a-f]{32}\.sums\.npz)"
)
#: Folder of a file that is being written, as `files.replacing` names it.
LEFTOVER_NAME = re.compile(r"\.([0-9a-f]{32}\.(?:[0-9a-f.]+\.)?[a-z]+\.[a-z]+)\.[a-z0-9_]{8}")

#: The file that marks a folder as a cache, by a convention that backup programs know:
#: https://bford.info/cachedir
TAG = "CACHEDIR.TAG"
TAG_TEXT = """Signature: 8a477f597d28d172789f06886806bc55
# This file is a cache directory tag created by lightpaint, which keeps rendered bases here.
# All of this folder may be deleted at any time.
"""

#: Signature at or near the beginning of each kind of file, and its largest offset in bytes.
MARKS = {
    SUFFIX: b"lightpaint-basis",
    DENOISED_SUFFIX: b"made_of.npy",
    FACTS_SUFFIX: b'"lightpaint-known',
    SUMS_SUFFIX: b"sums_a.npy",
}
MARK_WITHIN = {SUFFIX: 2**20, DENOISED_SUFFIX: 2**8, FACTS_SUFFIX: 2**8, SUMS_SUFFIX: 2**8}

#: Other files that are named of a folder that is none of ours, and looked at before it is one.
NAMES_SHOWN, NAMES_READ = 3, 100_000


def folder() -> Path:
    """Return where bases are kept.

    Raises OutputError for a folder that LIGHTPAINT_CACHE names and that has other files in it, not
    having been made, or begun, for this.
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
    """Mark the folder as one of ours, where it is not yet. Raises OutputError."""
    tag = folder() / TAG
    if not tag.exists():
        write_text(tag, TAG_TEXT)


def is_own(path: Path) -> bool:
    """Return whether the file at `path` was written by this program, and by somebody to believe."""
    ending = next((end for end in MARKS if path.name.endswith(end)), None)
    if ending is None:
        return False
    try:
        # A file of another user may be a link, or a pipe that never ends.
        with open(path, "rb", opener=lambda name, flags: os.open(name, flags | os.O_NONBLOCK)) as f:
            status = os.fstat(f.fileno())
            return is_trusted_owner(status) and MARKS[ending] in f.read(MARK_WITHIN[ending])
    except OSError:
        return False


def is_trusted_owner(status: os.stat_result) -> bool:
    """Return whether this process's user or the administrator owns a file or folder."""
    return not hasattr(os, "geteuid") or status.st_uid in (os.geteuid(), 0)


def companions_of(path: Path) -> list[Path]:
    """Return the data derived from the basis at `path`."""
    name = path.name.removesuffix(SUFFIX)
    return [companion for companion, stem in _companions() if stem == name]


def delete_orphans(unused_s: float = 0.0) -> int:
    """Delete long-unused files without a kept basis, and return their bytes."""
    freed = 0
    for path, name in _companions():
        with suppress(OSError):
            status = path.stat()
            is_alone = not path.with_name(name + SUFFIX).exists()
            if is_alone and time.time() - status.st_mtime >= unused_s:
                path.unlink()
                freed += status.st_size
    return freed


def _companions() -> list[tuple[Path, str]]:
    """Return data derived from bases, with the stem of each basis."""
    matches = ((path, COMPANION_NAME.fullmatch(path.name)) for path in folder().glob("*"))
    return [(path, match[1]) for path, match in matches if match is not None and is_own(path)]


def _foreign_names(path: Path) -> list[str]:
    """Return some foreign names in the folder; none if it is ours, new or hidden."""
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
