"""The arrays of a target, and their means at other sizes."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from lightpaint.arrays import Bools, Floats
from lightpaint.images.pixel_blocks import block_mean
from lightpaint.images.resampling import resampled

#: Margin above one half by which a share prevails, beyond float32 rounding.
TIE = 1e-5


class TargetPixels(NamedTuple):
    """The painted image with the weight of each pixel, and where brighter is as good.

    image: (h, w, 3) float32, linear. importance: (h, w) float32 >= 0. at_least: (h, w, 3) bool, or
    None for nowhere.
    """

    image: Floats
    importance: Floats
    at_least: Bools | None

    def resampled(self, size: tuple[int, int]) -> "TargetPixels":
        """Return these pixels at `size` (height, width), in linear light, weighted by importance.

        The importance is resampled too.
        """
        weighted = np.dstack([self.image * self.importance[..., None], self.importance])
        *rgb, importance = np.moveaxis(resampled(weighted, size), -1, 0)
        image = np.dstack(rgb) / np.where(importance > 0, importance, 1)[..., None]
        at_least = self._mean_at_least(lambda planes: resampled(planes, size))
        return TargetPixels(image, importance, at_least)

    def averaged(self, factor: int) -> "TargetPixels":
        """Return the means over blocks of factor × factor pixels, weighted by importance.

        The importance of a block is the mean over its pixels. For images that are constant in each
        block, the squared residual stays the same up to a constant.
        """
        importance = block_mean(self.importance, factor)
        weighted = block_mean(self.image * self.importance[..., None].astype(np.float64), factor)
        image = weighted / np.where(importance > 0, importance, 1)[..., None]
        at_least = self._mean_at_least(lambda planes: block_mean(planes, factor))
        return TargetPixels(image.astype(np.float32), importance, at_least)

    def cropped(self, height: int, width: int) -> "TargetPixels":
        """Return the top left part, of this size."""
        part = (slice(height), slice(width))
        at_least = None if self.at_least is None else self.at_least[part]
        return TargetPixels(self.image[part], self.importance[part], at_least)

    def _mean_at_least(self, mean: Callable[[Floats], Floats]) -> Bools | None:
        """Return `at_least` at another size, whose pixels are the `mean` of these.

        Light brighter than such a mean is acceptable if most of its pixels mean "at least", or if
        it contains part of a patch that does: then the excess lies in the patch, since a lamp
        outshines its surroundings. Single pixels are texture: there, light brighter than the mean
        would exceed the exact pixels between them.
        """
        if self.at_least is None:
            return None
        importance = self.importance[..., None]
        share = mean(self.at_least * importance)
        prevails = share > (0.5 + TIE) * mean(importance)
        patch = _patches(self.at_least) & (importance > 0)
        return np.asarray(prevails | (mean(patch.astype(np.float32)) > 0))


def _patches(mask: Bools) -> Bools:
    """Return `mask` (h, w, n) without parts narrower than three pixels: its opening by 3 × 3."""
    core = ~_grown(~mask)
    return _grown(core) & mask


def _grown(mask: Bools) -> Bools:
    """Return whether each pixel or one of its eight neighbours is set."""
    for axis in (0, 1):
        lines = np.moveaxis(mask, axis, 0)
        grown = lines.copy()
        grown[1:] |= lines[:-1]
        grown[:-1] |= lines[1:]
        mask = np.moveaxis(grown, 0, axis)
    return mask
