"""The losses of paintings, and the meaning of paint over an emitter in view: seldom that it should
give less light.

A flame outshines every display. Painting a table and the lantern on it in a warm colour does not
ask for less light from the lantern, although the paint is darker than each pixel of the flame.
Only paint that darkens the surroundings of the emitter, or its displayed value where nothing around
it is painted, asks for less. A warmer stroke over both does not, even if it is darker than a bright
room was before.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from lightpaint.arrays import Bools, Doubles, Floats, Slices
from lightpaint.basis import Basis
from lightpaint.colour import ViewTransform, luminance
from lightpaint.errors import TargetError
from lightpaint.images import box_mean
from lightpaint.lighting.fit import Emitters, Fit
from lightpaint.lighting.joined_views import Views
from lightpaint.lighting.loss.painting_loss import PaintingLoss
from lightpaint.lighting.loss.pixel_loss import Loss, Squares
from lightpaint.sentences import Hint, Word
from lightpaint.target import Target

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


def literal_squares(
    image: Floats, importance: Floats, *, seen: Bools, current: Floats | None, unpainted: float
) -> Squares:
    """Return the literal squares of a painting, or of a part of its pixels.

    image: (h, w, 3); importance: (h, w), a; seen: (h, w), where the camera sees an emitter;
    current: (h, w, 3), the current look, needed only for unpainted > 0, the weight that holds
    unpainted pixels to it. A pixel then minimises a ‖Ψ − x‖² + unpainted (1 − a) ‖current − x‖²,
    which is one residual of weight a + unpainted (1 − a) against the weighted mean of both images.
    """
    a = importance.astype(np.float64)[..., None]
    psi = image.astype(np.float64)
    if current is None:
        return Squares(psi, a, np.zeros_like(a))
    rest = np.where(seen[..., None], 0, unpainted * np.maximum(1 - a, 0))
    total = a + rest
    counted = np.where(total > 0, total, 1)
    mixed = (a * psi + rest * current) / counted
    return Squares(mixed, total, np.where(total > 0, 1 - a / counted, 0))


def ignored_paint(target: Target, is_emitter: Bools, emitters: Emitters) -> Bools:
    """Return, (h, w), the painted pixels that do not count because an emitter is in view there.

    is_emitter: (h, w), where one is. Emitters count only if they were painted; at unit emission
    they would outshine everything that they light.
    """
    skips = target.everything if emitters == "auto" else emitters == "skip"
    return np.asarray(is_emitter & (target.importance > 0) & skips)


def resolve_importance(target: Target, is_emitter: Bools, emitters: Emitters = "auto") -> Target:
    """Return `target` with the final importance of each pixel.

    is_emitter, emitters: as in `ignored_paint`.

    Raises TargetError if nothing is left.
    """
    importance = np.where(
        ignored_paint(target, is_emitter, emitters), np.float32(0), target.importance
    )
    if not importance.any():
        raise TargetError(
            target.title,
            ": the camera sees an emitter in every painted pixel, so none "
            "counts; paint others too, or pass ",
            Hint("emitters", Word("count")),
        )
    return replace(target, importance=importance, everything=False)


def resolve_emitter_paint(target: Target, basis: Basis, fit: Fit) -> Target:
    """Return `target`, painted over the look of `basis`, with "at least" for its emitters in view.

    This happens once, unless the target is literal or the fit says how emitters count. fit: with
    nothing left open.
    """
    if fit.literal or fit.emitters != "auto" or not (target.over_look and target.reads_emitters):
        return target
    glows = find_glow_paint(
        target.image,
        target.importance,
        basis.current_look,
        basis.emitters_seen,
        fit.transform,
        dark=dark_threshold(basis.current_look, basis.emitters_seen),
    )[..., None]
    at_least = glows if target.at_least is None else target.at_least | glows
    mask = np.broadcast_to(at_least, target.image.shape) if glows.any() else target.at_least
    return replace(target, at_least=mask, reads_emitters=False)


def current_look(basis: Basis, unpainted: float) -> Floats | None:
    """Return the look (h, w, 3) that holds unpainted pixels; None if it does not."""
    return basis.current_look if unpainted > 0 else None


def target_squares(basis: Basis, target: Target, *, unpainted: float = 0.0) -> Squares:
    """Return the literal squares of one painting of the size of the basis."""
    counted = resolve_importance(target, basis.emitters_seen)
    return literal_squares(
        counted.image,
        counted.importance,
        seen=basis.emitters_seen,
        current=current_look(basis, unpainted),
        unpainted=unpainted,
    )


def unpainted_weight_of(views: Views, fit: Fit) -> float:
    """Return the weight of each unpainted pixel, as `rest_weight` does."""
    return unpainted_weight(*importance_sums(views), fit)


def unpainted_weight(painted: float, rest: float, fit: Fit) -> float:
    """Return the weight of each unpainted pixel, h Σ D / Σ (1 − D) for hold h.

    painted, rest: Σ D and Σ (1 − D). It is at most the weight of a painted pixel, so that a small
    rest does not outweigh the painting.
    """
    if fit.unpainted or not fit.hold:
        return fit.unpainted
    return min(fit.hold * painted / rest, 1.0) if rest > 0 else 0.0


def importance_sums(views: Views) -> tuple[float, float]:
    """Return Σ D and Σ (1 − D), the latter over pixels without a visible emitter."""
    painted, rest = 0.0, 0.0
    for basis, target in zip(views.bases, views.targets, strict=True):
        a = target.importance.astype(np.float64)
        painted += float(a.sum())
        rest += float(np.maximum(1 - a, 0)[~basis.emitters_seen].sum())
    return painted, rest


def joint_squares(views: Views, *, unpainted: float) -> Squares:
    """Return the literal squares of all paintings as one problem."""
    parts = [
        target_squares(basis, target, unpainted=unpainted)
        for basis, target in zip(views.bases, views.targets, strict=True)
    ]
    return Squares(
        views.join([squares.image for squares in parts]),
        views.join([squares.weight for squares in parts]),
        views.join([squares.share for squares in parts]),
    )


def choose_loss(
    literal: Squares,
    at_least: Bools,
    transform: ViewTransform | None,
    *,
    painted: Callable[[], Floats],
    current: Callable[[], Floats],
) -> Loss:
    """Choose the loss; return `literal` itself if it is equal.

    at_least: (h, w, 3), where brighter is as good. painted, current: return Ψ and the current look,
    if needed.
    """
    if transform is None and not (at_least.any() and at_least[literal.weight[..., 0] > 0].any()):
        return literal
    return PaintingLoss(
        painted=painted(),
        importance=literal.weight[..., 0],
        share=literal.share[..., 0],
        current=current(),
        at_least=at_least,
        transform=transform,
    )


def at_least_mask(views: Views) -> Bools:
    """Return where brighter than the painting is as good, in all views."""
    nowhere = [np.zeros((*basis.size, 3), bool) for basis in views.bases]
    masks = [target.at_least for target in views.targets]
    return views.join([n if a is None else a for a, n in zip(masks, nowhere, strict=True)])


def target_light(views: Views) -> Floats:
    """Return Ψ of all views, (h, w, 3), in the precision of the paintings."""
    return views.join([target.image for target in views.targets])
