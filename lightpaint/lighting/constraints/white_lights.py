"""The restriction to whites, for all lamps whose colour is open."""

from collections.abc import Sequence

from lightpaint.basis.lights import BasisLight
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.constraints.light_patterns import constraints_by_light, tied_lights

#: The range of usual lamps, in kelvin.
LAMP_KELVINS = (2200, 9000)


def whiten_open_lights(constraints: Constraints, lights: Sequence[BasisLight]) -> Constraints:
    """Return constraints in which every light of open colour also stays between LAMP_KELVINS."""
    tied = tied_lights(constraints, lights)
    free = [
        light.name
        for k, (light, constraint) in enumerate(
            zip(lights, constraints_by_light(constraints, lights), strict=True)
        )
        if not (light.is_fixed or light.is_scalar or k in tied)
        and (constraint is None or not (constraint.is_fixed or constraint.primaries is not None))
    ]
    return constraints.and_then(
        Constraints.of({name: {"kelvin": list(LAMP_KELVINS)} for name in free})
    )
