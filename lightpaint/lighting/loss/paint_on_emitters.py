"""The meaning of paint over an emitter in view: seldom that it should give less light.

A flame outshines every display. Painting a table and the lantern on it in a warm colour does not
ask for less light from the lantern, although the paint is darker than each pixel of the flame.
Only paint that darkens the surroundings of the emitter, or its displayed value where nothing around
it is painted, asks for less. A warmer stroke over both does not, even if it is darker than a bright
room was before.
"""

import numpy as np

from lightpaint.arrays import Bools, Doubles, Floats, Slices
from lightpaint.colour import ViewTransform, luminance
from lightpaint.images import box_mean

#: The radius around an emitter's pixel in which paint counts: a share of the picture's height, and
#: a minimum in pixels.
RADIUS, MIN_RADIUS = 1 / 30, 2

#: Stops from which paint counts as darker than the picture under it.
DARKER_STOPS = 0.5

#: Stops of red against blue from which paint counts as warmer than the picture under it.
WARMER_STOPS = 0.5

#: Light, relative to the picture's mean, below which a ratio means nothing.
DARK_SHARE = 0.01

#: Mean importance that is round-off of no paint.
NO_IMPORTANCE = 1e-7


def dark_threshold(look: Floats, is_emitter: Bools) -> float:
    """Return the light below which ratios of a picture (h, w, 3) mean nothing.

    is_emitter: (h, w), where an emitter is in view.
    """
    if is_emitter.all():
        return 0.0
    return DARK_SHARE * float(luminance(look[~is_emitter].mean(axis=0)))


def paint_radius(size: tuple[int, int]) -> int:
    """Return the radius in pixels around an emitter's pixel in which paint counts. size: (h, w)."""
    return max(MIN_RADIUS, round(RADIUS * size[0]))


def find_glow_paint(
    image: Floats,
    importance: Floats,
    look: Floats,
    is_emitter: Bools,
    transform: ViewTransform | None,
    *,
    dark: float,
) -> Bools:
    """Return where emitters are painted that need no less light, (h, w).

    image: (h, w, 3) linear, the painting; importance: (h, w); look: (h, w, 3) linear, the current
    one; seen: (h, w), where an emitter is. transform: that shows both; None for light itself. dark:
    see `dark_threshold`, of the whole picture, of which these arrays may be a part.
    """
    painted_emitters = is_emitter & (importance > 0)
    if not painted_emitters.any():
        return painted_emitters
    counts = (importance * ~is_emitter)[..., None]
    radius = paint_radius(is_emitter.shape)
    paint_nearby, painted, now = (
        box_mean(np.maximum(np.asarray(x, np.float64), 0), radius)
        for x in (counts, counts * image, counts * look)
    )
    # Sums that slide along have round-off where they are 0.
    is_near = paint_nearby[..., 0] > NO_IMPORTANCE
    # Ratios of means, since single pixels are noise.
    painted, now = painted + dark * paint_nearby, now + dark * paint_nearby
    change = _stops(_brightness(painted), _brightness(now))
    own_change = _stops(
        _brightness(_clip_to_display(image, transform)) + dark,
        _brightness(_clip_to_display(look, transform)) + dark,
    )
    warmth = [_stops(x[..., 0], x[..., 2]) for x in (painted, now)]
    is_covered = (warmth[0] - warmth[1] > WARMER_STOPS) & (own_change < change - DARKER_STOPS)
    is_less = (change <= -DARKER_STOPS) & ~is_covered
    return np.asarray(painted_emitters & ~np.where(is_near, is_less, own_change <= -DARKER_STOPS))


def affected_region(region: Slices, size: tuple[int, int]) -> Slices:
    """Return the rectangle in which paint within `region` may change the meaning of paint."""
    radius = paint_radius(size)
    (top, bottom, _), (left, right, _) = (
        part.indices(length) for part, length in zip(region, size, strict=True)
    )
    rows = slice(max(top - radius, 0), min(bottom + radius, size[0]))
    return rows, slice(max(left - radius, 0), min(right + radius, size[1]))


def _brightness(image: Floats | Doubles) -> Doubles:
    return np.maximum(np.asarray(luminance(np.asarray(image, np.float64))), 0)


def _clip_to_display(image: Floats, transform: ViewTransform | None) -> Floats | Doubles:
    """Return light as bright as a display shows it."""
    return image if transform is None else np.minimum(image, transform.white)


def _stops(value: Floats, reference: Floats) -> Doubles:
    safe = np.maximum(reference, 1e-30)
    return np.asarray(np.log2(np.maximum(value, 1e-30) / safe))
