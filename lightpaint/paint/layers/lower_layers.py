"""The composition below a layer that is being painted or changed, kept until that changes.

With it a stroke costs the same however many layers lie below. It is computed in cells of the
picture, when a stroke first comes there.
"""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Floats
from lightpaint.paint.layers.composition import ShownLayer, compose_over
from lightpaint.paint.layers.layer_pixels import TILE_SIDE
from lightpaint.paint.store.canvas_pixels import Pixels, Region, slices


class LowerLayers:
    """The composition of some lower layers of a view.

    current: (h, w, 3) float32 linear, the look on which they lie.
    """

    def __init__(self, current: Floats) -> None:
        self.current = current
        self._layers: list[tuple[ShownLayer, int]] = []
        self._pixels = Pixels.unpainted(current)
        self._is_known = np.zeros((0, 0), bool)  # by cell

    def part(self, layers: Sequence[ShownLayer], region: Region) -> Pixels:
        """Return a copy of the composition of these layers, the lowest first, in a region."""
        if not layers:
            return Pixels.unpainted(np.array(self.current[slices(region)], np.float32))
        self._follow(layers, region)
        return self._pixels.part(region).copy()

    def importance(
        self, layers: Sequence[ShownLayer], region: Region
    ) -> npt.NDArray[np.float32] | None:
        """Return a copy of the importance of the same; None below the lowest layer."""
        if not layers:
            return None
        self._follow(layers, region)
        return self._pixels.importance[slices(region)].copy()

    def _follow(self, layers: Sequence[ShownLayer], region: Region) -> None:
        """Keep the composition of these layers, at least in a region."""
        revised = [(shown, shown.pixels.revision) for shown in layers]
        if revised != self._layers:
            height, width = self.current.shape[:2]
            self._layers, self._pixels = revised, Pixels.unpainted(self.current.copy())
            self._is_known = np.zeros((-(-height // TILE_SIDE), -(-width // TILE_SIDE)), bool)
        self._complete(layers, region)

    def _complete(self, layers: Sequence[ShownLayer], region: Region) -> None:
        """Compose the cells of a region that are not known yet."""
        top, bottom, left, right = region
        height, width = self.current.shape[:2]
        rows = slice(top // TILE_SIDE, -(-bottom // TILE_SIDE))
        columns = slice(left // TILE_SIDE, -(-right // TILE_SIDE))
        unknown = ~self._is_known[rows, columns]
        if not unknown.any():
            return
        # A stroke comes to new cells side by side: the smallest block that has them all.
        ys, xs = (np.flatnonzero(unknown.any(axis=k)) for k in (1, 0))
        above, below = rows.start + int(ys[0]), rows.start + int(ys[-1]) + 1
        start, end = columns.start + int(xs[0]), columns.start + int(xs[-1]) + 1
        block = (
            *(above * TILE_SIDE, min(below * TILE_SIDE, height)),
            *(start * TILE_SIDE, min(end * TILE_SIDE, width)),
        )
        area = slices(block)
        on_look = Pixels.unpainted(np.array(self.current[area], np.float32))
        image, importance, at_least = compose_over(layers, on_look, block)
        self._pixels.image[area], self._pixels.importance[area] = image, importance
        if at_least is not None:
            if self._pixels.at_least is None:
                marks = np.zeros(self._pixels.image.shape, bool)
                self._pixels = self._pixels._replace(at_least=marks)
            assert self._pixels.at_least is not None
            self._pixels.at_least[area] = at_least
        self._is_known[above:below, start:end] = True
