"""Whole pictures computed in bands of rows, so that intermediate arrays have one band only."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

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
