"""Planes that are one picture in different colours, while no light has been rendered alone."""

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles, Floats, Indices
from lightpaint.basis.file.file_planes import RowPlanes


class ScaledPlanes(RowPlanes):
    """Planes Φ_i = c_i P of one picture P. It takes the memory of one plane.

    picture: (h, w, 3) float32. colours: (n, 3).
    """

    def __init__(self, picture: Floats, colours: Doubles) -> None:
        self._picture, self._colours = picture, np.asarray(colours, np.float32)

    @classmethod
    def summing_to(cls, picture: Floats, weights: Doubles) -> "ScaledPlanes":
        """Return planes with Σ w_i Φ_i = P, to which all lights that are on contribute alike.

        picture: P, (h, w, 3). weights: (n, 3).
        """
        is_on = weights != 0
        share = 1 / np.maximum(is_on.sum(axis=0), 1)
        return cls(picture, np.divide(share, weights, out=np.zeros(weights.shape), where=is_on))

    @property
    def count(self) -> int:
        """Number of lights."""
        return len(self._colours)

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) in pixels."""
        return self._picture.shape[0], self._picture.shape[1]

    def plane(self, i: int) -> Floats:
        """Return the plane of light i, (h, w, 3)."""
        return np.asarray(self._picture * self._colours[i])

    def rows(self, top: int, bottom: int) -> Floats:
        """Return rows `top` to `bottom` of all planes, (n, bottom - top, w, 3)."""
        return self._picture[top:bottom] * self._colours[:, None, None]

    def pixels(self, where: slice | Indices) -> Floats:
        """Return some pixels of all planes, (n, p, 3)."""
        return np.asarray(self._picture.reshape(-1, 3)[where] * self._colours[:, None])

    def mixes(self, weights: Doubles) -> npt.NDArray[np.float32]:
        """Return several sums Σ w_i Φ_i, (k, h, w, 3). weights: (k, n, 3)."""
        colours = (np.asarray(weights) * self._colours).sum(axis=1).astype(np.float32)
        return np.asarray(self._picture * colours[:, None, None])
