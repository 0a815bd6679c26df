"""Washes: the patches of light that people compare, instead of pixels.

A wash is a picture as the display shows it, blurred by a fortieth of its width, so that noise, the
texture of paint and the edges of a brush vanish. The wash of an area contains no light from beside
it: it is B(a·x) / B(a) with the blur B, the area a and the picture x.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from lightpaint.arrays import Bools, Doubles, Floats
from lightpaint.colour import ViewTransform, lab
from lightpaint.images import block_mean, fitting_factor
from lightpaint.lighting.display import display_light
from lightpaint.threads import one_thread

#: Standard deviation of the blur, relative to the width of the picture.
BLUR = 1 / 40

#: Largest side of the pictures before they are blurred.
MAX_SIDE = 160

#: L* from which a place is lit.
LIT = 5.0


class AreaWashes(NamedTuple):
    """The washes of an area.

    now, asked, got: (h, w, 3), light of the current look, the painting and the answer, white = 1.
    weight: (h, w), how much of the area lies there, in pixels of the picture; 0 where it is lit in
    none of the three.
    """

    now: Doubles
    asked: Doubles
    got: Doubles
    weight: Doubles

    @property
    def lit_pixels(self) -> float:
        """The lit part of the area, in pixels of the picture."""
        return float(self.weight.sum())


@dataclass(frozen=True)
class Washes:
    """The pictures of one view before they are blurred.

    light: (3, h, w, 3), of the current look, the painting and the answer, as the display shows
    them. share: (h, w), 0 where an emitter is in view and not painted. factor: pixels of the view
    along the side of one of these.
    """

    light: Doubles
    share: Doubles
    factor: int

    @staticmethod
    def of(
        now: Floats, asked: Floats, got: Floats, *, counts: Bools, transform: ViewTransform
    ) -> "Washes":
        """Return the washes of three pictures, (h, w, 3) linear each.

        counts: (h, w), the pixels that count. transform: that of the display.
        """
        height, width = counts.shape
        factor = fitting_factor((height, width), -(-max(height, width) // MAX_SIDE))
        mask = counts.astype(np.float32)
        share = block_mean(mask, factor).astype(np.float64)
        safe = np.where(share > 0, share, 1)[..., None]
        means = [block_mean(mask[..., None] * x, factor) / safe for x in (now, asked, got)]
        return Washes(display_light(np.stack(means), transform), share, factor)

    @cached_property
    def whole(self) -> AreaWashes:
        """The washes of the whole view."""
        return self._washes(*self._whole_sums)

    def of_area(self, area: Floats) -> tuple[AreaWashes, AreaWashes]:
        """Return the washes of an area, (h, w) from 0 to 1 at the size of the view, and of the
        rest.
        """
        sums, weight = self._sums(block_mean(area, self.factor).astype(np.float64))
        whole_sums, whole_weight = self._whole_sums
        rest = np.maximum(whole_sums - sums, 0), np.maximum(whole_weight - weight, 0)
        return self._washes(sums, weight), self._washes(*rest)

    @cached_property
    def _whole_sums(self) -> tuple[Doubles, Doubles]:
        return self._sums(np.ones(self.share.shape))

    @cached_property
    def _blurs(self) -> tuple[Doubles, Doubles]:
        height, width = self.share.shape
        return _blur_matrix(height, BLUR * width), _blur_matrix(width, BLUR * width)

    def _sums(self, area: Doubles) -> tuple[Doubles, Doubles]:
        """Return B(a·x) of the three pictures, (3, h', w', 3), and B(a), (h', w')."""
        rows, columns = self._blurs
        counted = area * self.share
        # One channel after the other, which takes a fifth of the time of one array of all.
        channels = np.ascontiguousarray(np.moveaxis(self.light, -1, 0)) * counted
        planes = [counted, *channels.reshape(-1, *counted.shape)]
        with one_thread():
            weight, *blurred = [rows @ plane @ columns.T for plane in planes]
        sums = np.reshape(blurred, (3, 3, *blurred[0].shape))
        return np.moveaxis(sums, 0, -1), weight

    def _washes(self, sums: Doubles, weight: Doubles) -> AreaWashes:
        known = weight > 1e-6
        now, asked, got = sums / np.where(known, weight, 1)[..., None]
        brightest = np.max([now, asked, got], axis=0)
        is_lit = known & (lab(brightest)[..., 0] >= LIT)
        return AreaWashes(now, asked, got, self.factor**2 * np.where(is_lit, weight, 0))


def _blur_matrix(length: int, sigma: float) -> Doubles:
    """Return the matrix that blurs values, (length,), and samples them once per `sigma`.

    It keeps their sum.
    """
    step = max(int(sigma), 1)
    samples = np.arange((step - 1) / 2, length, step)
    kernel = np.exp(-0.5 * ((samples[:, None] - np.arange(length)) / max(sigma, step / 2)) ** 2)
    return np.asarray(kernel / kernel.sum(axis=0))
