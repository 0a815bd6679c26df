"""The open stroke: its region, and the pixels before it."""

from collections.abc import Iterator

import numpy as np

from lightpaint.paint.store.canvas_pixels import Pixels, Region, slices

#: Side, in pixels, of the squares that are saved when a stroke first touches them.
SQUARE_SIDE = 64


class OpenStroke:
    """The pixels under a stroke, saved once however often it passes. Updated in place.

    Attributes:
        region: The smallest that holds the whole stroke.
    """

    def __init__(self) -> None:
        self.region: Region = (0, 0, 0, 0)
        self._before: dict[Region, Pixels] = {}

    def __bool__(self) -> bool:
        """Return whether the stroke has touched anything."""
        return bool(self._before)

    def touch(self, region: Region, painting: Pixels) -> None:
        """Save the pixels of a region of `painting`, which is about to change there."""
        if _is_empty(region):
            return
        for square in _squares(region, painting.importance.shape):
            if square not in self._before:
                self._before[square] = painting.part(square).copy()
        self.region = _union(self.region, region)

    def pixels_before(self, painting: Pixels) -> Pixels:
        """Return copies of the pixels in `region` before the stroke. painting: as it is now."""
        image, importance, at_least = painting.part(self.region).copy()
        if painting.at_least is not None and at_least is None:
            at_least = np.zeros(image.shape, bool)
        for square, pixels in self._before.items():
            shared = _intersection(square, self.region)
            if _is_empty(shared):
                continue
            area, saved = (
                slices(_relative_to(shared, self.region)),
                pixels.part(_relative_to(shared, square)),
            )
            image[area], importance[area] = saved.image, saved.importance
            if at_least is not None:
                at_least[area] = False if saved.at_least is None else saved.at_least
        is_marked = at_least is not None and at_least.any()
        return Pixels(image, importance, at_least if is_marked else None)


def _squares(region: Region, size: tuple[int, ...]) -> Iterator[Region]:
    """Yield the squares of a fixed grid that a region touches, within the picture."""
    top, bottom, left, right = region
    for y in range(top - top % SQUARE_SIDE, bottom, SQUARE_SIDE):
        for x in range(left - left % SQUARE_SIDE, right, SQUARE_SIDE):
            yield y, min(y + SQUARE_SIDE, size[0]), x, min(x + SQUARE_SIDE, size[1])


def _is_empty(region: Region) -> bool:
    top, bottom, left, right = region
    return top >= bottom or left >= right


def _union(first: Region, second: Region) -> Region:
    """Return the smallest region that holds both, of which the first may be empty."""
    if _is_empty(first):
        return second
    (a, b, c, d), (e, f, g, h) = first, second
    return min(a, e), max(b, f), min(c, g), max(d, h)


def _intersection(first: Region, second: Region) -> Region:
    (a, b, c, d), (e, f, g, h) = first, second
    return max(a, e), min(b, f), max(c, g), min(d, h)


def _relative_to(region: Region, origin: Region) -> Region:
    """Return a region in coordinates that begin at the corner of another."""
    top, bottom, left, right = region
    return top - origin[0], bottom - origin[0], left - origin[2], right - origin[2]
