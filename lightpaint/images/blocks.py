"""Images of one picture at two sizes, one a whole multiple of the other."""

from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Floats

Size = tuple[int, int]


def whole_factor(larger: Size, smaller: Size) -> int | None:
    """By which whole number both sides of `larger` exceed those of `smaller`; None if by none.

    Both are (height, width) or both (width, height).
    """
    factor = larger[0] // smaller[0]
    return factor if factor >= 1 and larger == (smaller[0] * factor, smaller[1] * factor) else None


def block_mean(image: Floats, factor: int) -> Floats:
    """Means over blocks of factor x factor pixels, in the precision of `image`.

    image: (h, w, …), both sides divisible by `factor`. A box-filtered render at 1/factor of
    the size estimates just that.
    """
    if factor == 1:
        return image
    height, width, *rest = image.shape
    blocks = image.reshape(height // factor, factor, width // factor, factor, *rest)
    return np.asarray(blocks.mean(axis=(1, 3), dtype=np.float64).astype(image.dtype))


def enlarged(image: npt.NDArray[Any], factor: int) -> npt.NDArray[Any]:
    """Every pixel repeated factor x factor times."""
    return image.repeat(factor, axis=0).repeat(factor, axis=1)
