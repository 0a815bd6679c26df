"""The wish of paint that ends at the top of its range.

Eight bits end at the white of a display, so a wash that makes a room warmer ends there at a lamp
that is white already. Read as it stands, that place asks for less than the paint around it: a wish
that nobody had. Such paint means at least its light, so it asks for the change that the rest of its
layer does where that is more.
"""

import numpy as np

from lightpaint.arrays import Bools, Floats
from lightpaint.target.target import Target

#: Light below which a ratio says little, relative to the mean of the look.
DARK = 0.01

#: Coverage from which a pixel belongs to a layer, and the approximate number of pixels of one that
#: are compared.
COVERED, SAMPLES = 0.5, 2**14


def extend_saturated(target: Target, current_look: Floats) -> Floats:
    """Return the painting, (h, w, 3) linear, with what its saturated values ask for at least.

    current_look: (h, w, 3) linear, the current look at the size of the target. A value at the top
    of its range becomes the look times the median ratio of painting to look of the other pixels of
    its layer, where that is brighter; without layers, of all paint.
    """
    if target.at_least is None or not target.at_least.any() or not target.over_look:
        return target.image
    dark = DARK * float(np.mean(current_look))
    if not dark > 0:
        return target.image
    image, painted = target.image.copy(), target.importance > 0
    layers = [painted & (wish.area > COVERED) for wish in target.wishes] or [painted]
    for own in layers:
        usual = _median_ratio(target.image, current_look, own & ~target.at_least.any(-1), dark)
        lifted = np.maximum(image, (current_look * usual).astype(np.float32))
        image = np.where(own[..., None] & target.at_least, lifted, image)
    return image


def _median_ratio(image: Floats, look: Floats, pixels: Bools, dark: float) -> Floats:
    """Return the median ratio of a painting to the look in `pixels`, (3,); 0 where there are none.

    dark: light that is added to both.
    """
    chosen = np.flatnonzero(pixels)
    if not chosen.size:
        return np.zeros(3, np.float32)
    chosen = chosen[:: 1 + chosen.size // SAMPLES]
    painted, now = (np.maximum(x.reshape(-1, 3)[chosen], 0) + dark for x in (image, look))
    return np.asarray(np.median(painted / now, axis=0), np.float32)
