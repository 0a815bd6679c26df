"""Removal of weights that are mere round-off of lights that are off.

For a painting that is a mix of the layers without a light, the solve finds 10⁻⁹ of that light
instead of 0, because numbers in a file are rounded. A reader of −28 stops would take that for an
answer.
"""

import numpy as np

from lightpaint.arrays import Bools, Doubles, Floats
from lightpaint.basis.basis import Basis

#: Largest relative error of one rounding to float16 and to float32.
HALF_ROUND_OFF, SINGLE_ROUND_OFF = 2.0**-11, 2.0**-24

#: Roundings that may add up: those of the painting, the layers and the sum.
ROUNDINGS = 4

#: A light above this share of its current emission counts as on, however little it shows.
MAX_TRACE = 2.0**-11


def remove_traces(
    basis: Basis, weights: Doubles, image: Floats, *, is_constrained: Bools
) -> Doubles:
    """Return weights (n, 3) with 0 for those that are visible in no pixel.

    is_constrained: (n,), lights with constraints, whose weights are kept.

    A weight is a trace if it is small, and its light in each pixel is below the round-off of the
    other lights there, or of the picture's mean where there are none. Round-off is that of the
    painting, `image`, or of the layers: float16 if all of these are. A basis with known noise keeps
    its weights: noise is larger, and error bars show it.
    """
    small = (weights > 0) & (weights <= MAX_TRACE) & ~(basis.is_fixed | is_constrained)[:, None]
    if basis.knows_noise or not small.any():
        return weights
    # The fixed part is a difference, with a round-off of its own.
    is_half = _is_half(image) or all(
        _is_half(plane) for k, plane in enumerate(basis.planes) if not basis.is_fixed[k]
    )
    resolution = ROUNDINGS * (HALF_ROUND_OFF if is_half else SINGLE_ROUND_OFF)
    mixed = basis.mix(weights)
    size = np.sqrt(np.square(mixed, dtype=np.float64).mean())
    cleaned = weights.copy()
    for k, c in np.argwhere(small):
        added = weights[k, c] * basis.planes.plane(k)[..., c]
        if (np.abs(added) <= resolution * (np.abs(mixed[..., c] - added) + size)).all():
            cleaned[k, c] = 0
    return cleaned


def _is_half(image: Floats) -> bool:
    """Return whether float16 holds all numbers of an image."""
    with np.errstate(over="ignore"):
        return bool((image.astype(np.float16) == image).all())
