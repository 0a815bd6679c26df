"""Copies in a temporary file of planes that are costly to compute and requested repeatedly."""

from contextlib import suppress

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.basis.file.file_planes import RowPlanes
from lightpaint.basis.file.temporary_array import TemporaryArray
from lightpaint.basis.planes import Planes


def spooled(planes: Planes) -> Planes:
    """Return planes in memory unchanged, and others copied to a temporary file.

    If the file does not fit on the disk, planes are returned unchanged and computed on each
    request.
    """
    if isinstance(planes, RowPlanes):
        with suppress(OSError):
            return SpooledPlanes(planes)
    return planes


class SpooledPlanes(RowPlanes):
    """A copy of planes in a temporary file. Raises OSError if the disk is full."""

    def __init__(self, planes: RowPlanes) -> None:
        height, width = planes.size
        # Channels first, which is how they are summed.
        self._file = TemporaryArray((planes.count, 3, height, width))
        step = planes.strip_rows
        for top in range(0, height, step):
            rows = planes.rows(top, min(top + step, height))
            self._file.array[:, :, top : top + step] = rows.transpose(0, 3, 1, 2)
            self._file.release()

    @property
    def count(self) -> int:
        """Number of lights."""
        return int(self._file.array.shape[0])

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) in pixels."""
        height, width = self._file.array.shape[2:]
        return height, width

    def plane(self, i: int) -> Floats:
        """Return the plane of light i, (h, w, 3)."""
        image = np.ascontiguousarray(self._file.array[i].transpose(1, 2, 0))
        self._file.release()
        return image

    def rows(self, top: int, bottom: int) -> Floats:
        """Return rows `top` to `bottom` of all planes, (n, bottom - top, w, 3)."""
        block = np.array(self._file.array[:, :, max(top, 0) : max(bottom, 0)])
        self._file.release()
        return block.transpose(0, 2, 3, 1)
