"""Planes of one basis that come from several others."""

from collections.abc import Sequence

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.basis.file_planes import RowPlanes
from lightpaint.basis.planes import MemoryPlanes, Planes

#: A plane by its number among others; None for a black one.
PlaneReference = tuple[Planes, int] | None


def compose_planes(
    picks: Sequence[PlaneReference], size: tuple[int, int], *, in_memory: bool
) -> Planes:
    """Return planes of (height, width) pixels, one for each of `picks`.

    in_memory: whether they are copied there, or else stay where they are.
    """
    composed = ComposedPlanes(picks, size)
    return MemoryPlanes(np.stack(list(composed))) if in_memory else composed


class ComposedPlanes(RowPlanes):
    """Planes that stay with the others that they come from. picks: one for each light."""

    def __init__(self, picks: Sequence[PlaneReference], size: tuple[int, int]) -> None:
        self._picks, self._size = tuple(picks), size

    @property
    def count(self) -> int:
        """n."""
        return len(self._picks)

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) in pixels."""
        return self._size

    def plane(self, i: int) -> Floats:
        """Return the plane of light i, (h, w, 3)."""
        pick = self._picks[i]
        return np.zeros((*self._size, 3), np.float32) if pick is None else pick[0].plane(pick[1])

    def rows(self, top: int, bottom: int) -> Floats:
        """Return some rows of all planes, (n, bottom - top, w, 3)."""
        top, bottom = max(top, 0), min(bottom, self._size[0])
        made = np.zeros((self.count, max(bottom - top, 0), self._size[1], 3), np.float32)
        sources = {id(pick[0]): pick[0] for pick in self._picks if pick is not None}
        for key, source in sources.items():
            rows = source.rows(top, bottom)
            for i, pick in enumerate(self._picks):
                if pick is not None and id(pick[0]) == key:
                    made[i] = rows[pick[1]]
        return made
