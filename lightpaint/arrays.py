"""Types of the arrays that walk between the rooms. No library stands behind them but NumPy."""

from collections.abc import Iterable
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

_Kind = TypeVar("_Kind", bound=np.generic)

#: Pixels and what is computed of them, of whichever precision.
Floats = npt.NDArray[np.floating[Any]]

#: Inner products, weights, and all that is solved.
Doubles = npt.NDArray[np.float64]

Bools = npt.NDArray[np.bool_]
Indices = npt.NDArray[np.intp]

#: Rows and columns of an image, to index it with.
Slices = tuple[slice, slice]

#: One colour, linear Rec.709.
RGB = tuple[float, float, float]

#: One place, in units of the scene.
Position = tuple[float, float, float]


def largest(image: Floats) -> Floats:
    """The largest of the three channels, (…), of (…, 3): a fifth of the time of max(axis=-1)."""
    red, green, blue = (image[..., c] for c in range(3))
    return np.asarray(np.maximum(np.maximum(red, green), blue))


def read_only(array: npt.NDArray[_Kind]) -> npt.NDArray[_Kind]:
    """Return `array`, which none of those who share it may change from now on."""
    array.flags.writeable = False
    return array


def as_rgb(values: Iterable[Any]) -> RGB:
    """Three numbers of an array, or any others, as one colour."""
    r, g, b = (float(v) for v in values)
    return r, g, b
