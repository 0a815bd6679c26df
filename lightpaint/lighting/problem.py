"""The problem to solve: pictures, their goals, the lights and their constraints; and light as a
display shows it, in the view of a problem.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Bools, Doubles, Floats, in_any_channel
from lightpaint.basis import Basis, Lights, Planes, as_multiplied
from lightpaint.colour import ViewTransform, choose_exposure, decode_display
from lightpaint.display_text import short_repr
from lightpaint.errors import BasisError, ConstraintError, TargetError
from lightpaint.keywords import keywords
from lightpaint.lighting import linear_problem
from lightpaint.lighting.constraints.absolute_scale import with_scale
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.constraints.constraints_file import constraints_of
from lightpaint.lighting.constraints.light_constraints import held_at_start, start_weights
from lightpaint.lighting.fit import Fit, Space, resolve_for_targets
from lightpaint.lighting.joined_views import Views, joint_basis
from lightpaint.lighting.loss import painting
from lightpaint.lighting.loss.expected_lights import ExpectedLights, Wash
from lightpaint.lighting.loss.lit_pixels import LitPixels
from lightpaint.lighting.loss.pixel_loss import Loss, Squares
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.unknowns.gamuts import PaintedLight
from lightpaint.lighting.unknowns.lamps_in_view import GlowPaint
from lightpaint.lighting.unknowns.reduction import Reduction
from lightpaint.lighting.unknowns.white_mixes import tangent_reduction
from lightpaint.progress import cancellation_check
from lightpaint.target import Target

#: Largest relative error of one rounding to float16 and to float32.
HALF_ROUND_OFF, SINGLE_ROUND_OFF = 2.0**-11, 2.0**-24

#: Roundings that may add up: the roundings of the painting, the layers and the sum.
ROUNDINGS = 4

#: A light above this share of its current emission counts as on, however little it shows.
MAX_TRACE = 2.0**-11

#: Mireds by which a light of a range may leave its white in the analysis of uncertainty and bounds.
TANGENT_REACH = 32.0


def remove_traces(
    basis: Basis, weights: Doubles, image: Floats, *, is_constrained: Bools
) -> Doubles:
    """Return weights (n, 3) with 0 for those that are visible in no pixel.

    For a painting that is a mix of the layers without a light, the solve finds 10⁻⁹ of that light
    instead of 0, because numbers in a file are rounded. A reader of −28 stops would take that for
    an answer.

    is_constrained: (n,), lights with constraints, whose weights are kept.

    A weight is a trace if it is small, and its light in each pixel is below the round-off of the
    other lights there, or of the picture's mean where there are none. Round-off is the round-off of
    the painting, `image`, or of the layers: float16 if all of these are. A basis with known noise
    keeps its weights: noise is larger, and error bars show it.
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


@dataclass(frozen=True)
class Refinement:
    """The noise in the last step to an answer, by `lp.refine`.

    before: (n, 3), the weights at its start.
    noise: (h, w, 3), half difference of the prediction there, as far as it influenced the step.
    gradient_error: (3, n), the expected error that remains in the gradient.
    share: of the step that the render of the mix determined, 0 to 1; the basis did the rest.
    """

    before: Doubles
    noise: Floats
    gradient_error: Doubles
    share: float


@keywords()
@dataclass(frozen=True)
class Problem(linear_problem.LinearProblem):
    """The loss of pictures from a basis, and the freedom of the lights.

    Attributes:
        basis: The basis of all views together.
        views: Basis and target of each view.
        loss: The loss of a picture.
        squares: The linear problem that approximates the loss, or the loss itself if it is linear;
            before a solve, the literal squares of the painting.
        equations: M and b of these squares, without correction for noise.
        constraints: Constraints on the lights, besides the colours that `fit` allows.
        reduction: The unknowns that both leave.
        full: The same, including lights that `sparse` has not chosen.
        start: (n, 3), the initial weights; lights that reach nothing keep them.
        fit: Options of the fit.
        corrected: The equations without that share of the noise; None if none was removed.
        noise_removed: The share of the noise in `equations` that `corrected` lacks.
        refinement: The last step that improved an answer, if there was one.
        expected: The lights that the paintings let one expect, where lights keep to them; None
            where they may take any colour.
        contrast: The term that keeps the contrasts between wishes; None without one.
        restraint: The price of what each light by itself does to unpainted parts; None without a
            hold.
        block_side: Pixels along the side of the blocks behind `corrected`; 1 for single pixels.
        tether: A further pull on the weights, to those at other frames of a shot; None without.
        holding: The pull to the current lights that holds an answer which would lead away from the
            paint; None without.
        filter_share: The share of a Gaussian reconstruction filter whose effect was taken out of
            the paintings; 0 without one.
        is_render: Whether the paintings are renders: what the lights make, but for noise, and so
            without contrasts between wishes. None if noise hides that.
        given: The bases of the views of light groups whose renderer multiplies in other primaries,
            where the bases of the problem add up to its picture at one lighting; () for others.

    Examples:
        >>> problem = lp.Problem.of(basis, target)
        >>> problem.equations.M.shape
        (3, 2, 2)
    """

    basis: Basis
    views: Views
    loss: Loss
    squares: Squares
    equations: NormalEquations
    constraints: Constraints
    reduction: Reduction
    full: Reduction
    start: Doubles
    fit: Fit
    corrected: NormalEquations | None = None
    noise_removed: float = 0.0
    refinement: Refinement | None = None
    expected: ExpectedLights | None = None
    contrast: NormalEquations | None = None
    restraint: NormalEquations | None = None
    block_side: int = 1
    tether: NormalEquations | None = None
    holding: NormalEquations | None = None
    filter_share: float = 0.0
    is_render: bool | None = False
    given: tuple[Basis, ...] = ()

    __repr__ = short_repr

    @classmethod
    def of(
        cls,
        basis: Basis | Sequence[Basis],
        target: Target | Sequence[Target],
        *,
        constraints: Constraints | None = None,
        start: Doubles | None = None,
        fit: Fit | None = None,
        resize: bool = False,
    ) -> "Problem":
        """Make the problem of one view, or of several, with bases and targets in the same order.

        Arguments are as in `solve`. `constraints` win over the constraints of the scene's lights
        file.
        """
        bases = [basis] if isinstance(basis, Basis) else _bases(basis)
        targets = [target] if isinstance(target, Target) else _targets(target)
        if not (constraints is None or isinstance(constraints, Constraints)):
            raise ConstraintError(
                f"the constraints are a {type(constraints).__name__}: give Constraints.of(...)"
            )
        all_constraints = constraints_of(bases[0].requests)
        if constraints is not None:
            all_constraints = all_constraints.and_then(constraints)
        all_constraints = with_scale(all_constraints, bases[0].lights)
        whole, parts = joint_basis([held_at_start(x, all_constraints.start) for x in bases])
        check = cancellation_check()  # each step of a painting of many layers takes a while
        views, fit = _resolve_views(parts, targets, fit or Fit(), resize=resize)
        check()
        pictures = _pictures(whole, views, fit)
        check()
        reference = start_weights(all_constraints.start, whole.lights)
        reading = ViewsReading(views, whole.power, reference, fit, all_constraints)
        terms = reading.terms()
        check()
        gamuts = reading.gamuts(around_of(terms.expected))
        whites = linear_problem.whites_for(terms.expected, fit)
        reduction = linear_problem.reduce_lights(all_constraints, whole.lights, fit, gamuts, whites)
        return cls(
            **pictures,
            constraints=all_constraints,
            reduction=reduction,
            full=reduction,
            start=reference if start is None else start,
            fit=fit,
            **vars(terms),
        )

    @property
    def name(self) -> str:
        """Name of the painting, for people."""
        return " + ".join(target.name for target in self.views.targets)

    @property
    def lights(self) -> Lights:
        """The lights of the basis."""
        return self.basis.lights

    @property
    def power(self) -> Doubles:
        """‖Φᵢ‖² over the picture, (n, 3)."""
        return self.basis.power

    @property
    def scene_identity(self) -> str:
        """The identity of the basis's scene."""
        return self.basis.origin.scene_identity

    @property
    def spp(self) -> int | None:
        """Samples per pixel of the basis, of the first of several; None if unknown."""
        return self.basis.origin.spp if self.basis.knows_noise else None

    @property
    def transform(self) -> ViewTransform | None:
        """The view transform of the loss; None for linear light."""
        return self.loss.transform

    def remove_traces(self, weights: Doubles, is_constrained: Bools) -> Doubles:
        """Return weights (n, 3) with 0 for those that show in no pixel.

        is_constrained: (n,), lights whose weights stay.
        """
        if self.basis.knows_noise:  # which is larger, and squares may have no image yet
            return weights
        return remove_traces(self.basis, weights, self.squares.image, is_constrained=is_constrained)

    @property
    def is_linear(self) -> bool:
        """True if the squares are the whole loss."""
        return self.loss.is_linear

    @property
    def space(self) -> Space:
        """The space in which prediction and painting are compared."""
        return "linear" if self.loss.transform is None else "display"

    @property
    def is_constrained(self) -> bool:
        """True if anything limits the lights: constraints, or whites or own colours only."""
        return bool(self.constraints) or self.fit.colors in ("white", "own")

    @cached_property
    def local_reduction(self) -> Reduction:
        """The reduction for analyses of an answer: whites of a range along a straight line."""
        return tangent_reduction(self.reduction, TANGENT_REACH)

    @cached_property
    def painted_share(self) -> float:
        """The total importance, relative to the number of pixels."""
        total = sum(float(x.importance.sum(dtype=np.float64)) for x in self.views.targets)
        return total / sum(x.importance.size for x in self.views.targets)

    @property
    def norm2(self) -> Doubles:
        """(3,), the loss of a black picture, as a scale for the objective."""
        return self.equations.target_norm2 if self.is_linear else self.loss.norm2

    def objective(self, weights: Doubles) -> Doubles:
        """Return the loss of weights (n, 3), (3,)."""
        if self.is_linear:
            return self.equations.objective(weights)
        return LitPixels.whole(self.basis, self.loss).objective(weights)

    def unsolved(self, **changes: Any) -> "Problem":
        """Return the problem before a solve, with other fields: all lights, and all of the noise in
        its equations.
        """
        whole = replace(self, reduction=self.full, corrected=None, noise_removed=0.0)
        return replace(whole, **changes)

    def with_paintings(self, images: Sequence[Floats]) -> "Problem":
        """Return the problem of the same demands with other paintings of light, before a solve.

        images: (h, w, 3) of each view. Raises TargetError for another number of them.
        """
        if len(images) != len(self.views):
            raise TargetError(f"{len(images)} images for {len(self.views)} views: give one each")
        targets = zip(self.views.targets, images, strict=True)
        views = Views(self.views.bases, tuple(replace(x, image=image) for x, image in targets))
        return replace(self, **_pictures(self.basis, views, self.fit))

    def view_problem(self, k: int) -> "Problem":
        """Return the problem of view k alone: its pixels of the same squares."""
        if len(self.views) == 1:
            return self

        def part(joint: npt.NDArray[Any]) -> npt.NDArray[Any]:
            return self.views.part(joint, k)

        basis, squares = self.views.bases[k], self.squares.cut(part)
        return replace(
            self,
            basis=basis,
            views=Views((basis,), (self.views.targets[k],)),
            loss=squares if self.is_linear else self.loss.cut(part),
            squares=squares,
            equations=NormalEquations.of(basis, squares.image, squares.weight),
            corrected=None,
        )


def problem_as_multiplied(
    problem: Problem, weights: Doubles, planes: Sequence[Planes] | None = None
) -> Problem:
    """Return a problem, before a solve, on planes that add up to the render at weights (n, 3); see
    `basis.as_multiplied`. planes: of each view.
    """
    bases = problem.views.bases
    of_views = [None] * len(bases) if planes is None else planes
    multiplied = [as_multiplied(x, weights, y) for x, y in zip(bases, of_views, strict=True)]
    return replace(_with_bases(problem, multiplied), given=bases)


def problem_as_given(problem: Problem) -> Problem:
    """Return a problem before `problem_as_multiplied`, and before a solve."""
    return replace(_with_bases(problem, problem.given), given=()) if problem.given else problem


def _with_bases(problem: Problem, bases: Sequence[Basis]) -> Problem:
    """Return the same demands on other planes of the same lights. bases: of each view."""
    whole, parts = joint_basis(bases)
    pictures = _pictures(whole, Views(parts, problem.views.targets), problem.fit)
    return problem.unsolved(**pictures)


def _pictures(whole: Basis, views: Views, fit: Fit) -> dict[str, Any]:
    """Return the fields of a problem that follow from its pictures: bases, paintings, the loss,
    and the literal squares with their equations.
    """
    squares = painting.joint_squares(views, unpainted=painting.unpainted_weight_of(views, fit))
    loss = painting.choose_loss(
        squares,
        painting.at_least_mask(views),
        fit.transform,
        painted=lambda: painting.target_light(views),
        current=lambda: whole.current_look,
    )
    equations = NormalEquations.of(whole, squares.image, squares.weight)
    return {
        "basis": whole,
        "views": views,
        "loss": loss,
        "squares": squares,
        "equations": equations,
    }


def _resolve_views(
    bases: tuple[Basis, ...], targets: Sequence[Target], fit: Fit, *, resize: bool
) -> tuple[Views, Fit]:
    """Return the views at the size of their bases, with the importance that the fit gives each
    pixel, and the fit with no option left open.
    """
    if len(targets) != len(bases):
        raise TargetError(
            f"{len(targets)} targets for bases of {len(bases)} views: give one for each"
        )
    fitted = [
        painting.resolve_importance(
            target.fitted_to(basis.size, resize=resize), basis.emitters_seen, fit.emitters
        )
        for target, basis in zip(targets, bases, strict=True)
    ]
    fit = resolve_for_targets(fit, fitted)
    resolved = (
        painting.resolve_emitter_paint(target, basis, fit)
        for target, basis in zip(fitted, bases, strict=True)
    )
    return Views(bases, tuple(resolved)), fit


class ViewsReading(linear_problem.PaintReading):
    """The demands of the paintings of views on their lights.

    power, own, fit, constraints: as in `PaintReading`. wash: returns the wash of the views, by
    default a new one.
    """

    def __init__(
        self,
        views: Views,
        power: Doubles,
        own: Doubles,
        fit: Fit,
        constraints: Constraints,
        wash: Callable[[], Wash] | None = None,
    ) -> None:
        super().__init__(
            views.bases,
            power,
            own,
            fit,
            constraints=constraints,
            is_sketch=are_sketches(views),
        )
        self._views, self._wash = views, partial(wash_of, views) if wash is None else wash

    def wash(self) -> Wash:
        """Return the paintings and their lights, averaged over blocks of pixels."""
        return self._wash()

    def samples(self) -> PaintedLight:
        """Return a sample of the painted pixels whose colour counts."""
        return PaintedLight.of(
            [
                (basis, target.image, _color_importance(target))
                for basis, target in zip(self._views.bases, self._views.targets, strict=True)
            ]
        )

    def paintings(self) -> Sequence[GlowPaint]:
        """Return the painting of each view."""
        return [(x.image, x.importance, x.at_least) for x in self._views.targets]

    def amounts(self) -> tuple[float, float]:
        """Return the importance of all pixels together, and the weight of each unpainted one."""
        importance = sum(float(x.importance.sum(dtype=np.float64)) for x in self._views.targets)
        return importance, painting.unpainted_weight_of(self._views, self.fit)


def wash_of(views: Views) -> Wash:
    """Return the paintings of views and their lights, averaged over blocks of pixels."""
    return Wash.joined([Wash.of(*view) for view in zip(views.bases, views.targets, strict=True)])


def around_of(expected: ExpectedLights | None) -> Callable[[], Doubles] | None:
    """Return the `around` of `PaintReading.gamuts`: what returns the painted light, (n, 3)."""
    return None if expected is None else lambda: expected.painted


def are_sketches(views: Views) -> bool:
    """Return whether any view was painted over the current look, or as a display shows it."""
    return any(target.over_look or target.through_view for target in views.targets)


def _color_importance(target: Target) -> Floats:
    """Return the importance (h, w) of pixels whose colour counts: not those that mean "at
    least".
    """
    if target.at_least is None:
        return target.importance
    return np.where(in_any_channel(target.at_least), np.float32(0), target.importance)


def _bases(bases: Any) -> list[Basis]:
    if isinstance(bases, Sequence) and bases and all(isinstance(x, Basis) for x in bases):
        return list(bases)
    raise BasisError(
        f"the basis is a {type(bases).__name__}: give what render_basis or read_basis returns, or "
        "the .basis of light groups"
    )


def _targets(targets: Any) -> list[Target]:
    if isinstance(targets, Sequence) and targets and all(isinstance(t, Target) for t in targets):
        return list(targets)
    raise TargetError(f"the target is a {type(targets).__name__}: give what read_target returns")


def display_light(pixels: Doubles, transform: ViewTransform) -> Doubles:
    """Return the light that a display emits for light (..., 3), white = 1."""
    if transform.name == "srgb":  # encoding and decoding cancel
        return np.asarray(np.clip(pixels * 2.0**transform.stops, 0, 1))
    return np.asarray(decode_display(transform.encode(pixels)), np.float64)


def display_transform(problem: Problem) -> ViewTransform:
    """Return the view of the painting or, if it holds light, sRGB at a fitting exposure."""
    target = problem.views.targets[0]
    chosen = problem.fit.transform or target.transform
    if chosen is not None:
        return chosen
    return ViewTransform("srgb", choose_exposure(target.image[target.importance > 0][None]))
