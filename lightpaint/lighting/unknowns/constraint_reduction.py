"""The reduction that constraints on lights leave."""

from collections.abc import Sequence

import numpy as np

from lightpaint.basis.lights import BasisLight
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.constraints.light_patterns import constraints_by_light, tied_lights
from lightpaint.lighting.unknowns.knobs import (
    Knob,
    dimmer_knob,
    locked_emission,
    mixing_knob,
    tied_knob,
)
from lightpaint.lighting.unknowns.reduction import Reduction


def reduce_to(constraints: Constraints, lights: Sequence[BasisLight]) -> Reduction:
    """Return the unknowns that `constraints` leave among `lights`.

    Raises ConstraintError for a light that is not there, and for the impossible: a colour for a
    light that has only a dimmer, a light on two dimmers, limits that leave nothing.
    """
    by_light = constraints_by_light(constraints, lights)
    labels = ["" if constraint is None else constraint.label for constraint in by_light]
    tied, fixed, knobs = tied_lights(constraints, lights), np.zeros((len(lights), 3)), []
    for k, (light, constraint) in enumerate(zip(lights, by_light, strict=True)):
        if light.is_fixed:
            fixed[k] = 1
        elif k in tied:
            tie, members = tied[k]
            names = ", ".join(lights[i].name for i in members)
            labels[k] = ", ".join(filter(None, [f"tied ({names})", labels[k]]))
            if k == members[0]:
                knob = tied_knob(tie, members, names, lights, by_light)
                if any(
                    member_constraint.is_fixed
                    for member_constraint in (by_light[i] for i in members)
                    if member_constraint is not None
                ):
                    [level] = knob.unknowns
                    for i, rgb in level.columns:
                        fixed[i] = level.lower * rgb
                else:
                    knobs.append(knob)
        elif constraint is not None and constraint.is_fixed:
            fixed[k] = (
                0
                if constraint.lock is None
                else locked_emission(light, constraint.lock, constraint.where)
            )
        elif constraint is None:
            knobs.append(Knob.of_any_colour(k, is_scalar=light.is_scalar))
        elif light.is_scalar or (
            constraint.primaries is not None and len(constraint.primaries) == 1
        ):
            knobs.append(dimmer_knob(k, light, constraint))
        else:
            knobs.append(mixing_knob(k, light, constraint))
    return Reduction(fixed, tuple(labels), tuple(knobs))
