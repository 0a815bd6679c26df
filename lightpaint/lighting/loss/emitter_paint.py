"""Paint over an emitter in view is paint for what that lights, or its glow, seldom for less light.

A flame outshines every display. Somebody who paints a table and the lantern on it warm means no
less light of the lantern, though each pixel of the flame is darker painted than it is. Only paint
that darkens what is around the emitter, or what a display shows of the emitter where nothing around
it is painted, asks for less.
"""

import numpy as np

from lightpaint.arrays import Bools, Doubles, Floats, Slices
from lightpaint.colour.color import luminance
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.images.estimate import box_mean

#: How far around an emitter's pixel paint is looked at: a part of the picture's height, and pixels
#: at least.
RADIUS, MIN_RADIUS = 1 / 30, 2

#: Stops from which on paint is darker than what it covers.
DARKER_STOPS = 0.5

#: Light beside the picture's mean, below which a ratio says nothing.
DARK = 0.01

#: Mean importance of paint that is none.
NOTHING = 1e-7


def dark_of(look: Floats, seen: Bools) -> float:
    """Return the light under which a ratio says nothing of a picture (h, w, 3). seen: (h, w)."""
    return DARK * float(luminance(look[~seen].mean(axis=0))) if not seen.all() else 0.0


def paint_radius(size: tuple[int, int]) -> int:
    """Return how far around an emitter's pixel paint is looked at, in pixels. size: (h, w)."""
    return max(MIN_RADIUS, round(RADIUS * size[0]))


def asks_no_less(
    image: Floats,
    importance: Floats,
    look: Floats,
    seen: Bools,
    transform: ViewTransform | None,
    *,
    dark: float,
) -> Bools:
    """Return where emitters are painted and no less light of them is meant, (h, w).

    image: (h, w, 3) linear, the painting; importance: (h, w); look: (h, w, 3) linear, the present
    one; seen: (h, w), where an emitter is. transform: that shows both; None for light itself. dark:
    as of `dark_of`, of the whole picture, of which these may be a part.
    """
    found = seen & (importance > 0)
    if not found.any():
        return found
    counts = importance * ~seen
    radius = paint_radius(seen.shape)
    near, painted, now = (
        box_mean(np.asarray(x, np.float64), radius)
        for x in (counts, counts * _bright(image), counts * _bright(look))
    )
    # Sums that slide along have round-off where they are 0.
    is_near = near > NOTHING
    # Of ratios of means, since single pixels are noise.
    change = _stops(painted + dark * near, now + dark * near)
    own = _stops(_bright(_shown(image, transform)) + dark, _bright(_shown(look, transform)) + dark)
    return np.asarray(found & (np.where(is_near, change, own) > -DARKER_STOPS))


def grow(region: Slices, size: tuple[int, int]) -> Slices:
    """Return the rectangle in which paint within `region` may change what paint says."""
    by = paint_radius(size)
    (top, bottom, _), (left, right, _) = (
        part.indices(length) for part, length in zip(region, size, strict=True)
    )
    rows = slice(max(top - by, 0), min(bottom + by, size[0]))
    return rows, slice(max(left - by, 0), min(right + by, size[1]))


def _bright(image: Floats | Doubles) -> Doubles:
    return np.maximum(np.asarray(luminance(np.asarray(image, np.float64))), 0)


def _shown(image: Floats, transform: ViewTransform | None) -> Floats | Doubles:
    """Return light as bright as a display shows it."""
    return image if transform is None else np.minimum(image, transform.white)


def _stops(to: Doubles, of: Doubles) -> Doubles:
    safe = np.maximum(of, 1e-30)
    return np.asarray(np.log2(np.maximum(to, 1e-30) / safe))
