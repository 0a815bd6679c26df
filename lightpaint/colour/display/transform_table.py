"""View transforms as tables, for programs without their code, such as the painter's page."""

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.colour.display.view_transform import ViewTransform


def lattice_of(transform: ViewTransform, side: int, low: float, high: float) -> Floats:
    """Return display values, (side, side, side, 3) float32, with axes r, g, b in log2 of light.

    low, high: stops at the ends of an axis; the first point stands for all light below it.
    """
    axis = _axis(side, low, high)
    light = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1)
    encoded = transform.encode(light.reshape(1, -1, 3))
    return np.asarray(encoded.reshape(side, side, side, 3), np.float32)


def curve_of(transform: ViewTransform, side: int, low: float, high: float) -> Floats:
    """Return the diagonal of `lattice_of`, (side,) float32, which suffices if channels do not
    mix.
    """
    grey = np.repeat(_axis(side, low, high)[:, None], 3, axis=1)
    return np.asarray(transform.encode(grey)[:, 0], np.float32)


def _axis(side: int, low: float, high: float) -> Floats:
    axis = 2.0 ** np.linspace(low, high, side)
    axis[0] = 0.0
    return axis
