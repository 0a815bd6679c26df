"""The results of walks over all planes with which a session begins, kept beside a cached basis.

Reading a thousand planes takes many seconds, and a painter needs few numbers of them for its first
picture and its first strokes: the present look, the power of each light, and averages.
"""

import hashlib
import io
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from math import prod
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.basis.cache import basis_cache
from lightpaint.basis.file.basis_file import DeferredFile
from lightpaint.basis.light_basis import Basis
from lightpaint.basis.plane_results import known_arrays, set_known_arrays
from lightpaint.errors import LightpaintError
from lightpaint.files import replacing
from lightpaint.images.formats import RowsUnsupportedError

FORMAT, CONTENT = "lightpaint-opening 1", "opening_of"

#: Suffix of the arrays in an archive of NumPy, and what reads the header of each version of them.
NPY = ".npy"
READ_HEADER = {
    (1, 0): np.lib.format.read_array_header_1_0,
    (2, 0): np.lib.format.read_array_header_2_0,
}

#: Prefixes of names of arrays that follow from images, and from noise.
PREFIXES = "images ", "noise "

#: Exceptions raised by a truncated or foreign file.
_READ_ERRORS = (*(OSError, EOFError, LookupError, ValueError), zipfile.BadZipFile)

Arrays = Mapping[str, npt.NDArray[Any]]


def find_opening(
    scene_identity: str, sensor: str, seed: int, size: tuple[int, int]
) -> Basis | None:
    """Return the cached basis for these arguments as `open_kept` does."""
    path = basis_cache.path_for(scene_identity, sensor, seed, size)
    return open_kept(path) if basis_cache.is_own(path) else None


def open_kept(path: Path) -> Basis | None:
    """Return the basis of a file, whose planes are read at the first walk over them.

    None if the walks with which a session begins are not known: all planes are needed then.
    """
    with suppress(RowsUnsupportedError, OSError, LightpaintError):
        file = DeferredFile(path)
        basis = file.basis()
        arrays = _read(basis_cache.companion_path(basis, basis_cache.OPENING_SUFFIX), file.content)
        if arrays is None:
            return None
        for prefix, planes in zip(PREFIXES, (basis.planes, basis.noise), strict=True):
            names = [name for name in arrays if name.startswith(prefix)]
            set_known_arrays(planes, {name.removeprefix(prefix): arrays[name] for name in names})
        return basis
    return None


def keep_opening(basis: Basis) -> bool:
    """Keep the results of walks that a session of `basis` began with. Returns whether that worked.

    Nothing is kept of a basis of few lights, which is read quickly, or without a file.
    """
    arrays = {
        prefix + name: array
        for prefix, planes in zip(PREFIXES, (basis.planes, basis.noise), strict=True)
        for name, array in known_arrays(planes).items()
    }
    try:
        content = DeferredFile(basis_cache.file_of(basis) or Path(basis.source)).content
        path = basis_cache.companion_path(basis, basis_cache.OPENING_SUFFIX)
        if _kept_names(path, content) >= arrays.keys():
            return True
        with replacing(path) as place, place.open("wb") as file:
            kept_arrays: dict[str, Any] = {CONTENT: np.array(_digest(content)), **arrays}
            np.savez(file, **kept_arrays)
    except (RowsUnsupportedError, OSError, LightpaintError):
        return False
    return True


def _kept_names(path: Path, content: str) -> set[str]:
    """Return the names of the arrays that are kept."""
    with suppress(*_READ_ERRORS, LightpaintError), _opened(path, content) as archive:
        return _names(archive)
    return set()


def _read(path: Path, content: str) -> Arrays | None:
    with suppress(*_READ_ERRORS, LightpaintError), _opened(path, content) as archive:
        path.touch()
        return {name: _array(archive, name) for name in _names(archive)}
    return None


@contextmanager
def _opened(path: Path, content: str) -> Iterator[zipfile.ZipFile]:
    """Open a kept file of a basis with this content. Raises ValueError for another's."""
    if not basis_cache.is_own(path):
        raise ValueError("it is not the user's")
    with zipfile.ZipFile(path) as archive:
        if str(_array(archive, CONTENT)) != _digest(content):
            raise ValueError("it is kept of another basis")
        yield archive


def _names(archive: zipfile.ZipFile) -> set[str]:
    return {name.removesuffix(NPY) for name in archive.namelist()} - {CONTENT}


def _array(archive: zipfile.ZipFile, name: str) -> npt.NDArray[Any]:
    """Return an array, read-only. NumPy would read it in small pieces.

    Raises one of `_READ_ERRORS` for a damaged one.
    """
    data = archive.read(name + NPY)
    stream = io.BytesIO(data)
    shape, is_fortran, kind = READ_HEADER[np.lib.format.read_magic(stream)](stream)
    numbers = np.frombuffer(data, kind, prod(shape), stream.tell())
    return numbers.reshape(shape, order="F" if is_fortran else "C")


def _digest(content: str) -> str:
    return f"{FORMAT} {hashlib.sha256(content.encode()).hexdigest()}"
