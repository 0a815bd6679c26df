"""Colours that a light may have: mixes of given colours, or the whites between two temperatures.

Mixes are a polygon in CIE 1976 (u', v'). There the mixes of two lights lie on the straight line
between them, so mixes of colours in a convex polygon stay in it. The polygon is described by its
extent in a fixed set of directions.

Whites are the part of Planck's locus between two temperatures, as a polyline. The locus is curved,
and the straight line between two distant whites lies off it, towards pink: halfway between 2200 K
and 9000 K by 0.015 in Duv. Between whites that are `STEP` apart the deviation is neither visible
nor measurable.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import ceil

import numpy as np

from lightpaint.arrays import Doubles, Floats
from lightpaint.colour.color import kelvin_to_rgb, luminance, uv_of, xyz_of
from lightpaint.colour.primaries import REC709, rgb_to_xyz

#: Directions in which a polygon is bounded, in degrees; denser where the curve of whites bounds it
#: towards green.
DEGREES = (0, 30, 60, 90, 120, 135, 150, 165, 180, 210, 240, 270, 300, 330)

#: The same directions as unit vectors, (k, 2).
DIRECTIONS = np.stack([np.cos(np.deg2rad(DEGREES)), np.sin(np.deg2rad(DEGREES))], axis=1)

#: Distance beyond a bound, in (u', v'), that counts as round-off.
ROUND_OFF = 1e-9

#: Maximum step between neighbouring whites, in mireds. The chord is less than 3e-5 off the locus,
#: and neighbours differ by less than two just noticeable steps.
STEP = 8.0


def chromaticity(rgb: Floats) -> Doubles:
    """Return CIE 1976 (u', v'), (…, 2), of linear Rec.709 colours (…, 3) that are not black."""
    return np.asarray(uv_of(np.asarray(rgb, np.float64) @ rgb_to_xyz(REC709).T) * [1, 1.5])


def reach_of(rgb: Floats) -> Doubles:
    """Return the extent (k,) of linear colours (n, 3) in each direction."""
    return np.asarray((chromaticity(rgb) @ DIRECTIONS.T).max(axis=0))


def sides_of(reach: Doubles) -> Doubles:
    """Return linear functions of light, (…, k, 3), that are >= 0 within a reach (…, k).

    u' = 4 X / W and v' = 9 Y / W with W = X + 15 Y + 3 Z, so that d·(u', v') <= r is
    r W - 4 d₁ X - 9 d₂ Y >= 0.
    """
    X, Y, _ = to_xyz = rgb_to_xyz(REC709)
    W = np.array([1.0, 15.0, 3.0]) @ to_xyz
    x, y = DIRECTIONS.T
    return np.asarray(reach[..., None] * W - np.outer(4 * x, X) - np.outer(9 * y, Y), np.float64)


@dataclass(frozen=True, eq=False)
class ColorHull:
    """A set of colours: those that extend no further than `reach`, (k,), in each direction.

    own: (3,), linear, one of these colours.
    """

    reach: Doubles
    own: Doubles

    @cached_property
    def primaries(self) -> Doubles:
        """Colours (m, 3), linear Rec.709 with luminance 1, whose non-negative mixes are the hull.

        The hull is clipped to Rec.709.
        """
        # Of a dozen corners, in numbers of Python: an array for each takes ten times as long.
        corners = [(u, v) for u, v in chromaticity(np.eye(3)).tolist()]
        for direction, reach in zip(DIRECTIONS.tolist(), self.reach.tolist(), strict=True):
            corners = _cut(corners, direction, reach)
        xyz = np.array([xyz_of((u, v / 1.5)) for u, v in corners])
        rgb: Doubles = np.maximum(np.linalg.solve(rgb_to_xyz(REC709), xyz.T).T, 0)
        rgb /= luminance(rgb)[:, None]
        return rgb

    @cached_property
    def middle(self) -> Doubles:
        """The colour in the middle of the corners, (3,), linear with luminance 1."""
        return np.asarray(self.primaries.mean(axis=0))

    def fan(self, side: int) -> Doubles:
        """Return the colours at the corners, (3, 3), of the triangle between a side and the centre.

        Each colour of the hull is a mix of the three colours of one triangle; on the boundary, of
        two.
        """
        primaries = self.primaries
        return np.stack(
            [
                self.middle,
                primaries[side % len(primaries)],
                primaries[(side + 1) % len(primaries)],
            ]
        )

    def side_towards(self, rgb: Doubles) -> int:
        """Return the side whose triangle, or the sector beyond it, contains a linear colour (3,);
        the first for black, which is in all of them.
        """
        if not rgb.any():
            return 0
        middle, to_corners = self._corners_from_middle
        to_color = chromaticity(rgb) - middle
        turn = _cross(to_corners, to_color)
        facing = _cross(to_corners, np.roll(to_corners, -1, axis=0)).sum()
        # The colour is to the left of one end of that side, and to the right of the other.
        left = turn * facing >= 0
        sides = np.flatnonzero(left & ~np.roll(left, -1))
        return int(sides[0]) if sides.size else 0

    @cached_property
    def _corners_from_middle(self) -> tuple[Doubles, Doubles]:
        """The chromaticity of the centre, (2,), and the directions from there to the corners."""
        middle = chromaticity(self.middle)
        return middle, chromaticity(self.primaries) - middle

    @cached_property
    def _sides(self) -> Doubles:
        return sides_of(self.reach)

    def has(self, rgb: Doubles) -> bool:
        """Return True if the hull contains the colour of a light (3,), linear; every hull contains
        black.
        """
        return bool((self._sides @ rgb >= -ROUND_OFF * rgb.sum()).all())

    def nearest(self, rgb: Doubles) -> Doubles:
        """Return a light (3,), linear, mixed with the hull's own colour until it is inside, at the
        same luminance.
        """
        if self.has(rgb):
            return rgb
        room, own = self._sides @ rgb, self._sides @ self.own
        beyond = (room < 0) & (own > 0)
        # This much of the hull's own colour brings it within all sides.
        mixture = rgb + float(np.max(-room[beyond] / own[beyond], initial=0.0)) * self.own
        return np.asarray(mixture * (luminance(rgb) / luminance(mixture)), np.float64)


def _cross(first: Doubles, second: Doubles) -> Doubles:
    """Return the cross products of vectors (…, 2)."""
    return np.asarray(first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0])


def _cut(
    corners: Sequence[tuple[float, float]], direction: Sequence[float], reach: float
) -> list[tuple[float, float]]:
    """Return the part of a convex polygon within `reach` (Sutherland–Hodgman)."""
    x, y = direction
    room = [reach - x * u - y * v for u, v in corners]
    kept = []
    for k, ((u, v), left) in enumerate(zip(corners, room, strict=True)):
        if left >= 0:
            kept.append((u, v))
        (next_u, next_v), other = corners[(k + 1) % len(corners)], room[(k + 1) % len(corners)]
        if left * other < 0:
            part = left / (left - other)
            kept.append((u + (next_u - u) * part, v + (next_v - v) * part))
    return kept


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
