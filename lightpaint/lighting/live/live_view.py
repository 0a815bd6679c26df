"""One view of what is painted live, and its sums, which follow the brush."""

import numpy as np

from lightpaint.arrays import Doubles, Floats, Slices
from lightpaint.basis.basis import Basis
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.lighting.live.live_sums import FILM, PaintedTiles, SmallFilm
from lightpaint.lighting.loss.emitter_paint import asks_no_less, dark_of, grow

#: Pixels along the parts of rows that importance is summed over.
WIDE = 64


class LiveView:
    """A painting that changes under a brush. Updated in place.

    image: (h, w, 3) linear; importance: (h, w): the painting, which whoever paints writes to and
    then says `painted`.
    """

    def __init__(self, basis: Basis, image: Floats, importance: Floats) -> None:
        self.basis, self._image, self._importance = basis, image, importance
        self._counted = importance.copy()
        self._dark = dark_of(basis.present_look, basis.emitters_seen)
        self._transform: ViewTransform | None = None
        self._read((slice(0, len(importance)), slice(0, importance.shape[1])))
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
        region, is_other = self._read(region)
        with_importance = with_importance or is_other
        if with_importance:
            self._count(region)
        if self._light is not None:
            self._light.painted(region, with_importance=with_importance)
        if self._display is not None:
            self._display.painted(region)

    def tiles(self) -> PaintedTiles:
        """Sums in linear light."""
        if self._light is None:
            self._light = PaintedTiles(self.basis, self._image, self._counted)
        return self._light

    def film(self, transform: ViewTransform | None, most: int = FILM) -> SmallFilm:
        """The picture in display space, of `most` pixels."""
        if self._display is None:
            self._display = SmallFilm(self.basis, self._image, self._counted, most)
            self._display.see_through(transform)
        return self._display

    def see_through(self, transform: ViewTransform | None) -> None:
        """From now on a display is meant that shows light so."""
        if transform != self._transform:
            self._transform = transform
            self.painted((slice(0, len(self._counted)), slice(0, self._counted.shape[1])))
        if self._display is not None:
            self._display.see_through(transform)

    def _read(self, region: Slices) -> tuple[Slices, bool]:
        """Read what is painted of a rectangle; return where that tells, and whether more counts.

        Emitters in view of which no less light is meant count nothing here.
        """
        wide = grow(region, self._counted.shape)
        seen = self.basis.emitters_seen[wide]
        if not seen.any():
            self._counted[region] = self._importance[region]
            return region, False
        # What is around the emitters in this rectangle lies in a wider one.
        its = grow(wide, self._counted.shape)
        importance = self._importance[its]
        glows = asks_no_less(
            self._image[its],
            importance,
            self.basis.present_look[its],
            self.basis.emitters_seen[its],
            self._transform,
            dark=self._dark,
        )
        inner = tuple(
            slice(part.start - outer.start, part.stop - outer.start)
            for part, outer in zip(wide, its, strict=True)
        )
        counted = np.where(glows, np.float32(0), importance)[inner]
        is_other = not np.array_equal(self._counted[wide], counted)
        self._counted[wide] = counted
        return wide, is_other

    def _count(self, region: Slices) -> None:
        """Sum importance anew, of parts of rows: a sum of sums has the same bits whatever the way
        it came about.
        """
        rows, columns = region
        first, last = columns.start // WIDE, -(-columns.stop // WIDE)
        where = rows, slice(first * WIDE, last * WIDE)
        a = self._counted[where].astype(np.float64)
        left = np.where(self.basis.emitters_seen[where], 0, np.maximum(1 - a, 0))
        starts = np.arange(0, a.shape[1], WIDE)
        for k, values in enumerate((a, left)):
            if a.size:
                self._sums[rows, first:last, k] = np.add.reduceat(values, starts, axis=1)
