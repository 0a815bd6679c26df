"""Restores the scene's colours for exported lights whose colour the painting does not determine."""

from collections.abc import Mapping

import numpy as np

from lightpaint.arrays import RGB, as_rgb
from lightpaint.colour.color import luminance
from lightpaint.lighting.answer.lighting import Lighting, LightSetting

#: Width of a 95 % interval, relative to the brightest channel, above which a light is hardly known.
UNBOUNDED = 1.0


def with_own_colors(
    lighting: Lighting, current: Mapping[str, RGB]
) -> tuple[Lighting, tuple[str, ...]]:
    """Return the lighting for other programs, and the names of lights that differ from the answer.

    The solve gives a hardly visible light an arbitrary colour, often a saturated one. If an
    interval is wider than the light is bright, and the light's colour in the scene lies within the
    intervals of all channels at some brightness, it keeps that colour, at its solved brightness or
    at the nearest one that fits. Colours with a constraint are kept.

    current: emission in the scene by light name, in the same units.
    """
    names = []
    for light in lighting.lights:
        rgb = _own_color(light, current[light.name])
        if rgb is not None:
            names.append(light.name)
            lighting = lighting.with_emission(light.name, rgb)
    return lighting, tuple(names)


def _own_color(light: LightSetting, current: RGB) -> RGB | None:
    """Return the emission in the scene's colour; None if the painting determines another colour."""
    color, solved_emission = np.array(current, np.float64), np.array(light.emission, np.float64)
    ends = light.interval
    if (
        light.is_fixed
        or light.constraint
        or ends is None
        or not color.any()
        or not solved_emission.any()
    ):
        return None
    ends_known = [x for x in ends if x is not None]
    if (
        len(ends_known) < 3
        or max(high - low for low, high in ends_known) <= UNBOUNDED * solved_emission.max()
    ):
        return None
    if np.allclose(
        solved_emission * color.max(),
        color * solved_emission.max(),
        rtol=0,
        atol=1e-6 * color.max() * solved_emission.max(),
    ):
        return None  # it has that colour already
    # The range of factors for the current emission that fits all channels.
    lowest, highest = 0.0, np.inf
    for (low, high), value in zip(ends_known, color, strict=True):
        if value == 0:
            lowest = lowest if low <= 0 else np.inf
        else:
            lowest, highest = max(lowest, low / value), min(highest, high / value)
    if lowest > highest:
        return None
    times = float(luminance(solved_emission)) / float(luminance(color))
    return as_rgb(color * min(max(times, lowest), highest))
