"""What is left of a light that is off: weights that only rounding has made.

Where a painting is a mix of the layers in which a light is off, the solve finds 10⁻⁹ of it instead
of 0, because numbers in a file are rounded. Whoever reads −28 stops takes that for an answer.
"""

import numpy as np

from lightpaint.arrays import Bools, Doubles, Floats
from lightpaint.basis.basis import Basis

#: Largest relative error of one rounding to float16 and to float32.
HALF, SINGLE = 2.0**-11, 2.0**-24

#: Roundings that may go the same way: those of the painting, the layers and the sum.
ROUNDINGS = 4

#: A light at more than this share of what it was is on, however little there is to be seen of it.
LARGEST = 2.0**-11


def without_traces(basis: Basis, weights: Doubles, image: Floats, *, is_asked: Bools) -> Doubles:
    """Weights (n, 3) in which what shows in no pixel is 0.

    is_asked: (n,), the lights of which something is asked, which keep what they have.

    A weight is a trace if it is small and what it adds is in no pixel more than rounding makes of
    the other lights there, or of the picture in the mean where there are none. The numbers are as
    coarse as those of the painting, `image`, or of the layers: float16 where all of these are.
    Of a basis that knows its noise nothing is taken: that is larger, and error bars tell it.
    """
    small = (weights > 0) & (weights <= LARGEST) & ~(basis.is_fixed | is_asked)[:, None]
    if basis.knows_noise or not small.any():
        return weights
    # What is kept is a difference, and as fine as that comes out.
    is_half = _is_half(image) or all(
        _is_half(plane) for k, plane in enumerate(basis.planes) if not basis.is_fixed[k]
    )
    resolution = ROUNDINGS * (HALF if is_half else SINGLE)
    mixed = basis.mix(weights)
    size = np.sqrt(np.square(mixed, dtype=np.float64).mean())
    kept = weights.copy()
    for k, c in np.argwhere(small):
        added = weights[k, c] * basis.planes.plane(k)[..., c]
        if (np.abs(added) <= resolution * (np.abs(mixed[..., c] - added) + size)).all():
            kept[k, c] = 0
    return kept


def _is_half(image: Floats) -> bool:
    """Whether all numbers of an image are of float16."""
    with np.errstate(over="ignore"):
        return bool((image.astype(np.float16) == image).all())
