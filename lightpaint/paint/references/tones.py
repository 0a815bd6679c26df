"""The light of a picture by areas: brightness and colour, without its detail."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Bools, Floats
from lightpaint.colour.color import luminance
from lightpaint.images.resampling import resampled
from lightpaint.paint.presets.view_areas import soft_bands, soft_spot

#: Pixels of the longer side of the picture in which light is compared: smaller detail is no light.
TONE_SIDE = 64

#: Stops below the bright quarter of a picture at which all is equally dark: 8 bits tell no more.
DARKEST = 7.0

Weights = npt.NDArray[np.floating]


@dataclass(frozen=True)
class Tone:
    """Mean light of an area. level: log2 of its luminance. chroma: log2 of RGB over luminance."""

    level: float
    chroma: npt.NDArray[np.float64]


class Tones:
    """The light of a picture, to be compared with another picture's.

    Args:
        light: (h, w, 3) linear, of any exposure.
        usable: (h, w), True where it is light on a surface; everywhere by default.
    """

    def __init__(self, light: Floats, usable: Bools | None = None) -> None:
        height, width = light.shape[:2]
        factor = min(1.0, TONE_SIDE / max(height, width))
        self.size = max(1, round(height * factor)), max(1, round(width * factor))
        known = np.ones((height, width), np.float32) if usable is None else usable
        planes = np.dstack([np.asarray(light) * known[..., None], known]).astype(np.float32)
        *rgb, share = np.moveaxis(resampled(planes, self.size).astype(np.float64), -1, 0)
        self.share: Weights = share
        small = np.maximum(np.stack(rgb, axis=-1) / np.maximum(share, 1e-6)[..., None], 0)
        bright = self._quantile(luminance(small), 0.75)
        self._light = small + max(bright, 1e-30) * 2.0**-DARKEST
        self._levels = np.log2(luminance(self._light))

    def tone(self, weights: Weights) -> Tone | None:
        """Return the mean light of pixels with these weights (h, w); None without any."""
        counts = weights * self.share
        total = counts.sum()
        if total < 1e-3:
            return None
        levels = self._levels
        chroma = np.log2(self._light) - levels[..., None]
        shares = counts / total
        return Tone(float((shares * levels).sum()), np.einsum("yx,yxc->c", shares, chroma))

    @cached_property
    def whole(self) -> Weights:
        """All pixels."""
        return np.ones(self.size)

    @cached_property
    def lit(self) -> Weights:
        """The brighter half."""
        return (self._levels >= self._quantile(self._levels, 0.5)).astype(float)

    @cached_property
    def shadows(self) -> Weights:
        """The darker half."""
        return 1 - self.lit

    @property
    def bands(self) -> tuple[Weights, Weights, Weights]:
        """The upper part of the picture, its middle, and its lower part."""
        return soft_bands(self.size)

    def around(self, x: float, y: float, radius: float) -> Weights:
        """Return a soft spot. x, y: its place, 0 to 1. radius: in longer sides."""
        return soft_spot(self.size, x, y, radius)

    def _quantile(self, values: npt.NDArray[np.floating], share: float) -> float:
        known = values[self.share > 0.5]
        return float(np.quantile(known, share)) if known.size else 0.0
