"""What pages show of a basis whatever the answer is: made once, and while an answer is sought.

Many looks share a basis, and while one is solved a processor is idle now and then.
"""

import weakref
from collections.abc import Callable, Hashable
from concurrent.futures import Future
from threading import Lock, Thread
from typing import Any, TypeVar

from lightpaint.basis.basis import Basis
from lightpaint.basis.clean import CleanPlanes, clean_planes

Made = TypeVar("Made")

_lock = Lock()
#: By the identity of a basis's planes, which views of it share, and what it is.
_made: dict[int, dict[Hashable, Future[Any]]] = {}


def once(basis: Basis, what: Hashable, make: Callable[[], Made]) -> Made:
    """What `make` makes of `basis`, or has made before; whoever asks meanwhile waits for it."""
    with _lock:
        planes = id(basis.planes)
        if planes not in _made:
            weakref.finalize(basis.planes, _made.pop, planes, None)
            _made[planes] = {}
        its = _made[planes]
        made = its.get(what)
        if made is not None:
            is_mine = False
        else:
            made, is_mine = its.setdefault(what, Future()), True
    if is_mine:
        try:
            made.set_result(make())
        except BaseException as error:
            its.pop(what, None)  # the next may have more luck
            made.set_exception(error)
    result: Made = made.result()
    return result


def planes_of(basis: Basis) -> CleanPlanes | None:
    """As of `clean_planes`."""
    return once(basis, "planes", lambda: clean_planes(basis))


def ahead(basis: Basis, makes: Callable[[Basis], object]) -> None:
    """Begin `makes(basis)` in a thread of its own; what comes of it is there `once` asked for."""

    def run() -> None:
        try:
            makes(basis)
        except Exception:  # who asks for it hears of it
            return

    Thread(target=run, name="lightpaint-ahead").start()
