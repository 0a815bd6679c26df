"""Colour rendering of the lamps of a lighting, what it costs, and the light that they make of a
watt.
"""

from dataclasses import dataclass, replace

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.colour import ColorRendering, Lamp, color_rendering, fidelity
from lightpaint.lighting.answer.lighting import Lighting, LightSetting

#: Most lamps whose best mix is searched for the table alone, which takes up to half a second each.
SEARCHED_LAMPS = 32


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

    color: ColorRendering | None
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
    color, best, watts = color_rendering(light.powers), None, _watts(lamp, drives)
    if color is not None and (is_searched or lamp.searches_rendering):
        mix = lamp.best_rendering(emission)
        best = max(color.rf, fidelity(mix @ lamp.powers_at_full))
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
        found, plain_rf=fidelity(plain @ lamp.powers_at_full), plain_watts=_watts(lamp, plain)
    )


def _watts(lamp: Lamp, drives: Doubles) -> float | None:
    """Return the power of drives (e,); None if the power of an emitter is unknown."""
    known = [x.watts for x in lamp.emitters if x.watts is not None]
    return float(drives @ np.array(known)) if len(known) == len(lamp.emitters) else None
