"""Types of the arrays that the folders pass to each other. They need no library but NumPy."""

from collections.abc import Iterable
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

_Kind = TypeVar("_Kind", bound=np.generic)

#: Pixels and what is computed from them, in any precision.
Floats = npt.NDArray[np.floating[Any]]

#: Inner products, weights and everything that is solved for.
Doubles = npt.NDArray[np.float64]

Bools = npt.NDArray[np.bool_]
Indices = npt.NDArray[np.intp]

#: Rows and columns of an image, to index it with.
Slices = tuple[slice, slice]

#: One colour, linear Rec.709.
RGB = tuple[float, float, float]

#: A point, in units of the scene.
Position = tuple[float, float, float]


def largest(image: Floats) -> Floats:
    """Return the largest of the three channels, (…), of (…, 3): a fifth of the time of
    max(axis=-1).
    """
    red, green, blue = (image[..., c] for c in range(3))
    return np.asarray(np.maximum(np.maximum(red, green), blue))


def read_only(array: npt.NDArray[_Kind]) -> npt.NDArray[_Kind]:
    """Make `array` read-only, since several owners share it, and return it."""
    array.flags.writeable = False
    return array


def as_rgb(values: Iterable[Any]) -> RGB:
    """Return the three numbers of an array or any other iterable as one colour."""
    r, g, b = (float(v) for v in values)
    return r, g, b
