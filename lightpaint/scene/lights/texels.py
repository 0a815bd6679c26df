"""Texels: the pixels of a coarse image around the scene, each of which is a light of its own.

Mitsuba interpolates the pixels of an environment map bilinearly, so a texel shines as a hat: it is
1 at its own direction and falls to 0 towards its neighbours. Hats sum to one, so an image with a
value for each texel is the sum of their lights.

Columns wrap around. The first row is the direction up and the last the direction down, in the
light's own space: all texels of such a row meet at a pole.
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import Doubles, Floats, Position
from lightpaint.errors import SceneError
from lightpaint.files import one_line

#: Lights that can be split: an image around the scene, or one colour that becomes such an image.
SPLIT_PLUGINS = ("envmap", "constant")

#: Columns and rows of an image.
GridSize = tuple[int, int]

#: Least numbers of columns and rows: Mitsuba resamples smaller images.
MIN_COLUMNS, MIN_ROWS = 2, 3
#: Most texels of an image: each is a light with pictures of its own.
MAX_TEXELS = 4096

_SIZE = re.compile(r"(\d{1,9})\s*[x×,]\s*(\d{1,9})")
_NAME = re.compile(r"(.+)\.x(\d{1,4})\.y(\d{1,4})", re.DOTALL)


@dataclass(frozen=True)
class Texel:
    """A texel of the image of a light.

    image: name of the light. column, row: its place, from the left and from the top. size: of the
    image.
    """

    image: str
    column: int
    row: int
    size: GridSize

    @property
    def name(self) -> str:
        """Its name as a light: those of its image, its column and its row."""
        return texel_name(self.image, self.column, self.row)

    @property
    def direction(self) -> Position:
        """The direction from the scene to its centre, in the light's own space."""
        columns, rows = self.size
        azimuth = 2 * np.pi * (self.column + 0.5) / columns
        polar = np.pi * self.row / (rows - 1)
        x, z = np.sin(polar) * np.sin(azimuth), -np.sin(polar) * np.cos(azimuth)
        return float(x), float(np.cos(polar)), float(z)


def texel_name(image: str, column: int, row: int) -> str:
    """Return the name of a texel, from the name of its image."""
    return f"{image}.x{column}.y{row}"


def image_of(name: str) -> str:
    """Return the name of the image that a texel of this name belongs to; "" for other names."""
    found = _NAME.fullmatch(name)
    return "" if found is None else found[1]


def images_of(names: Iterable[str]) -> dict[str, GridSize]:
    """Return the images of which `names` has all texels, with their sizes."""
    places: dict[str, set[tuple[int, int]]] = {}
    for name in names:
        if (found := _NAME.fullmatch(name)) is not None:
            places.setdefault(found[1], set()).add((int(found[2]), int(found[3])))
    sizes = {
        image: (max(x for x, _ in texels) + 1, max(y for _, y in texels) + 1)
        for image, texels in places.items()
    }
    return {
        image: size for image, size in sizes.items() if len(places[image]) == size[0] * size[1] > 1
    }


def texel_names(image: str, size: GridSize) -> list[str]:
    """Return the names of all texels of an image, row by row."""
    columns, rows = size
    return [texel_name(image, x, y) for y in range(rows) for x in range(columns)]


def parse_size(value: object, where: str) -> GridSize:
    """Return columns and rows from `16x8` or [16, 8]. where: their place, for errors."""
    size: GridSize | None = None
    if isinstance(value, str) and (found := _SIZE.fullmatch(value.strip())) is not None:
        size = int(found[1]), int(found[2])
    if isinstance(value, list | tuple) and len(value) == 2 and all(type(v) is int for v in value):
        size = value[0], value[1]
    if size is None:
        raise SceneError(
            f"{where} is {one_line(repr(value))}: expected columns and rows, such as 16x8"
        )
    columns, rows = size
    if columns < MIN_COLUMNS or rows < MIN_ROWS:
        raise SceneError(
            f"{where} is {columns}x{rows}: an image around the scene has at least {MIN_COLUMNS} "
            f"columns and {MIN_ROWS} rows"
        )
    if columns * rows > MAX_TEXELS:
        raise SceneError(
            f"{where} is {columns}x{rows}, {columns * rows:,} texels: expected at most "
            f"{MAX_TEXELS:,}, each of which is a light with pictures of its own"
        )
    return columns, rows


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


def coarse_image(image: Floats, size: GridSize) -> Doubles:
    """Return the mean of an environment map under each hat, (rows, columns, 3).

    image: (h, w, 3), which Mitsuba interpolates. The result emits the same total light.
    """
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
    return np.where(total > 0, mean, interpolated(image, size))


def interpolated(image: Floats, size: GridSize) -> Doubles:
    """Return an environment map at another size, as Mitsuba interpolates it, (rows, columns, 3)."""
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
