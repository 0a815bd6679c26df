"""The exposure at which a picture mixed from a basis is shown."""

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.basis.basis import Basis
from lightpaint.colour.display.exposure import choose_exposure


def meter_exposure(image: Floats, *bases: Basis) -> float:
    """Return the exposure in stops at which to show a picture mixed from `bases`.

    image: (h, w, 3) linear; for several bases, their pixels in one row, (1, p, 3). Visible emitters
    are ignored, except in light groups, which do not say where they are.
    """
    if not all(basis.knows_noise for basis in bases):
        return choose_exposure(image)
    is_emitter = [basis.emitters_seen.ravel() for basis in bases]
    return choose_exposure(image, np.concatenate(is_emitter).reshape(image.shape[:2]))
