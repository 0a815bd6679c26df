"""Planes in a basis file, whose rows are read when they are asked for: larger than memory."""

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles, Floats, Indices
from lightpaint.basis.planes import MemoryPlanes, Planes, PlanesBase, mix
from lightpaint.images.formats.exr_rows import PartLayout, RowFile

#: Bytes of the rows of all planes that are mixed at a time, and of picked pixels that are kept.
STRIP, PICKED = 2**26, 2**28

#: Rows among which scattered pixels are looked for at a time.
SEARCHED = 32


class RowPlanes(PlanesBase):
    """Planes that are read by their rows, by whoever says how (`rows`)."""

    def rows(self, top: int, bottom: int) -> Floats:
        """Some rows of all, (n, bottom - top, w, 3)."""
        raise NotImplementedError

    def pixels(self, where: slice | Indices) -> Floats:
        """Some pixels of all, (n, p, 3)."""
        height, width = self.size
        if isinstance(where, slice):
            start, stop, step = where.indices(height * width)
            top, bottom = start // width, max(-(-stop // width), start // width)
            lit = self.rows(top, bottom).reshape(self.count, -1, 3)
            return lit[:, start - top * width : stop - top * width : step]
        made = np.empty((self.count, len(where), 3), np.float32)
        of_row = where // width
        for top in range(0, height, SEARCHED):
            its = np.flatnonzero((of_row >= top) & (of_row < top + SEARCHED))
            if not its.size:
                continue
            first, last = int(of_row[its].min()), int(of_row[its].max()) + 1
            lit = self.rows(first, last).reshape(self.count, -1, 3)
            made[:, its] = lit[:, where[its] - first * width]
        return made

    def picked(self, where: slice | Indices) -> Planes:
        """The same pixels as planes of one row; kept in memory where they are few."""
        height, width = self.size
        if isinstance(where, slice):
            where = np.arange(height * width)[where]
        if self.count * len(where) * 12 <= PICKED:
            return MemoryPlanes(self.pixels(where)[:, None])
        return PickedPlanes(self, where)

    def mix(self, weights: Doubles) -> npt.NDArray[np.float32]:
        """Σ w_i Φ_i, (h, w, 3)."""
        height, width = self.size
        step = max(1, STRIP // (12 * self.count * width))
        tops = range(0, height, step)
        strips = [mix(self.rows(top, min(top + step, height)), weights) for top in tops]
        return np.concatenate(strips)

    def replaced(self, planes: Mapping[int, Floats]) -> Planes:
        """These planes with others, (h, w, 3), for some of the lights."""
        return ReplacedPlanes(self, planes)

    def array(self) -> Floats:
        """All of them, (n, h, w, 3): as much memory as that takes."""
        return self.rows(0, self.size[0])


class FilePlanes(RowPlanes):
    """Planes in parts of an OpenEXR file.

    parts: one for each light, all of one size. names: the channels of red, green and blue.
    """

    def __init__(self, file: RowFile, parts: Sequence[PartLayout], names: Sequence[str]) -> None:
        self._file, self._parts, self._names = file, tuple(parts), tuple(names)

    @property
    def count(self) -> int:
        """n."""
        return len(self._parts)

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) in pixels."""
        return self._parts[0].size

    def plane(self, i: int) -> Floats:
        """That of light i, (h, w, 3)."""
        return self._file.rows(self._parts[i], 0, self.size[0], self._names)

    def rows(self, top: int, bottom: int) -> Floats:
        """Some rows of all, (n, bottom - top, w, 3)."""
        top, bottom = max(top, 0), min(bottom, self.size[0])
        made = np.empty((self.count, max(bottom - top, 0), self.size[1], 3), np.float32)
        for rows, part in zip(made, self._parts, strict=True):
            rows[...] = self._file.rows(part, top, bottom, self._names)
        return made


class PickedPlanes(RowPlanes):
    """Some pixels of other planes, as one row, that are read when they are asked for."""

    def __init__(self, whole: RowPlanes, where: Indices) -> None:
        self._whole, self._where = whole, where

    @property
    def count(self) -> int:
        """n."""
        return self._whole.count

    @property
    def size(self) -> tuple[int, int]:
        """(1, pixels)."""
        return 1, len(self._where)

    def plane(self, i: int) -> Floats:
        """That of light i, (1, p, 3)."""
        return self._whole.plane(i).reshape(-1, 3)[self._where][None]

    def rows(self, top: int, bottom: int) -> Floats:
        """The one row of all, (n, 1, p, 3), if it is asked for."""
        return self.pixels(slice(0, len(self._where)))[:, None][:, top:bottom]

    def pixels(self, where: slice | Indices) -> Floats:
        """Some of the pixels, (n, p, 3)."""
        return self._whole.pixels(self._where[where])

    def mix(self, weights: Doubles) -> npt.NDArray[np.float32]:
        """Σ w_i Φ_i, (1, p, 3)."""
        return self._whole.mix(weights).reshape(-1, 3)[self._where][None]


class ReplacedPlanes(RowPlanes):
    """Other planes, but for some of the lights."""

    def __init__(self, whole: RowPlanes, planes: Mapping[int, Floats]) -> None:
        self._whole, self._planes = whole, dict(planes)

    @property
    def count(self) -> int:
        """n."""
        return self._whole.count

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) in pixels."""
        return self._whole.size

    def plane(self, i: int) -> Floats:
        """That of light i, (h, w, 3)."""
        return self._planes[i] if i in self._planes else self._whole.plane(i)

    def rows(self, top: int, bottom: int) -> Floats:
        """Some rows of all, (n, bottom - top, w, 3)."""
        made = self._whole.rows(top, bottom)
        for k, plane in self._planes.items():
            made[k] = plane[top:bottom]
        return made
