"""Linear problems: squares, and all else that their solve needs, without pixels.

A literal fit in linear light needs nothing of a basis but M, b and norms. Sums of parts of a
picture add, so that each machine can sum its part of the basis and send no image.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Self

import numpy as np

from lightpaint.arrays import Bools, Doubles, Floats
from lightpaint.basis import Basis, Lights, texel_lights
from lightpaint.colour import ViewTransform
from lightpaint.display_text import short_repr
from lightpaint.errors import TargetError
from lightpaint.lighting.constraints import light_constraints
from lightpaint.lighting.constraints.absolute_scale import with_scale
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.constraints.constraints_file import constraints_of
from lightpaint.lighting.fit import Fit, resolve_fit, resolve_for_targets
from lightpaint.lighting.loss.expected_lights import ExpectedLights, Wash
from lightpaint.lighting.loss.painting import ignored_paint
from lightpaint.lighting.loss.weight_penalty import PaintTerms, joint_pull
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.unknowns.gamuts import Gamuts, PaintedLight
from lightpaint.lighting.unknowns.lamps_in_view import GlowPaint, LampsInView
from lightpaint.lighting.unknowns.reduction import Reduction, reduce_to
from lightpaint.lighting.unknowns.slot_search import improve_slots
from lightpaint.sentences import Hint, Word
from lightpaint.target import Target, titled


class PaintReading(ABC):
    """The demands of paintings on lights, beside their squares: expected lights, gamuts and terms.

    bases: of the views. power: (n, 3), ‖Φᵢ‖² of all views together. own: (n, 3), weights with the
    colours that lights have. fit: with nothing left open. constraints: on the lights. is_sketch: as
    for `Fit.reads_wishes`.
    """

    def __init__(
        self,
        bases: Sequence[Basis],
        power: Doubles,
        own: Doubles,
        fit: Fit,
        *,
        constraints: Constraints,
        is_sketch: bool,
    ) -> None:
        self.bases, self.power, self.own, self.fit = tuple(bases), power, own, fit
        self.is_sketch, self._constraints = is_sketch, constraints

    @cached_property
    def is_free(self) -> Bools:
        """(n,), lights that may stand in for others: nothing limits them."""
        lights = self.bases[0].lights
        limited = light_constraints.limited_lights(self._constraints, lights)
        return ~(limited | texel_lights(lights))

    @abstractmethod
    def wash(self) -> Wash:
        """Return the paintings and their lights, averaged over blocks of pixels."""

    @abstractmethod
    def samples(self) -> PaintedLight:
        """Return a sample of the painted pixels whose colour counts."""

    @abstractmethod
    def paintings(self) -> Sequence[GlowPaint]:
        """Return the painting of each view."""

    @abstractmethod
    def amounts(self) -> tuple[float, float]:
        """Return the importance of all pixels together, and the weight of each unpainted one."""

    def terms(self) -> PaintTerms:
        """Return what a sketch lets one expect, and its terms of the loss."""
        if not self.fit.reads_wishes(is_sketch=self.is_sketch):
            return PaintTerms(self.expected() if self.fit.colors == "white" else None)
        importance, unpainted = self.amounts()
        return PaintTerms.of(
            self.wash(),
            self.fit,
            self.own,
            importance=importance,
            unpainted=unpainted,
            texels=texel_lights(self.bases[0].lights),
            is_free=self.is_free,
        )

    def expected(self) -> ExpectedLights | None:
        """Return the lights that paintings let one expect; None if the fit leaves colours free."""
        if self.fit.colors not in ("gentle", "white"):
            return None
        return ExpectedLights.of(self.wash(), self.own, self.is_free)

    def gamuts(self, around: Callable[[], Doubles] | None) -> Gamuts | None:
        """Return the colours that each light may take; None if the fit does not limit them.

        around: as in `LampsInView`, while lights keep to what a sketch lets one expect.
        """
        if not self.fit.keeps_to_hues(is_sketch=self.is_sketch):
            return None
        is_bold, in_view = self.fit.colors == "free", None
        if around is not None and not is_bold:
            in_view = LampsInView.of(self.bases, self.own, self.paintings, around)
        is_texel = texel_lights(self.bases[0].lights)
        return Gamuts(
            self.samples, self.power, self.own, is_texel, is_bold=is_bold, in_view=in_view
        )


class LinearProblem:
    """A linear problem by its sums, and the freedom of its lights.

    `Problem` and `SummedProblem` are frozen dataclasses with these fields.

    equations: M and b of the squares; corrected: the same without the share `noise_removed` of the
    noise, None if none was removed. constraints: on the lights. reduction: the unknowns that these
    leave; full: the same with the lights that `sparse` has not chosen. fit: with nothing left open.
    expected: see `weight_pull`. holding: a pull to the current lights, of an answer that would lead
    away from the paint. tether: a further pull on the weights, to lights at other frames;
    None for a problem that stands alone.
    """

    equations: NormalEquations
    corrected: NormalEquations | None
    noise_removed: float
    constraints: Constraints
    reduction: Reduction
    full: Reduction
    fit: Fit
    expected: ExpectedLights | None
    contrast: NormalEquations | None
    restraint: NormalEquations | None
    tether: NormalEquations | None
    holding: NormalEquations | None

    if TYPE_CHECKING:  # properties of one kind of problem, fields of the other

        @property
        def name(self) -> str:
            """Name of the painting, for people."""

        @property
        def lights(self) -> Lights:
            """The lights of the problem."""

        @property
        def power(self) -> Doubles:
            """‖Φᵢ‖² over the picture, (n, 3), as in `Basis`."""

        @property
        def transform(self) -> ViewTransform | None:
            """The view transform of the loss; None for linear light."""

        @property
        def painted_share(self) -> float:
            """The total importance, relative to the number of pixels."""

        @property
        def scene_identity(self) -> str:
            """The identity of the lights' scene, as in `Origin`."""

        @property
        def spp(self) -> int | None:
            """Samples per pixel behind the sums; None if unknown."""

        @property
        def norm2(self) -> Doubles:
            """(3,), the loss of a black picture, as a scale for the objective."""

    def objective(self, weights: Doubles) -> Doubles:
        """Return the loss of weights (n, 3), (3,)."""
        raise NotImplementedError

    def remove_traces(self, weights: Doubles, is_constrained: Bools) -> Doubles:
        """Return weights (n, 3) without those that round-off made.

        is_constrained: (n,), lights whose weights stay.
        """
        raise NotImplementedError

    @property
    def solved(self) -> NormalEquations:
        """The equations to solve: without noise if it was removed."""
        return self.equations if self.corrected is None else self.corrected

    @property
    def pull_strength(self) -> float:
        """Strength of the pull to the current lighting, for light as bright as it is displayed."""
        return self.constraints.prefer_current * self.fit.brightness

    @property
    def keeps_color(self) -> Bools:
        """(n,), the lights with a pull to their colour: those free to leave it that reach
        something. Texels have an expectation of their own (`image_prior`).
        """
        is_lamp = ~texel_lights(self.lights)
        return self.full.is_free & self.equations.reached.any(axis=1) & is_lamp

    @cached_property
    def reference(self) -> Doubles:
        """(n, 3), the lighting to start from: the current one, unless another was set by hand."""
        return light_constraints.start_weights(self.constraints.start, self.lights)

    @cached_property
    def pull(self) -> NormalEquations | None:
        """The penalty for leaving the current lighting, its colours, the contrasts, unpainted parts
        or the lights at other frames; None if there is none.
        """
        return joint_pull(
            self.lights,
            self.power,
            self.reference,
            self.fit,
            self.constraints,
            PaintTerms(self.expected, self.contrast, self.restraint),
            painted_share=self.painted_share,
            keeps_color=self.keeps_color,
            tether=self.tether,
            holding=self.holding,
        )

    def with_pull(self, equations: NormalEquations) -> NormalEquations:
        """Return `equations` with the pull on the weights, if there is one."""
        return equations if self.pull is None else equations + self.pull

    def with_reduction(self, reduction: Reduction) -> Self:
        """Return this problem with other constraints: another `reduction` of the same `full`."""
        return replace(self, reduction=reduction)  # type: ignore[type-var]

    def with_whites(self, reduction: Reduction) -> Self:
        """Return this problem with a reduction that differs in the whites of its lights."""
        if self.reduction is self.full:
            full = reduction
        else:
            windows = {k: reduction.knobs[k].window for k in reduction.white_knobs}
            full = self.full.with_windows(windows)
        return replace(self, reduction=reduction, full=full)  # type: ignore[type-var]

    def with_slots(self, weights: Doubles) -> Self:
        """Return this problem with colour wheels at the slots closest to weights (n, 3)."""
        reduction, full = (x.with_slots(weights) for x in (self.reduction, self.full))
        return replace(self, reduction=reduction, full=full)  # type: ignore[type-var]

    def with_better_slots(self, weights: Doubles) -> Self | None:
        """Return this problem with colour wheels at slots that bring the picture closer than
        weights (n, 3), its solution; None if no other slot of a single wheel does.
        """
        reduction = self.reduction
        if not reduction.wheels:
            return None
        norm2, equations = float(np.sum(self.norm2)), self.with_pull(self.solved)
        better = improve_slots(equations, reduction, weights, norm2)
        moved = {k: x.at for k, x in better.slots.items() if x.at != reduction.slots[k].at}
        return self.at_slots(moved) if moved else None

    def at_slots(self, places: Mapping[int, int]) -> Self:
        """Return this problem with wheels, by the place of the knob, at other slots."""
        reduction, full = (x.at_slots(places) for x in (self.reduction, self.full))
        return replace(self, reduction=reduction, full=full)  # type: ignore[type-var]

    def with_final_slots(self) -> Self:
        """Return this problem with colour wheels that stay at their slots."""
        reduction, full = (replace(x, slots={}) for x in (self.reduction, self.full))
        return replace(self, reduction=reduction, full=full)  # type: ignore[type-var]


@dataclass(frozen=True, kw_only=True)
class SummedProblem(LinearProblem):
    """A literal problem in linear light, of which only the sums are known.

    name, lights, power, scene_identity, spp: see `LinearProblem`. start: (n, 3), the weights to
    begin with: lights that reach nothing keep them.
    """

    name: str
    lights: Lights
    power: Doubles
    equations: NormalEquations
    constraints: Constraints
    reduction: Reduction
    full: Reduction
    fit: Fit
    start: Doubles
    scene_identity: str = ""
    spp: int | None = None
    corrected: NormalEquations | None = None
    noise_removed: float = 0.0
    expected: ExpectedLights | None = None
    contrast: NormalEquations | None = None
    restraint: NormalEquations | None = None
    tether: NormalEquations | None = None
    holding: NormalEquations | None = None
    painted_share: float = 1.0  # on which nothing in literal problems depends

    __repr__ = short_repr

    @property
    def transform(self) -> None:
        """None: display values have no such sums."""

    def objective(self, weights: Doubles) -> Doubles:
        """Return the loss of weights (n, 3), (3,)."""
        return self.equations.objective(weights)

    @property
    def norm2(self) -> Doubles:
        """(3,), the loss of a black picture."""
        return self.equations.target_norm2

    def remove_traces(self, weights: Doubles, is_constrained: Bools) -> Doubles:
        """Return weights (n, 3) unchanged: sums say nothing about single pixels."""
        return weights


def whites_for(expected: ExpectedLights | None, fit: Fit) -> light_constraints.WhiteLimits | None:
    """Return the ranges of lights that are to be white; None for others."""
    if fit.colors != "white" or expected is None:
        return None
    return light_constraints.painted_whites(expected.painted)


def reduce_lights(
    constraints: Constraints,
    lights: Lights,
    fit: Fit,
    gamuts: Gamuts | None = None,
    whites: light_constraints.WhiteLimits | None = None,
) -> Reduction:
    """Reduce the lights to the unknowns that constraints and the options for colours leave.

    gamuts: see `PaintReading`. whites: see `whiten_open_lights`. Raises ConstraintError for a light
    whose constraints exclude white.
    """
    if fit.colors == "white":
        constraints = light_constraints.whiten_open_lights(constraints, lights, whites)
    # Pulls to the colours of lights and images couple the channels.
    is_joined = fit.colors == "gentle" or bool(texel_lights(lights).any())
    reduction = reduce_to(constraints, lights)
    is_joined = is_joined or reduction.is_joined
    reduction = replace(reduction, is_joined=is_joined)
    if fit.colors == "own":
        labels = light_constraints.own_color_labels(reduction.labels, constraints, lights)
        dimmers = reduce_to(light_constraints.keep_own_colors(constraints, lights), lights)
        return replace(dimmers, is_joined=is_joined, labels=labels)
    return reduction if gamuts is None else reduction.with_gamuts(gamuts)


@dataclass(frozen=True)
class Sums:
    """Sums over a part of a picture. power: (n, 3), see `Basis`."""

    equations: NormalEquations
    power: Doubles

    def __add__(self, other: "Sums") -> "Sums":
        return Sums(self.equations + other.equations, self.power + other.power)


def reason_against_sums(target: Target, fit: Fit) -> str:
    """Return the reason why sums do not suffice for a problem; "" if they do."""
    resolved = resolve_for_targets(fit, [target])
    if resolved.space != "linear":
        return "it is fitted as a display shows it"
    if resolved.hold or resolved.unpainted:
        return "what is not painted is held"
    if resolved.colors == "gentle":
        return "lights are held to their colours"
    if target.over_look and not fit.literal:
        return "what paint over emitters means depends on what is around them"
    if target.at_least is not None and target.at_least[target.importance > 0].any():
        return "brighter than some of the painting is as good"
    return ""


def sum_rows(basis: Basis, target: Target, rows: slice, fit: Fit) -> Sums:
    """Sum over some rows. basis: of these rows alone; target: of the whole picture."""
    importance = row_importance(target, basis.emitters_seen, rows, fit)
    equations = NormalEquations.of(basis, target.image[rows], importance)
    return Sums(equations, basis.power)


def row_importance(target: Target, seen: Bools, rows: slice, fit: Fit) -> Floats:
    """Return the weight of each pixel of some rows.

    seen: (rows, w), where an emitter is visible.
    """
    importance = target.importance[rows]
    if not importance.any():  # a target would refuse that
        return importance
    part = Target(
        target.name,
        target.image[rows],
        importance,
        everything=target.everything,
        files=target.files,
    )
    return np.where(ignored_paint(part, seen, fit.emitters), np.float32(0), importance)


def summed_problem(
    lights: Lights,
    name: str,
    sums: Sums,
    *,
    constraints: Constraints,
    fit: Fit,
    scene_identity: str = "",
    spp: int | None = None,
) -> SummedProblem:
    """Make the problem that has these sums.

    name: of the target. scene_identity, spp: see `LinearProblem`. Raises TargetError if no pixel
    counts.
    """
    if not sums.equations.target_norm2.any() and not sums.equations.M.any():
        raise TargetError(
            f"{titled(name)}: no light reaches a painted pixel that counts; paint others, too, or "
            "pass ",
            Hint("emitters", Word("count")),
        )
    all_constraints, fit = constraints_of(lights.requests).and_then(constraints), resolve_fit(fit)
    all_constraints = with_scale(all_constraints, lights)
    reduction = reduce_lights(all_constraints, lights, fit)
    return SummedProblem(
        name=name,
        lights=lights,
        power=sums.power,
        equations=sums.equations,
        constraints=all_constraints,
        reduction=reduction,
        full=reduction,
        fit=fit,
        start=light_constraints.start_weights(all_constraints.start, lights),
        scene_identity=scene_identity,
        spp=spp,
    )
