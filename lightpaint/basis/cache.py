"""Bases kept from earlier runs, so that a second painting of a scene is answered at once.

One file per scene content, sensor, size and seed; more samples are added to it when asked for.
Beside it lies, under its name with another ending, what was made of it or is known of its scene.
The folder (`cache_folder.py`) may be deleted at any time.
"""

import hashlib
import shutil
import time
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path

from lightpaint.basis.basis import Basis, Origin
from lightpaint.basis.basis_file import FORMAT, read_basis, read_origin, write_basis
from lightpaint.basis.cache_folder import (
    BASIS_NAME,
    COMPANION_NAME,
    LEFTOVER_NAME,
    SUFFIX,
    folder,
    is_own,
    mark_folder,
)
from lightpaint.errors import BasisError, LightpaintError, OutputError

#: Bytes above which the bases that were not used for longest are deleted.
MAX_BYTES = 8 * 2**30
#: Seconds after which an unfinished file belongs to nobody.
LEFTOVER_S = 3600.0
#: And after which what was made of a basis that is not kept here is made again if need be.
UNUSED_S = 30 * 86400.0


@dataclass(frozen=True)
class Entry:
    """A cached basis.

    size: in bytes, with what is kept beside it. image_size: (height, width), lights: how many.
    origin and these are None if the file cannot be read. identities: of its planes, where known.
    """

    path: Path
    size: int
    origin: Origin | None
    image_size: tuple[int, int] | None = None
    lights: int | None = None
    identities: frozenset[str] = frozenset()


def find(scene_identity: str, sensor: str, seed: int, size: tuple[int, int]) -> Basis | None:
    """Return the cached basis for these arguments; None if missing or damaged."""
    path = _path(scene_identity, sensor, seed, size)
    return _read(path) if is_own(path) else None


def read(entry: Entry) -> Basis | None:
    """Return the basis of an entry, or None if it is damaged, or deleted since it was listed."""
    return _read(entry.path)


def _read(path: Path) -> Basis | None:
    try:
        basis = read_basis(path)
        if path != _path_of(basis):
            raise BasisError(f"{path} is the basis of something else")
    except LightpaintError:
        return None
    with suppress(OSError):  # a cache that can only be read
        path.touch()
    return basis


def cached_spp(scene_identity: str, sensor: str, seed: int, size: tuple[int, int]) -> int:
    """Return the samples per pixel of the cached basis for these arguments; 0 if there is none."""
    path = _path(scene_identity, sensor, seed, size)
    kept = _entry(path).origin if is_own(path) else None
    return 0 if kept is None else kept.spp


def find_most_sampled(
    scene_identity: str, sensor: str, *, samples: int, largest: int
) -> Basis | None:
    """Return the cached basis of any size and seed with the most samples; None if there is none.

    samples: of all pixels together, that it has at least. largest: bytes of its file, at most.
    """
    found: list[tuple[int, Origin, tuple[int, int]]] = []
    for entry in entries():
        of, size = entry.origin, entry.image_size
        if of is None or size is None or entry.size > largest:
            continue
        taken = size[0] * size[1] * of.spp
        if (of.scene_identity, of.sensor) == (scene_identity, sensor) and taken >= samples:
            found.append((taken, of, size))
    if not found:
        return None
    _, origin, size = max(found, key=lambda one: one[0])
    return find(scene_identity, sensor, origin.seed, size)


def keep(basis: Basis) -> bool:
    """Keep `basis` in the place of what was kept for its scene, sensor, size and seed.

    Returns whether that worked: a full disk is no reason to lose a render.
    """
    try:
        path = _path_of(basis)
        mark_folder()
        write_basis(path, basis)
        _prune(path)
    except (OutputError, OSError):
        return False
    return True


def file_of(basis: Basis) -> Path | None:
    """Return the file that holds just `basis`; None if it is not, or has more samples there."""
    path = _path_of(basis)
    return path if is_own(path) and _entry(path).origin == basis.origin else None


def companion_path(basis: Basis, ending: str) -> Path:
    """Return the place for data derived from `basis`, whether that is cached or not.

    ending: CLEAN or KNOWN, what stands before it included.
    """
    return folder() / f"{_path_of(basis).name.removesuffix(SUFFIX)}{ending}"


def companions_of(path: Path) -> list[Path]:
    """Return the data derived from the basis at `path`."""
    name = path.name.removesuffix(SUFFIX)
    return [other for other, its in _companions() if its == name]


def delete_orphans(unused_s: float = 0.0) -> int:
    """Delete what lies beside no kept basis and was not used for that long; how many bytes."""
    freed = 0
    for path, name in _companions():
        with suppress(OSError):
            its = path.stat()
            is_alone = not path.with_name(name + SUFFIX).exists()
            if is_alone and time.time() - its.st_mtime >= unused_s:
                path.unlink()
                freed += its.st_size
    return freed


def _companions() -> list[tuple[Path, str]]:
    """Return data derived from bases, with the stem of each basis."""
    found = ((path, COMPANION_NAME.fullmatch(path.name)) for path in folder().glob("*"))
    return [(path, match[1]) for path, match in found if match is not None and is_own(path)]


def is_cached(basis: Basis) -> bool:
    """Return True if `basis`, or the same with more samples, is in the cache."""
    path = _path_of(basis)
    kept = _entry(path).origin if is_own(path) else None
    return kept is not None and (kept == basis.origin or kept.spp > basis.origin.spp)


def _prune(path: Path) -> None:
    """Bring the folder back under LARGEST, and keep `path`."""
    for leftover in folder().glob(".*"):
        # What a killed process was writing.
        if _is_leftover(leftover) and time.time() - leftover.stat().st_mtime > LEFTOVER_S:
            shutil.rmtree(leftover, ignore_errors=True)
    delete_orphans(UNUSED_S)
    rest = MAX_BYTES - _entry(path).size
    for entry in reversed(entries()):
        if entry.path == path:
            continue
        rest -= entry.size
        if rest < 0:
            for gone in (*companions_of(entry.path), entry.path):
                gone.unlink(missing_ok=True)


def _is_leftover(path: Path) -> bool:
    """Return True for a folder in which a single file of the cache was being written."""
    name = LEFTOVER_NAME.fullmatch(path.name)
    if name is None or not path.is_dir() or path.is_symlink():
        return False
    return {inside.name for inside in path.iterdir()} <= {name[1]}


def entries() -> list[Entry]:
    """Return all entries of the cache, the longest unused first."""
    there = [path for path in folder().glob(f"*{SUFFIX}") if BASIS_NAME.fullmatch(path.name)]
    files = sorted(filter(is_own, there), key=lambda path: path.stat().st_mtime)
    return [_entry(path) for path in files]


def entries_named(pattern: str) -> list[Entry]:
    """Return the entries of a scene, or of a file, of that name; `*` matches anything.

    A scene goes by the name of its file, with or without its ending.
    """
    return [entry for entry in entries() if any(fnmatchcase(x, pattern) for x in _names(entry))]


def delete_entries(kept: Iterable[Entry]) -> int:
    """Delete these. Returns how many bytes that freed."""
    freed = 0
    for entry in kept:
        try:
            for gone in (*companions_of(entry.path), entry.path):
                gone.unlink(missing_ok=True)
        except OSError as error:
            raise OutputError(f"cannot delete {entry.path}: {error.strerror or error}") from error
        freed += entry.size
    return freed


def _names(entry: Entry) -> set[str]:
    file = entry.path.name
    names = {file, file.removesuffix(SUFFIX)}
    if entry.origin is not None:
        names |= {entry.origin.scene, Path(entry.origin.scene).stem}
    return names


def _path(scene_identity: str, sensor: str, seed: int, size: tuple[int, int]) -> Path:
    key = repr((FORMAT, scene_identity, sensor, seed, size))
    return folder() / f"{hashlib.sha256(key.encode()).hexdigest()[:32]}{SUFFIX}"


def _path_of(basis: Basis) -> Path:
    origin = basis.origin
    return _path(origin.scene_identity, origin.sensor, origin.seed, basis.size)


def _entry(path: Path) -> Entry:
    size = sum(file.stat().st_size for file in (path, *companions_of(path)))
    try:
        origin, image_size, identities = read_origin(path)
    except LightpaintError:
        return Entry(path, size, None)
    known = frozenset(identities) - {""}
    return Entry(path, size, origin, image_size, len(identities), known)
