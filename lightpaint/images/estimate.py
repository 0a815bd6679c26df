"""A Monte Carlo image with an estimate of its noise."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lightpaint.arrays import Doubles, Floats
from lightpaint.display_text import short_repr, some_names
from lightpaint.errors import ImageError, SizeError
from lightpaint.files import one_line
from lightpaint.images.formats.exr import ExrPart, read_parts, rgb_channels, write_parts
from lightpaint.images.pixel_blocks import block_mean, check_factor
from lightpaint.keywords import keywords

#: EXR layer that holds half the difference of two independent halves of the samples.
HALF_DIFFERENCE = "half_difference"


@keywords()
@dataclass(frozen=True)
class Estimate:
    """The mean of two independent renders A and B, and half their difference.

    Attributes:
        image: (h, w, 3) float32, (A + B) / 2, linear Rec.709 radiance.
        half_difference: (h, w, 3) float32, (A − B) / 2. Its square is an unbiased estimate of the
            variance of `image`, one per pixel and channel.

    Examples:
        >>> predicted = lp.combine(basis, lp.solve(basis, target).lighting)
        >>> predicted.image.shape == predicted.variance().shape
        True
    """

    image: Floats
    half_difference: Floats

    __repr__ = short_repr

    def __post_init__(self) -> None:
        if self.image.shape != self.half_difference.shape:
            raise ImageError(
                f"image {self.image.shape} and half difference "
                f"{self.half_difference.shape} differ in shape"
            )

    @classmethod
    def of_halves(cls, a: Floats, b: Floats) -> "Estimate":
        """Return the estimate of two independent renders of equal sample count.

        a, b: (h, w, 3). Raises ImageError for images of different shapes.
        """
        if np.shape(a) != np.shape(b):
            raise ImageError(f"halves {np.shape(a)} and {np.shape(b)} differ in shape")
        return cls((a + b) / 2, (a - b) / 2)

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) in pixels."""
        return self.image.shape[0], self.image.shape[1]

    def reduced(self, factor: int) -> "Estimate":
        """Return the estimate averaged over blocks of factor × factor pixels.

        Raises SizeError where it has no such blocks.
        """
        check_factor(self.size, factor)
        return Estimate(block_mean(self.image, factor), block_mean(self.half_difference, factor))

    def variance(self, *, radius: int = 2) -> Floats:
        """Return the variance of each pixel of `image`, (h, w, 3), averaged over its neighbours.

        A pair of halves gives one squared difference per pixel, which is too rough to divide by. So
        it is averaged over a window of (2 radius + 1)² pixels, which is clipped at the borders.
        Raises SizeError for a negative radius.
        """
        if radius < 0:
            raise SizeError(f"radius is {radius}: expected a whole number of pixels >= 0")
        return box_mean(np.square(self.half_difference, dtype=np.float64), radius)


def box_mean(values: Floats, radius: int) -> Floats:
    """Return means over a square window, which is clipped at the borders. values: (h, w, …)."""
    radius = min(radius, max(values.shape[:2]))  # a larger window has the same pixels
    for axis in (0, 1):
        length = values.shape[axis]
        # Running sums, with 0 before them and the last one repeated after them.
        shape = (*values.shape[:axis], length + 2 * radius + 1, *values.shape[axis + 1 :])
        sums = np.zeros(shape)
        inside, after, low, high = (
            (*[slice(None)] * axis, part)
            for part in (
                slice(radius + 1, radius + 1 + length),
                slice(radius + 1 + length, None),
                slice(length),
                slice(2 * radius + 1, None),
            )
        )
        _add_up(values, axis, into=sums[inside])
        sums[after] = np.take(sums, [radius + length], axis)
        places = np.arange(length)
        count = np.minimum(places + radius + 1, length) - np.maximum(places - radius, 0)
        values = sums[high] - sums[low]
        values /= count.reshape([-1 if k == axis else 1 for k in range(values.ndim)])
    return values


def _add_up(values: Floats, axis: int, *, into: Doubles) -> None:
    """Write the running sums of `values` along an axis into an array of its shape."""
    if axis > 0:
        np.cumsum(values, axis=axis, out=into)
        return
    # Row after row, a ninth of the time in which NumPy adds column after column.
    into[:1] = values[:1]
    for above, row, total in zip(into, values[1:], into[1:], strict=False):
        np.add(above, row, out=total)


def shifted(values: Floats, dy: int, dx: int) -> Floats:
    """Return each pixel's neighbour at this offset; border pixels are repeated outwards."""
    height, width = values.shape[:2]
    before, after = (max(-dy, 0), max(-dx, 0)), (max(dy, 0), max(dx, 0))
    margins = [*zip(before, after, strict=True), *[(0, 0)] * (values.ndim - 2)]
    wider = np.pad(values, margins, mode="edge")
    return np.asarray(wider[after[0] : after[0] + height, after[1] : after[1] + width])


def write_estimate(path: Path, estimate: Estimate, attributes: dict[str, str]) -> None:
    """Write R, G, B and, as a separate layer, the half difference, in float32."""
    channels = rgb_channels(estimate.image)
    channels |= rgb_channels(estimate.half_difference, HALF_DIFFERENCE)
    write_parts(path, [ExrPart("rgb", channels, attributes)])


def read_estimate(path: Path) -> tuple[Estimate, Mapping[str, str]]:
    """Read a file of `write_estimate`. Returns the estimate and the text attributes of its
    header.
    """
    parts = read_parts(path)
    if len(parts) > 1:
        raise ImageError(
            path,
            f" has {len(parts)} parts ({some_names(p.name for p in parts)}) instead of one: "
            "give an image that lightpaint rendered",
        )
    [part] = parts
    if f"{HALF_DIFFERENCE}.R" not in part.channels:
        raise ImageError(
            path,
            f" has no {HALF_DIFFERENCE} layer, so its noise is unknown: "
            "give an image that lightpaint rendered",
        )
    try:
        return Estimate(part.rgb(), part.rgb(HALF_DIFFERENCE)), part.attributes
    except ImageError as error:
        raise ImageError(path, f" is damaged: {one_line(str(error))}") from None
