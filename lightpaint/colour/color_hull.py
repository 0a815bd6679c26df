"""Colours that light may have: all mixes of some, as a polygon in CIE 1976 (u', v').

Mixes of two lights lie on the straight line between them there, so that what is mixed of colours
in a convex polygon stays in it. The polygon is given by how far it reaches in some directions.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from lightpaint.arrays import Doubles, Floats
from lightpaint.colour.color import luminance
from lightpaint.colour.planckian_locus import uv_of, xyz_of
from lightpaint.colour.primaries import REC709, rgb_to_xyz

#: Directions in which a polygon is bounded, in degrees: closer where it is the curve of whites that
#: ends it towards green.
DEGREES = (0, 30, 60, 90, 120, 135, 150, 165, 180, 210, 240, 270, 300, 330)

#: The same as vectors, (k, 2), of length 1.
DIRECTIONS = np.stack([np.cos(np.deg2rad(DEGREES)), np.sin(np.deg2rad(DEGREES))], axis=1)

#: Distance beyond a bound that is round-off, in (u', v').
ROUND_OFF = 1e-9


def chromaticity(rgb: Floats) -> Doubles:
    """Return CIE 1976 (u', v'), (…, 2), of linear Rec.709 colours (…, 3) that are not black."""
    return np.asarray(uv_of(np.asarray(rgb, np.float64) @ rgb_to_xyz(REC709).T) * [1, 1.5])


def reach_of(rgb: Floats) -> Doubles:
    """Return how far the farthest of colours (n, 3), linear, reaches in each direction, (k,)."""
    return np.asarray((chromaticity(rgb) @ DIRECTIONS.T).max(axis=0))


def sides_of(reach: Doubles) -> Doubles:
    """Return by what a light has >= 0 that reaches no further than (…, k): linear in it, (…, k, 3).

    u' = 4 X / W and v' = 9 Y / W with W = X + 15 Y + 3 Z, so that d·(u', v') <= r is
    r W - 4 d₁ X - 9 d₂ Y >= 0.
    """
    X, Y, _ = to_xyz = rgb_to_xyz(REC709)
    W = np.array([1.0, 15.0, 3.0]) @ to_xyz
    one, other = DIRECTIONS.T
    return np.asarray(
        reach[..., None] * W - np.outer(4 * one, X) - np.outer(9 * other, Y), np.float64
    )


@dataclass(frozen=True, eq=False)
class ColorHull:
    """A set of colours: those that reach no further than `reach`, (k,), in each direction.

    own: (3,), one of them, linear.
    """

    reach: Doubles
    own: Doubles

    @cached_property
    def primaries(self) -> Doubles:
        """(m, 3), linear Rec.709 of luminance 1, whose mixes with weights >= 0 these are.

        No more than Rec.709 has.
        """
        corners = chromaticity(np.eye(3))
        for direction, reach in zip(DIRECTIONS, self.reach, strict=True):
            corners = _cut(corners, direction, float(reach))
        xyz = np.array([xyz_of((u, v / 1.5)) for u, v in corners])
        rgb: Doubles = np.maximum(np.linalg.solve(rgb_to_xyz(REC709), xyz.T).T, 0)
        rgb /= luminance(rgb)[:, None]
        return rgb

    def fan(self, side: int) -> Doubles:
        """Return the three colours, (3, 3), of the triangle that a side makes with the middle.

        Each of its colours is a mix of three of one triangle, and of two on the boundary.
        """
        its = self.primaries
        return np.stack([its.mean(axis=0), its[side % len(its)], its[(side + 1) % len(its)]])

    def side_towards(self, rgb: Doubles) -> int:
        """Return the side in whose triangle a colour (3,), linear, lies, or beyond which."""
        corners = chromaticity(self.primaries)
        middle = chromaticity(self.primaries.mean(axis=0))
        ways, way = corners - middle, chromaticity(rgb) - middle
        turn = _cross(ways, way)
        facing = _cross(ways, np.roll(ways, -1, axis=0)).sum()
        # It is to the left of the one end of a side, and to the right of the other.
        left = turn * facing >= 0
        found = np.flatnonzero(left & ~np.roll(left, -1))
        return int(found[0]) if found.size else 0

    @cached_property
    def _sides(self) -> Doubles:
        return sides_of(self.reach)

    def has(self, rgb: Doubles) -> bool:
        """Return whether the colour of a light (3,), linear, is in it; black is."""
        return bool((self._sides @ rgb >= -ROUND_OFF * rgb.sum()).all())

    def nearest(self, rgb: Doubles) -> Doubles:
        """Return a light (3,), linear, mixed with its own colour until it is in it, as bright."""
        if self.has(rgb):
            return rgb
        room, own = self._sides @ rgb, self._sides @ self.own
        beyond = (room < 0) & (own > 0)
        # With so much of its own colour beside it is within all sides.
        mixed = rgb + float(np.max(-room[beyond] / own[beyond], initial=0.0)) * self.own
        return np.asarray(mixed * (luminance(rgb) / luminance(mixed)), np.float64)


def _cross(one: Doubles, other: Doubles) -> Doubles:
    """Return the cross products of vectors (…, 2)."""
    return np.asarray(one[..., 0] * other[..., 1] - one[..., 1] * other[..., 0])


def _cut(corners: Doubles, direction: Doubles, reach: float) -> Doubles:
    """Return the part of a convex polygon, (m, 2), that reaches no further (Sutherland–Hodgman)."""
    room = reach - corners @ direction
    kept = []
    for k, (a, left) in enumerate(zip(corners, room, strict=True)):
        b, other = corners[(k + 1) % len(corners)], room[(k + 1) % len(corners)]
        if left >= 0:
            kept.append(a)
        if left * other < 0:
            kept.append(a + (b - a) * (left / (left - other)))
    return np.array(kept).reshape(-1, 2)
