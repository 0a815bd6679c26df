"""Lamps whose glowing parts the camera sees, and the colours that are painted on these.

A flame, a bulb or a skylight in view shows the colour of its lamp to everybody. Such a lamp must
not turn blue to make up for what others spill on the table beside it: its colours are its own, the
one that is painted on its glow, and the one that is painted where it shines.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import ceil
from typing import Self

import numpy as np

from lightpaint.arrays import Bools, Doubles, Floats, Indices
from lightpaint.basis import Basis, array_name, array_once
from lightpaint.colour import luminance

#: A painting (h, w, 3), linear, its importance (h, w), and where brighter is as good, (h, w, 3), or
#: None for nowhere.
GlowPaint = tuple[Floats, Floats, Bools | None]

#: Parameters of lights without a surface, which no camera sees.
WITHOUT_SURFACE = frozenset({"intensity", "irradiance"})

#: Share of the light of a pixel from which on it shows the glow of one lamp.
GLOW_SHARE = 0.5

#: Light of a lamp's glow, relative to the mean of the look, from which on its colour is noticed.
LEAST_GLOW = 1.0

#: Pixels that are sampled, about.
MAX_GLOW_PIXELS = 2**11


@dataclass(frozen=True)
class Glow:
    """Pixels of a view in which a lamp itself is seen.

    pixels: (p,), row-major. lamp: (p,), the number of the lamp in each. light: (p, 3), linear, as
    they are now.
    """

    pixels: Indices
    lamp: Indices
    light: Doubles

    @classmethod
    def of(cls, basis: Basis, current: Doubles) -> Self:
        """Find the pixels. current: (n, 3), the present weights of the lights."""
        pixels, rows = light_of_emitters_seen(basis)
        rows = np.maximum(rows.astype(np.float64) * current[:, None], 0)
        light = np.asarray(luminance(rows), np.float64)
        lamp, total = light.argmax(axis=0), light.sum(axis=0)
        has_surface = np.array([x.parameter not in WITHOUT_SURFACE for x in basis.lights], bool)
        others = ~basis.emitters_seen
        mean = float(luminance(basis.current_look[others].mean(axis=0))) if others.any() else 0.0
        glows = (light.max(axis=0, initial=0) > GLOW_SHARE * total) & has_surface[lamp]
        glows &= total > LEAST_GLOW * mean
        return cls(pixels[glows], lamp[glows], rows[:, glows].sum(axis=0))

    def sums(self, paint: GlowPaint, count: int) -> tuple[Doubles, Doubles]:
        """Return the light that is painted on the glow of each of `count` lamps, and what is there
        now under this paint, (n, 3) each. Where brighter is as good, no colour is painted.
        """
        image, importance, at_least = paint
        weight = importance.ravel()[self.pixels].astype(np.float64)[:, None]
        if at_least is not None:
            weight *= ~at_least.reshape(-1, 3)[self.pixels].any(axis=1, keepdims=True)
        sums = np.zeros((2, count, 3))
        np.add.at(sums[0], self.lamp, weight * image.reshape(-1, 3)[self.pixels])
        np.add.at(sums[1], self.lamp, weight * self.light)
        return sums[0], sums[1]


def light_of_emitters_seen(basis: Basis) -> tuple[Indices, Floats]:
    """Return some pixels in which emitters are seen, (p,), and the light in them, (n, p, 3)."""
    pixels, planes = np.flatnonzero(basis.emitters_seen), basis.planes
    pixels = pixels[:: max(1, ceil(pixels.size / MAX_GLOW_PIXELS))]
    return pixels, array_once(planes, array_name("pixels", pixels), lambda: planes.pixels(pixels))


@dataclass(frozen=True)
class LampsInView:
    """The lamps that are seen in any of several views.

    glows: of each view. current: (n, 3), the present weights of the lights. paintings: returns the
    painting of each view. around: returns the light of each lamp with the mean change that is
    painted where it shines, (n, 3).
    """

    glows: tuple[Glow, ...]
    current: Doubles
    paintings: Callable[[], Sequence[GlowPaint]]
    around: Callable[[], Doubles]

    @classmethod
    def of(
        cls,
        bases: Sequence[Basis],
        current: Doubles,
        paintings: Callable[[], Sequence[GlowPaint]],
        around: Callable[[], Doubles],
    ) -> Self:
        """Find the lamps in views of the same lights."""
        return cls(tuple(Glow.of(x, current) for x in bases), current, paintings, around)

    @cached_property
    def lamps(self) -> Bools:
        """(n,), which lamps these are."""
        counts = [np.bincount(x.lamp, minlength=len(self.current)) for x in self.glows]
        return np.asarray(np.sum(counts, axis=0) > 0)

    def painted(self) -> Doubles:
        """Return the light of each lamp that is painted on its glow, and where it shines,
        (n, 2, 3); its own without paint.
        """
        count, paintings = len(self.current), self.paintings()
        found = [glow.sums(x, count) for glow, x in zip(self.glows, paintings, strict=True)]
        painted, now = np.sum(found, axis=0)
        is_painted = (now > 0).all(axis=1) & (painted > 0).all(axis=1)
        ratio = np.where(is_painted[:, None], painted, 1) / np.where(is_painted[:, None], now, 1)
        return np.stack([self.current * ratio, self.around()], axis=1)
