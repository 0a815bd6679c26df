"""Which object is seen in each pixel of a picture, and what the objects are called."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Bools
from lightpaint.errors import SizeError
from lightpaint.keywords import keywords

#: Index of a pixel in which there is nothing.
NOTHING = -1


@keywords()
@dataclass(frozen=True)
class Objects:
    """Whose surface is seen first in each pixel.

    Attributes:
        index: (h, w) int32, which object is seen in most of a pixel; -1 for none.
        names: Of the objects, in the order of their indices; several may have the same, and one
            whose author gave it none goes by its mesh file, its material or its kind.

    Raises:
        SizeError: If it is no picture of indices of these names.

    Examples:
        >>> objects = lp.Objects(np.array([[-1, 0], [1, 1]], np.int32), ("wall", "statue"))
        >>> int(objects.mask("statue").sum())
        2
    """

    index: npt.NDArray[np.int32]
    names: tuple[str, ...]

    def __post_init__(self) -> None:
        its, count = self.index, len(self.names)
        if its.ndim != 2 or its.dtype.kind != "i":
            raise SizeError(f"objects are {its.dtype} {its.shape}: expected whole numbers (h, w)")
        if its.size and not NOTHING <= its.min() <= its.max() < count:
            raise SizeError(f"objects {its.min()} to {its.max()} are seen, and {count} have names")

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) in pixels."""
        return self.index.shape[0], self.index.shape[1]

    def mask(self, name: str) -> Bools:
        """(h, w), where all objects of that name are seen; nowhere where there is none."""
        its = [k for k, other in enumerate(self.names) if other == name]
        return np.isin(self.index, its)
