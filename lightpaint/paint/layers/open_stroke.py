"""The open stroke on a layer: its region, and the pixels before it."""

from collections.abc import Iterator

import numpy as np

from lightpaint.paint.layers.layer_pixels import (
    LayerPixels,
    enclosing,
    is_empty,
    relative,
    shared,
)
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
        self._before: dict[Region, Pixels | None] = {}  # None for no coverage

    def __bool__(self) -> bool:
        """Return whether the stroke has touched anything."""
        return bool(self._before)

    def touch(self, region: Region, layer: LayerPixels) -> None:
        """Save the pixels of a region of a layer, which is about to change there."""
        if is_empty(region):
            return
        for square in _squares(region, layer.size):
            if square not in self._before:
                self._before[square] = None if layer.is_empty_in(square) else layer.part(square)
        self.region = enclosing([self.region, region])

    def pixels_before(self, layer: LayerPixels) -> Pixels:
        """Return the pixels in `region` before the stroke. layer: the current one."""
        before = layer.part(self.region)
        marks = before.at_least
        saved_marks = [pixels.at_least for pixels in self._before.values() if pixels is not None]
        if marks is None and any(x is not None for x in saved_marks):
            marks = np.zeros(before.image.shape, bool)
        for square, pixels in self._before.items():
            area = shared(square, self.region)
            to = slices(relative(area, self.region))
            saved = None if pixels is None else pixels.part(relative(area, square))
            before.image[to] = 0 if saved is None else saved.image
            before.importance[to] = 0 if saved is None else saved.importance
            if marks is not None:
                marks[to] = False if saved is None or saved.at_least is None else saved.at_least
        has_marks = marks is not None and marks.any()
        return before._replace(at_least=marks if has_marks else None)


def _squares(region: Region, size: tuple[int, ...]) -> Iterator[Region]:
    """Yield the squares of a fixed grid that a region touches, within the picture."""
    top, bottom, left, right = region
    for y in range(top - top % SQUARE_SIDE, bottom, SQUARE_SIDE):
        for x in range(left - left % SQUARE_SIDE, right, SQUARE_SIDE):
            yield y, min(y + SQUARE_SIDE, size[0]), x, min(x + SQUARE_SIDE, size[1])
