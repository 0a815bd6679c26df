"""A memo of those parts of pages that depend on the basis alone: made once, or ahead of the answer.

Many looks share a basis, and cores are idle now and then while one of them is solved.
"""

import weakref
from collections.abc import Callable, Hashable
from concurrent.futures import Future
from threading import Lock
from typing import Any, TypeVar

from lightpaint.basis import Basis, DenoisedPlanes, obtain_denoised_planes, read_denoised_planes
from lightpaint.images import fitting_factor
from lightpaint.threads import start_in_background

Result = TypeVar("Result")

#: Rows of a long list that are always visible, and the largest number of further rows that are not
#: folded.
ROWS_SHOWN, SPARE_ROWS = 10, 3

#: Maximum width of a plane in a page, in pixels, and maximum number of pixels in all planes.
MAX_WIDTH, MAX_PIXELS = 480, 1_000_000

_lock = Lock()
#: Results by the identity of a basis's planes, which its views share, and by key.
_memos: dict[int, dict[Hashable, Future[Any]]] = {}


def make_once(basis: Basis, key: Hashable, make: Callable[[], Result]) -> Result:
    """Return the result of `make`, which runs once for a basis; concurrent callers wait for it."""
    with _lock:
        planes = id(basis.planes)
        if planes not in _memos:
            weakref.finalize(basis.planes, _memos.pop, planes, None)
            _memos[planes] = {}
        memo = _memos[planes]
        future = memo.get(key)
        if future is not None:
            is_mine = False
        else:
            future, is_mine = memo.setdefault(key, Future()), True
    if is_mine:
        try:
            future.set_result(make())
        except BaseException as error:
            memo.pop(key, None)  # the next may have more luck
            future.set_exception(error)
    result: Result = future.result()
    return result


def page_reduction(basis: Basis, count: int, *, max_pixels: int = MAX_PIXELS) -> int:
    """Return the side of the blocks of pixels that become a pixel of a plane in a page.

    count: planes in the page. max_pixels: of all of them.
    """
    height, width = basis.size
    factor = fitting_factor(basis.size, -(-width // MAX_WIDTH))
    while count * (height // factor) * (width // factor) > max_pixels and factor < min(
        height, width
    ):
        factor += 1
    return factor


def cached_clean_planes(basis: Basis) -> DenoisedPlanes | None:
    """Return denoised planes of a basis, made once: whole ones if they are kept, or the planes of a
    page that shows all lights. None where it shows some, which are then denoised alone.
    """
    count = len(basis.lights)
    if count > ROWS_SHOWN + SPARE_ROWS:
        return make_once(basis, "planes", lambda: read_denoised_planes(basis))
    factor = page_reduction(basis, count)
    return make_once(basis, "planes", lambda: obtain_denoised_planes(basis, factor=factor))


def make_ahead(basis: Basis, make: Callable[[Basis], object]) -> None:
    """Start `make(basis)` in a thread of its own, so that a later call finds its results."""

    def run() -> None:
        try:
            make(basis)
        except Exception:  # a later call raises it again
            return

    start_in_background(run, name="lightpaint-ahead")
