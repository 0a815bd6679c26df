"""The cache of bases, so that a second painting of a scene starts at once.

There is one file per scene content, sensor, size and seed; further samples are added to it. Data
derived from a basis lie beside it under the same name with another suffix. The folder may be
deleted at any time.

A file there is listed, read or deleted only if its name follows our patterns, it contains the mark
of our formats, and its owner is trusted. So nobody loses files by naming a work folder as the
cache.
"""

import hashlib
import os
import re
import shutil
import time
import zipfile
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np
from platformdirs import user_cache_path

from lightpaint.arrays import Floats
from lightpaint.basis.file import basis_file
from lightpaint.basis.light_basis import Basis, Origin
from lightpaint.display_text import some_names
from lightpaint.errors import BasisError, LightpaintError, OutputError
from lightpaint.files import read_text, replacing, write_text

#: Size of the cache in bytes above which the least recently used bases are deleted.
MAX_BYTES = 8 * 2**30
#: Exceptions raised by damaged array files.
_DAMAGES = (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile)
#: Age in seconds after which an unfinished file counts as abandoned.
LEFTOVER_S = 3600.0
#: Age in seconds after which data derived from a basis that is not in the cache are deleted.
UNUSED_S = 30 * 86400.0

#: Environment variable that overrides the default folder in the user's cache.
VARIABLE = "LIGHTPAINT_CACHE"

#: Suffixes of a basis and of the files beside it: its denoised planes, facts about its scene, the
#: exact sums of a basis to which samples are still to be added, and results that open a session.
SUFFIX, DENOISED_SUFFIX, FACTS_SUFFIX = ".basis.exr", ".clean.npz", ".known.json"
SUMS_SUFFIX, OPENING_SUFFIX = ".sums.npz", ".opening.npz"
#: Folder for parts of bases that are being rendered.
PARTS = "parts"

BASIS_NAME = re.compile(r"[0-9a-f]{32}\.basis\.exr")
COMPANION_NAME = re.compile(
    r"([0-9a-f]{32})(?:\.clean\.npz|\.opening\.npz|\.[0-9a-f]{32}\.known\.json|\.[0-9a-f]{32}\.sums\.npz)"
)
#: Pattern of the temporary folders that `files.replacing` creates.
LEFTOVER_NAME = re.compile(r"\.([0-9a-f]{32}\.(?:[0-9a-f.]+\.)?[a-z]+\.[a-z]+)\.[a-z0-9_]{8}")

#: Marks a cache folder, by a convention that backup programs know: https://bford.info/cachedir
TAG, MAX_TAG = "CACHEDIR.TAG", 2**16
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
    OPENING_SUFFIX: b"opening_of.npy",
}
MARK_WITHIN = {SUFFIX: 2**20} | dict.fromkeys(
    (DENOISED_SUFFIX, FACTS_SUFFIX, SUMS_SUFFIX, OPENING_SUFFIX), 2**8
)

#: Number of foreign files that an error message names, and number of files that are inspected.
NAMES_SHOWN, NAMES_READ = 3, 100_000


@dataclass(frozen=True)
class Entry:
    """A cached basis.

    size: bytes, including the files beside it. image_size: (height, width). lights: number of
    lights. identities: the known identities of its planes. origin, image_size and lights are None
    if the file cannot be read.
    """

    path: Path
    size: int
    origin: Origin | None
    image_size: tuple[int, int] | None = None
    lights: int | None = None
    identities: frozenset[str] = frozenset()


def find(scene_identity: str, sensor: str, seed: int, size: tuple[int, int]) -> Basis | None:
    """Return the cached basis for these arguments; None if it is missing or damaged."""
    path = path_for(scene_identity, sensor, seed, size)
    return _read(path) if is_own(path) else None


def read(entry: Entry) -> Basis | None:
    """Return the basis of an entry; None if it is damaged or was deleted after it was listed."""
    return _read(entry.path)


def _read(path: Path) -> Basis | None:
    try:
        basis = basis_file.read_basis(path)
        if path != _path_of(basis):
            raise BasisError(f"{path} is the basis of something else")
    except LightpaintError:
        return None
    with suppress(OSError):  # the cache may be read-only
        path.touch()
    return basis


def cached_spp(scene_identity: str, sensor: str, seed: int, size: tuple[int, int]) -> int:
    """Return the samples per pixel of the cached basis for these arguments; 0 if there is none."""
    path = path_for(scene_identity, sensor, seed, size)
    origin = _entry(path).origin if is_own(path) else None
    return 0 if origin is None else origin.spp


def find_most_sampled(
    scene_identity: str, sensor: str, *, samples: int, largest: int
) -> Basis | None:
    """Return the cached basis with the most samples, at any size and seed; None if there is none.

    samples: minimum number of samples, summed over all pixels. largest: maximum file size in bytes.
    """
    candidates: list[tuple[int, Origin, tuple[int, int]]] = []
    for entry in entries():
        origin, size = entry.origin, entry.image_size
        if origin is None or size is None or entry.size > largest:
            continue
        count = size[0] * size[1] * origin.spp
        is_same = (origin.scene_identity, origin.sensor) == (scene_identity, sensor)
        if is_same and count >= samples:
            candidates.append((count, origin, size))
    if not candidates:
        return None
    _, origin, size = max(candidates, key=lambda candidate: candidate[0])
    return find(scene_identity, sensor, origin.seed, size)


def keep(basis: Basis) -> bool:
    """Store `basis` in the cache, replacing the one for its scene, sensor, size and seed.

    Returns whether that worked: a full disk must not lose a render.
    """
    try:
        path = _path_of(basis)
        tag = folder() / TAG
        if not tag.exists():
            write_text(tag, TAG_TEXT)
        _write_sums(basis)
        basis_file.write_basis(path, basis)
        for other in _companions_of(path):
            is_old = basis.sums is None or other != _sums_path(basis)
            if other.name.endswith(SUMS_SUFFIX) and is_old:
                other.unlink()
        _prune(path)
    except (OutputError, OSError):
        return False
    return True


def sums_of(basis: Basis) -> tuple[Floats, Floats] | None:
    """Return the exact sums of a cached basis (`Basis.sums`); None if they are not in the cache."""
    path = _sums_path(basis)
    try:
        if not is_own(path):
            return None
        with path.open("rb") as file, np.load(file, allow_pickle=False) as arrays:
            sums = arrays["sums_a"], arrays["sums_b"]
    except (*_DAMAGES, OutputError):
        return None
    n = len(basis.lights) * (1 if basis.indirect is None else 2)
    shape = (n, *basis.size, 3)
    return sums if all((x.shape, x.dtype) == (shape, np.float32) for x in sums) else None


def _write_sums(basis: Basis) -> None:
    """Write the exact sums of `basis`, if it has any, before the basis itself is written.

    The file name depends on the samples, so the sums of the old basis stay until it is replaced.
    """
    if basis.sums is None:
        return
    with suppress(OutputError, OSError), replacing(_sums_path(basis)) as path:
        # Uncompressed, because noise does not shrink and the sums are soon needed again.
        np.savez(path, sums_a=basis.sums[0], sums_b=basis.sums[1])


def _sums_path(basis: Basis) -> Path:
    """Return the path for the exact sums of `basis`, which is unique to its samples."""
    samples = hashlib.sha256(repr(basis.origin).encode()).hexdigest()[:32]
    return companion_path(basis, f".{samples}{SUMS_SUFFIX}")


def file_of(basis: Basis) -> Path | None:
    """Return the cache file that holds exactly `basis`; None if there is none or it has other
    samples.
    """
    path = _path_of(basis)
    return path if is_own(path) and _entry(path).origin == basis.origin else None


def write_from_cache(path: Path, basis: Basis) -> None:
    """Write a basis from `obtain_basis` as `write_basis` does, by copying its file in the cache if
    there is one: compressing a thousand planes again takes as long as rendering them.
    """
    source = _path_of(basis)
    try:
        with replacing(path) as temporary:
            try:
                if not is_own(source):
                    raise _NotCachedError
                shutil.copyfile(source, temporary)
            except FileNotFoundError as error:
                raise _NotCachedError from error
            # The copy is checked, since another process may replace the file at any time.
            if not basis_file.is_file_of(temporary, basis):
                raise _NotCachedError
    except _NotCachedError:
        basis_file.write_basis(path, basis)


class _NotCachedError(Exception):
    """A basis that the cache does not hold as it is."""


def companion_path(basis: Basis, ending: str) -> Path:
    """Return the path for data derived from `basis`, whether or not the basis is cached.

    ending: DENOISED_SUFFIX, FACTS_SUFFIX or SUMS_SUFFIX, including what precedes it.
    """
    return folder() / f"{_path_of(basis).name.removesuffix(SUFFIX)}{ending}"


def companions_with(ending: str) -> list[Path]:
    """Return the cached files with this ending, also those whose basis was deleted; none if the
    folder cannot be read.
    """
    with suppress(OSError, OutputError):
        return [path for path in folder().glob(f"*{ending}") if is_own(path)]
    return []


def is_cached(basis: Basis) -> bool:
    """Return True if `basis`, or the same basis with more samples, is in the cache."""
    path = _path_of(basis)
    origin = _entry(path).origin if is_own(path) else None
    return origin is not None and (
        origin == basis.origin or origin.mean_spp > basis.origin.mean_spp
    )


def _prune(path: Path) -> None:
    """Bring the folder back under MAX_BYTES, without deleting `path`."""
    for leftover in folder().glob(".*"):
        # Leftovers of a killed process.
        if _is_leftover(leftover) and time.time() - leftover.stat().st_mtime > LEFTOVER_S:
            shutil.rmtree(leftover, ignore_errors=True)
    delete_orphans(UNUSED_S)
    remaining_bytes = MAX_BYTES - _entry(path).size
    for entry in reversed(entries()):
        if entry.path == path:
            continue
        remaining_bytes -= entry.size
        if remaining_bytes < 0:
            for file in (*_companions_of(entry.path), entry.path):
                file.unlink(missing_ok=True)


def _is_leftover(path: Path) -> bool:
    """Return True for a temporary folder in which one file of the cache was being written."""
    name = LEFTOVER_NAME.fullmatch(path.name)
    if name is None or not path.is_dir() or path.is_symlink():
        return False
    return {entry.name for entry in path.iterdir()} <= {name[1]}


def entries() -> list[Entry]:
    """Return all entries of the cache, least recently used first."""
    basis_files = [path for path in folder().glob(f"*{SUFFIX}") if BASIS_NAME.fullmatch(path.name)]
    files = sorted(filter(is_own, basis_files), key=lambda path: path.stat().st_mtime)
    return [_entry(path) for path in files]


def entries_named(pattern: str) -> list[Entry]:
    """Return the entries whose scene or file name matches `pattern`, in which `*` matches anything.

    A scene matches by its file name, with or without the suffix.
    """
    return [entry for entry in entries() if any(fnmatchcase(x, pattern) for x in _names(entry))]


def delete_entries(entries: Iterable[Entry]) -> int:
    """Delete entries and return the number of bytes freed. Raises OutputError."""
    freed_bytes = 0
    for entry in entries:
        try:
            for file in (*_companions_of(entry.path), entry.path):
                file.unlink(missing_ok=True)
        except OSError as error:
            raise OutputError(f"cannot delete {entry.path}: {error.strerror or error}") from error
        freed_bytes += entry.size
    return freed_bytes


def _names(entry: Entry) -> set[str]:
    file = entry.path.name
    names = {file, file.removesuffix(SUFFIX)}
    if entry.origin is not None:
        names |= {entry.origin.scene, Path(entry.origin.scene).stem}
    return names


def path_for(scene_identity: str, sensor: str, seed: int, size: tuple[int, int]) -> Path:
    """Return the path of the basis for these arguments, whether or not it is cached."""
    key = repr((basis_file.FORMAT, scene_identity, sensor, seed, size))
    return folder() / f"{hashlib.sha256(key.encode()).hexdigest()[:32]}{SUFFIX}"


def _path_of(basis: Basis) -> Path:
    origin = basis.origin
    return path_for(origin.scene_identity, origin.sensor, origin.seed, basis.size)


def _entry(path: Path) -> Entry:
    size = sum(file.stat().st_size for file in (path, *_companions_of(path)))
    try:
        origin, image_size, identities = basis_file.read_origin(path)
    except LightpaintError:
        return Entry(path, size, None)
    known_identities = frozenset(identities) - {""}
    return Entry(path, size, origin, image_size, len(identities), known_identities)


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


def _companions_of(path: Path) -> list[Path]:
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
    with suppress(LightpaintError):
        if "created by lightpaint" in read_text(path / TAG, "tag", LightpaintError, limit=MAX_TAG):
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
