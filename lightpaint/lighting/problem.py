"""What is to be solved: which pictures are to come close to what, by which lights, held how."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Bools, Doubles, Floats
from lightpaint.basis.basis import Basis
from lightpaint.basis.lights import Lights
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.errors import BasisError, ConstraintError, TargetError
from lightpaint.keywords import keywords
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.constraints.constraints_file import constraints_of
from lightpaint.lighting.constraints.gamuts import Gamuts, PaintedLight
from lightpaint.lighting.constraints.reduction import Reduction
from lightpaint.lighting.constraints.white_neighbours import tangent_reduction
from lightpaint.lighting.fit import Fit, Space, meant_by
from lightpaint.lighting.linear_problem import LinearProblem, reduced_by
from lightpaint.lighting.loss.lit_pixels import LitPixels
from lightpaint.lighting.loss.loss import Loss, Squares
from lightpaint.lighting.loss.painting import (
    brighter_will_do,
    joint_squares,
    loss_of,
    painted_light,
    weight_of_rest,
    what_counts,
    with_emitters_read,
)
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.round_off import without_traces
from lightpaint.lighting.views import Views, joint_basis
from lightpaint.screen import shortly
from lightpaint.target.target import Target

#: Mireds by which a light that keeps to a range of white may leave its white, where it is asked how
#: firmly that is known, or what it is held by.
REACH = 32.0


@dataclass(frozen=True)
class Refinement:
    """What is known of the noise in the last step to an answer (see analysis/refine.py).

    before: (n, 3), the weights that it went from.
    noise: (h, w, 3), half difference of the prediction there, as far as it decided the step.
    lacking: (3, n), what is still to be expected to lack in the gradient.
    share: of the step that the render of the mix decided, 0 to 1; the basis did the rest.
    """

    before: Doubles
    noise: Floats
    lacking: Doubles
    share: float


@keywords()
@dataclass(frozen=True)
class Problem(LinearProblem):
    """A loss over the pictures that a basis can make, and what the lights may do.

    Attributes:
        basis: Of all views together.
        views: Basis and target of each view (views.py).
        loss: What a picture costs.
        squares: The linear problem that stands for the loss, the loss itself where that is one;
            before a solve has found better, the painting taken at its word.
        equations: M and b of these squares, of the basis as it is.
        constraints: What is asked of the lights, beside what `fit` says of their colours.
        reduction: What both leave to solve for.
        full: The same with all lights that `sparse` has not chosen.
        start: (n, 3), the weights to begin with: lights that reach nothing keep them.
        fit: How close is measured, and how the closest is found.
        corrected: The equations without that part of the noise; None where none was taken out.
        noise_removed: The part of the noise in `equations` that is not in `corrected`, where some
            was taken out.
        refinement: The last step by which an answer was improved, if one was.
        dimming: (n,), by how much dimmer lights are than at present in an answer before, which the
            pull to their colours heeds; None where there was none.
        block_side: Pixels along the side of the blocks that `corrected` is of; 1 for single pixels.

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
    dimming: Doubles | None = None
    block_side: int = 1

    __repr__ = shortly

    @classmethod
    @keywords()
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
        """Of one view, or of several: their bases and targets in the same order. As of `solve`.

        What the bases' scene asks of its lights is heeded; `constraints` go before it.
        """
        bases = [basis] if isinstance(basis, Basis) else _bases(basis)
        targets = [target] if isinstance(target, Target) else _targets(target)
        if not (constraints is None or isinstance(constraints, Constraints)):
            raise ConstraintError(
                f"the constraints are a {type(constraints).__name__}: give Constraints.of(...)"
            )
        whole, parts = joint_basis(bases)
        asked = constraints_of(whole.requests).and_then(constraints or Constraints())
        fit = fit or Fit()
        fitted = [
            what_counts(its.fitted_to(one.size, resize=resize), one.emitters_seen, fit.emitters)
            for its, one in zip(targets, parts, strict=True)
        ]
        fit = meant_by(fit, fitted)
        read = [with_emitters_read(x, one, fit) for x, one in zip(fitted, parts, strict=True)]
        views = Views(parts, tuple(read))
        word = joint_squares(views, unpainted=weight_of_rest(views, fit))
        loss = loss_of(
            word,
            brighter_will_do(views),
            fit.transform,
            painted=lambda: painted_light(views),
            current=lambda: whole.mix(whole.present_weights),
        )
        reduction = reduced_by(asked, whole.lights, fit, gamuts_for(whole, views, fit))
        return cls(
            basis=whole,
            views=views,
            loss=loss,
            squares=word,
            equations=NormalEquations.of(whole, word.image, word.weight),
            constraints=asked,
            reduction=reduction,
            full=reduction,
            start=whole.present_weights if start is None else start,
            fit=fit,
        )

    @property
    def name(self) -> str:
        """What was painted, for people."""
        return " + ".join(target.name for target in self.views.targets)

    @property
    def lights(self) -> Lights:
        """Those of the basis."""
        return self.basis.lights

    @property
    def power(self) -> Doubles:
        """‖Φᵢ‖² over the picture, (n, 3)."""
        return self.basis.power

    @property
    def scene_identity(self) -> str:
        """The scene that the basis is of."""
        return self.basis.origin.scene_identity

    @property
    def spp(self) -> int | None:
        """Samples per pixel of the basis, of the first of several; None where nobody knows."""
        return self.basis.origin.spp if self.basis.knows_noise else None

    @property
    def transform(self) -> ViewTransform | None:
        """The view transform through which the loss is seen; None for linear light."""
        return self.loss.transform

    def without_traces(self, weights: Doubles, is_asked: Bools) -> Doubles:
        """Weights (n, 3) in which what shows in no pixel is 0. is_asked: (n,), whose are kept."""
        return without_traces(self.basis, weights, self.squares.image, is_asked=is_asked)

    @property
    def is_linear(self) -> bool:
        """Whether its squares are all there is to its loss."""
        return self.loss.is_linear

    @property
    def space(self) -> Space:
        """In which the prediction is brought close to the painting."""
        return "linear" if self.loss.transform is None else "display"

    @property
    def asks(self) -> bool:
        """Whether anything limits the lights: constraints, or that they are to be white."""
        return bool(self.constraints) or self.fit.colors == "white"

    @cached_property
    def about_answer(self) -> Reduction:
        """`reduction` where an answer is asked about: whites of a range along a straight line."""
        return tangent_reduction(self.reduction, REACH)

    @cached_property
    def painted_share(self) -> float:
        """Importance of all that is painted, beside the number of pixels."""
        painted = sum(float(x.importance.sum(dtype=np.float64)) for x in self.views.targets)
        return painted / sum(x.importance.size for x in self.views.targets)

    @property
    def norm2(self) -> Doubles:
        """(3,), what a black picture would miss, to hold the objective against."""
        return self.equations.target_norm2 if self.is_linear else self.loss.norm2

    def objective(self, weights: Doubles) -> Doubles:
        """(3,), what weights (n, 3) miss."""
        if self.is_linear:
            return self.equations.objective(weights)
        lit = LitPixels.whole(self.basis, self.loss)
        return lit.pixels.objective(lit.predicted(weights))

    def of_view(self, k: int) -> "Problem":
        """The problem of view k alone: its pixels of the same squares."""
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


def gamuts_for(basis: Basis, views: Views, fit: Fit) -> Gamuts | None:
    """Of each light the colours that it may take; None where `fit` does not limit them."""
    if fit.colors != "gentle":
        return None
    its = [
        (one, target.image, _with_colour(target))
        for one, target in zip(views.bases, views.targets, strict=True)
    ]
    return Gamuts(partial(PaintedLight.of, its), basis.power, basis.present_weights)


def _with_colour(target: Target) -> Floats:
    """(h, w), the importance of what has a colour: not where a channel may be more than it is."""
    if target.at_least is None:
        return target.importance
    return np.where(target.at_least.any(axis=-1), np.float32(0), target.importance)


def _bases(given: Any) -> list[Basis]:
    if isinstance(given, Sequence) and given and all(isinstance(x, Basis) for x in given):
        return list(given)
    raise BasisError(
        f"the basis is a {type(given).__name__}: give what render_basis or read_basis returns, or "
        "the .basis of light groups"
    )


def _targets(targets: Any) -> list[Target]:
    if isinstance(targets, Sequence) and targets and all(isinstance(t, Target) for t in targets):
        return list(targets)
    raise TargetError(f"the target is a {type(targets).__name__}: give what read_target returns")
