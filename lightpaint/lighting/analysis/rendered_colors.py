"""Colour rendering: of each lamp of a lighting, with what it costs, and of objects under them all.

Two lights that are white alike show a surface in different colours (metamerism). The light on an
object is the light of the lamps in their shares there, each with its spectrum.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from lightpaint import colour
from lightpaint.arrays import RGB, Bools, Doubles, as_rgb
from lightpaint.lighting.answer.lighting import Lighting, LightSetting
from lightpaint.lighting.solution import Solution

#: Most lamps whose best mix is searched for the table alone, which takes up to half a second each.
SEARCHED_LAMPS = 32

#: Luminous reflectance below which a surface has no colour to speak of: black, mirrors, glass.
DARKEST = 0.01

#: Most pixels of an object whose light is averaged.
MAX_PIXELS = 2**12


@dataclass(frozen=True)
class LightRendering:
    """Colour rendering and efficacy of a lamp.

    color: how it renders colours; None for a light that is off, or far from white. best_rf: the
    highest Rf that was found among mixes of the same colour, of the first lamps. lm_per_w: None if
    lumens or watts are unknown. watts: its power; None if the power of an emitter is unknown.
    wanted_rf: the least Rf that was asked for; 100 for the best. plain_rf, plain_watts: of the mix
    of the same colour that it would have without that; with spectra of the one that was solved for,
    if another was chosen since. held_mix_change: as in `LightSetting`.
    """

    color: colour.ColorRendering | None
    best_rf: float | None
    lm_per_w: float | None
    watts: float | None = None
    wanted_rf: float | None = None
    plain_rf: float | None = None
    plain_watts: float | None = None
    held_mix_change: float | None = None


def renderings_of(lighting: Lighting) -> dict[str, LightRendering]:
    """Return the colour rendering of each lamp that is on and whose spectra are known, by its
    name."""
    lamps = [x for x in lighting.of_lamps().lights if x.powers is not None and x.powers.any()]
    return {
        light.name: _rendering(lighting, light, is_searched=k < SEARCHED_LAMPS)
        for k, light in enumerate(lamps)
    }


def _rendering(lighting: Lighting, light: LightSetting, *, is_searched: bool) -> LightRendering:
    lamp = light.lamp
    assert lamp is not None
    assert light.powers is not None
    assert lamp.powers_at_full is not None
    emission, drives = np.array(light.emission), np.array([*light.drives.values()])
    color, best, watts = colour.color_rendering(light.powers), None, _watts(lamp, drives)
    if color is not None and (is_searched or lamp.searches_rendering):
        mix = lamp.best_rendering(emission)
        best = max(color.rf, colour.fidelity(mix @ lamp.powers_at_full))
    lumens, lm_per_w = lighting.photometry(light).flux_lm, None
    if lumens is not None and watts is not None:
        lm_per_w = lumens / watts if watts > 0 else None
    found = LightRendering(color, best, lm_per_w, watts)
    if not lamp.searches_rendering:
        return found
    found = replace(
        found,
        wanted_rf=100 if lamp.prefer == "rf" else lamp.least_rf,
        held_mix_change=light.held_mix_change,
    )
    if color is None or (light.mix is not None and light.solved_mix is None):
        return found
    plain = np.array(light.solved_mix or lamp.while_painting.drives_for(emission))
    return replace(
        found,
        plain_rf=colour.fidelity(plain @ lamp.powers_at_full),
        plain_watts=_watts(lamp, plain),
    )


def _watts(lamp: colour.Lamp, drives: Doubles) -> float | None:
    """Return the power of drives (e,); None if the power of an emitter is unknown."""
    known = [x.watts for x in lamp.emitters if x.watts is not None]
    return float(drives @ np.array(known)) if len(known) == len(lamp.emitters) else None


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
        if (
            colour.xyz_of_powers(daylight * reflectance)[1]
            < DARKEST * colour.xyz_of_powers(daylight)[1]
        ):
            continue
        shares = _luminance_by_light(solution, objects.index == k)
        of_surface = np.array([colour.xyz_of_powers(x * reflectance)[1] for x in spectra])
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
    return np.asarray(colour.luminance(seen * solution.weights), np.float64)


def _color_of(name: str, reflectance: Doubles, light: Doubles, daylight: Doubles) -> SurfaceColor:
    shown = colour.adapted_color(daylight, reflectance)
    if not light.any() or colour.white_of(light) is None:
        return SurfaceColor(name, as_rgb(shown), None, None)
    seen = colour.adapted_color(light, reflectance)
    return SurfaceColor(
        name,
        as_rgb(shown),
        as_rgb(seen),
        float(colour.ciede2000(colour.lab(shown), colour.lab(seen))),
    )
