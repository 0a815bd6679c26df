"""Films reduced by a whole factor, so that each pixel is a block of the whole film's.

Only then is a box-filtered render on the small film the block mean of one on the large, and a
painting or a verification of full size can be compared with it exactly.
"""

import math
import re
from dataclasses import replace

from lightpaint.errors import SceneError
from lightpaint.images.blocks import whole_factor
from lightpaint.scene.parsed import View

#: How many sizes a refusal names.
NAMED = 8


def reductions(view: View) -> list[int]:
    """The factors that divide film and crop window, ascending from 1."""
    common = math.gcd(*view.size, *view.crop_size, *view.crop_offset)
    return [factor for factor in range(1, common + 1) if common % factor == 0]


def check_resolution(resolution: str) -> re.Match[str]:
    """Its numbers. Raises SceneError for what is neither a part, `1/4`, nor a size, `320x180`."""
    given = re.fullmatch(r"1/(\d{1,9})|(\d{1,9})x(\d{1,9})", resolution)
    if given is None:
        raise SceneError(f"{resolution!r} is no resolution: give 1/4, say, or 320x180")
    return given


def reduction(view: View, resolution: str) -> int:
    """The factor that `resolution`, `1/4` or `320x180`, means for `view`.

    A size is that of the image, so of the crop window. Raises SceneError if it is neither,
    or if film or crop window are not whole multiples of it.
    """
    given = check_resolution(resolution)
    part, width, height = (int(number or 0) for number in given.groups())
    factor = part if given[1] else None
    if width and height:
        factor = whole_factor(view.crop_size, (width, height))
    possible = reductions(view)
    if factor not in possible:
        whole = "x".join(map(str, view.crop_size))
        sizes = [f"{_size(view, k)} (1/{k})" for k in possible[1 : NAMED + 1]]
        raise SceneError(
            f"a film of {whole} cannot be reduced to {resolution}, since its parts must be whole "
            f"blocks of pixels: {', '.join(sizes) or 'only its full size'} will do"
        )
    return factor


def reduced(view: View, factor: int) -> View:
    """`view` on a film that is smaller by one of its `reductions`."""

    def part(pair: tuple[int, int]) -> tuple[int, int]:
        return pair[0] // factor, pair[1] // factor

    return replace(
        view,
        size=part(view.size),
        crop_size=part(view.crop_size),
        crop_offset=part(view.crop_offset),
    )


def _size(view: View, factor: int) -> str:
    return "x".join(str(side // factor) for side in view.crop_size)
