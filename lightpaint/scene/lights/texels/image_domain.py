"""The domain of an image: where its texels lie, and how they shine."""

from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import ClassVar

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
        units of length in which the area is that of the unit sphere, 4π.
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
