"""Colours that lamps may take which keep their own unless the painting asks for another.

A lamp that hardly shines, or whose light comes off a coloured surface, can lower what is missed by
colours that nobody painted: a little green that makes up for other lamps. So of each lamp the light
is limited to mixes of its own colour, of whites, and of the light that the painting asks for where
the lamp counts: as much redder or bluer than the lamps' light there as painted Ψ is than the look,
and no more so than Ψ is than the surface.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from lightpaint.arrays import Doubles, Floats, Indices
from lightpaint.basis.basis import Basis
from lightpaint.colour.color import luminance
from lightpaint.colour.color_hull import (
    DIRECTIONS,
    ROUND_OFF,
    ColorHull,
    chromaticity,
    reach_of,
    sides_of,
)
from lightpaint.colour.white_range import white_range
from lightpaint.lighting.constraints.white_lights import WHITES

#: Part of the painted light beyond which what is painted says nothing: noise, edges of strokes.
OUTLYING = 0.05

#: By how much a lamp's colour may leave whites, in (u', v'): less than is called green.
MARGIN = 0.004

#: By how much it may leave what is painted, at most: people paint hues that much off. It is twice
#: as far as the paint itself leaves whites, since whoever paints white means white.
PAINTED_MARGIN = 0.01

#: What a bound is rounded to, in (u', v'): less than people see; it lasts while one paints.
STEP = 0.001

#: Painted pixels that are looked at, about.
LOOKED_AT = 2**12

#: Light of a painted pixel, beside what is bright there now, below which it has no colour: in 8
#: bits the codes from 0 to 10.
DARK = 0.003

#: Times as many pixels among which painted ones are looked for, where there are enough of them.
SEARCHED = 2**5

#: Brightness, beside that of the mean lamp, at which a lamp counts that is off.
FAINT = 0.01

#: Albedo below which painted light is not known by it.
BLACK = 0.02


@dataclass(frozen=True)
class PaintedLight:
    """Some of the painted pixels.

    rows: (n, p, 3), Φ. image: (p, 3), Ψ. weight: (p,). albedo: (p, 3), of what is seen, 1 where it
    is not known.
    """

    rows: Floats
    image: Floats
    weight: Floats
    albedo: Floats

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
        rows, image, weight, albedo = [], [], [], []
        for (basis, painting, importance), where in zip(views, its, strict=True):
            some = where[::step]
            rows.append(basis.planes.pixels(some))
            image.append(painting.reshape(-1, 3)[some])
            weight.append(importance.ravel()[some])
            known = None if basis.features is None else basis.features.albedo.reshape(-1, 3)[some]
            albedo.append(np.ones((some.size, 3), np.float32) if known is None else known)
        return cls(
            np.concatenate(rows, axis=1),
            np.concatenate(image),
            np.concatenate(weight),
            np.concatenate(albedo),
        )


def _painted_pixels(importance: Floats, most: int) -> Indices:
    """Return places of painted pixels, (p,): of evenly spread ones, where these are enough."""
    every = importance.ravel()
    thin = max(1, every.size // (SEARCHED * most)) | 1
    found = np.flatnonzero(every[::thin]) * thin
    return found if thin == 1 or found.size >= most // 4 else np.flatnonzero(every)


class Gamuts:
    """The colours that each lamp may take.

    How far the painting lets them reach is found only where a lamp takes a colour that is none of
    its own and of whites: most never do, and under a brush each answer would wait for it.

    light: finds painted pixels; whoever paints on says so (`repainted`). power, present: (n, 3),
    ‖Φᵢ‖² of the lamps' pictures, and their weights now.
    """

    def __init__(self, light: Callable[[], PaintedLight], power: Doubles, present: Doubles) -> None:
        self._light, self._power, self._present = light, power, present
        self._own = np.where(luminance(present)[:, None] > 0, present, 1.0)
        # Its own colour is within its gamut, and not at the edge of it.
        own = chromaticity(self._own) @ DIRECTIONS.T + 2 * STEP
        self._reach = np.maximum(own, reach_of(white_range(*WHITES).colors) + MARGIN)
        self._sides = sides_of(self._reach - STEP)
        self._wanted: _WantedLight | None = None
        self._found: dict[int, ColorHull] = {}
        self._before: dict[int, ColorHull] = {}

    def __getitem__(self, light: int) -> ColorHull:
        if light not in self._found:
            if self._wanted is None:
                self._wanted = _WantedLight.of(self._light(), self._power, self._present)
            own, wanted = self._reach[light], self._wanted.reach(light)
            beside = np.clip(2 * (wanted - own + MARGIN), MARGIN, PAINTED_MARGIN)
            reach = np.maximum(own, wanted + beside)
            reach = np.round(reach / STEP) * STEP
            found, before = ColorHull(reach, self._own[light]), self._before.get(light)
            is_same = before is not None and np.array_equal(before.reach, reach)
            self._found[light] = before if before is not None and is_same else found
        return self._found[light]

    def repainted(self) -> None:
        """Find anew what the painting asks for. What comes out the same is the same object."""
        self._before |= self._found
        self._found, self._wanted = {}, None

    def beyond(self, weights: Doubles, lights: Indices) -> list[int]:
        """Return which of some lights, (m,), have colours in weights (n, 3) beyond theirs."""
        its = weights[lights]
        room = np.einsum("mkc,mc->mk", self._sides[lights], its)
        known = (room >= -ROUND_OFF * its.sum(axis=1, keepdims=True)).all(axis=1)
        return [k for k in lights[~known].tolist() if not self[k].has(weights[k])]


@dataclass(frozen=True)
class _WantedLight:
    """The light that some painted pixels ask for.

    along: (p, k), how far its colours reach in each direction, in CIE 1976 (u', v'). share: (n, p),
    how much each pixel says of a lamp's light.
    """

    along: Doubles
    share: Doubles

    @classmethod
    def of(cls, light: PaintedLight, power: Doubles, present: Doubles) -> "_WantedLight":
        """Find it for lamps of such ‖Φᵢ‖² and weights now, (n, 3); one that is off is faint."""
        size, now = np.sqrt(power.sum(axis=1)), np.asarray(luminance(present))
        faint = FAINT * (now * size).mean() / np.where(size > 0, size, np.inf)
        lamps = np.where(now[:, None] > 0, present / np.where(now > 0, now, 1)[:, None], 1.0)
        lit = (np.maximum(now, faint)[:, None] * lamps)[:, None] * light.rows
        look, painted = lit.sum(axis=0), np.asarray(luminance(light.image))
        dark = DARK * np.percentile(luminance(look), 95) if len(look) else 0.0
        counts = (look.min(axis=1) > 0) & (light.image.min(axis=1) >= 0) & (painted > dark)
        share = np.asarray(luminance(lit[:, counts]) / luminance(look[counts]), np.float64)
        wanted = light.image[counts] / look[counts] * (share.T @ lamps)
        # What is dim is seen the more: display values are near the root of light.
        weight = light.weight[counts] * np.sqrt(painted[counts])
        along = chromaticity(wanted) @ DIRECTIONS.T
        # What makes up for light off coloured surfaces was not painted: the paint itself is no
        # greener than that.
        albedo = light.albedo[counts]
        known = albedo.min(axis=1) > BLACK
        itself = light.image[counts][known] / albedo[known]
        along[known] = np.minimum(along[known], chromaticity(itself) @ DIRECTIONS.T)
        return cls(along, share * weight)

    @cached_property
    def _order(self) -> Indices:
        """(p, k), pixels by how far they reach."""
        return np.argsort(self.along, axis=0)

    def reach(self, lamp: int) -> Doubles:
        """Return how far it reaches where a lamp counts, (k,), but for what is outlying.

        -inf for a lamp that counts nowhere.
        """
        sums = np.cumsum(self.share[lamp][self._order], axis=0)
        if not (len(sums) and sums[-1, 0] > 0):
            return np.full(len(DIRECTIONS), -np.inf)
        last = np.minimum((sums < (1 - OUTLYING) * sums[-1]).sum(axis=0), len(sums) - 1)
        columns = np.arange(len(DIRECTIONS))
        return np.asarray(self.along[self._order[last, columns], columns])
