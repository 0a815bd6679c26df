"""Pixels of a painting, as canvas, steps, looks and files exchange them."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Bools, Floats

#: Rows and columns of the picture, `(top, bottom, left, right)`, the ends not included.
Region = tuple[int, int, int, int]


class Pixels(NamedTuple):
    """Paint in a region.

    image: (rows, columns, 3) float32, linear. importance: (rows, columns) float32. at_least: (rows,
    columns, 3), where brighter is as good, as in `Target`; None for nowhere.
    """

    image: npt.NDArray[np.float32]
    importance: npt.NDArray[np.float32]
    at_least: Bools | None = None

    @classmethod
    def unpainted(cls, image: Floats) -> "Pixels":
        """Return this light with nothing painted on it."""
        return cls(np.asarray(image, np.float32), np.zeros(image.shape[:2], np.float32))

    def part(self, region: Region) -> "Pixels":
        """Return the pixels of a region, as views of the same arrays."""
        area = slices(region)
        at_least = None if self.at_least is None else self.at_least[area]
        return Pixels(self.image[area], self.importance[area], at_least)

    def copy(self) -> "Pixels":
        """Return a copy; `at_least` is None where no mark is set."""
        at_least = self.at_least
        if at_least is not None:
            at_least = at_least.copy() if at_least.any() else None
        return Pixels(self.image.copy(), self.importance.copy(), at_least)

    def equals(self, other: "Pixels") -> bool:
        """Return whether both are equal, to the last bit."""
        if not all(np.array_equal(a, b) for a, b in zip(self[:2], other[:2], strict=True)):
            return False
        return equal_marks(self.at_least, other.at_least)


def mix_pixels(pair: tuple[Pixels, Pixels], shares: tuple[float, float]) -> Pixels:
    """Mix two paintings of a view, each weighted by its share and its importance."""
    counts = [share * pixels.importance for share, pixels in zip(shares, pair, strict=True)]
    total = counts[0] + counts[1]
    whole = np.where(total > 0, total, 1)[..., None]
    image = np.zeros((*total.shape, 3), np.float32)
    for count, pixels in zip(counts, pair, strict=True):
        image += (count[..., None] / whole * pixels.image).astype(np.float32)
    # A pixel is marked "at least" if it is in all paintings that count there.
    unsure = np.zeros(image.shape, bool)
    for count, pixels in zip(counts, pair, strict=True):
        fixed = True if pixels.at_least is None else ~pixels.at_least
        unsure |= fixed & (count > 0)[..., None]
    at_least = ~unsure & (total > 0)[..., None]
    return Pixels(image, total.astype(np.float32), at_least if at_least.any() else None)


def equal_marks(first: Bools | None, second: Bools | None) -> bool:
    """Return whether two paintings have the same "at least" marks; None for none."""
    if first is None or second is None:
        return not any(marks is not None and marks.any() for marks in (first, second))
    return np.array_equal(first, second)


def slices(region: Region) -> tuple[slice, slice]:
    """Return row and column slices, to index an array with."""
    top, bottom, left, right = region
    return slice(top, bottom), slice(left, right)
