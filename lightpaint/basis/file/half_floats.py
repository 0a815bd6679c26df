"""Half floats for planes: which are stored in them, so that nobody ever sees their rounding.

Rounding to half is 2⁻¹¹ of a value at most. An image is stored so where that is far below its own
noise in every tile of it, and in float32 where it is so clean that rounding would show. What is too
bright for half floats, or so dim that they lose digits, is multiplied by a power of two first.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles, Floats, Indices, copy_as_singles
from lightpaint.basis.file.file_planes import RowPlanes

HALF, FLOAT = np.dtype(np.float16), np.dtype(np.float32)

#: Part of the noise of a tile that rounding may have at most, root mean square: it adds 1/512 to
#: the standard deviation. Pixels along the side of a tile.
HIDDEN_SHARE, TILE = 1 / 16, 32

#: Power of two to which the brightest value is scaled, of 15 that half floats reach.
BRIGHTEST = 14


@dataclass(frozen=True)
class PlaneEncoding:
    """The storage of a plane. kind: type of its numbers. scale: factor for them, a power of two."""

    kind: np.dtype[Any] = FLOAT
    scale: float = 1.0

    def encoded(self, plane: Floats) -> npt.NDArray[Any]:
        """Return the numbers that are stored of a plane, or of a part of one."""
        with np.errstate(over="ignore", invalid="ignore"):
            scaled = plane if self.scale == 1 else plane * np.float32(1 / self.scale)
            return scaled.astype(self.kind, copy=False)

    def decoded(self, stored: npt.NDArray[Any]) -> npt.NDArray[np.float32]:
        """Return light, float32, of numbers that were stored."""
        plane = stored.astype(np.float32, copy=False)
        return plane if self.scale == 1 else plane * np.float32(self.scale)

    def rounded(self, plane: Floats) -> npt.NDArray[np.float32]:
        """Return a plane as it comes back."""
        return self.decoded(self.encoded(plane))


class EncodedPlanes(RowPlanes):
    """Planes that memory holds as files do: in half floats where nobody sees the rounding.

    stored: of each light its three channels, (h, w) each, half floats or float32, as
    `PlaneEncoding.encoded` returns them. scales: what the numbers of each light are to be
    multiplied by.
    """

    def __init__(
        self, stored: Sequence[Sequence[npt.NDArray[Any]]], scales: Sequence[float]
    ) -> None:
        self._stored = [[np.ascontiguousarray(its) for its in channels] for channels in stored]
        self._scales = tuple(scales)

    @property
    def count(self) -> int:
        """n."""
        return len(self._stored)

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) in pixels."""
        height, width = self._stored[0][0].shape
        return height, width

    @property
    def nbytes(self) -> int:
        """Bytes of memory that the planes take."""
        return sum(its.nbytes for channels in self._stored for its in channels)

    def plane(self, i: int) -> Floats:
        """Return the plane of light i, (h, w, 3)."""
        made = np.empty((*self.size, 3), np.float32)
        self._decode(i, slice(None), made.reshape(-1, 3).T)
        return made

    def rows(self, top: int, bottom: int) -> Floats:
        """Return some rows of all planes, (n, bottom - top, w, 3)."""
        height, width = self.size
        top, bottom = max(top, 0), min(bottom, height)
        made = self.pixels(slice(top * width, max(bottom, top) * width))
        return made.transpose(0, 2, 1).reshape(self.count, 3, -1, width).transpose(0, 2, 3, 1)

    def pixels(self, where: slice | Indices) -> Floats:
        """Return some pixels of all planes, (n, p, 3)."""
        length = self._stored[0][0].reshape(-1)[where].size
        # Channel by channel, as they are stored and as sums go over them.
        made = np.empty((self.count, 3, length), np.float32)
        for i, channels in enumerate(made):
            self._decode(i, where, channels)
        return made.transpose(0, 2, 1)

    def _decode(self, i: int, where: slice | Indices, into: Floats) -> None:
        """Write some pixels of light i into (3, p)."""
        for stored, channel in zip(self._stored[i], into, strict=True):
            copy_as_singles(stored.reshape(-1)[where], channel)
        if self._scales[i] != 1:
            into *= np.float32(self._scales[i])


def encodings_of(image: Floats, noise: Floats) -> tuple[PlaneEncoding, PlaneEncoding]:
    """Return how the image of a light and its half difference, (h, w, 3), are best stored."""
    hidden = HIDDEN_SHARE**2 * _power(noise)
    found = []
    for plane in (image, noise):
        halves = (PlaneEncoding(HALF, scale) for scale in dict.fromkeys((1.0, _scale_of(plane))))
        found.append(next((x for x in halves if _is_hidden(plane, x, hidden)), PlaneEncoding()))
    return found[0], found[1]


def _is_hidden(plane: Floats, encoding: PlaneEncoding, hidden: Doubles) -> bool:
    """Return whether rounding has no more power than `hidden` in any tile, channel by channel."""
    with np.errstate(over="ignore", invalid="ignore"):
        return all(
            bool((power <= its).all())
            for its, power in zip(hidden, _powers(plane, encoding), strict=True)
        )


def _scale_of(plane: Floats) -> float:
    """Return the power of two that brings the brightest value to just below 2^BRIGHTEST."""
    brightest = float(max(plane.max(initial=0), -plane.min(initial=0)))
    if not 0 < brightest < np.inf:
        return 1.0
    # Within what float32 has, so that scaling to and fro changes no bit.
    return float(2.0 ** np.clip(np.frexp(brightest)[1] - BRIGHTEST, -100, 100))


def _power(plane: Floats) -> Doubles:
    """Return Σ x² of each tile and channel, (rows, columns, 3)."""
    return np.array(list(_powers(plane, None)))


def _powers(plane: Floats, encoding: PlaneEncoding | None) -> Iterator[Doubles]:
    """Yield Σ x² of a row of tiles after the other, (columns, 3), of what rounding changes.

    encoding: None for the plane itself.
    """
    height, width, _ = plane.shape
    columns = np.arange(0, width, TILE)
    for top in range(0, height, TILE):
        its = plane[top : top + TILE]
        if encoding is not None:
            its = encoding.rounded(its) - its
        # Each row of pixels is summed first, which stays in the processor's cache.
        squares = np.square(its, dtype=np.float64).sum(axis=0)
        yield np.add.reduceat(squares, columns, axis=0)
