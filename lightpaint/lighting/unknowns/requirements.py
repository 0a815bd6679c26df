"""Sums of light and of power that a lighting has to reach, such as the illuminance of a desk."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.colour.lamp import Lamp
from lightpaint.lighting.unknowns.knobs import Knob


@dataclass(frozen=True)
class Requirements:
    """Sums that have to reach given values: Σ rows·w + watts P ≥ least, P the power of all lamps.

    rows: (m, n, 3), the part of each weight. watts: (m,), -1 for a limit of the power, 0 for sums
    of light. least: (m,).
    """

    rows: Doubles
    watts: Doubles
    least: Doubles

    def __len__(self) -> int:
        return len(self.least)

    def lowered(self, slack: Doubles) -> "Requirements":
        """Return requirements that ask for less. slack: (m,)."""
        return Requirements(self.rows, self.watts, self.least - slack)


def watts_of_unknowns(knobs: Sequence[Knob], lamps: Mapping[int, Lamp]) -> Doubles:
    """Return the power, (k,), of each x at 1; 0 for those of lights of unknown power."""
    powers = list[float]()
    for knob in knobs:
        lamp = lamps.get(knob.lights[0]) if len(knob.lights) == 1 else None
        if lamp is not None and len(lamp.emitters) == len(knob.unknowns) > 1:
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
