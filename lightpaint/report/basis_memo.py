"""Parts of pages that depend on the basis alone: made once, or ahead of the answer.

Many looks share a basis, and cores are idle now and then while one of them is solved.
"""

from collections.abc import Callable

from lightpaint.basis import (
    Basis,
    DenoisedPlanes,
    make_once,
    obtain_denoised_planes,
    read_denoised_planes,
)
from lightpaint.images import Size, fitting_factor
from lightpaint.threads import start_in_background

#: Rows of a long list that are always visible, and the largest number of further rows that are not
#: folded.
ROWS_SHOWN, SPARE_ROWS = 10, 3

#: Maximum width of a plane in a page, in pixels, and maximum number of pixels in all planes.
MAX_WIDTH, MAX_PIXELS = 480, 1_000_000

#: Maximum width of the pictures of the scene in a page, which shows them 1132 pixels wide.
LOOK_MAX_WIDTH = 1280


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


def look_reduction(size: Size) -> int:
    """Return the side of the blocks of pixels that become a pixel of a picture of the scene.

    size: (height, width) of the film.
    """
    return fitting_factor(size, -(-size[1] // LOOK_MAX_WIDTH))


def cached_clean_planes(basis: Basis) -> DenoisedPlanes | None:
    """Return denoised planes of a basis, made once: whole ones if they are kept, or the planes of a
    page that shows all lights. None where it shows some, which are then denoised alone.
    """
    count = len(basis.lights)
    if count > ROWS_SHOWN + SPARE_ROWS:
        return make_once(basis.planes, "planes", lambda: read_denoised_planes(basis))
    factor, look_factor = page_reduction(basis, count), look_reduction(basis.size)
    return make_once(
        basis.planes,
        "planes",
        lambda: obtain_denoised_planes(basis, factor=factor, look_factor=look_factor),
    )


def make_ahead(basis: Basis, make: Callable[[Basis], object]) -> None:
    """Start `make(basis)` in a thread of its own, so that a later call finds its results."""

    def run() -> None:
        try:
            make(basis)
        except Exception:  # a later call raises it again
            return

    start_in_background(run, name="lightpaint-ahead")
