"""Lightings between lightings: the frames of a sequence, even in stops or as people see."""

from collections.abc import Sequence
from dataclasses import replace
from math import floor

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.batch.keys import Space
from lightpaint.batch.variations import with_emission
from lightpaint.errors import LightingError
from lightpaint.lighting.lighting import Lighting

#: Stops below the brighter end at which a light that is off begins, or ends, in `log`.
DARK = 10.0

#: Linear Rec.709 to cone responses, and their cube roots to Oklab (Ottosson 2020).
TO_CONES = np.array(
    [
        [0.4122214708, 0.5363325363, 0.0514459929],
        [0.2119034982, 0.6806995451, 0.1073969566],
        [0.0883024619, 0.2817188376, 0.6299787005],
    ]
)
TO_LAB = np.array(
    [
        [0.2104542553, 0.7936177850, -0.0040720468],
        [1.9779984951, -2.4285922050, 0.4505937099],
        [0.0259040371, 0.7827717662, -0.8086757660],
    ]
)


def at_frame(frame: int, frames: int, keys: int) -> tuple[int, float]:
    """Between which two of `keys` lightings a frame lies, by the first, and how far, 0 to 1."""
    if keys == 1:
        return 0, 0.0
    position = frame * (keys - 1) / (frames - 1)
    first = min(floor(position), keys - 2)
    return first, position - first


def between(ends: Sequence[Lighting], share: float, *, space: Space) -> Lighting:
    """The lighting at `share`, 0 to 1, of the way from one to the other.

    Raises LightingError if the two are not of the same lights.
    """
    one, other = ends
    if one.members != other.members or one.fixed != other.fixed:
        raise LightingError(
            "the lightings of a sequence are of different lights, or of lights in other groups"
        )
    mix = _in_stops if space == "log" else _in_oklab
    lights = tuple(
        light
        if light.is_fixed
        else with_emission(
            light, mix(np.array(light.emission), np.array(other[light.name].emission), share)
        )
        for light in one.lights
    )
    return replace(one, lights=lights, certificate=None)


def _in_stops(one: Doubles, other: Doubles, share: float) -> Doubles:
    """Each channel by the same stops in each frame; what is off is that DARK stops below."""
    if share in (0.0, 1.0):
        return other if share else one
    floor_ = np.maximum(one, other) * 2.0**-DARK
    ends = np.maximum(one, floor_), np.maximum(other, floor_)
    # Of what is off at both ends there is no logarithm.
    ratio = np.divide(ends[1], ends[0], out=np.ones(3), where=ends[0] > 0)
    return np.asarray(ends[0] * ratio**share)


def _in_oklab(one: Doubles, other: Doubles, share: float) -> Doubles:
    if share in (0.0, 1.0):
        return other if share else one
    if np.ptp(one) == np.ptp(other) == 0:  # as of what can only be dimmed: grey to the last bit
        light = ((1 - share) * np.cbrt(one[0]) + share * np.cbrt(other[0])) ** 3
        return np.full(3, light)
    ends = [TO_LAB @ np.cbrt(TO_CONES @ rgb) for rgb in (one, other)]
    lab = (1 - share) * ends[0] + share * ends[1]
    linear = np.linalg.solve(TO_CONES, np.linalg.solve(TO_LAB, lab) ** 3)
    # Between two colours a lamp can have lies now and then one that it cannot.
    return np.maximum(linear, 0.0)
