"""Own colours for exported lights whose colour the painting does not determine."""

from collections.abc import Mapping

import numpy as np

from lightpaint.arrays import RGB, as_rgb
from lightpaint.colour.color import luminance
from lightpaint.lighting.answer.light_setting import LightSetting
from lightpaint.lighting.answer.lighting import Lighting

#: Width of a 95 % interval, relative to the brightest channel, from which a light is hardly known.
WIDE = 1.0


def with_own_colors(
    lighting: Lighting, present: Mapping[str, RGB]
) -> tuple[Lighting, tuple[str, ...]]:
    """Return the lighting for other programs, and the names of lights that differ from the answer.

    The solve gives a hardly visible light an arbitrary colour, often a pure one. If an interval is
    wider than the light is bright, and the light's colour in the scene lies within the intervals of
    all channels at some brightness, it keeps that colour, at its solved brightness or the nearest
    one that fits. Colours with a constraint stay.

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
    """Return the emission in the light's own colour; None if the painting determines another."""
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
    # The range of factors for the present emission that fit all channels.
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
