"""The light of a reference of another place, as changes of the light of key, backdrop and fill: its
key is given to hard light, its fill to the rest.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from lightpaint.arrays import Bools, Doubles, Floats
from lightpaint.basis import Basis, denoise_mix
from lightpaint.colour import kelvin_to_rgb, luminance
from lightpaint.errors import PaintError
from lightpaint.paint.layers.canvas import Canvas
from lightpaint.paint.layers.layer_stack import Layer
from lightpaint.paint.presets import lighting_presets
from lightpaint.paint.presets.lamp_roles import LampRoles, find_roles, light_share
from lightpaint.paint.presets.view_areas import MIN_ALBEDO, Mask, ViewAreas
from lightpaint.paint.references.tones import LightTones, Tones

#: Stops of a picture's contrast that are of its surfaces, and the least contrast of light.
SURFACE_STOPS, LEAST_STOPS = 0.7, 0.05

#: Stops of red over blue by which shadows are cooler than lit parts, from which on they begin to be
#: of a hard key and from which on they fully are: then the darkest tenth counts as shadows, since
#: such a key may light most of a picture.
HARD_COOL = (0.1, 0.25)

#: Stops that count for each stop by which shadows are cooler than that, and the most.
COOL_SHADOWS, MOST_COOL = 1.5, 1.0

#: Stops by which a reference may be darker as a whole, which is its exposure; and the share of the
#: rest that counts, since a night is meant to be dark.
DARKER, DARKER_SHARE = 0.7, 1.0

#: Most stops by which a picture becomes brighter as a whole, so that its highlights stay.
MOST_BRIGHTER = 0.2

#: Distance of a change of colour from a change of whites, in stops of a channel: up to the first
#: it is one of whites, as surfaces tint it, and from the second on the colour of the light.
WHITE_CHANGE = (0.25, 0.75)

#: White from which changes of whites are taken.
NEUTRAL_KELVIN = 5300.0

#: Difference of two pictures' light, in stops, from which on they begin to count as pictures of
#: different places, and from which on they do so fully.
SAME_PLACE = (0.3, 0.8)

#: Most and least stops by which the light of lamps changes, and a channel of it.
MAX_STOPS, MIN_STOPS, MAX_TINT = 4.0, -5.0, 4.2

#: Changes that nobody sees: these are not asked for.
SEEN_STOPS, SEEN_TINT = 0.08, 0.04

#: Share of a reference that is nearly as bright as its highlights, up to which its key is a pool of
#: light; and the least contrast of such a reference, in stops.
POOL_SHARE, POOL_STOPS = 0.3, 2.5

#: Stops of red over blue from which on light is the light of a flame, and so a pool.
FLAME_WARMTH = 4.0

#: Weight of contrast in the distance of lights: it is as much of a place's corners as of its light.
CONTRAST_WEIGHT = 0.5

#: Contrast of light, in stops, below which a reference has hardly any key, and is softer than lamps
#: alone may make a picture.
SOFT_STOPS = 1.0

#: Difference of the colours of light at the left and at the right, in stops of a channel, from
#: which on a reference has a key of each; and the least contrast of their light, in stops.
TWO_KEYS, TWO_KEYS_STOPS = 1.0, 2.5

#: Approximate pixels of the longer side of the picture in which changes are found.
FINDING_SIDE = 160

#: Shares of the changes that are tried in turn, until one does not lead away from a reference.
STRENGTHS = (1.0, 0.7, 0.4)

#: Quantile of the light of a picture that stays as bright as it is.
HIGHLIGHTS = 0.95

#: Least distance from the middle, -1 to 1, at which a lamp belongs to one side of a picture.
SIDE = 0.1

#: Most by which the light of a side becomes brighter or darker, to be like the light of the other
#: side.
MOST_BALANCE = 4.0

#: Share of the stops from fill to key at which the light of a backdrop lies, which stands for a
#: sky, and the share of its colour that is the key's.
BACKDROP = 0.5


@dataclass(frozen=True)
class LightMatch:
    """Changes of light that bring a picture near a reference.

    key_stops, fill_stops: by which the light of the key and of all other lamps changes. key_tints:
    log2 gains (3,) of the channels of the key; two if it differs from left to right. fill_tint:
    (3,), the tint of the other lamps.
    """

    key_stops: float
    fill_stops: float
    key_tints: tuple[Doubles, ...]
    fill_tint: Doubles

    @property
    def is_visible(self) -> bool:
        """True if anybody sees it."""
        tint = max(float(np.abs(x).max()) for x in (*self.key_tints, self.fill_tint))
        return tint >= SEEN_TINT or max(abs(self.key_stops), abs(self.fill_stops)) >= SEEN_STOPS


def has_pool(reference: LightTones) -> bool:
    """Return True if the key of a reference is a pool of light in the dark."""
    is_small = reference.bright_share <= POOL_SHARE or _warmth(reference.lit) >= FLAME_WARMTH
    return is_small and reference.contrast >= POOL_STOPS


def has_two_keys(reference: LightTones) -> bool:
    """Return True if the light of a reference has another colour at its left than at its right."""
    left, right = reference.sides
    return float(np.abs(left - right).max()) >= TWO_KEYS


def contrast_of_light(reference: LightTones) -> float:
    """Return the stops from shadows to lit parts that are of the light of a reference."""
    least = TWO_KEYS_STOPS if has_two_keys(reference) else LEAST_STOPS
    cool = _warmth(reference.lit) - _warmth(reference.shadows)
    begin, full = HARD_COOL
    hard = float(np.clip((cool - begin) / (full - begin), 0, 1)) * (not has_pool(reference))
    depth = float(reference.levels[1] - reference.levels[0])
    stops = max(reference.contrast + hard * depth - SURFACE_STOPS, least)
    return stops + float(np.clip(COOL_SHADOWS * (cool - begin), 0, MOST_COOL))


def is_soft(reference: LightTones) -> bool:
    """Return True if a reference shows hardly any key."""
    return contrast_of_light(reference) < SOFT_STOPS


@dataclass(frozen=True)
class LampLight:
    """Present light of some lamps. level: where they shine. color: log2 (3,) of its RGB there."""

    level: float
    color: Doubles


def match_light(
    reference: LightTones, picture: LightTones, key: LampLight, fill: LampLight
) -> LightMatch:
    """Return the changes of key and fill that give a picture, as it is now, a reference's light.

    Contrast and whites are as in the reference, but a picture of much the same light asks for no
    more than what differs. Lit parts stay as bright as they are.
    """
    other = _otherness(reference, picture)
    lit = key.level + fill.level
    now = float(np.log2(lit / fill.level)) if fill.level and key.level else 0.0
    meant = contrast_of_light(reference)
    stops = now + other * (meant - now) + (1 - other) * (reference.contrast - picture.contrast)
    new_fill = lit * 2.0 ** -max(stops, LEAST_STOPS)
    theirs: tuple[Doubles, ...] = (reference.lit,)
    fill_color = reference.shadows
    if is_soft(reference):
        fill_color = 0.5 * (fill_color + reference.lit)
    if has_two_keys(reference):
        theirs = reference.sides
        fill_color = np.mean(theirs, axis=0)
    bright = other * key.color + (1 - other) * picture.lit
    dark = other * fill.color + (1 - other) * picture.shadows
    return LightMatch(
        _stops(lit - new_fill, key.level),
        _stops(new_fill, fill.level),
        tuple(_limited(x - bright) for x in theirs),
        _limited(fill_color - dark),
    )


def light_distance(reference: LightTones, picture: LightTones) -> float:
    """Return how far the light of a picture, without its surfaces, is from a reference's, in stops.

    The mean of the differences in contrast, which counts half, in the warmth of lit parts and in
    the warmth of shadows; in the colours of both sides instead of these if a reference has a key of
    each.
    """
    parts = [CONTRAST_WEIGHT * (contrast_of_light(reference) - picture.contrast)]
    if has_two_keys(reference):
        pairs = zip(reference.sides, picture.sides, strict=True)
        parts += [float(np.abs(theirs - ours).mean()) for theirs, ours in pairs]
    else:
        parts.append(_warmth(reference.lit) - _warmth(picture.lit))
        parts.append(_warmth(reference.shadows) - _warmth(picture.shadows))
    return float(np.mean(np.abs(parts)))


def stops_darker(reference: LightTones, picture: LightTones) -> float:
    """Return the stops by which a picture becomes darker, of a reference that is far darker."""
    difference = float(picture.levels[-2] - reference.levels[-2])
    return DARKER_SHARE * max(difference - DARKER, 0.0)


def gains_of(tint: Doubles) -> Doubles:
    """Return 2 to the power of `tint`, (3,), scaled to a luminance of 1."""
    gains = 2.0**tint
    return np.asarray(gains / luminance(gains))


def _warmth(color: Doubles) -> float:
    """Return the stops of red over blue of a colour, log2 (3,)."""
    return float(color[0] - color[2])


def _believable(tint: Doubles) -> Doubles:
    """Return a change of colour, log2 gains (3,), as one of whites where it nearly is one."""
    whites = _white_changes()
    white = whites[int(np.argmin(np.abs((whites - tint) @ np.array([1.0, 0.0, -1.0]))))]
    off = tint - white
    least, most = WHITE_CHANGE
    kept = np.clip((np.abs(off).max() - least) / (most - least), 0, 1)
    return np.asarray(white + kept * off)


@cache
def _white_changes() -> Doubles:
    """Return the changes from neutral white to whites, log2 gains (n, 3), from warm to cool."""
    neutral = np.log2(kelvin_to_rgb(NEUTRAL_KELVIN))
    mired = np.arange(25.0, 520.0, 1.0)
    return np.array([np.log2(np.maximum(kelvin_to_rgb(1e6 / x), 0.01)) - neutral for x in mired])


def _otherness(reference: LightTones, picture: LightTones) -> float:
    """Return 0 for pictures of much the same light, 1 for others."""
    levels = reference.levels - picture.levels
    differences = (
        levels - np.median(levels),
        reference.lit - picture.lit,
        reference.shadows - picture.shadows,
    )
    least, most = SAME_PLACE
    difference = max(float(np.abs(x).max()) for x in differences)
    return float(np.clip((difference - least) / (most - least), 0, 1))


def _stops(after: float, before: float) -> float:
    if not before:
        return 0.0
    return float(np.clip(np.log2(max(after, 1e-6) / before), MIN_STOPS, MAX_STOPS))


def _limited(tint: Doubles) -> Doubles:
    return np.clip(_believable(tint), -MAX_TINT, MAX_TINT)


@dataclass(frozen=True)
class LightLayers:
    """Layers for the light of a reference.

    groups: lamps that they change, without the `fill`. layers: one for the fill, one for each
    group. image: (h, w, 3) linear, the picture with them, reduced. strength: share of the changes
    that is asked for: less than 1 where all of them would lead away from the reference.
    """

    groups: tuple[lighting_presets.LampGroup, ...]
    fill: lighting_presets.LampGroup
    layers: tuple[Layer, ...]
    image: Floats
    strength: float

    def masks(self, basis: Basis, areas: ViewAreas) -> list[Mask]:
        """Return the mask (h, w) of each layer in a view."""
        shares = [_share(basis, group.lamps, areas) for group in self.groups]
        usable = areas.whole
        masks = lighting_presets.masks_of(self.groups, self.fill, shares)
        return [usable, *(x * usable for x in masks)]


def find_light(
    canvas: Canvas, reference: Tones, light: Floats, areas: ViewAreas, *, matches_brightness: bool
) -> LightLayers | None:
    """Return layers that give a view the light of a reference of another place.

    None if nobody would see them. Raises PaintError if even a part of them would lead away from
    the reference. light: (h, w, 3) linear, the picture now, and `areas` its areas, both reduced.
    matches_brightness: whether it becomes as bright as the reference.
    """
    there, known = reference.light_tones, areas.whole > 0
    roles, _ = find_roles(canvas)
    keys = key_lamps(canvas.basis, roles, there)
    lit = np.any(keys, axis=0)
    match = match_light(
        there,
        Tones(light, known).light_tones,
        _lamp_light(canvas, roles, lit, known, is_key=True),
        _lamp_light(canvas, roles, ~lit, known, is_key=False),
    )
    if not match.is_visible:
        return None
    before = distance_of(canvas, there, light, known)
    for strength in STRENGTHS:
        part = _share_of(match, strength)
        level = reference.level - Tones(light, known).level if matches_brightness else None
        found = _layers(canvas, roles, keys, part, there, light, areas, level)
        if distance_of(canvas, there, found.image, known) < before:
            return replace(found, strength=strength)
    raise PaintError("these lamps bring the picture no nearer to that light")


def distance_of(canvas: Canvas, reference: LightTones, light: Floats, known: Bools) -> float:
    """Return how far the light of a picture, (h, w, 3) linear, is from the light of a reference."""
    return light_distance(reference, Tones(without_surfaces(canvas, light), known).light_tones)


def key_lamps(basis: Basis, roles: LampRoles, reference: LightTones) -> list[Bools]:
    """Return the lamps of a view, (n,), that serve best as the key light of a reference: two
    groups, at the left and at the right, for a reference with a key light on either side.
    """
    is_on = basis.current_weights.any(axis=1) & ~basis.is_fixed
    usable = roles.lamps(is_on)
    if has_two_keys(reference):
        wide = roles.is_soft & roles.is_daylight & ~roles.is_wash
        local = usable & ~(wide if (usable & ~wide).any() else np.zeros_like(wide))
        place = roles.places
        pair = [local & (place < -SIDE), local & (place > SIDE)]
        if all(x.any() for x in pair):
            return pair
        middle = float(np.median(place[usable])) if usable.any() else 0.0
        return [usable & (place < middle), usable & (place >= middle)]
    if has_pool(reference):
        return [roles.candle & usable]
    if is_soft(reference) and (roles.hard & usable).any():
        return [roles.hard & usable]
    return [roles.sun & usable]


def without_surfaces(canvas: Canvas, light: Floats) -> Floats:
    """Return the light (h, w, 3) that arrives at surfaces; as it is where these are unknown."""
    features = canvas.basis.features
    if features is None:
        return light
    albedo = features.reduced(lighting_presets.reduction(canvas, FINDING_SIDE)).albedo
    return np.asarray(light / np.maximum(albedo, MIN_ALBEDO), np.float32)


def _lamp_light(
    canvas: Canvas, roles: LampRoles, lamps: Bools, known: Bools, *, is_key: bool
) -> LampLight:
    """Return the present light of lamps: its colour where they are brightest, or in the dark."""
    weights = canvas.basis.current_weights * roles.lights(lamps)[:, None]
    if not weights.any():
        return LampLight(0.0, np.zeros(3))
    image = denoise_mix(
        canvas.basis, weights, factor=lighting_presets.reduction(canvas, FINDING_SIDE)
    )
    tones = Tones(without_surfaces(canvas, np.maximum(image, 0)), known).light_tones
    return LampLight(roles.level(lamps), tones.lit if is_key else tones.shadows)


def _share_of(match: LightMatch, share: float) -> LightMatch:
    return LightMatch(
        share * match.key_stops,
        share * match.fill_stops,
        tuple(share * x for x in match.key_tints),
        share * match.fill_tint,
    )


def _layers(
    canvas: Canvas,
    roles: LampRoles,
    keys: Sequence[Bools],
    match: LightMatch,
    reference: LightTones,
    light: Floats,
    areas: ViewAreas,
    level: float | None,
) -> LightLayers:
    """Return the layers of a match. level: stops by which all becomes brighter, if that is asked
    for.
    """
    names = ("Key light",) if len(keys) == 1 else ("Key light, left", "Key light, right")
    groups = [
        lighting_presets.LampGroup(name, key, 2.0**match.key_stops * gain, tint)
        for name, key, tint, gain in zip(
            names, keys, match.key_tints, _balance(roles, keys), strict=True
        )
    ]
    sky = roles.is_wash & ~np.any(keys, axis=0)
    is_sky = len(keys) == 1 and not has_pool(reference) and not is_soft(reference)
    if is_sky and sky.any() and roles.lights(sky).any():
        stops = match.fill_stops + BACKDROP * (match.key_stops - match.fill_stops)
        tint = match.fill_tint + BACKDROP * (match.key_tints[0] - match.fill_tint)
        groups.append(lighting_presets.LampGroup("Backdrop", sky, 2.0**stops, tint))
    rest = ~np.any([x.lamps for x in groups], axis=0)
    fill = lighting_presets.LampGroup("Fill light", rest, 2.0**match.fill_stops, match.fill_tint)
    picture = Tones(light, areas.whole > 0).light_tones
    if level is None and has_pool(reference):
        level = 0.0
    elif level is None:
        level = _steady_stops(roles, (*groups, fill)) - stops_darker(reference, picture)
    gain = 2.0**level
    fill, *groups = (
        replace(x, lamps=roles.lights(x.lamps), gain=gain * x.gain, tint=gains_of(x.tint))
        for x in (fill, *groups)
    )
    layers = lighting_presets.layers_of(groups, fill, 1, "")[:-1]
    factor = lighting_presets.reduction(canvas, FINDING_SIDE)
    shares = [_share(canvas.basis, x.lamps, areas, factor) for x in groups]
    masks = [areas.whole, *lighting_presets.masks_of(groups, fill, shares)]
    image = lighting_presets.with_layers(np.asarray(light, np.float32), layers, masks)
    return LightLayers(tuple(groups), fill, layers, image, 1.0)


def _balance(roles: LampRoles, keys: Sequence[Bools]) -> list[float]:
    """Return the gains by which the keys of two sides light their sides alike; 1 for a key."""
    if len(keys) == 1:
        return [1.0]
    middle = roles.light.shape[2] // 2
    halves = slice(0, middle), slice(middle, None)
    amounts = [
        max(float(roles.light[key][:, :, half].sum(dtype=np.float64)), 1e-30)
        for key, half in zip(keys, halves, strict=True)
    ]
    mean = float(np.sqrt(amounts[0] * amounts[1]))
    return [float(np.clip(mean / x, 1 / MOST_BALANCE, MOST_BALANCE)) for x in amounts]


def _steady_stops(roles: LampRoles, groups: Sequence[lighting_presets.LampGroup]) -> float:
    """Return the stops that leave the highlights of a picture as bright as they are, but do not
    make all of it much brighter.
    """
    gains = np.ones(len(roles.light))
    for group in groups:
        gains[group.lamps] = group.gain
    before, after = roles.light.sum(axis=0), np.tensordot(gains, roles.light, axes=1)
    lit = before > 0
    if not lit.any():
        return 0.0
    tops = [_log2(np.quantile(x[lit], HIGHLIGHTS)) for x in (before, after)]
    means = [float(np.mean(np.log2(x[lit] + 1e-9))) for x in (before, after)]
    return min(tops[0] - tops[1], means[0] - means[1] + MOST_BRIGHTER)


def _log2(value: float) -> float:
    return float(np.log2(max(value, 1e-30)))


def _share(basis: Basis, lamps: Bools, areas: ViewAreas, factor: int = 1) -> Mask:
    """Return the share (h, w) of the light that comes from lamps; lit parts for all or none."""
    is_divided = lighting_presets.is_divided(basis, lamps)
    return light_share(basis, lamps, factor) if is_divided else areas.lit
