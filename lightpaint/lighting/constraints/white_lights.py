"""Lamps that may only be white, as if that had been asked of each."""

from collections.abc import Sequence

from lightpaint.basis.lights import BasisLight
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.constraints.light_patterns import of_each_light, tied_lights

#: What lamps are made for, in kelvin.
WHITES = (2200, 9000)


def white_where_free(asked: Constraints, lights: Sequence[BasisLight]) -> Constraints:
    """`asked`, and of every light whose colour is left open that it be between WHITES."""
    tied = tied_lights(asked, lights)
    free = [
        light.name
        for k, (light, one) in enumerate(zip(lights, of_each_light(asked, lights), strict=True))
        if not (light.is_fixed or light.is_scalar or k in tied)
        and (one is None or not (one.is_held or one.primaries is not None))
    ]
    return asked.and_then(Constraints.of({name: {"kelvin": list(WHITES)} for name in free}))
