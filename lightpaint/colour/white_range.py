"""Ranges of white: the part of Planck's locus between two temperatures, as a polyline.

The locus is curved, and the straight line between two distant whites lies off it, towards pink:
halfway between 2200 K and 9000 K by 0.015 in Duv. Between whites that are `STEP` apart the
deviation is neither visible nor measurable.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import ceil

import numpy as np

from lightpaint.arrays import Doubles, Floats
from lightpaint.colour.color import kelvin_to_rgb, luminance, uv_of
from lightpaint.colour.primaries import REC709, rgb_to_xyz

#: Maximum step between neighbouring whites, in mireds. The chord is less than 3e-5 off the locus,
#: and neighbours differ by less than two just noticeable steps.
STEP = 8.0


@dataclass(frozen=True)
class WhiteRange:
    """The whites between two temperatures.

    low, high: in kelvin. duv: their distance from Planck's locus in CIE 1960 (u, v), positive
    towards green.
    """

    low: float
    high: float
    duv: float = 0.0

    @cached_property
    def mireds(self) -> Doubles:
        """Mireds of the whites, (k,), from the warmest to the coolest, both ends included."""
        warm, cool = 1e6 / self.low, 1e6 / self.high
        return np.linspace(warm, cool, 1 + max(1, ceil((warm - cool) / STEP)))

    @cached_property
    def colors(self) -> Doubles:
        """Colours of the whites, (k, 3), linear Rec.709 with luminance 1; negative blue becomes
        0.
        """
        kelvin = [self.low, *(1e6 / self.mireds[1:-1]).tolist(), self.high]
        return np.array([kelvin_to_rgb(float(x), self.duv) for x in kelvin])

    @property
    def last(self) -> int:
        """Index of the coolest white."""
        return len(self.mireds) - 1

    @cached_property
    def _uv(self) -> Doubles:
        return uv_of(self.colors @ rgb_to_xyz(REC709).T)

    @cached_property
    def _tristimulus(self) -> Doubles:
        """X + 15 Y + 3 Z of the whites, (k,): their weights when mixing in (u, v)."""
        return np.asarray(self.colors @ rgb_to_xyz(REC709).T @ np.array([1.0, 15.0, 3.0]))

    def places(self, rgb: Floats) -> Doubles:
        """Return places of the nearest whites in CIE 1960 (u, v), (n,): k + t between k and k + 1.

        rgb: (n, 3), linear, >= 0. Black maps to the middle.
        """
        rgb = np.asarray(rgb, np.float64)
        lit = rgb.max(axis=1) > 0
        uv = uv_of(np.where(lit[:, None], rgb, 1.0) @ rgb_to_xyz(REC709).T)
        segments = np.diff(self._uv, axis=0)
        offsets = uv[:, None] - self._uv[:-1]
        part = np.clip((offsets * segments).sum(axis=2) / np.square(segments).sum(axis=1), 0, 1)
        distance = np.square(offsets - part[..., None] * segments).sum(axis=2)
        k = np.argmin(distance, axis=1)
        # Convert the fraction of the distance in (u, v) to a fraction of the light.
        t = np.take_along_axis(part, k[:, None], axis=1)[:, 0]
        first, second = (1 - t) / self._tristimulus[k], t / self._tristimulus[k + 1]
        return np.where(lit, k + second / (first + second), self.last / 2)

    def at(self, places: Doubles) -> Doubles:
        """Return the whites at these positions, (n,), as linear colours (n, 3) with luminance 1."""
        k = np.minimum(places.astype(np.intp), self.last - 1)
        part = (places - k)[:, None]
        return np.asarray((1 - part) * self.colors[k] + part * self.colors[k + 1])

    def nearest(self, rgb: Floats) -> Doubles:
        """Return the whites nearest to linear colours (n, 3), with the same luminance."""
        return np.asarray(np.asarray(luminance(rgb))[:, None] * self.at(self.places(rgb)))

    def greener(self, rgb: Floats) -> Doubles:
        """Return the Duv, (n,), by which colours (n, 3) are greener than the nearest white.

        Negative values are pinker; black gives 0.
        """
        rgb = np.asarray(rgb, np.float64)
        lit = rgb.max(axis=1) > 0
        places = self.places(rgb)
        k = np.minimum(places.astype(np.intp), self.last - 1)
        # Towards cooler whites, green is to the right of the locus.
        tangents = np.diff(self._uv, axis=0)[k]
        normals = (
            np.stack([tangents[:, 1], -tangents[:, 0]], axis=1) / np.hypot(*tangents.T)[:, None]
        )
        to_xyz = rgb_to_xyz(REC709).T
        offset = uv_of(np.where(lit[:, None], rgb, 1.0) @ to_xyz) - uv_of(self.at(places) @ to_xyz)
        return np.where(lit, (offset * normals).sum(axis=1), 0.0)

    def window(self, place: float, width: int) -> tuple[int, int]:
        """Return the first and last white of a window of `width` pieces around a position, within
        the range.
        """
        width = min(width, self.last)
        first = min(max(round(place - width / 2), 0), self.last - width)
        return first, first + width

    def tangent(self, window: tuple[int, int], reach: float) -> Doubles:
        """Return the line of a window extended by `reach` mireds at both ends, within the range.

        The result is its end points, (2, 3) linear, with luminance 1 and never negative.
        """
        first, last = window
        a, b = self.colors[first], self.colors[last]
        per_mired = (b - a) / (self.mireds[first] - self.mireds[last])
        backwards = min(reach, float(self.mireds[0] - self.mireds[first]))
        step = min(reach, float(self.mireds[last] - self.mireds[-1]))
        return np.stack(
            [_moved_color(a, -backwards * per_mired), _moved_color(b, step * per_mired)]
        )


@lru_cache(64)
def white_range(low: float, high: float, duv: float = 0.0) -> WhiteRange:
    """Return the range, cached with its whites. Raises ColorError like `kelvin_to_rgb`."""
    whites = WhiteRange(low, high, duv)
    whites.colors.setflags(write=False)
    return whites


def _moved_color(color: Doubles, direction: Doubles) -> Doubles:
    """Return a colour (3,) moved by `direction`, (3,), as far as all channels stay >= 0."""
    with np.errstate(divide="ignore"):
        room = np.where(direction < 0, color / np.where(direction < 0, -direction, 1), np.inf)
    return np.asarray(np.maximum(color + min(1.0, float(room.min())) * direction, 0))
