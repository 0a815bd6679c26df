"""Colours that lamps may take which keep their own unless the painting asks for another.

A lamp that hardly shines, or whose light comes off a coloured surface, can lower what is missed by
colours that nobody painted: a little green that makes up for other lamps. So of each lamp the light
is limited to mixes of its own colour, of whites, and of the light that the painting asks for where
the lamp counts: painted Ψ, beside what white lamps as bright as those there are would make.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import Doubles, Floats, Indices
from lightpaint.basis.basis import Basis
from lightpaint.colour.color import luminance
from lightpaint.colour.hull import DIRECTIONS, ColorHull, chromaticity, reach_of
from lightpaint.colour.whites import white_range
from lightpaint.lighting.constraints.whites import WHITES

#: One of each light.
Gamuts = tuple[ColorHull, ...]

#: Part of the painted light beyond which what is painted says nothing: noise, edges of strokes.
OUTLYING = 0.05

#: By how much colours may leave what is painted, in (u', v'): people paint hues that much off.
MARGIN = 0.01

#: Painted pixels that are looked at, about.
LOOKED_AT = 2**12

#: Light of a painted pixel, beside what is bright there now, below which it has no colour: in 8
#: bits the codes from 0 to 10.
DARK = 0.003

#: Pixels among which painted ones are looked for, where there are enough of them.
SEARCHED = 2**16

#: Brightness, beside that of the mean lamp, at which a lamp counts that is off.
FAINT = 0.01


@dataclass(frozen=True)
class PaintedLight:
    """Some of the painted pixels. rows: (n, p, 3), Φ. image: (p, 3), Ψ. weight: (p,)."""

    rows: Floats
    image: Floats
    weight: Floats

    @classmethod
    def of(
        cls, views: Sequence[tuple[Basis, Floats, Floats]], most: int = LOOKED_AT
    ) -> "PaintedLight":
        """Choose painted pixels of views, evenly spread.

        views: of each the basis, the painting (h, w, 3), linear, and its importance (h, w). most:
        pixels, about.
        """
        its = [_painted_pixels(importance, most) for _, _, importance in views]
        step = max(1, sum(x.size for x in its) // most)
        rows, image, weight = [], [], []
        for (basis, painting, importance), where in zip(views, its, strict=True):
            some = where[::step]
            rows.append(basis.images.reshape(len(basis.images), -1, 3)[:, some])
            image.append(painting.reshape(-1, 3)[some])
            weight.append(importance.ravel()[some])
        return cls(np.concatenate(rows, axis=1), np.concatenate(image), np.concatenate(weight))


def _painted_pixels(importance: Floats, most: int) -> Indices:
    """Return places of painted pixels, (p,): of evenly spread ones, where these are enough."""
    every = importance.ravel()
    thin = max(1, every.size // SEARCHED) | 1
    found = np.flatnonzero(every[::thin]) * thin
    return found if thin == 1 or found.size >= most // 4 else np.flatnonzero(every)


def gamuts_of(light: PaintedLight, power: Doubles, present: Doubles) -> Gamuts:
    """Return the colours that each lamp may take.

    power, present: (n, 3), ‖Φᵢ‖² of the lamps' pictures, and their weights now.
    """
    own = np.where(luminance(present)[:, None] > 0, present, 1.0)
    white = reach_of(white_range(*WHITES).colors)
    reach = np.maximum(chromaticity(own) @ DIRECTIONS.T, white)
    reach = np.maximum(reach, _painted(light, power, present)) + MARGIN
    return tuple(ColorHull(r, c) for r, c in zip(reach, own, strict=True))


def _painted(light: PaintedLight, power: Doubles, present: Doubles) -> Doubles:
    """Return how far the light that is painted where a lamp counts reaches in each direction.

    (n, k), in CIE 1976 (u', v'); -inf for a lamp that counts nowhere.
    """
    size = np.sqrt(power.sum(axis=1))
    now = np.asarray(luminance(present))
    faint = FAINT * (now * size).mean() / np.where(size > 0, size, np.inf)
    lit = np.maximum(now, faint)[:, None, None] * light.rows
    total, painted = lit.sum(axis=0), np.asarray(luminance(light.image))
    dark = DARK * np.percentile(luminance(total), 95) if len(total) else 0.0
    counts = (total.min(axis=1) > 0) & (light.image.min(axis=1) >= 0) & (painted > dark)
    wanted = light.image[counts] / total[counts]
    reach = np.full((len(present), len(DIRECTIONS)), -np.inf)
    if not len(wanted):
        return reach
    along = chromaticity(wanted) @ DIRECTIONS.T
    # What is dim is seen the more: display values are near the root of light.
    weight = light.weight[counts] * np.sqrt(painted[counts])
    share = luminance(lit[:, counts]) / luminance(total[counts]) * weight
    order = np.argsort(along, axis=0)
    for k, its in enumerate(order.T):
        sums = np.cumsum(share[:, its], axis=1)
        last = (sums < (1 - OUTLYING) * sums[:, -1:]).sum(axis=1)
        reach[:, k] = np.where(
            sums[:, -1] > 0, along[its, k][np.minimum(last, its.size - 1)], -np.inf
        )
    return reach
