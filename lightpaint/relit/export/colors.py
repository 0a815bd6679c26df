"""Colours that the painting does not tell: in exports such a light keeps its own."""

from collections.abc import Mapping

import numpy as np

from lightpaint.arrays import RGB, as_rgb
from lightpaint.colour.color import luminance
from lightpaint.lighting.answer.light_setting import LightSetting
from lightpaint.lighting.answer.lighting import Lighting

#: Width of a 95 % interval, beside the brightest channel, from which on a light is hardly known.
WIDE = 1.0


def with_own_colors(
    lighting: Lighting, present: Mapping[str, RGB]
) -> tuple[Lighting, tuple[str, ...]]:
    """Return the lighting as other programs should get it, and the names of lights that differ.

    Of a light that is hardly seen the solve finds some colour or other, often a pure one. Where an
    interval is wider than the light is bright, and the colour that the light has in the scene lies
    within the intervals of all channels at some brightness, it keeps that colour: at the brightness
    that was found, or the nearest at which it fits. Colours that somebody asked for stay.

    present: emission in the scene, by name, in the same units.
    """
    changed = []
    for light in lighting.lights:
        rgb = _own(light, present[light.name])
        if rgb is not None:
            changed.append(light.name)
            lighting = lighting.with_emission(light.name, rgb)
    return lighting, tuple(changed)


def _own(light: LightSetting, present: RGB) -> RGB | None:
    """Return the emission in the light's own colour; None where the painting tells another."""
    own, found = np.array(present, np.float64), np.array(light.emission, np.float64)
    ends = light.interval
    if light.is_fixed or light.constraint or ends is None or not own.any() or not found.any():
        return None
    known = [x for x in ends if x is not None]
    if len(known) < 3 or max(high - low for low, high in known) <= WIDE * found.max():
        return None
    if np.allclose(
        found * own.max(), own * found.max(), rtol=0, atol=1e-6 * own.max() * found.max()
    ):
        return None  # it has its own colour already
    # How often the present emission fits between the ends, channel by channel.
    least, most = 0.0, np.inf
    for (low, high), its in zip(known, own, strict=True):
        if its == 0:
            least = least if low <= 0 else np.inf
        else:
            least, most = max(least, low / its), min(most, high / its)
    if least > most:
        return None
    times = float(luminance(found)) / float(luminance(own))
    return as_rgb(own * min(max(times, least), most))
