"""Planes that stay in their file until something walks over all of them.

A painter that knows the results of the walks with which it begins (see
lightpaint/basis/plane_results.py) needs single planes at most until the first exact answer.
"""

from collections.abc import Callable
from threading import Lock

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Bools, Doubles, Floats, Indices
from lightpaint.basis.file.file_planes import FilePlanes, RowPlanes
from lightpaint.basis.planes import LitEntries, Planes


class LoadOnce:
    """The sets of planes of a basis, which `load` reads when the first of them is needed."""

    def __init__(self, load: Callable[[], tuple[Planes, Planes]]) -> None:
        self._load, self._lock = load, Lock()
        self._sets: tuple[Planes, Planes] | None = None

    def __call__(self) -> tuple[Planes, Planes]:
        """Return images and noise. Raises LightpaintError for a damaged file."""
        with self._lock:
            if self._sets is None:
                self._sets = self._load()
            return self._sets

    @property
    def is_done(self) -> bool:
        """True once they are read."""
        return self._sets is not None


class DeferredPlanes(RowPlanes):
    """Planes of which one is read from its file, and all are at the first walk over them.

    number: 0 for images, 1 for noise.
    """

    def __init__(self, planes: FilePlanes, load: LoadOnce, number: int) -> None:
        self._of_file, self._load, self._number = planes, load, number
        self.count, self.size, self.is_noisy = planes.count, planes.size, planes.is_noisy

    @property
    def whole(self) -> Planes:
        """The planes, read now if they are not yet."""
        return self._load()[self._number]

    def plane(self, i: int) -> Floats:
        """Return the plane of light i, (h, w, 3)."""
        return self.whole.plane(i) if self._load.is_done else self._of_file.plane(i)

    def lit_plane(self, i: int) -> tuple[slice | Indices, Floats]:
        """Return pixels of light i, outside of which it is black, and their light, (3, p)."""
        return self.whole.lit_plane(i) if self._load.is_done else self._of_file.lit_plane(i)

    def rows(self, top: int, bottom: int) -> Floats:
        """Return rows `top` to `bottom` of all planes, (n, bottom - top, w, 3)."""
        return self.whole.rows(top, bottom)

    def pixels(self, where: slice | Indices) -> Floats:
        """Return some pixels of all planes, (n, p, 3)."""
        return self.whole.pixels(where)

    @property
    def strip_pixels(self) -> int:
        """Number of consecutive pixels that are best looked for together, by `lit_entries`."""
        return self.whole.strip_pixels

    def lit_entries(self, where: slice | Indices) -> LitEntries | None:
        """Return the lit ones of some pixels of all planes; None if the planes do not know them."""
        return self.whole.lit_entries(where)

    def picked(self, where: slice | Indices) -> Planes:
        """Return these pixels as planes with a single row."""
        return self.whole.picked(where)

    def mixes(self, weights: Doubles) -> npt.NDArray[np.float32]:
        """Return several sums Σ w_i Φ_i, (k, h, w, 3), in one walk. weights: (k, n, 3)."""
        return self.whole.mixes(weights)

    def exact_mix(self, weights: Doubles) -> Doubles:
        """Return Σ w_i Φ_i channel by channel, (3, p), summed in float64."""
        return self.whole.exact_mix(weights)

    def power_and_totals(self, mask: Bools) -> tuple[Doubles, Doubles]:
        """Return ‖Φᵢ‖² over the counted pixels and Σ Φᵢ over all pixels, (n, 3) each."""
        return self.whole.power_and_totals(mask)

    def array(self) -> Floats:
        """Return all planes, (n, h, w, 3). The whole array must fit in memory."""
        return self.whole.array()


def loaded(planes: Planes) -> Planes:
    """Return planes that are read, whatever they were."""
    return planes.whole if isinstance(planes, DeferredPlanes) else planes
