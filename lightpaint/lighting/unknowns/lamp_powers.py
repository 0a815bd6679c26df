"""The power of lamps: of each unknown that drives their emitters, and of lamps that stay."""

from collections.abc import Mapping, Sequence

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.colour import Lamp
from lightpaint.lighting.unknowns.knobs import Knob


def watts_of_unknowns(knobs: Sequence[Knob], lamps: Mapping[int, Lamp]) -> Doubles:
    """Return the power, (k,), of each x at 1; 0 for those of lights of unknown power."""
    powers = list[float]()
    for knob in knobs:
        lamp = lamps.get(knob.lights[0]) if len(knob.lights) == 1 else None
        if lamp is not None and knob.has_drives_of(lamp):
            powers += [x.watts or 0.0 for x in lamp.emitters]
            continue
        for unknown in knob.unknowns:
            members = ((lamps.get(light), rgb) for light, rgb in unknown.columns)
            powers.append(sum(_watts_per_level(lamp, rgb) for lamp, rgb in members if lamp))
    return np.array(powers)


def watts_of_fixed(weights: Doubles, lamps: Mapping[int, Lamp]) -> float:
    """Return the power of lights that stay at weights (n, 3)."""
    return sum(lamp.watts_for(weights[light]) or 0.0 for light, lamp in lamps.items())


def _watts_per_level(lamp: Lamp, color: Doubles) -> float:
    """Return the power of a colour (3,), as if the lamp were as bright as it needs."""
    level = lamp.brightest(color)
    return 0.0 if level == 0 else (lamp.watts_for(level * color) or 0.0) / level
