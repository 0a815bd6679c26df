"""Interpolation of lightings for the frames of a sequence, even in stops or perceived colour."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import floor

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.batch.manifest.keys import Space, with_emission
from lightpaint.colour import NAMED_DUV, cct_and_duv, kelvin_to_rgb, luminance
from lightpaint.display_text import some_names
from lightpaint.errors import LightingError
from lightpaint.lighting import Lighting, LightSetting

#: Stops below the brighter end at which a light that is off begins or ends, in `log`.
OFF_STOPS = 10.0

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


def frame_position(frame: int, frames: int, keys: int) -> tuple[int, float]:
    """Return the first of the two lightings between which a frame lies, and how far, 0 to 1."""
    if keys == 1:
        return 0, 0.0
    position = frame * (keys - 1) / (frames - 1)
    first = min(floor(position), keys - 2)
    return first, position - first


def interpolate(ends: Sequence[Lighting], share: float, *, space: Space) -> Lighting:
    """Return the lighting at `share`, 0 to 1, of the way from one to the other.

    Raises LightingError if the two have different lights, or have them at different places.
    """
    first, second = ends
    moved_names = [
        place.name
        for place, end_place in zip(first.places, second.places, strict=False)
        if not place.site.is_near(end_place.site)
    ]
    if moved_names:
        raise LightingError(
            f"the lightings of a sequence have {some_names(moved_names)} at different places, and "
            "no lamp travels between two looks: let these share places"
        )
    if first.members != second.members or first.fixed != second.fixed:
        raise LightingError(
            "the lightings of a sequence are of different lights, or of lights in other groups"
        )
    mix = _mix_in_stops if space == "log" else _mix_in_oklab

    def between(light: LightSetting) -> LightSetting:
        end = second[light.name]
        if light.is_fixed:
            return light
        if light.mix is not None and end.mix is not None:
            return _mix_of_drives(light, end, share, mix)
        return with_emission(light, mix(np.array(light.emission), np.array(end.emission), share))

    lights = tuple(map(between, first.lights))
    return replace(first, lights=lights, certificate=None)


def _mix_of_drives(
    first: LightSetting,
    second: LightSetting,
    share: float,
    mix: Callable[[Doubles, Doubles, float], Doubles],
) -> LightSetting:
    """Return a lamp between two of its mixes: evenly in the shares of its emitters, and at the
    brightness that `mix` gives to greys.
    """
    drives = [np.array(x.mix) for x in (first, second)]
    y = [float(luminance(np.array(x.emission))) for x in (first, second)]
    level = float(mix(np.full(3, y[0]), np.full(3, y[1]), share)[0])
    # A lamp that is off has the mix of the other end.
    parts = [(a / b, s) for a, b, s in zip(drives, y, (1 - share, share), strict=True) if b > 0]
    if not parts or level == 0:
        return first.with_mix(0 * drives[0])
    weight = sum(s for _, s in parts) or 1.0
    return first.with_mix(np.asarray(sum(s * x for x, s in parts) * (level / weight)))


def _mix_in_stops(first: Doubles, second: Doubles, share: float) -> Doubles:
    """Mix brightness evenly in stops, and colour evenly as perceived.

    Mixed channel by channel, a lamp would pass through colours of neither end: from red to blue
    through green. A light that is off starts OFF_STOPS below the other end, in the other's colour.
    """
    if share in (0.0, 1.0):
        return second if share else first
    brightness = [float(luminance(rgb)) for rgb in (first, second)]
    minimum = max(brightness) * 2.0**-OFF_STOPS
    if minimum == 0:
        return np.zeros(3)
    hues = [rgb / y for rgb, y in zip((first, second), brightness, strict=True) if y > minimum]
    y = max(brightness[0], minimum) ** (1 - share) * max(brightness[1], minimum) ** share
    if len(hues) == 1 or np.ptp(first) == np.ptp(second) == 0:
        return np.asarray(y * hues[0])
    return np.asarray(y * _mix_hues(hues[0], hues[1], share))


def _mix_hues(first: Doubles, second: Doubles, share: float) -> Doubles:
    """Return the colour, (3,) of luminance 1, at `share` between two of luminance 1.

    Whites stay white: they follow the black bodies, evenly in mireds and Duv. A straight line from
    2000 to 9000 K would be pink in the middle, at a Duv of -0.010. Other colours are mixed in Oklab
    at equal lightness, so that the mix does not depend on their brightness.
    """
    whites = [cct_and_duv(rgb) for rgb in (first, second)]
    if all(white is not None and abs(white[1]) <= NAMED_DUV for white in whites):
        (kelvin, duv), (kelvin_, duv_) = whites  # type: ignore[misc]
        mired = (1 - share) * 1e6 / kelvin + share * 1e6 / kelvin_
        return kelvin_to_rgb(1e6 / mired, (1 - share) * duv + share * duv_)
    ends = [TO_LAB @ np.cbrt(TO_CONES @ rgb) for rgb in (first, second)]
    lab = (1 - share) * ends[0] / ends[0][0] + share * ends[1] / ends[1][0]
    # The mix of two colours that a lamp can have may lie outside its gamut.
    linear = np.maximum(_lab_to_linear(lab), 0.0)
    return np.asarray(linear / luminance(linear))


def _lab_to_linear(lab: Doubles) -> Doubles:
    """Return linear Rec.709, (3,), of Oklab."""
    return np.asarray(np.linalg.solve(TO_CONES, np.linalg.solve(TO_LAB, lab) ** 3))


def _mix_in_oklab(first: Doubles, second: Doubles, share: float) -> Doubles:
    if share in (0.0, 1.0):
        return second if share else first
    if np.ptp(first) == np.ptp(second) == 0:  # a light that can only be dimmed stays exactly grey
        light = ((1 - share) * np.cbrt(first[0]) + share * np.cbrt(second[0])) ** 3
        return np.full(3, light)
    ends = [TO_LAB @ np.cbrt(TO_CONES @ rgb) for rgb in (first, second)]
    lab = (1 - share) * ends[0] + share * ends[1]
    return np.maximum(_lab_to_linear(lab), 0.0)
