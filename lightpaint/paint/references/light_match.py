"""The light of a reference, given to lamps: its key to hard light, its fill to the rest."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.colour.color import kelvin_to_rgb, luminance
from lightpaint.paint.references.tones import LightTones

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

#: Stops of red over blue from which on light is that of a flame, and so a pool.
FLAME_WARMTH = 4.0

#: Weight of contrast in the distance of lights: it is as much of a place's corners as of its light.
CONTRAST_WEIGHT = 0.5

#: Contrast of light, in stops, below which a reference has hardly any key, and is softer than lamps
#: alone may make a picture.
SOFT_STOPS = 1.0

#: Difference of the colours of light at the left and at the right, in stops of a channel, from
#: which on a reference has a key of each; and the least contrast of their light, in stops.
TWO_KEYS, TWO_KEYS_STOPS = 1.0, 2.5


@dataclass(frozen=True)
class LightMatch:
    """Changes of light that bring a picture near a reference.

    key_stops, fill_stops: by which the light of the key and of all other lamps changes. key_tints:
    log2 gains (3,) of the channels of the key; two if it differs from left to right. fill_tint:
    (3,), that of the other lamps.
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

    Contrast and whites are those of the reference, but a picture of much the same light asks for no
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
    that of shadows; in the colours of both sides instead of these if a reference has a key of each.
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
    """Return the gains (3,), of luminance 1, of log2 gains."""
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
