"""Half floats for planes: which are stored in them, so that nobody ever sees their rounding.

Rounding to half is 2⁻¹¹ of a value at most. An image is stored so where that is far below its own
noise in every tile of it, and in float32 where it is so clean that rounding would show. What is too
bright for half floats, or so dim that they lose digits, is multiplied by a power of two first.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles, Floats

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
