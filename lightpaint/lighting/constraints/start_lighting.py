"""A lighting to start from, set by hand, in place of that of the scene.

The painting is answered by lights near to it: unpainted parts are held to its look, the colours of
its lamps count as theirs, and what the painting leaves open stays as it is.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from lightpaint.arrays import RGB, Doubles
from lightpaint.basis import Basis, BasisLight, Lights
from lightpaint.display_text import some_names, with_similar_name
from lightpaint.errors import ConstraintError
from lightpaint.images import Estimate


def start_weights(start: Mapping[str, RGB], lights: Sequence[BasisLight]) -> Doubles:
    """Return the weights (n, 3) that a solve starts from: those of the scene for other lights.

    start: emissions by name. Raises ConstraintError for a light that is not there, or is fixed.
    """
    weights = np.array(Lights.of(lights).current_weights)
    names = [light.name for light in lights]
    for name, emission in start.items():
        if name not in names:
            hint = with_similar_name(f"there are {some_names(names)}", name, names)
            raise ConstraintError(f"start: no light {name!r}; {hint}")
        light = lights[names.index(name)]
        if light.is_fixed or (light.is_scalar and len(set(emission)) > 1):
            reason = "is fixed" if light.is_fixed else "can only be dimmed as a whole"
            raise ConstraintError(f"start.{name} is {list(emission)}, and {name!r} {reason}")
        weights[names.index(name)] = emission
    return weights


def held_at_start(basis: Basis, start: Mapping[str, RGB]) -> Basis:
    """Return a basis whose unpainted parts are held to the look of the lighting to start from."""
    if not start:
        return basis
    weights = start_weights(start, basis.lights)
    return replace(basis, former=Estimate(basis.mix(weights), basis.noise.mix(weights)))
