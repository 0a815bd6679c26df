"""Colour rendering of the lamps of a lighting, and the light that they make of a watt."""

from dataclasses import dataclass

import numpy as np

from lightpaint.colour.spectra.color_rendering import (
    ColorRendering,
    color_rendering,
    fidelity,
)
from lightpaint.lighting.answer.lighting import Lighting, LightSetting

#: Most lamps whose best mix is searched, which takes a second or two for each.
SEARCHED_LAMPS = 8


@dataclass(frozen=True)
class LightRendering:
    """Colour rendering and efficacy of a lamp.

    color: how it renders colours; None for a light that is off, or far from white. best_rf: the
    highest Rf that was found among mixes of the same colour, of the first lamps. lm_per_w: None if
    lumens or watts are unknown.
    """

    color: ColorRendering | None
    best_rf: float | None
    lm_per_w: float | None


def renderings_of(lighting: Lighting) -> dict[str, LightRendering]:
    """Return those of each lamp that is on and whose spectra are known, by its name."""
    lamps = [x for x in lighting.of_lamps().lights if x.powers is not None and x.powers.any()]
    return {
        light.name: _rendering(lighting, light, is_searched=k < SEARCHED_LAMPS)
        for k, light in enumerate(lamps)
    }


def _rendering(lighting: Lighting, light: LightSetting, *, is_searched: bool) -> LightRendering:
    assert light.lamp is not None
    assert light.powers is not None
    color, best = color_rendering(light.powers), None
    if color is not None and is_searched:
        mix = light.lamp.best_rendering(np.array(light.emission))
        assert light.lamp.powers_at_full is not None
        best = max(color.rf, fidelity(mix @ light.lamp.powers_at_full))
    watts = [x.watts for x in light.lamp.emitters]
    known = [x for x in watts if x is not None]
    lumens, lm_per_w = lighting.photometry(light).flux_lm, None
    if lumens is not None and len(known) == len(watts):
        power = float(np.array([*light.drives.values()]) @ np.array(known))
        lm_per_w = lumens / power if power > 0 else None
    return LightRendering(color, best, lm_per_w)
