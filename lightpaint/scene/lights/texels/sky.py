"""Images around the scene, as Mitsuba's environment maps have them.

Columns wrap around. The first row is the direction up and the last the direction down, in the
light's own space: all texels of such a row meet at a pole.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from lightpaint.arrays import Doubles, Floats, Position
from lightpaint.scene.lights.texels.image_domain import GridSize, ImageDomain, Neighbours


@dataclass(frozen=True)
class Sky(ImageDomain):
    """All directions, from which an `envmap` or a `constant` shines."""

    noun: ClassVar[str] = "an image around the scene"
    extent: ClassVar[str] = "all around"
    whole: ClassVar[str] = "all directions"
    parameter: ClassVar[str] = "radiance"
    unit: ClassVar[str] = "W/(m² sr)"
    min_size: ClassVar[GridSize] = (2, 3)
    has_texture: ClassVar[bool] = False

    def shares(self, size: GridSize) -> Doubles:
        """See ImageDomain."""
        return solid_angles(size) / (4 * np.pi)

    def neighbours(self, size: GridSize) -> Iterator[Neighbours]:
        """See ImageDomain."""
        columns, rows = size
        height, width = np.pi / (rows - 1), 2 * np.pi / columns
        for y in range(rows):
            # The texels at a pole are half as high, and a quarter of a texel away from it.
            is_pole = y in (0, rows - 1)
            sine = np.sin(height / 4) if is_pole else np.sin(height * y)
            across = height * (0.5 if is_pole else 1.0) / (sine * width) / (4 * np.pi)
            down = np.sin(height * (y + 0.5)) * width / height / (4 * np.pi)
            for x in range(columns):
                yield (y, x), (y, (x + 1) % columns), float(across)
                if y + 1 < rows:
                    yield (y, x), (y + 1, x), float(down)

    def coarse(self, image: Floats, size: GridSize) -> Doubles:
        """See ImageDomain."""
        columns, rows = size
        height, width = image.shape[:2]
        polar = np.pi * np.arange(height) / max(height - 1, 1)
        half = np.pi / max(height - 1, 1) / 2
        band = np.cos(np.maximum(polar - half, 0)) - np.cos(np.minimum(polar + half, np.pi))
        y, x = polar / np.pi * (rows - 1), (np.arange(width) + 0.5) / width * columns - 0.5
        down = np.maximum(1 - np.abs(y - np.arange(rows)[:, None]), 0) * band
        distance = np.abs(x - np.arange(columns)[:, None])
        across = np.maximum(1 - np.minimum(distance, columns - distance), 0)
        # A map that is coarser than the texels has no pixel under some of them.
        total = (down.sum(axis=1)[:, None] * across.sum(axis=1))[..., None]
        rows_of_light = np.tensordot(down, image, axes=1)
        mean = np.einsum("rwc,kw->rkc", rows_of_light, across) / np.where(total > 0, total, 1)
        return np.where(total > 0, mean, self.interpolated(image, size))

    def interpolated(self, image: Floats, size: GridSize) -> Doubles:
        """See ImageDomain."""
        columns, rows = size
        height, width = image.shape[:2]
        y = np.linspace(0, height - 1, rows)
        x = (np.arange(columns) + 0.5) / columns * width - 0.5
        top, left = np.clip(np.floor(y).astype(int), 0, max(height - 2, 0)), np.floor(x).astype(int)
        below, beside = (y - top)[:, None, None], (x - left)[:, None]
        lower, right = np.minimum(top + 1, height - 1), (left + 1) % width
        left = left % width
        upper_row = image[top][:, left] * (1 - beside) + image[top][:, right] * beside
        lower_row = image[lower][:, left] * (1 - beside) + image[lower][:, right] * beside
        return np.asarray(upper_row * (1 - below) + lower_row * below, np.float64)

    def seen(self, image: Floats, directions: Doubles) -> Doubles:
        """Return the radiance from directions in the light's own space, as Mitsuba interpolates it.

        image: (rows, columns, 3). directions: unit vectors (..., 3). Returns (..., 3).
        """
        rows, columns = image.shape[:2]
        azimuth = np.arctan2(directions[..., 0], -directions[..., 2]) / (2 * np.pi)
        polar = np.arccos(np.clip(directions[..., 1], -1, 1)) / np.pi
        x, y = azimuth * columns - 0.5, polar * (rows - 1)
        left, top = np.floor(x).astype(int), np.minimum(np.floor(y).astype(int), rows - 2)
        beside, below = (x - left)[..., None], (y - top)[..., None]
        first, second = left % columns, (left + 1) % columns
        upper = image[top, first] * (1 - beside) + image[top, second] * beside
        lower = image[top + 1, first] * (1 - beside) + image[top + 1, second] * beside
        return np.asarray(upper * (1 - below) + lower * below, np.float64)

    def picture_size(self, size: GridSize, width: int) -> GridSize:
        """See ImageDomain: twice as wide as high, whatever the texels."""
        return width, width // 2


def texel_direction(column: int, row: int, size: GridSize) -> Position:
    """Return the direction from the scene to the centre of a texel, in the light's own space."""
    columns, rows = size
    azimuth = 2 * np.pi * (column + 0.5) / columns
    polar = np.pi * row / (rows - 1)
    x, z = np.sin(polar) * np.sin(azimuth), -np.sin(polar) * np.cos(azimuth)
    return float(x), float(np.cos(polar)), float(z)


def solid_angles(size: GridSize) -> Doubles:
    """Return the integral of each texel's hat over all directions, (rows, columns); the sum is
    4π.
    """
    columns, rows = size
    step = np.pi / (rows - 1)
    polar = step * np.arange(rows)
    # The integral of sin θ under a hat of half width `step`: 2 (1 − cos step) / step · sin θ,
    # and (1 − sin step / step) for the half of a hat at a pole.
    band = 2 * (1 - np.cos(step)) / step * np.sin(polar)
    band[[0, -1]] = 1 - np.sin(step) / step
    return np.repeat(band[:, None], columns, axis=1) * (2 * np.pi / columns)
