"""The channels of the part of a light in a basis file, of all pixels or of its lit pixels; and rows
of the latter (see file_parts.py).
"""

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Floats, Indices, as_singles, round_to_halves
from lightpaint.errors import BasisError
from lightpaint.images import HALF_DIFFERENCE
from lightpaint.images.formats import PartLayout, RowFile

#: Channels of each light: its image and its noise.
IMAGE_CHANNELS, NOISE_CHANNELS = (*"RGB",), (*(f"{HALF_DIFFERENCE}.{c}" for c in "RGB"),)
LIGHT_CHANNELS = {*IMAGE_CHANNELS, *NOISE_CHANNELS}

#: Channels of the indirect part of image and noise, if it is stored separately.
INDIRECT_IMAGE_CHANNELS = (*(f"indirect.{c}" for c in "RGB"),)
INDIRECT_NOISE_CHANNELS = (*(f"indirect_{HALF_DIFFERENCE}.{c}" for c in "RGB"),)
INDIRECT_CHANNELS = {*INDIRECT_IMAGE_CHANNELS, *INDIRECT_NOISE_CHANNELS}

#: Channels of all planes that a light may have.
PLANE_CHANNELS = (IMAGE_CHANNELS, NOISE_CHANNELS, INDIRECT_IMAGE_CHANNELS, INDIRECT_NOISE_CHANNELS)

#: The channel of a part with only lit pixels that has the steps between them.
STEP = "step"

#: Prefixes of the channels of image and ratios, of all light and of indirect light.
PREFIXES = (("", "half_ratio."), ("indirect.", "indirect_half_ratio."))

#: All channels of a part with indirect light.
LIT_CHANNELS = {STEP, *(f"{prefix}{c}" for pair in PREFIXES for prefix in pair for c in "RGB")}

#: Bits of half floats: the sign, and the number 1.
_SIGN, _ONE = np.uint16(0x8000), np.float16(1).view(np.uint16)


def has_indirect_channels(names: Collection[str]) -> bool:
    """Return whether the part of a light with these channels has its indirect light."""
    wanted = LIT_CHANNELS if is_lit_part(names) else INDIRECT_CHANNELS
    return wanted <= {*names}


def channels_of_plane(number: int) -> tuple[list[str], list[str]]:
    """Return the channels of the image and, if it is a half difference, the ratios of a plane.

    number: index into `PLANE_CHANNELS`.
    """
    image, ratios = ([f"{prefix}{c}" for c in "RGB"] for prefix in PREFIXES[number // 2])
    return image, ratios if number % 2 else []


def is_lit_part(channels: Collection[str]) -> bool:
    """Return whether a part with these channels holds the lit pixels of a light."""
    return STEP in channels


def noise_numbers(
    light: npt.NDArray[np.float16], ratios: npt.NDArray[np.float16]
) -> npt.NDArray[np.float16]:
    """Return the stored numbers of a half difference from those that its image has, and ratios."""
    bits, of_ratios = light.view(np.uint16), ratios.view(np.uint16)
    # Most ratios are 1 or −1, which change the sign alone.
    numbers = bits ^ (of_ratios & _SIGN)
    others = np.flatnonzero((of_ratios & ~_SIGN) != _ONE)
    products = as_singles(light.reshape(-1)[others]) * as_singles(ratios.reshape(-1)[others])
    numbers.reshape(-1)[others] = round_to_halves(products).view(np.uint16)
    return numbers.view(np.float16)


def lit_pixels(steps: npt.NDArray[np.float16], size: tuple[int, int]) -> npt.NDArray[np.uint32]:
    """Return the lit pixels of a part, in row-major order. Raises BasisError if damaged."""
    counted = as_singles(steps[: np.count_nonzero(steps)])
    # Half floats that are whole are far within the range of integers.
    whole = np.where(np.isfinite(counted), counted, 0).astype(np.int64)
    pixels = np.cumsum(whole) - 1
    is_valid = (whole == counted).all() and (whole > 0).all()
    if not is_valid or (whole.size and pixels[-1] >= size[0] * size[1]):
        raise BasisError("the steps between the lit pixels of a light are wrong")
    return pixels.astype(np.uint32)


@dataclass(frozen=True)
class LitRows:
    """Places of the rows of a picture in a part with lit pixels.

    begins: (h + 1,), the first lit pixel of each row in the list of them. before: (rows of the
    part,), the pixel of the picture at which the steps in each of them begin.
    """

    begins: Indices
    before: Indices

    @classmethod
    def of(cls, file: RowFile, part: PartLayout) -> "LitRows":
        """Return the rows of a part, of which all steps are read."""
        steps = np.empty((1, *part.size), np.float32)
        file.read_rows(part, 0, part.size[0], [STEP], steps)
        pixels = lit_pixels(steps.astype(np.float16).reshape(-1), part.display).astype(np.intp)
        height, width = part.display
        begins = np.searchsorted(pixels, width * np.arange(height + 1))
        return cls(begins, np.concatenate([[-1], pixels[width - 1 :: width]]))

    def read(self, file: RowFile, part: PartLayout, rows: slice, number: int, into: Floats) -> None:
        """Read rows of the picture into (3, rows, w), as stored. number: of the plane."""
        into[...] = 0
        first, last = (int(x) for x in self.begins[[rows.start, rows.stop]])
        if first == last:
            return
        width = part.display[1]
        top, bottom = first // width, -(-last // width)
        image, ratios = channels_of_plane(number)
        names = [STEP, *image, *ratios]
        block = np.empty((len(names), bottom - top, width), np.float32)
        file.read_rows(part, top, bottom, names, block)
        flat = block.reshape(len(names), -1)
        pixels = self.before[top] + np.cumsum(flat[0].astype(np.intp))
        listed = slice(first - top * width, last - top * width)
        values = flat[1:4, listed]
        if ratios:
            of_noise = noise_numbers(
                values.astype(np.float16), flat[4:7, listed].astype(np.float16)
            )
            values = as_singles(of_noise)
        y, x = np.divmod(pixels[listed], width)
        into[:, y - rows.start, x] = values
