"""The painting as the solve takes it, and while it is painted on (Eq 7-9)."""

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Bools, Doubles, Floats, Slices
from lightpaint.basis.basis import Basis
from lightpaint.colour.transform import ViewTransform
from lightpaint.errors import TargetError
from lightpaint.lighting.emitters import asks_no_less, dark_of
from lightpaint.lighting.fit import Emitters, Fit
from lightpaint.lighting.loss import Loss, PaintingLoss, Squares
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.tiles import TiledEquations
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
    """What each pixel that is not painted counts, h Σ D / Σ (1 − D) for hold h.

    No more than one that is painted: where little is left, that does not rule the rest.
    """
    return weight_between(*painted_and_rest(views), fit)


def weight_between(painted: float, rest: float, fit: Fit) -> float:
    """The same of Σ D and Σ (1 − D)."""
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
    """What a picture costs: `word` itself where it says all.

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


class Painting:
    """Targets that are painted on, with the sums over tiles that follow the brush.

    Updated in place: the arrays of `word` and of the targets are its own.
    """

    def __init__(self, whole: Basis, views: Views, *, fit: Fit) -> None:
        self.strokes = 0
        self.fit = fit
        self.whole = whole
        self.views = replace(views, targets=tuple(_own(target) for target in views.targets))
        self.at_least = brighter_will_do(self.views)
        self.light = painted_light(self.views)
        self._take(weight_of_rest(self.views, fit))

    def _take(self, unpainted: float) -> None:
        """Sums anew, with this weight for each pixel that is not painted."""
        bases = self.views.bases
        self.unpainted = unpainted
        self.looks = [present_look(basis, unpainted) for basis in bases]
        self.word = joint_squares(self.views, unpainted=unpainted)
        self.tiles = [
            TiledEquations(
                basis.images,
                self.views.part(self.word.image, k),
                self.views.part(self.word.weight, k),
            )
            for k, basis in enumerate(bases)
        ]

    @cached_property
    def current(self) -> Floats:
        """The present look, of all views."""
        return self.whole.mix(self.whole.present_weights)

    def loss(self, word: Squares, transform: ViewTransform | None) -> Loss:
        """What a picture costs, with `word` for its squares."""
        light, current = lambda: self.light, lambda: self.current
        return loss_of(word, self.at_least, transform, painted=light, current=current)

    @property
    def equations(self) -> NormalEquations:
        """M, b and ‖Ψ‖² of all views as they are now."""
        first, *others = (tiles.equations for tiles in self.tiles)
        for other in others:
            first += other
        return first

    def paint(
        self,
        k: int,
        region: Slices,
        image: npt.ArrayLike | None,
        importance: npt.ArrayLike | None,
        at_least: npt.ArrayLike | None,
    ) -> None:
        """Paint over a rectangle of view k. Raises ValueError, and changes nothing, for misfits."""
        target, basis, look = self.views.targets[k], self.views.bases[k], self.looks[k]
        assert target.at_least is not None
        self.tiles[k].touched(region)
        if importance is not None:
            given = np.asarray(importance)
            if not (np.isfinite(given).all() and (given >= 0).all()):
                raise ValueError("importance is a finite weight >= 0 of each pixel")
            np.broadcast_to(given, target.importance[region].shape)
        if image is not None:
            if not np.isfinite(image).all():
                raise ValueError("a painting is of finite numbers")
            np.broadcast_to(image, target.image[region].shape)
        if at_least is not None:
            target.at_least[region] = at_least
            self.views.part(self.at_least, k)[region] = at_least
        if image is not None:
            target.image[region] = image
            self.views.part(self.light, k)[region] = target.image[region]
        if importance is not None:
            target.importance[region] = importance
            if self.fit.emitters == "skip":
                target.importance[region][basis.emitters_seen[region]] = 0
        part = at_its_word(
            target.image[region],
            target.importance[region],
            seen=basis.emitters_seen[region],
            current=None if look is None else look[region],
            unpainted=self.unpainted,
        )
        for name in ("image", "weight", "share"):
            self.views.part(getattr(self.word, name), k)[region] = getattr(part, name)
        # A stroke of colour leaves M as it is.
        self.tiles[k].update(region, with_M=importance is not None)
        self.strokes += 1
        if importance is not None and self.fit.hold:
            unpainted = weight_of_rest(self.views, self.fit)
            if unpainted != self.unpainted:
                self._take(unpainted)


def _own(target: Target) -> Target:
    """A copy whose arrays may be written to."""
    nowhere = np.zeros(target.image.shape, bool)
    return replace(
        target,
        image=target.image.copy(),
        importance=target.importance.copy(),
        at_least=nowhere if target.at_least is None else target.at_least.copy(),
    )
