"""The losses of paintings."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from lightpaint.arrays import Bools, Floats
from lightpaint.basis import Basis
from lightpaint.colour import ViewTransform
from lightpaint.errors import TargetError
from lightpaint.lighting.fit import Emitters, Fit
from lightpaint.lighting.joined_views import Views
from lightpaint.lighting.loss.loss import Loss, Squares
from lightpaint.lighting.loss.paint_on_emitters import dark_threshold, find_glow_paint
from lightpaint.lighting.loss.painting_loss import PaintingLoss
from lightpaint.sentences import Hint, Word
from lightpaint.target import Target


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

    painted, rest: Σ D and Σ (1 − D). It is at most that of a painted pixel, so that a small rest
    does not outweigh the painting.
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
