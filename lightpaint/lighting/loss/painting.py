"""The painting as the solve takes it."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from lightpaint.arrays import Bools, Doubles, Floats
from lightpaint.basis.basis import Basis
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.errors import TargetError
from lightpaint.lighting.fit import Emitters, Fit
from lightpaint.lighting.loss.emitter_paint import asks_no_less, dark_of
from lightpaint.lighting.loss.loss import Loss, Squares
from lightpaint.lighting.loss.painting_loss import PaintingLoss
from lightpaint.lighting.views import Views
from lightpaint.target.target import Target


def at_its_word(
    image: Floats, importance: Floats, *, seen: Bools, current: Floats | None, unpainted: float
) -> Squares:
    """The squares that a painting stands for, of any part of its pixels.

    image: (h, w, 3); importance: (h, w), a; seen: (h, w), where the camera sees an emitter;
    current: (h, w, 3), the present look, needed only for unpainted > 0: the weight of what is not
    painted against it. A pixel then minimises a ‖Ψ − x‖² + unpainted (1 − a) ‖current − x‖²,
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


def left_out(target: Target, seen: Bools, emitters: Emitters) -> Bools:
    """(h, w), what is painted and counts nothing, since an emitter is `seen` there, (h, w).

    Unless somebody painted them: at unit emission they would outshine everything the light falls
    on.
    """
    skips = target.everything if emitters == "auto" else emitters == "skip"
    return np.asarray(seen & (target.importance > 0) & skips)


def what_counts(target: Target, seen: Bools, emitters: Emitters = "auto") -> Target:
    """`target` whose importance says it all. seen, emitters: as of `left_out`.

    Raises TargetError if nothing is left.
    """
    importance = np.where(left_out(target, seen, emitters), np.float32(0), target.importance)
    if not importance.any():
        raise TargetError(
            f"target {target.name}: the camera sees an emitter in every painted pixel, so none "
            'counts; paint others too, or pass emitters="count"'
        )
    return replace(target, importance=importance, everything=False)


def with_emitters_read(target: Target, basis: Basis, fit: Fit) -> Target:
    """`target`, painted over the look of `basis`, with "at least" where it paints emitters in view.

    Once: where it is not taken at its word, and nobody says that emitters count as painted. fit:
    with nothing left open.
    """
    if fit.literal or fit.emitters != "auto" or not (target.over_look and target.reads_emitters):
        return target
    glows = asks_no_less(
        target.image,
        target.importance,
        basis.present_look,
        basis.emitters_seen,
        fit.transform,
        dark=dark_of(basis.present_look, basis.emitters_seen),
    )[..., None]
    at_least = glows if target.at_least is None else target.at_least | glows
    its = np.broadcast_to(at_least, target.image.shape) if glows.any() else target.at_least
    return replace(target, at_least=its, reads_emitters=False)


def present_look(basis: Basis, unpainted: float) -> Floats | None:
    """(h, w, 3), what unpainted pixels are held to; None if nothing is."""
    return basis.mix(basis.present_weights) if unpainted > 0 else None


def squares_of(basis: Basis, target: Target, *, unpainted: float = 0.0) -> Squares:
    """The linear problem of one painting, taken at its word, of the size of the basis."""
    counted = what_counts(target, basis.emitters_seen)
    return at_its_word(
        counted.image,
        counted.importance,
        seen=basis.emitters_seen,
        current=present_look(basis, unpainted),
        unpainted=unpainted,
    )


def weight_of_rest(views: Views, fit: Fit) -> float:
    """Return the weight of each pixel that is not painted, as of `rest_weight`."""
    return rest_weight(*painted_and_rest(views), fit)


def rest_weight(painted: float, rest: float, fit: Fit) -> float:
    """Return the weight of each pixel that is not painted, h Σ D / Σ (1 − D) for hold h.

    painted, rest: Σ D and Σ (1 − D). It is at most that of a painted pixel, so that a small rest
    does not outweigh the painting.
    """
    if fit.unpainted or not fit.hold:
        return fit.unpainted
    return min(fit.hold * painted / rest, 1.0) if rest > 0 else 0.0


def painted_and_rest(views: Views) -> tuple[float, float]:
    """Σ D and Σ (1 − D), the latter of the pixels in which no emitter is seen."""
    painted, rest = 0.0, 0.0
    for basis, target in zip(views.bases, views.targets, strict=True):
        a = target.importance.astype(np.float64)
        painted += float(a.sum())
        rest += float(np.maximum(1 - a, 0)[~basis.emitters_seen].sum())
    return painted, rest


def joint_squares(views: Views, *, unpainted: float) -> Squares:
    """All paintings, each taken at its word, as one problem."""
    each = [
        squares_of(basis, target, unpainted=unpainted)
        for basis, target in zip(views.bases, views.targets, strict=True)
    ]
    return Squares(
        views.join([word.image for word in each]),
        views.join([word.weight for word in each]),
        views.join([word.share for word in each]),
    )


def loss_of(
    word: Squares,
    at_least: Bools,
    transform: ViewTransform | None,
    *,
    painted: Callable[[], Doubles],
    current: Callable[[], Floats],
) -> Loss:
    """Choose what a picture costs: `word` itself where it says all.

    at_least: (h, w, 3), where brighter is as good. painted, current: Ψ and the present look, asked
    for where they are needed.
    """
    if transform is None and not (at_least.any() and at_least[word.weight[..., 0] > 0].any()):
        return word
    return PaintingLoss(
        painted=painted(),
        importance=word.weight[..., 0],
        share=word.share[..., 0],
        current=current(),
        at_least=at_least,
        transform=transform,
    )


def brighter_will_do(views: Views) -> Bools:
    """Where something brighter than the painting is as good, of all views."""
    nowhere = [np.zeros((*basis.size, 3), bool) for basis in views.bases]
    given = [target.at_least for target in views.targets]
    return views.join([n if a is None else a for a, n in zip(given, nowhere, strict=True)])


def painted_light(views: Views) -> Doubles:
    """Ψ of all views in float64."""
    return views.join([target.image.astype(np.float64) for target in views.targets])
