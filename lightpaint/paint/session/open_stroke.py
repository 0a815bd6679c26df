"""The stroke that is not done yet: where it is, and what there was before it."""

from collections.abc import Iterator

import numpy as np

from lightpaint.paint.store.canvas_pixels import Pixels, Region, slices

#: Side of the squares that are kept from the first time that a stroke touches them.
SIDE = 64


class OpenStroke:
    """What a stroke has painted over, once, however often it goes over it. Updated in place.

    Attributes:
        region: The smallest that holds all of it.
    """

    def __init__(self) -> None:
        self.region: Region = (0, 0, 0, 0)
        self._before: dict[Region, Pixels] = {}

    def __bool__(self) -> bool:
        """Whether it has touched anything."""
        return bool(self._before)

    def touches(self, region: Region, painting: Pixels) -> None:
        """`painting` is about to change there."""
        if _is_empty(region):
            return
        for square in _squares(region, painting.importance.shape):
            if square not in self._before:
                self._before[square] = painting.part(square).copy()
        self.region = _around(self.region, region)

    def before(self, painting: Pixels) -> Pixels:
        """What there was in `region`, now that `painting` is there; arrays of their own."""
        image, importance, at_least = painting.part(self.region).copy()
        if painting.at_least is not None and at_least is None:
            at_least = np.zeros(image.shape, bool)
        for square, pixels in self._before.items():
            shared = _shared(square, self.region)
            if _is_empty(shared):
                continue
            to, kept = slices(_moved(shared, self.region)), pixels.part(_moved(shared, square))
            image[to], importance[to] = kept.image, kept.importance
            if at_least is not None:
                at_least[to] = False if kept.at_least is None else kept.at_least
        is_marked = at_least is not None and at_least.any()
        return Pixels(image, importance, at_least if is_marked else None)


def _squares(region: Region, size: tuple[int, ...]) -> Iterator[Region]:
    """Those of a fixed grid that a region touches, within the picture."""
    top, bottom, left, right = region
    for y in range(top - top % SIDE, bottom, SIDE):
        for x in range(left - left % SIDE, right, SIDE):
            yield y, min(y + SIDE, size[0]), x, min(x + SIDE, size[1])


def _is_empty(region: Region) -> bool:
    top, bottom, left, right = region
    return top >= bottom or left >= right


def _around(one: Region, other: Region) -> Region:
    """The smallest region that holds both, of which the first may be empty."""
    if _is_empty(one):
        return other
    (a, b, c, d), (e, f, g, h) = one, other
    return min(a, e), max(b, f), min(c, g), max(d, h)


def _shared(one: Region, other: Region) -> Region:
    (a, b, c, d), (e, f, g, h) = one, other
    return max(a, e), min(b, f), max(c, g), min(d, h)


def _moved(region: Region, origin: Region) -> Region:
    """As seen from the corner of another."""
    top, bottom, left, right = region
    return top - origin[0], bottom - origin[0], left - origin[2], right - origin[2]
