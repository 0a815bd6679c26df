"""Names and directions of the texels of an image light."""

import numpy as np

from lightpaint.arrays import Position
from lightpaint.scene.lights.texels.texel import GridSize, texel_name


def texel_names(image: str, size: GridSize) -> list[str]:
    """Return the names of all texels of an image, row by row."""
    columns, rows = size
    return [texel_name(image, x, y) for y in range(rows) for x in range(columns)]


def texel_direction(column: int, row: int, size: GridSize) -> Position:
    """Return the direction from the scene to the centre of a texel, in the light's own space."""
    columns, rows = size
    azimuth = 2 * np.pi * (column + 0.5) / columns
    polar = np.pi * row / (rows - 1)
    x, z = np.sin(polar) * np.sin(azimuth), -np.sin(polar) * np.cos(azimuth)
    return float(x), float(np.cos(polar)), float(z)
