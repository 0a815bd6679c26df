"""The domains of images, skies, walls and slides: where texels lie, and how they shine."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from lightpaint.arrays import Doubles, Floats
from lightpaint.errors import SceneError

#: Columns and rows of an image.
GridSize = tuple[int, int]

#: The place of a texel in an image: row, column.
GridPlace = tuple[int, int]

#: Two texels that are neighbours, and how stiffly a smooth image joins them.
Neighbours = tuple[GridPlace, GridPlace, float]


class ImageDomain(ABC):
    """A domain that the image of a light covers: all directions, a surface, or a projector's slide.

    noun: of its image, for errors. extent: where the image is seen, for captions. whole: what its
    mean is taken over. parameter, unit: of the emission of a texel. min_size: fewest columns and
    rows; Mitsuba resamples smaller images. has_texture: whether the emitter has the image in a
    texture, its parameter; otherwise it is an environment map. has_proportions: whether the light
    has the proportions of the image, also of an even one. smoothness: how strongly its image is
    pulled to a smooth one, relative to a sky.

    The first row of an image is its top.
    """

    noun: ClassVar[str]
    extent: ClassVar[str]
    whole: ClassVar[str]
    parameter: ClassVar[str]
    unit: ClassVar[str]
    min_size: ClassVar[GridSize]
    has_texture: ClassVar[bool]
    has_proportions: ClassVar[bool] = False
    smoothness: ClassVar[float] = 1.0

    def check_size(self, size: GridSize, pixels: GridSize, light: str) -> None:
        """Raise SceneError for an image with too few columns or rows, or of other proportions than
        the light has.

        pixels: columns and rows of its bitmap now, or 1 and 1. light: for the error.
        """
        (columns, rows), (least_columns, least_rows) = size, self.min_size
        if columns < least_columns or rows < least_rows:
            raise SceneError(
                f"split: {light} is {columns}x{rows}: {self.noun} has at least {least_columns} "
                f"columns and {least_rows} rows"
            )
        width, height = (max(2, x) for x in pixels)
        fits = rows == round(columns * height / width) or columns == round(rows * width / height)
        if self.has_proportions and not fits:
            fitting_rows = max(2, round(columns * height / width))
            raise SceneError(
                f"split: {light} is {columns}x{rows}, but {self.noun} has the proportions of its "
                f"bitmap, {width}x{height}: expected {columns}x{fitting_rows}, or another size of "
                "that shape"
            )

    @abstractmethod
    def shares(self, size: GridSize) -> Doubles:
        """Return the share of each texel's hat in the domain, (rows, columns); the sum is 1."""

    @abstractmethod
    def neighbours(self, size: GridSize) -> Iterator[Neighbours]:
        """Yield the neighbours in an image.

        The sum of stiffness times squared difference is the mean of |∇f|² over the domain, in
        units of length in which the area is the area of the unit sphere, 4π.
        """

    @abstractmethod
    def coarse(self, image: Floats, size: GridSize) -> Doubles:
        """Return the mean of a finer image under each hat, (rows, columns, 3).

        The result emits the same total light.
        """

    @abstractmethod
    def interpolated(self, image: Floats, size: GridSize) -> Doubles:
        """Return an image at another size, as Mitsuba interpolates it, (rows, columns, 3)."""

    @abstractmethod
    def picture_size(self, size: GridSize, width: int) -> GridSize:
        """Return columns and rows of a picture of an image, of this width in pixels."""

    def as_stored(self, image: Floats) -> Floats:
        """Return an image with the rows in the order in which Mitsuba's file has them."""
        return image


@dataclass(frozen=True)
class Sky(ImageDomain):
    """All directions, from which an `envmap` or a `constant` shines.

    Columns wrap around. The first row is the direction up and the last the direction down, in the
    light's own space: all texels of such a row meet at a pole.
    """

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
        x = (np.arange(columns) + 0.5) / columns * width - 0.5
        return _around(image, x, np.linspace(0, height - 1, rows)[:, None])

    def seen(self, image: Floats, directions: Doubles) -> Doubles:
        """Return the radiance from directions in the light's own space, as Mitsuba interpolates it.

        image: (rows, columns, 3). directions: unit vectors (..., 3). Returns (..., 3).
        """
        rows, columns = image.shape[:2]
        azimuth = np.arctan2(directions[..., 0], -directions[..., 2]) / (2 * np.pi)
        polar = np.arccos(np.clip(directions[..., 1], -1, 1)) / np.pi
        return _around(image, azimuth * columns - 0.5, polar * (rows - 1))

    def picture_size(self, size: GridSize, width: int) -> GridSize:
        """See ImageDomain: twice as wide as high, whatever the texels."""
        return width, width // 2


def _around(image: Floats, x: Doubles, y: Doubles) -> Doubles:
    """Return an image between its pixels, whose columns wrap around, (..., 3).

    image: (rows, columns, 3). x, y: columns and rows, (...) each when broadcast.
    """
    rows, columns = image.shape[:2]
    left, top = np.floor(x).astype(int), np.clip(np.floor(y).astype(int), 0, max(rows - 2, 0))
    beside, below = (x - left)[..., None], (y - top)[..., None]
    first, second, lower = left % columns, (left + 1) % columns, np.minimum(top + 1, rows - 1)
    above = image[top, first] * (1 - beside) + image[top, second] * beside
    beneath = image[lower, first] * (1 - beside) + image[lower, second] * beside
    return np.asarray(above * (1 - below) + beneath * below, np.float64)


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


@dataclass(frozen=True)
class FlatDomain(ImageDomain):
    """A rectangle of texture coordinates, from 0 to 1.

    Texels lie between the borders of the image, half of one away from each, and beyond the
    outermost ones the image stays as it is there ("clamp"). So all hats have the same share of it.
    is_upside_down: whether the first row in Mitsuba's file, where its second coordinate is 0, is
    the lowest.
    """

    min_size: ClassVar[GridSize] = (2, 2)
    has_texture: ClassVar[bool] = True

    is_upside_down: bool = False

    def shares(self, size: GridSize) -> Doubles:
        """See ImageDomain."""
        columns, rows = size
        return np.full((rows, columns), 1 / (rows * columns))

    def neighbours(self, size: GridSize) -> Iterator[Neighbours]:
        """See ImageDomain. Texels count as squares."""
        columns, rows = size
        stiffness = 1 / (4 * np.pi)
        for y in range(rows):
            for x in range(columns):
                if x + 1 < columns:
                    yield (y, x), (y, x + 1), stiffness
                if y + 1 < rows:
                    yield (y, x), (y + 1, x), stiffness

    def coarse(self, image: Floats, size: GridSize) -> Doubles:
        """See ImageDomain."""
        return _resampled(image, size, _hats)

    def interpolated(self, image: Floats, size: GridSize) -> Doubles:
        """See ImageDomain."""
        return _resampled(image, size, _interpolation)

    def picture_size(self, size: GridSize, width: int) -> GridSize:
        """See ImageDomain: the shape of the image, whose texels are squares."""
        columns, rows = size
        return width, max(1, round(width * rows / columns))

    def as_stored(self, image: Floats) -> Floats:
        """See ImageDomain."""
        return image[::-1] if self.is_upside_down else image


@dataclass(frozen=True)
class Wall(FlatDomain):
    """A surface with texture coordinates, which shines as an `area` light.

    The second coordinate of a rectangle increases upwards, the coordinate of a mesh downwards, as
    its images are painted.
    """

    noun: ClassVar[str] = "the image of an area light"
    extent: ClassVar[str] = "over its surface"
    whole: ClassVar[str] = "its surface"
    parameter: ClassVar[str] = "radiance"
    unit: ClassVar[str] = "W/(m² sr)"
    # A wall lights a scene from one side and shows little of its image there.
    smoothness: ClassVar[float] = 10.0


@dataclass(frozen=True)
class Slide(FlatDomain):
    """The slide of a `projector`, whose sides are as long as its image has columns and rows."""

    noun: ClassVar[str] = "the slide of a projector"
    extent: ClassVar[str] = "on its slide"
    whole: ClassVar[str] = "its slide"
    parameter: ClassVar[str] = "irradiance"
    unit: ClassVar[str] = "W/m²"
    has_proportions: ClassVar[bool] = True


def _resampled(image: Floats, size: GridSize, weights: Callable[[int, int], Doubles]) -> Doubles:
    """Return an image (h, w, 3) at another size, (rows, columns, 3).

    weights: returns the weights of some pixels in a row at some places, (places, pixels).
    """
    columns, rows = size
    height, width = image.shape[:2]
    down, across = weights(height, rows), weights(width, columns)
    shown = np.einsum("rh,hwc,kw->rkc", down, image, across, optimize=True)
    return np.asarray(shown, np.float64)


def _hats(pixels: int, texels: int) -> Doubles:
    """Return the weights of pixels in the means under the hats of texels, (texels, pixels)."""
    if pixels < texels:
        # Some texels have no pixel under them.
        return _interpolation(pixels, texels)
    weights = _interpolation(texels, pixels).T
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))


def _interpolation(pixels: int, places: int) -> Doubles:
    """Return the weights of pixels at evenly spread places, (places, pixels)."""
    x = (np.arange(places) + 0.5) / places * pixels - 0.5
    x = np.clip(x, 0, pixels - 1)
    return np.asarray(np.maximum(1 - np.abs(x[:, None] - np.arange(pixels)), 0))


#: What the image of an emitter covers, by its plugin. A light of one colour becomes an image.
DOMAINS: dict[str, ImageDomain] = {
    "envmap": Sky(),
    "constant": Sky(),
    "area": Wall(),
    "projector": Slide(),
}

#: Rectangles have their second texture coordinate upwards.
RECTANGLE_WALL = Wall(is_upside_down=True)


def domain_of(plugin: str, shape: str = "") -> ImageDomain:
    """Return what the image of an emitter of this plugin covers. shape: plugin of its shape."""
    return RECTANGLE_WALL if shape == "rectangle" else DOMAINS[plugin]
