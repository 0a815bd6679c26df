"""A part of a painting that asks for something of its own."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.errors import SizeError
from lightpaint.images import block_mean, resampled


@dataclass(frozen=True, eq=False)
class Wish:
    """A layer, an object or a stroke: what a person would name if asked what was painted.

    Attributes:
        name: Its name for people.
        area: (h, w) float32 from 0 to 1, how much of each pixel is painted by it and not by
            another wish above it.
        layer: Id of its layer in a painter's session; None for a painting without layers.
        group: Name of the group of its layer, such as a preset; "" without one.
        has_strokes: Whether separate strokes in it are wishes of their own.
        is_exact: Whether its colours were given as numbers, and not painted by eye.
    """

    name: str
    area: Floats
    layer: int | None = None
    group: str = ""
    has_strokes: bool = False
    is_exact: bool = False

    def __post_init__(self) -> None:
        if self.area.ndim != 2:
            raise SizeError(f"wish {self.name}: an area of {self.area.shape}: expected (h, w)")

    def resized(self, size: tuple[int, int]) -> "Wish":
        """Return the wish resampled to `size` (height, width)."""
        area = np.clip(resampled(self.area[..., None], size)[..., 0], 0, 1)
        return replace(self, area=np.asarray(area, np.float32))

    def reduced(self, factor: int) -> "Wish":
        """Return the wish averaged over blocks of factor × factor pixels."""
        return replace(self, area=np.asarray(block_mean(self.area, factor), np.float32))

    def cropped(self, height: int, width: int) -> "Wish":
        """Return the top left part, of this size."""
        return replace(self, area=self.area[:height, :width])


def separate(areas: Sequence[Floats]) -> list[Floats]:
    """Return the part of each area that no later one covers, (h, w) float32 each.

    areas: (h, w) coverages from 0 to 1, the lowest first.
    """
    uncovered, parts = None, []
    for area in reversed(areas):
        coverage = np.clip(area, 0, 1).astype(np.float32)
        parts.append(coverage if uncovered is None else coverage * uncovered)
        uncovered = (1 - coverage) if uncovered is None else uncovered * (1 - coverage)
    return parts[::-1]
