"""Lamps at full: all emitters of a lights file on, as far as their power and colour let them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lightpaint.arrays import RGB, Doubles, as_rgb
from lightpaint.basis import BasisLight
from lightpaint.colour import Lamp
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.unknowns.knobs import Knob
from lightpaint.lighting.unknowns.reduction import reduce_to

#: Keys of a light that say how bright it is.
LEVELS = ("limits", "lock", "off")


@dataclass(frozen=True)
class FullLamp:
    """A lamp at full. emission: in the unit of its light. watts: None if unknown."""

    lamp: Lamp
    emission: RGB
    watts: float | None


def full_lamps(constraints: Constraints, lights: Sequence[BasisLight]) -> Mapping[int, FullLamp]:
    """Return the lamps of lights at full, by the indices of these, whatever limits dim them to.

    Limits may be shares of what a lamp gives now, so this does not depend on them. A lamp on a
    wheel whose slots are its emitters has none, since one slot at a time shines. Raises
    ConstraintError.
    """
    tables = tuple(
        (name, {key: x for key, x in table.items() if key not in LEVELS}, where)
        for name, table, where in constraints.lights
    )
    reduction = reduce_to(replace(constraints, lights=tables, requirements=None), lights)
    of_knobs = {k: row for knob in reduction.knobs for k, row in _emissions(knob).items()}
    return {
        k: FullLamp(lamp, as_rgb(emission), lamp.watts_for(emission))
        for k, lamp in reduction.lamps.items()
        if (emission := of_knobs.get(k, _all_on(lamp))) is not None
    }


def _emissions(knob: Knob) -> Mapping[int, Doubles | None]:
    """Return the brightest emission (3,) of each light of a knob; None if it has none."""
    upper = np.array([x.upper for x in knob.unknowns])
    if knob.wheel is not None or not np.isfinite(upper).all():
        return dict.fromkeys(knob.lights)
    if knob.limit is not None:
        coefficients, _, most = knob.limit
        upper = upper * min(1.0, most / max(float(np.dot(coefficients, upper)), 1e-300))
    found = {k: np.zeros(3) for k in knob.lights}
    for unknown, x in zip(knob.unknowns, upper, strict=True):
        for k, color in unknown.columns:
            found[k] = found[k] + x * color
    return found


def _all_on(lamp: Lamp) -> Doubles | None:
    """Return the emission (3,) of a lamp that stays as it is, with all its emitters on."""
    if lamp.is_wheel:
        return None
    power = 1.0 if lamp.power_share is None else float(lamp.powers @ lamp.most)
    share = 1.0 if lamp.power_share is None else min(1.0, lamp.power_share / power)
    return share * lamp.most @ lamp.columns
