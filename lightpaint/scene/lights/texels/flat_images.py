"""Images on flat domains: walls, which are surfaces with texture coordinates, and slides.

Texels lie between the borders of the image, half of one away from each, and beyond the outermost
ones the image stays as it is there ("clamp"). So all hats have the same share of the image.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from lightpaint.arrays import Doubles, Floats
from lightpaint.scene.lights.texels.image_domain import GridSize, ImageDomain, Neighbours


@dataclass(frozen=True)
class FlatDomain(ImageDomain):
    """A rectangle of texture coordinates, from 0 to 1.

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

    The second coordinate of a rectangle increases upwards, that of a mesh downwards, as its images
    are painted.
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

    weights: returns those of some pixels in a row at some places, (places, pixels).
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
