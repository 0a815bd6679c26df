"""Colours of lamps that keep their own unless the painting clearly needs others.

A dim lamp, or one that lights a coloured surface, can lower the error by colours that nobody
painted: a little green that compensates for other lamps. So each lamp is limited to mixes of its
own colour, of whites, and of the light that the painting needs where the lamp counts. This light is
redder or bluer than the lamps' light there by the ratio of the painted Ψ to the look, and at most
by the ratio of Ψ to the surface. A lamp that is itself in view takes no other whites, and of what
is painted only its own colour with the mean change where it shines, or with the change on itself.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from lightpaint import colour
from lightpaint.arrays import Bools, Doubles, Floats, Indices
from lightpaint.basis import Basis
from lightpaint.lighting.constraints.light_constraints import LAMP_KELVINS
from lightpaint.lighting.unknowns.lamps_in_view import LampsInView

#: Whites that paint may ask for, in kelvin: those that have a name.
ALL_KELVINS = (1901, 100_000)

#: Share of the painted light that is ignored as outliers: noise, edges of strokes.
OUTLIER_SHARE = 0.05

#: Distance from whites that a lamp's colour may have, in (u', v'): too small to look green.
WHITE_MARGIN = 0.004

#: Largest distance from painted colours: painted hues are that inexact. The allowed distance is
#: twice the distance of the paint itself from whites, so that white paint means white.
PAINTED_MARGIN = 0.01

#: Distance from whites of all temperatures that a colour may have, relative to the distance of the
#: paint: large, so that only paint that is a white of any temperature is taken for one.
PAINTED_FACTOR = 10

#: Change towards cooler whites that a lamp may make, relative to the change that is painted where
#: it shines: a room into which a warm spot spills stays as cool as painted only if its other lamps
#: are cooler than that.
COOL_OVERSHOOT = 1.5

#: The same distance from whites and from painted colours for bold answers, which keep to hues
#: alone: at the edge of what looks green.
BOLD_MARGIN = 0.006

#: Rounding of bounds, in (u', v'): too small to see, and it keeps bounds equal between strokes.
REACH_STEP = 0.001

#: Painted pixels that are sampled, about.
MAX_SAMPLED_PIXELS = 2**12

#: Light of a painted pixel, relative to the brightest ones of the look, below which its colour does
#: not count: codes 0 to 10 of 8 bits.
DARK_SHARE = 0.003

#: Pixels searched for each painted pixel that is needed, where enough of them are painted.
SEARCH_FACTOR = 2**5

#: Brightness assumed for a lamp that is off, relative to the mean lamp.
FAINT_BRIGHTNESS = 0.01

#: Albedo below which it does not tell the painted light.
BLACK_ALBEDO = 0.02


@dataclass(frozen=True)
class PaintedLight:
    """A sample of the painted pixels.

    rows: (n, p, 3), Φ. image: (p, 3), Ψ. weight: (p,). albedo: (p, 3), of the visible
    surface, 1 where it is not known.
    """

    rows: Floats
    image: Floats
    weight: Floats
    albedo: Floats

    @classmethod
    def of(
        cls, views: Sequence[tuple[Basis, Floats, Floats]], max_pixels: int = MAX_SAMPLED_PIXELS
    ) -> "PaintedLight":
        """Sample the painted pixels of views, evenly spread.

        views: of each the basis, the painting (h, w, 3), linear, and its importance (h, w).
        max_pixels: about how many are sampled.
        """
        painted_pixels = [_painted_pixels(importance, max_pixels) for _, _, importance in views]
        step = max(1, sum(x.size for x in painted_pixels) // max_pixels)
        rows, image, weight, albedo = [], [], [], []
        for (basis, painting, importance), pixels in zip(views, painted_pixels, strict=True):
            chosen = pixels[::step]
            rows.append(basis.planes.pixels(chosen))
            image.append(painting.reshape(-1, 3)[chosen])
            weight.append(importance.ravel()[chosen])
            albedo_of_view = (
                None if basis.features is None else basis.features.albedo.reshape(-1, 3)[chosen]
            )
            albedo.append(
                np.ones((chosen.size, 3), np.float32) if albedo_of_view is None else albedo_of_view
            )
        return cls(
            np.concatenate(rows, axis=1),
            np.concatenate(image),
            np.concatenate(weight),
            np.concatenate(albedo),
        )


def _painted_pixels(importance: Floats, max_pixels: int) -> Indices:
    """Return places of painted pixels, (p,): every few pixels, where these give enough."""
    flat = importance.ravel()
    thin = max(1, flat.size // (SEARCH_FACTOR * max_pixels)) | 1
    pixels = np.flatnonzero(flat[::thin]) * thin
    return pixels if thin == 1 or pixels.size >= max_pixels // 4 else np.flatnonzero(flat)


class Gamuts:
    """The colours that each lamp may take.

    The painting's part is computed only for a lamp that leaves its own colour and whites: most
    never do, and under the brush each answer would wait for it.

    light: samples the painted pixels; call `refresh` after strokes. power, current: (n, 3), ‖Φᵢ‖²
    of the lamps' pictures, and their current weights. exempt: (n,), lights of any colour. is_bold:
    whether whites of any temperature are allowed, and twice as much beyond what is painted.
    in_view: the lamps that are seen themselves, which have narrower gamuts; None for none.
    """

    def __init__(
        self,
        light: Callable[[], PaintedLight],
        power: Doubles,
        current: Doubles,
        exempt: Bools | None = None,
        *,
        is_bold: bool = False,
        in_view: LampsInView | None = None,
    ) -> None:
        self._is_bold, self._in_view = is_bold, in_view
        self._light, self._power, self._current = light, power, current
        self._exempt = np.zeros(len(current), bool) if exempt is None else exempt
        self._own = np.where(colour.luminance(current)[:, None] > 0, current, 1.0)
        # Its own colour is within its gamut, and not at the edge of it.
        own_reach = colour.chromaticity(self._own) @ colour.DIRECTIONS.T
        lamps, whites = (
            colour.reach_of(colour.white_range(*k).colors) for k in (LAMP_KELVINS, ALL_KELVINS)
        )
        self._reach = np.maximum(own_reach + 2 * REACH_STEP, lamps + WHITE_MARGIN)
        self._whites = whites
        self._cool_whites = colour.reach_of(
            colour.white_range(LAMP_KELVINS[1], ALL_KELVINS[1]).colors
        )
        # Off-white lamps lie near the whites, and so do surfaces under them; coloured lamps do not.
        self._off_white = np.maximum(own_reach - whites, 0).max(axis=1)
        is_near_white = self._off_white <= PAINTED_MARGIN
        self._tolerance = float(self._off_white[is_near_white].max(initial=0.0))
        self._own_reach = own_reach + 2 * REACH_STEP
        allowed = self._reach
        if in_view is not None:
            allowed = np.where(in_view.lamps[:, None], self._own_reach, self._reach)
        self._sides = colour.sides_of(allowed - REACH_STEP)
        self._needed: _NeededLight | None = None
        self._gamuts: dict[int, colour.ColorHull] = {}
        self._former_gamuts: dict[int, colour.ColorHull] = {}

    def __len__(self) -> int:
        return len(self._current)

    def __getitem__(self, light: int) -> colour.ColorHull:
        if light not in self._gamuts:
            reach = self._painted_reach(light)
            if self._in_view is not None and self._in_view.lamps[light]:
                painted = colour.chromaticity(self._in_view.painted()[light]) @ colour.DIRECTIONS.T
                seen = np.maximum(self._own_reach[light], painted.max(axis=0) + WHITE_MARGIN)
                reach = np.minimum(reach, seen)
            self._gamuts[light] = self._hull(light, reach)
        return self._gamuts[light]

    def _painted_reach(self, light: int) -> Doubles:
        """Return the reach of a light's own colour, of whites and of what is painted, (k,)."""
        if self._needed is None:
            self._needed = _NeededLight.of(self._light(), self._power, self._current)
        needed = self._needed.reach(light)
        lamp = colour.chromaticity(self._own[light]) @ colour.DIRECTIONS.T
        cooler = lamp + COOL_OVERSHOOT * np.maximum(needed - lamp, 0)
        cooler = np.minimum(cooler, self._cool_whites) + WHITE_MARGIN
        own_reach = np.maximum(self._reach[light], cooler)
        if self._is_bold:
            bold = np.maximum(self._whites, needed) + BOLD_MARGIN
            return np.asarray(np.maximum(own_reach, bold))
        margin = np.clip(2 * (needed - own_reach + WHITE_MARGIN), WHITE_MARGIN, PAINTED_MARGIN)
        reach = np.maximum(own_reach, needed + margin)
        # Paint that is cooler or warmer asks for other whites, and for none that is greener.
        off_white = max(self._off_white[light], WHITE_MARGIN)
        beyond_whites = np.maximum(needed - self._whites - self._tolerance, 0)
        whites = np.maximum(own_reach, self._whites + off_white)
        return np.asarray(np.minimum(reach, whites + PAINTED_FACTOR * beyond_whites))

    def _hull(self, light: int, reach: Doubles) -> colour.ColorHull:
        """Return the gamut of a reach, (k,): the same object as before where it is equal."""
        reach = np.round(reach / REACH_STEP) * REACH_STEP
        former = self._former_gamuts.get(light)
        if former is not None and np.array_equal(former.reach, reach):
            return former
        return colour.ColorHull(reach, self._own[light])

    def refresh(self) -> None:
        """Discard gamuts, which are computed again on request. Equal ones stay the same objects."""
        self._former_gamuts |= self._gamuts
        self._gamuts, self._needed = {}, None

    def lights_outside(self, weights: Doubles, lights: Indices) -> list[int]:
        """Return the ones among some lights, (m,), whose colours in weights (n, 3) are outside
        their gamuts.
        """
        colors = weights[lights]
        room = np.einsum("mkc,mc->mk", self._sides[lights], colors)
        is_inside = (room >= -colour.ROUND_OFF * colors.sum(axis=1, keepdims=True)).all(axis=1)
        is_inside |= self._exempt[lights]
        return [k for k in lights[~is_inside].tolist() if not self[k].has(weights[k])]


class GamutsOfSome(Gamuts):
    """The gamuts of some lights, numbered among themselves. lights: (m,), their numbers."""

    def __init__(self, gamuts: Gamuts, lights: Indices) -> None:
        self._whole, self._lights = gamuts, lights

    def __getitem__(self, light: int) -> colour.ColorHull:
        return self._whole[int(self._lights[light])]

    def refresh(self) -> None:
        """Discard the gamuts of all lights."""
        self._whole.refresh()

    def lights_outside(self, weights: Doubles, lights: Indices) -> list[int]:
        """Return the ones among some lights, (k,), whose colours in weights (m, 3) are outside
        their gamuts.
        """
        in_whole = np.zeros((len(self._whole), 3))
        in_whole[self._lights] = weights
        outside = self._whole.lights_outside(in_whole, self._lights[lights])
        return [int(k) for k in np.searchsorted(self._lights, outside)]


@dataclass(frozen=True)
class _NeededLight:
    """The light that the sampled pixels need.

    reach_by_pixel: (p, k), the reach of its colours in each direction, in CIE 1976 (u', v'). share:
    (n, p), the weight of each pixel for a lamp.
    """

    reach_by_pixel: Doubles
    share: Doubles

    @classmethod
    def of(cls, light: PaintedLight, power: Doubles, current: Doubles) -> "_NeededLight":
        """Compute it for lamps with these ‖Φᵢ‖² and current weights, (n, 3); one that is off is
        faint.
        """
        size, now = np.sqrt(power.sum(axis=1)), np.asarray(colour.luminance(current))
        faint = FAINT_BRIGHTNESS * (now * size).mean() / np.where(size > 0, size, np.inf)
        lamps = np.where(now[:, None] > 0, current / np.where(now > 0, now, 1)[:, None], 1.0)
        lit = (np.maximum(now, faint)[:, None] * lamps)[:, None] * light.rows
        look, brightness = lit.sum(axis=0), np.asarray(colour.luminance(light.image))
        dark = DARK_SHARE * np.percentile(colour.luminance(look), 95) if len(look) else 0.0
        counts = (look.min(axis=1) > 0) & (light.image.min(axis=1) >= 0) & (brightness > dark)
        share = np.asarray(
            colour.luminance(lit[:, counts]) / colour.luminance(look[counts]), np.float64
        )
        needed = light.image[counts] / look[counts] * (share.T @ lamps)
        # Errors of dim light show more: display values are near the root of light.
        weight = light.weight[counts] * np.sqrt(brightness[counts])
        along = colour.chromaticity(needed) @ colour.DIRECTIONS.T
        # Light that makes up for coloured surfaces was not painted: the paint itself is no greener
        # than that.
        albedo = light.albedo[counts]
        has_albedo = albedo.min(axis=1) > BLACK_ALBEDO
        illumination = light.image[counts][has_albedo] / albedo[has_albedo]
        along[has_albedo] = np.minimum(
            along[has_albedo], colour.chromaticity(illumination) @ colour.DIRECTIONS.T
        )
        return cls(along, share * weight)

    @cached_property
    def _order(self) -> Indices:
        """(p, k), pixels by how far they reach."""
        return np.argsort(self.reach_by_pixel, axis=0)

    def reach(self, lamp: int) -> Doubles:
        """Return the reach of its colours where a lamp counts, (k,), without outliers.

        -inf for a lamp that counts nowhere.
        """
        sums = np.cumsum(self.share[lamp][self._order], axis=0)
        if not (len(sums) and sums[-1, 0] > 0):
            return np.full(len(colour.DIRECTIONS), -np.inf)
        last = np.minimum((sums < (1 - OUTLIER_SHARE) * sums[-1]).sum(axis=0), len(sums) - 1)
        columns = np.arange(len(colour.DIRECTIONS))
        return np.asarray(self.reach_by_pixel[self._order[last, columns], columns])
