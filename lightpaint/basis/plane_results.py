"""A memo of what follows from planes alone, computed once for all who need it.

Results of walks over all planes with which a session begins are arrays with names, so that the
cache can keep them beside the basis.
"""

import hashlib
import weakref
from collections.abc import Callable, Hashable, Mapping
from concurrent.futures import Future
from dataclasses import dataclass
from threading import Lock
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from lightpaint.basis.planes import Planes

Result = TypeVar("Result")

_lock = Lock()
#: Results by the identity of planes, which bases share, and by key.
_memos: dict[int, dict[Hashable, Future[Any]]] = {}


#: The key of the content of the file that has the planes.
_FILE_CONTENT = "content of the file"


@dataclass(frozen=True)
class _ArrayKey:
    """The key of an array that may be kept in a file."""

    name: str


def make_once(planes: Planes, key: Hashable, make: Callable[[], Result]) -> Result:
    """Return the result of `make`, which runs once for these planes; concurrent callers wait."""
    with _lock:
        memo = _memo_of(planes)
        is_mine = key not in memo
        future = memo.setdefault(key, Future())
    if is_mine:
        try:
            future.set_result(make())
        except BaseException as error:
            memo.pop(key, None)  # the next may have more luck
            future.set_exception(error)
    result: Result = future.result()
    return result


def array_once(planes: Planes, name: str, make: Callable[[], npt.NDArray[Any]]) -> npt.NDArray[Any]:
    """Return an array that follows from planes, made once or known from a file.

    name: of the array, which covers all else that it depends on (see `array_name`).
    """
    return make_once(planes, _ArrayKey(name), make)


def array_name(name: str, *arrays: npt.NDArray[Any]) -> str:
    """Return the name of an array that depends on others, too, by their content."""
    content = hashlib.blake2b(digest_size=16)
    for array in arrays:
        content.update(np.ascontiguousarray(array).data)
    return f"{name} {content.hexdigest()}"


def known_arrays(planes: Planes) -> dict[str, npt.NDArray[Any]]:
    """Return the arrays that `array_once` has made of planes, by name."""
    with _lock:
        made = dict(_memo_of(planes))
    return {
        key.name: future.result()
        for key, future in made.items()
        if isinstance(key, _ArrayKey) and future.done() and future.exception() is None
    }


def set_known_arrays(planes: Planes, arrays: Mapping[str, npt.NDArray[Any]]) -> None:
    """Have `array_once` return these arrays, by name, for exactly these planes."""
    with _lock:
        memo = _memo_of(planes)
        for name, array in arrays.items():
            known = memo[_ArrayKey(name)] = Future()
            known.set_result(array)


def set_file_content(planes: Planes, content: str) -> None:
    """Note that a file has exactly these planes. content: another text for another file."""
    make_once(planes, _FILE_CONTENT, lambda: content)


def file_content(planes: Planes) -> str | None:
    """Return what `set_file_content` noted; None for planes that are of no file, or changed."""
    with _lock:
        noted = _memo_of(planes).get(_FILE_CONTENT)
    return None if noted is None else str(noted.result())


def forget_results(planes: Planes) -> None:
    """Forget all results, after planes were changed in place."""
    with _lock:
        _memo_of(planes).clear()


def _memo_of(planes: Planes) -> dict[Hashable, Future[Any]]:
    key = id(planes)
    if key not in _memos:
        weakref.finalize(planes, _memos.pop, key, None)
        _memos[key] = {}
    return _memos[key]
