"""Images in parts: computed in bands of rows, so that intermediate arrays have one band only;
resampled to any size, or with a block of pixels for each.

Blocks are squares, starting at the top left corner. A remainder at the right and at the bottom,
which is narrower than a block, belongs to none. So the two sizes alone determine the blocks.
"""

from collections.abc import Callable, Iterator, Sequence
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles, Floats
from lightpaint.errors import SizeError
from lightpaint.progress import with_progress
from lightpaint.threads import parallel_map

Job = TypeVar("Job")
Result = TypeVar("Result")

#: Approximate number of pixels in a band.
BAND_PIXELS = 2**18

#: Number of pixels in a picture from which jobs that need several such pictures run one by one.
LARGE_PICTURE = 2**22


def bands_of(size: tuple[int, ...]) -> Iterator[slice]:
    """Yield the rows of each band of a picture of (height, width, …) pixels."""
    step = max(1, BAND_PIXELS // max(size[1], 1))
    return (slice(top, min(top + step, size[0])) for top in range(0, size[0], step))


def by_bands(make: Callable[..., npt.NDArray[Any]], *pictures: npt.NDArray[Any]) -> Any:
    """Return `make(*pictures)`, (h, …), for a function that computes each pixel independently.

    pictures: (h, w, …) each. The result has the same bits as a single call on whole pictures.
    """
    top, *others = bands_of(pictures[0].shape)
    if not others:
        return make(*pictures)
    first = make(*(x[top] for x in pictures))
    result = np.empty((len(pictures[0]), *first.shape[1:]), first.dtype)
    result[top] = first

    def fill(rows: slice) -> None:
        result[rows] = make(*(x[rows] for x in pictures))

    parallel_map(fill, others, unit="bands")
    return result


def sum_by_bands(make: Callable[..., Any], *pictures: npt.NDArray[Any]) -> Any:
    """Return Σ make(*bands), a number or an array, summed in the order of the bands.

    pictures: (h, w, …) each.
    """

    def part(rows: slice) -> Any:
        return make(*(x[rows] for x in pictures))

    return np.sum(parallel_map(part, bands_of(pictures[0].shape), unit="bands"), axis=0)


def in_turns(
    work: Callable[[Job], Result],
    jobs: Sequence[Job],
    size: tuple[int, ...],
    *,
    unit: str | None = None,
) -> list[Result]:
    """Return work(job) for each job: in parallel, or one by one if the pictures are large.

    size: (height, width) of the pictures, of which each job holds several at a time. unit: as of
    `parallel_map`.
    """
    if not is_large(size):
        return parallel_map(work, jobs, unit=unit)
    return [work(job) for job in (jobs if unit is None else with_progress(jobs, unit))]


def is_large(size: tuple[int, ...]) -> bool:
    """Return whether jobs on pictures of (height, width) pixels wait for each other."""
    return size[0] * size[1] >= LARGE_PICTURE


def resampled(planes: Floats, size: tuple[int, int]) -> Floats:
    """Return (h, w, n) float32 at `size`: averaged where it shrinks, interpolated where it grows.

    size: (height, width).
    """
    from PIL import Image

    height, width = size
    shrinks = width <= planes.shape[1]
    kernel = Image.Resampling.BOX if shrinks else Image.Resampling.BILINEAR
    resized = [
        Image.fromarray(np.ascontiguousarray(plane, dtype=np.float32)).resize(
            (width, height), kernel
        )
        for plane in np.moveaxis(planes, -1, 0)
    ]
    return np.dstack([np.asarray(plane) for plane in resized])


Size = tuple[int, int]

#: Largest side of blocks whose pixels are summed one after the other, four times as fast as NumPy's
#: mean.
MAX_ADDED_SIDE = 8

#: Most pixels of an image that is resampled: the pixels of the largest film.
MAX_RESIZED = 2**28


def whole_factor(larger: Size, smaller: Size) -> int | None:
    """Return the side of the largest blocks that `larger` has as many of as `smaller` has pixels.

    Both are (height, width) or both (width, height). Returns None if there are no such blocks.
    """
    factor = min(larger[0] // smaller[0], larger[1] // smaller[1])
    return factor if factor >= 1 and blocks_in(larger, factor) == smaller else None


def blocks_in(size: Size, factor: int) -> Size:
    """Return the number of blocks of factor × factor pixels along each side of an image."""
    return size[0] // factor, size[1] // factor


def check_factor(size: Size, factor: int) -> None:
    """Raise SizeError unless an image has blocks of factor × factor pixels."""
    if not 1 <= factor <= min(size):
        raise SizeError(
            f"blocks of {factor}x{factor} pixels: an image of {size[1]}x{size[0]} has blocks of 1 "
            f"to {min(size)}"
        )


def check_size(size: Size) -> None:
    """Raise SizeError unless an image may have this size."""
    height, width = size
    if min(size) < 1 or height * width > MAX_RESIZED:
        raise SizeError(
            f"a size of {width}x{height} pixels: expected at least 1 along each side, and at most "
            f"{MAX_RESIZED} in all"
        )


def fitting_factor(size: Size, factor: int) -> int:
    """Return `factor`, or the shorter side of an image in which blocks of so many pixels do not
    fit.
    """
    return max(1, min(factor, *size))


def left_over(size: Size, factor: int) -> Size:
    """Return the number of pixels along each side that do not fill a block of factor × factor."""
    return size[0] % factor, size[1] % factor


def covered(image: Floats, smaller: Size) -> Floats:
    """Return the part of `image` that is covered by blocks, one for each pixel of size
    `smaller`.
    """
    factor = whole_factor(image.shape[:2], smaller) or 1
    return image[: smaller[0] * factor, : smaller[1] * factor]


def block_mean(image: Floats, factor: int) -> Floats:
    """Return means over blocks of factor × factor pixels of `image`, (h, w, …), in its precision.

    A box-filtered render with a pixel for each block estimates the same values.
    """
    if factor == 1:
        return image
    if factor > MAX_ADDED_SIDE:
        blocks = _in_blocks(image, factor)
        return np.asarray(blocks.mean(axis=(1, 3), dtype=np.float64).astype(image.dtype))
    whole = covered(image, blocks_in(image.shape[:2], factor))
    total = whole[::factor, ::factor].astype(np.float64)
    for k in range(1, factor * factor):
        total += whole[k // factor :: factor, k % factor :: factor]
    return np.asarray((total / factor**2).astype(image.dtype))


def block_sums(image: npt.NDArray[Any], factor: int) -> Doubles:
    """Return sums over blocks of factor × factor pixels of `image`, (h, w, …), in float64.

    Remainders at the right and at the bottom form smaller blocks here.
    """
    values = np.asarray(image)
    if factor == 1:
        return values.astype(np.float64)
    # Slices are added one after the other, several times as fast as NumPy's reduceat; those across
    # channel by channel, since NumPy walks an axis of three slowly.
    strips = _sums_of_rows(values, factor)
    full, remainder = divmod(strips.shape[1], factor)
    sums = np.zeros((len(strips), full + (remainder > 0), *strips.shape[2:]))
    for channel in np.ndindex(strips.shape[2:]):
        for k in range(factor):
            columns = strips[:, k::factor, *channel]
            sums[:, : columns.shape[1], *channel] += columns
    return sums


def _sums_of_rows(values: npt.NDArray[Any], count: int) -> Doubles:
    """Return sums of `count` rows of `values`, (n, …), in float64; the last may have fewer."""
    full, remainder = divmod(len(values), count)
    sums = np.zeros((full + (remainder > 0), *values.shape[1:]))
    for k in range(count):
        rows = values[k::count]
        sums[: len(rows)] += rows
    return sums


def block_pixels(image: Floats, factor: int) -> Floats:
    """Return the pixels of each block, (factor², h', w', …), of an image (h, w, …)."""
    blocks = np.moveaxis(_in_blocks(image, factor), (1, 3), (0, 1))
    return blocks.reshape(factor * factor, *blocks.shape[2:])


def _in_blocks(image: Floats, factor: int) -> Floats:
    """Return an image (h, w, …) as (h', factor, w', factor, …)."""
    (height, width), rest = blocks_in(image.shape[:2], factor), image.shape[2:]
    whole = image[: height * factor, : width * factor]
    return whole.reshape(height, factor, width, factor, *rest)


def enlarged(image: npt.NDArray[Any], factor: int) -> npt.NDArray[Any]:
    """Return an image with every pixel repeated factor × factor times."""
    return image.repeat(factor, axis=0).repeat(factor, axis=1)


def edge_padded(image: npt.NDArray[Any], size: Size) -> npt.NDArray[Any]:
    """Return an image, (h, w, n), at a larger `size`, (height, width): pixels at the right and at
    the bottom, which fill no block, repeat those beside them.
    """
    rest = [(0, side - known) for side, known in zip(size, image.shape[:2], strict=True)]
    return np.pad(image, [*rest, (0, 0)], mode="edge")
