"""Colours of objects under a lighting with spectra, and by daylight.

Two lights that are white alike show a surface in different colours (metamerism). The light on an
object is the light of the lamps in their shares there, each with its spectrum.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import RGB, Bools, Doubles, as_rgb
from lightpaint.colour import adapted_color, ciede2000, lab, luminance, white_of, xyz_of_powers
from lightpaint.lighting.answer.lighting import LightSetting
from lightpaint.lighting.solution import Solution

#: Luminous reflectance below which a surface has no colour to speak of: black, mirrors, glass.
DARKEST = 0.01

#: Most pixels of an object whose light is averaged.
MAX_PIXELS = 2**12


@dataclass(frozen=True)
class SurfaceColor:
    """The colour of an object under a lighting, and by daylight.

    name: of the object. daylight, seen: linear Rec.709 as a display shows it, for eyes that are
    used to the light; white is 1. delta_e: CIEDE2000 between the two; None, like `seen`, where
    the light on the object is dark or far from white.
    """

    name: str
    daylight: RGB
    seen: RGB | None
    delta_e: float | None


def surface_colors(
    solution: Solution, reflectances: Mapping[int, Doubles], daylight: Doubles
) -> tuple[SurfaceColor, ...]:
    """Return the colours of objects under the answer to one view, the most changed first.

    reflectances: (81,) of each object by its index. daylight: (81,), the power of D65, which is
    also that of lights that stay as they are.
    """
    objects = solution.basis.objects
    if objects is None:
        return ()
    spectra = np.array([_spectrum(light, daylight) for light in solution.lighting.lights])
    found = []
    for k, reflectance in reflectances.items():
        if xyz_of_powers(daylight * reflectance)[1] < DARKEST * xyz_of_powers(daylight)[1]:
            continue
        shares = _luminance_by_light(solution, objects.index == k)
        of_surface = np.array([xyz_of_powers(x * reflectance)[1] for x in spectra])
        light = np.divide(shares, of_surface, out=0 * shares, where=of_surface > 0) @ spectra
        found.append(_color_of(objects.names[k], reflectance, np.maximum(light, 0), daylight))
    return tuple(sorted(found, key=lambda x: -(x.delta_e or 0)))


def _spectrum(light: LightSetting, daylight: Doubles) -> Doubles:
    """Return the spectrum (81,) of an emitter that is a light; of others, daylight's."""
    if light.lamp is None or not light.part_of:
        return daylight
    [emitter] = light.lamp.emitters
    return daylight if emitter.spectrum is None else np.array(emitter.spectrum)


def _luminance_by_light(solution: Solution, mask: Bools) -> Doubles:
    """Return the luminance that each light gives an object on average, (n,)."""
    pixels = np.flatnonzero(mask)
    pixels = pixels[:: max(1, len(pixels) // MAX_PIXELS)]
    seen = solution.basis.planes.pixels(pixels).mean(axis=1, dtype=np.float64)
    return np.asarray(luminance(seen * solution.weights), np.float64)


def _color_of(name: str, reflectance: Doubles, light: Doubles, daylight: Doubles) -> SurfaceColor:
    shown = adapted_color(daylight, reflectance)
    if not light.any() or white_of(light) is None:
        return SurfaceColor(name, as_rgb(shown), None, None)
    seen = adapted_color(light, reflectance)
    return SurfaceColor(name, as_rgb(shown), as_rgb(seen), float(ciede2000(lab(shown), lab(seen))))
