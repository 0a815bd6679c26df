"""Pictures of light packed for a page: small, and unpacked by a few lines of JavaScript.

Light is divided by a power of two and rounded to half floats whose lowest bits are dropped; the
rounding error is relative, as with a logarithm. Of these integers, green is stored directly, red
and blue as differences from green. Each channel is predicted from its neighbours above and to the
left, and only the residuals are written: their lower bytes, then their upper ones, deflated.
`viewer/mixer/mixer_data.js` reads them in the page.
"""

import zlib
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Floats

#: Brightest value of a picture in half floats; the 24 stops below it have the same precision.
BRIGHTEST = 1024.0

#: Deflate level: the default 6 saves another 4 % but takes twice the time.
DEFLATE_LEVEL = 3

#: Number of low bits of half floats that are dropped: the remaining 7 mantissa bits keep light to
#: 1/256, and to half that on average.
DROPPED_BITS = 3


@dataclass(frozen=True)
class PackedPicture:
    """A packed (h, w, 3) picture of light >= 0. scale: factor of its half floats."""

    data: bytes
    scale: float
    dropped: int
    size: tuple[int, int]


def pack_picture(image: Floats, *, dropped: int = DROPPED_BITS) -> PackedPicture:
    """Pack a picture of light, (h, w, 3)."""
    brightest = float(image.max(initial=0))
    scale = 2.0 ** np.ceil(np.log2(brightest / BRIGHTEST)) if brightest > 0 else 1.0
    halves = np.asarray(np.clip(image / scale, 0, 65504), np.float16).view(np.uint16)
    # Half floats >= 0 are ordered like their bit patterns, so they can be rounded as integers.
    codes = (halves.astype(np.int32) + (1 << dropped >> 1)) >> dropped
    red, green, blue = np.moveaxis(codes, -1, 0)
    planes = np.stack([green, red - green, blue - green])
    residuals = planes - _predicted(planes)
    folded = np.asarray((residuals << 1) ^ (residuals >> 31), np.uint16)
    data = np.concatenate([(folded & 255).ravel(), (folded >> 8).ravel()]).astype(np.uint8)
    height, width = image.shape[:2]
    return PackedPicture(
        zlib.compress(data.tobytes(), DEFLATE_LEVEL), float(scale), dropped, (height, width)
    )


def _predicted(planes: npt.NDArray[np.int32]) -> npt.NDArray[np.int32]:
    """Return the prediction of each number from its neighbours, (3, h, w), with 0 beyond the
    border.
    """
    padded = np.pad(planes, ((0, 0), (1, 0), (1, 0)))
    left, above, corner = padded[:, 1:, :-1], padded[:, :-1, 1:], padded[:, :-1, :-1]
    # As in JPEG-LS: a plane through the three, clamped to the range of the two neighbours.
    lower, upper = np.minimum(left, above), np.maximum(left, above)
    return np.asarray(np.clip(left + above - corner, lower, upper))
