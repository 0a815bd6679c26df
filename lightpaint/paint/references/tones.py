"""The light of a picture by areas: brightness and colour, without its detail."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Bools, Doubles, Floats
from lightpaint.colour import luminance
from lightpaint.images import resampled
from lightpaint.paint.presets.view_areas import soft_bands, soft_spot

#: Pixels of the longer side of the picture in which light is compared: smaller detail is no light.
TONE_SIDE = 64

#: Stops below the bright quarter of a picture at which all is equally dark: 8 bits tell no more.
DARKEST = 7.0

#: Quantiles of luminance that say how deep shadows are and how high lights.
QUANTILES = (0.1, 0.25, 0.5, 0.75, 0.95, 0.97)

#: Quantiles of luminance from which on parts are the brightest, and up to which they are dark.
LIT_QUANTILE, DARK_QUANTILE = 0.88, 0.35

#: Height and width of the small picture by whose edges two places are distinguished.
DETAIL_SIZE = (24, 36)

#: Stops below the highlights down to which a part is nearly as bright.
NEARLY_BRIGHT = 1.5

#: Share of the picture's width that is its left, and its right.
SIDE = 0.35

#: Share of a side that has to be nearly as bright, to have a key of its own.
LEAST_SIDE = 0.1

#: Power of the mean by which the colour of light is separated from the colour of surfaces
#: (Finlayson and Trezzi 2004): the higher, the more the brightest pixels count, which are of the
#: palest surfaces.
SHADES_POWER = 6.0

Weights = npt.NDArray[np.floating]


@dataclass(frozen=True)
class Tone:
    """Mean light of an area. level: log2 of its luminance. chroma: log2 of RGB over luminance."""

    level: float
    chroma: npt.NDArray[np.float64]


@dataclass(frozen=True)
class LightTones:
    """The light of a picture.

    levels: log2 of luminance at QUANTILES. lit, shadows: (3,), log2 of RGB over luminance of the
    light in its brightest parts, and in its darker ones. sides: the first at its left and at its
    right. bright_share: share of the picture that is nearly as bright as its highlights.
    """

    levels: Doubles
    lit: Doubles
    shadows: Doubles
    sides: tuple[Doubles, Doubles]
    bright_share: float

    @property
    def contrast(self) -> float:
        """Stops from shadows to lit parts."""
        return float(self.levels[-2] - self.levels[1])


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
    def light_tones(self) -> LightTones:
        """The light of the picture."""
        known = self.share > 0.5
        known = known if known.any() else np.ones_like(known)
        levels = self._levels[known]
        bright, dark = (float(np.quantile(levels, x)) for x in (LIT_QUANTILE, DARK_QUANTILE))
        quantiles = np.quantile(levels, QUANTILES)
        across = np.broadcast_to((np.arange(self.size[1]) + 0.5) / self.size[1], self.size)
        is_bright = known & (self._levels > quantiles[-1] - NEARLY_BRIGHT)
        return LightTones(
            quantiles,
            self._illuminant(known & (self._levels >= bright)),
            self._illuminant(known & (self._levels <= dark)),
            (self._side(is_bright, across < SIDE), self._side(is_bright, across > 1 - SIDE)),
            float(is_bright.sum() / known.sum()),
        )

    @property
    def levels(self) -> Doubles:
        """log2 of luminance of each pixel, (h, w)."""
        return self._levels

    @cached_property
    def level(self) -> float:
        """Mean of log2 luminance."""
        return float((self.share * self._levels).sum() / max(float(self.share.sum()), 1e-6))

    def _side(self, is_bright: Bools, side: Bools) -> Doubles:
        """Return the colour of the light, (3,), in the bright parts of a side; of all if it has
        hardly any.
        """
        found = is_bright & side
        return self._illuminant(found if found.sum() >= LEAST_SIDE * side.sum() else is_bright)

    def _illuminant(self, where: Bools) -> Doubles:
        """Return the colour of the light in some pixels, (3,), by shades of grey."""
        light = self._light[where] if where.any() else self._light.reshape(-1, 3)
        means = np.mean((light / float(light.max())) ** SHADES_POWER, axis=0)
        color = np.maximum(means ** (1 / SHADES_POWER), 1e-2)
        return np.asarray(np.log2(color / luminance(color)))

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


def edges(levels: Doubles, size: tuple[int, int]) -> Doubles:
    """Return what a picture of levels, resampled to a size, has beyond its surroundings."""
    planes = np.repeat(levels[..., None], 3, axis=2).astype(np.float32)
    small = resampled(planes, size)[..., 0].astype(np.float64)
    rows, columns = (
        np.abs(np.subtract.outer(np.arange(n), np.arange(n))) <= 2 for n in small.shape
    )
    across = columns / columns.sum(axis=0)
    down = rows / rows.sum(axis=1, keepdims=True)
    return np.asarray(small - down @ small @ across)
