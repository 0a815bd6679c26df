"""One view of what is painted live, and its sums, which follow the brush."""

import numpy as np

from lightpaint.arrays import Doubles, Floats, Slices
from lightpaint.basis.basis import Basis
from lightpaint.colour.transform import ViewTransform
from lightpaint.lighting.live_sums import FILM, PaintedTiles, SmallFilm

#: Pixels along the parts of rows that importance is summed over.
WIDE = 64


class LiveView:
    """A painting that changes under a brush. Updated in place.

    image: (h, w, 3) linear; importance: (h, w): the painting, which whoever paints writes to and
    then says `painted`.
    """

    def __init__(self, basis: Basis, image: Floats, importance: Floats) -> None:
        self.basis, self._image, self._importance = basis, image, importance
        self._sums = np.zeros((len(importance), -(-importance.shape[1] // WIDE), 2))
        self._count((slice(0, len(importance)), slice(0, importance.shape[1])))
        self._light: PaintedTiles | None = None
        self._display: SmallFilm | None = None

    @property
    def painting(self) -> tuple[Basis, Floats, Floats]:
        """Its basis, painting and importance."""
        return self.basis, self._image, self._importance

    @property
    def counts(self) -> Doubles:
        """Importance of all that is painted, and the weight of the rest, (2,)."""
        return np.asarray(self._sums.sum(axis=(0, 1)))

    @property
    def is_painted(self) -> bool:
        """Whether anything is."""
        return bool(self._sums[..., 0].any())

    @property
    def pixels(self) -> int:
        """How many it has."""
        return self._importance.size

    def painted(self, region: Slices, *, with_importance: bool = True) -> None:
        """A rectangle of the painting is another now. with_importance: also what counts there."""
        if with_importance:
            self._count(region)
        if self._light is not None:
            self._light.painted(region, with_importance=with_importance)
        if self._display is not None:
            self._display.painted(region)

    def tiles(self) -> PaintedTiles:
        """Sums in linear light."""
        if self._light is None:
            self._light = PaintedTiles(self.basis, self._image, self._importance)
        return self._light

    def film(self, transform: ViewTransform | None, most: int = FILM) -> SmallFilm:
        """The picture in display space, of `most` pixels."""
        if self._display is None:
            self._display = SmallFilm(self.basis, self._image, self._importance, most)
            self._display.see_through(transform)
        return self._display

    def see_through(self, transform: ViewTransform | None) -> None:
        """From now on a display is meant that shows light so."""
        if self._display is not None:
            self._display.see_through(transform)

    def _count(self, region: Slices) -> None:
        """Sum importance anew, of parts of rows: a sum of sums has the same bits whatever the way
        it came about.
        """
        rows, columns = region
        first, last = columns.start // WIDE, -(-columns.stop // WIDE)
        where = rows, slice(first * WIDE, last * WIDE)
        a = self._importance[where].astype(np.float64)
        left = np.where(self.basis.emitters_seen[where], 0, np.maximum(1 - a, 0))
        starts = np.arange(0, a.shape[1], WIDE)
        for k, values in enumerate((a, left)):
            if a.size:
                self._sums[rows, first:last, k] = np.add.reduceat(values, starts, axis=1)
