"""The restriction to whites, for all lamps whose colour is open."""

from collections.abc import Sequence

from lightpaint.basis.lights import BasisLight
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.constraints.light_patterns import lights_of_open_color

#: The range of usual lamps, in kelvin.
LAMP_KELVINS = (2200, 9000)


def whiten_open_lights(constraints: Constraints, lights: Sequence[BasisLight]) -> Constraints:
    """Return constraints in which every light of open colour also stays between LAMP_KELVINS."""
    free = [lights[k].name for k in lights_of_open_color(constraints, lights)]
    return constraints.and_then(
        Constraints.of({name: {"kelvin": list(LAMP_KELVINS)} for name in free})
    )
