"""Pictures of light made small enough to stand in a page, and so that a few lines read them.

Light is divided by a power of two and rounded to halves of which the lowest bits are dropped, so
that what is left is the same part of the light wherever it is, as in a logarithm. Of these whole
numbers green stays, red and blue stand beside it; of each channel only what its neighbours above
and to the left do not tell is written: the numbers' lower bytes, then their upper ones, deflated.
The page's reader is `unpack.js`.
"""

import zlib
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Floats

#: The brightest light of a picture as halves: 24 stops below it are as precise.
BRIGHTEST = 1024.0

#: Effort of deflating: 6, the usual, takes off another 4 % in twice the time.
EFFORT = 3

#: Bits of halves that are dropped: the 7 that stay tell light to 1/256, half of that on average.
DROPPED = 3


@dataclass(frozen=True)
class Compact:
    """An (h, w, 3) picture of light >= 0. scale: what its halves are multiplied by."""

    data: bytes
    scale: float
    dropped: int
    size: tuple[int, int]


def compact(image: Floats, *, dropped: int = DROPPED) -> Compact:
    """A picture (h, w, 3) of light, made small."""
    brightest = float(image.max(initial=0))
    scale = 2.0 ** np.ceil(np.log2(brightest / BRIGHTEST)) if brightest > 0 else 1.0
    halves = np.asarray(np.clip(image / scale, 0, 65504), np.float16).view(np.uint16)
    # Halves >= 0 are in the order of their bits, and so is what is rounded of them.
    codes = (halves.astype(np.int32) + (1 << dropped >> 1)) >> dropped
    red, green, blue = np.moveaxis(codes, -1, 0)
    planes = np.stack([green, red - green, blue - green])
    rest = planes - _foretold(planes)
    folded = np.asarray((rest << 1) ^ (rest >> 31), np.uint16)
    whole = np.concatenate([(folded & 255).ravel(), (folded >> 8).ravel()]).astype(np.uint8)
    height, width = image.shape[:2]
    return Compact(zlib.compress(whole.tobytes(), EFFORT), float(scale), dropped, (height, width))


def expanded(its: Compact) -> Floats:
    """The picture of it, (h, w, 3) float32."""
    height, width = its.size
    whole = np.frombuffer(zlib.decompress(its.data), np.uint8).astype(np.int32)
    folded = (whole[: whole.size // 2] | whole[whole.size // 2 :] << 8).reshape(3, height, width)
    rest = (folded >> 1) ^ -(folded & 1)
    planes = np.zeros((3, height + 1, width + 1), np.int32)
    for y in range(1, height + 1):
        for x in range(1, width + 1):
            near = planes[:, y, x - 1], planes[:, y - 1, x], planes[:, y - 1, x - 1]
            planes[:, y, x] = rest[:, y - 1, x - 1] + _middle(*near)
    green, red, blue = planes[:, 1:, 1:]
    codes = np.stack([red + green, green, blue + green], axis=-1)
    halves = np.asarray(codes << its.dropped, np.uint16).view(np.float16)
    return np.asarray(halves.astype(np.float32) * np.float32(its.scale))


def _foretold(planes: npt.NDArray[np.int32]) -> npt.NDArray[np.int32]:
    """What the neighbours of each number say of it, (3, h, w); beyond the border there is 0."""
    around = np.pad(planes, ((0, 0), (1, 0), (1, 0)))
    return np.asarray(_middle(around[:, 1:, :-1], around[:, :-1, 1:], around[:, :-1, :-1]))


def _middle(left: Any, above: Any, corner: Any) -> Any:
    """The predictor of JPEG-LS: a plane through the three, kept between the two beside."""
    return np.clip(left + above - corner, np.minimum(left, above), np.maximum(left, above))
