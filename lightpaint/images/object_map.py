"""A map of the objects seen in each pixel of a picture, with their names."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Bools
from lightpaint.errors import SizeError
from lightpaint.keywords import keywords

#: Index of a background pixel.
BACKGROUND = -1


@keywords()
@dataclass(frozen=True)
class Objects:
    """The objects whose surfaces are seen first in each pixel.

    Attributes:
        index: (h, w) int32, index of the object that covers most of each pixel; -1 for none.
        names: Names of the objects, by index. Several may share a name. An object without a name is
            named after its mesh file, its material or its kind.

    Raises:
        SizeError: If `index` is not a picture of indices into `names`.

    Examples:
        >>> objects = lp.Objects(np.array([[-1, 0], [1, 1]], np.int32), ("wall", "statue"))
        >>> int(objects.mask("statue").sum())
        2
    """

    index: npt.NDArray[np.int32]
    names: tuple[str, ...]

    def __post_init__(self) -> None:
        index, count = self.index, len(self.names)
        if index.ndim != 2 or index.dtype.kind != "i":
            raise SizeError(
                f"objects are {index.dtype} {index.shape}: expected whole numbers (h, w)"
            )
        if index.size and not BACKGROUND <= index.min() <= index.max() < count:
            raise SizeError(
                f"objects {index.min()} to {index.max()} are seen, and {count} have names"
            )

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) in pixels."""
        return self.index.shape[0], self.index.shape[1]

    def mask(self, name: str) -> Bools:
        """Return (h, w), True where an object of that name is seen."""
        indices = [k for k, other in enumerate(self.names) if other == name]
        return np.isin(self.index, indices)
