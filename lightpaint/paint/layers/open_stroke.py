"""The open stroke on a layer: its region, and the pixels before it."""

from collections.abc import Iterator

from lightpaint.paint.layers.layer_pixels import LayerPixels, enclosing, is_empty
from lightpaint.paint.store.canvas_pixels import Pixels, Region

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

    def touch(self, region: Region, layer: LayerPixels) -> None:
        """Save the pixels of a region of a layer, which is about to change there."""
        if is_empty(region):
            return
        for square in _squares(region, layer.size):
            if square not in self._before:
                self._before[square] = layer.part(square)
        self.region = enclosing([self.region, region])

    def pixels_before(self, layer: LayerPixels) -> Pixels:
        """Return the pixels in `region` before the stroke. layer: the current one."""
        before = layer.copy()
        for square, pixels in self._before.items():
            before.put(square, pixels)
        return before.part(self.region)


def _squares(region: Region, size: tuple[int, ...]) -> Iterator[Region]:
    """Yield the squares of a fixed grid that a region touches, within the picture."""
    top, bottom, left, right = region
    for y in range(top - top % SQUARE_SIDE, bottom, SQUARE_SIDE):
        for x in range(left - left % SQUARE_SIDE, right, SQUARE_SIDE):
            yield y, min(y + SQUARE_SIDE, size[0]), x, min(x + SQUARE_SIDE, size[1])
