"""Linear problems: squares, and all else that their solve needs, without pixels."""

from dataclasses import dataclass, replace
from functools import cached_property, reduce
from operator import add
from typing import TYPE_CHECKING, Self

from lightpaint.arrays import Bools, Doubles
from lightpaint.basis.light_images import texel_lights
from lightpaint.basis.lights import Lights
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.display_text import short_repr
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.constraints.own_colors import keep_own_colors, own_color_labels
from lightpaint.lighting.constraints.start_lighting import start_weights
from lightpaint.lighting.constraints.white_lights import WhiteLimits, whiten_open_lights
from lightpaint.lighting.fit import Fit
from lightpaint.lighting.loss.expected_lights import ExpectedLights
from lightpaint.lighting.loss.image_prior import image_prior
from lightpaint.lighting.loss.weight_penalty import pull_near_start, weight_pull
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.unknowns.gamuts import Gamuts
from lightpaint.lighting.unknowns.reduction import Reduction, reduce_to


class LinearProblem:
    """A linear problem by its sums, and the freedom of its lights.

    `Problem` and `SummedProblem` are frozen dataclasses with these fields.

    equations: M and b of the squares; corrected: the same without the share `noise_removed` of the
    noise, None if none was removed. constraints: on the lights. reduction: the unknowns that these
    leave; full: the same with the lights that `sparse` has not chosen. fit: with nothing left open.
    expected: see `weight_pull`. tether: a further pull on the weights, to lights at other frames;
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
        something. Texels have an expectation of their own (image_prior.py).
        """
        is_lamp = ~texel_lights(self.lights)
        return self.full.is_free & self.equations.reached.any(axis=1) & is_lamp

    @cached_property
    def reference(self) -> Doubles:
        """(n, 3), the lighting to start from: the current one, unless another was set by hand."""
        return start_weights(self.constraints.start, self.lights)

    @cached_property
    def pull(self) -> NormalEquations | None:
        """The penalty for leaving the current lighting, its colours, the contrasts, unpainted parts
        or the lights at other frames; None if there is none.
        """
        prior = image_prior(self.lights, self.power, self.fit, self.painted_share, self.expected)
        pull = weight_pull(
            self.power,
            self.reference,
            self.fit,
            prefer_current=self.constraints.prefer_current,
            painted_share=self.painted_share,
            keeps_color=self.keeps_color,
            expected=self.expected,
        )
        near = pull_near_start(
            self.power,
            self.reference,
            self.fit,
            near=self.constraints.near,
            painted_share=self.painted_share,
        )
        terms = (pull, near, prior, self.contrast, self.restraint, self.tether)
        pulls = [x for x in terms if x is not None]
        return reduce(add, pulls) if pulls else None

    def with_pull(self, equations: NormalEquations) -> NormalEquations:
        """Return `equations` with the pull on the weights, if there is one."""
        return equations if self.pull is None else equations + self.pull

    def with_reduction(self, reduction: Reduction) -> Self:
        """Return this problem with that reduction, and the same `full`."""
        return replace(self, reduction=reduction)  # type: ignore[type-var]

    def with_whites(self, reduction: Reduction) -> Self:
        """Return this problem with a reduction that differs in the whites of its lights."""
        if self.reduction is self.full:
            full = reduction
        else:
            windows = {k: reduction.knobs[k].window for k in reduction.white_knobs}
            full = self.full.with_windows(windows)
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

    __repr__ = short_repr

    @property
    def transform(self) -> None:
        """None: display values have no such sums."""

    @property
    def painted_share(self) -> float:
        """1: nothing in such a problem depends on it."""
        return 1.0

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


def reduce_lights(
    constraints: Constraints,
    lights: Lights,
    fit: Fit,
    gamuts: Gamuts | None = None,
    whites: WhiteLimits | None = None,
) -> Reduction:
    """Reduce the lights to the unknowns that constraints and the options for colours leave.

    gamuts: see `gamuts_for`. whites: see `whiten_open_lights`. Raises ConstraintError for a light
    whose constraints exclude white.
    """
    if fit.colors == "white":
        constraints = whiten_open_lights(constraints, lights, whites)
    # Pulls to the colours of lights and images couple the channels.
    is_joined = fit.colors == "gentle" or bool(texel_lights(lights).any())
    reduction = replace(reduce_to(constraints, lights), is_joined=is_joined)
    if fit.colors == "own":
        labels = own_color_labels(reduction.labels, constraints, lights)
        dimmers = reduce_to(keep_own_colors(constraints, lights), lights)
        return replace(dimmers, is_joined=is_joined, labels=labels)
    return reduction if gamuts is None else reduction.with_gamuts(gamuts)
