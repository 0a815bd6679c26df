"""Problems that squares stand for: what their solve asks of them, which is no pixel."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Self

from lightpaint.arrays import Bools, Doubles
from lightpaint.basis.lights import Lights
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.constraints.gamuts import Gamuts
from lightpaint.lighting.constraints.reduction import Reduction, reduce_to
from lightpaint.lighting.constraints.white_lights import whiten_open_lights
from lightpaint.lighting.fit import Fit
from lightpaint.lighting.loss.weight_penalty import pull_of
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.screen import shortly


class LinearProblem:
    """Squares by their sums, and what the lights may do: the frozen dataclass adds the fields.

    equations: M and b of the squares; corrected: the same without that part of the noise which is
    not in `noise_removed`, None where none was taken out. constraints: what is asked of the lights.
    reduction: what is left to solve for; full: the same with all lights that `sparse` has not
    chosen. fit: with nothing left open. dimming: as of `pull_of`.
    """

    equations: NormalEquations
    corrected: NormalEquations | None
    noise_removed: float
    constraints: Constraints
    reduction: Reduction
    full: Reduction
    fit: Fit
    dimming: Doubles | None

    if TYPE_CHECKING:  # properties of one kind of problem, fields of the other

        @property
        def name(self) -> str:
            """Name of the painting, for people."""

        @property
        def lights(self) -> Lights:
            """The lights that are to be set."""

        @property
        def power(self) -> Doubles:
            """‖Φᵢ‖² over the picture, (n, 3), as of `Basis`."""

        @property
        def transform(self) -> ViewTransform | None:
            """The view transform through which the loss is seen; None for linear light."""

        @property
        def painted_share(self) -> float:
            """Importance of all that is painted, beside the number of pixels."""

        @property
        def scene_identity(self) -> str:
            """The scene that the lights are of, as of `Origin`."""

        @property
        def spp(self) -> int | None:
            """Samples per pixel that the sums are of; None where nobody knows of any."""

        @property
        def norm2(self) -> Doubles:
            """(3,), what a black picture would miss, to hold the objective against."""

    def objective(self, weights: Doubles) -> Doubles:
        """(3,), what weights (n, 3) miss."""
        raise NotImplementedError

    def without_traces(self, weights: Doubles, is_asked: Bools) -> Doubles:
        """Weights (n, 3) without what rounding alone has made. is_asked: (n,), whose are kept."""
        raise NotImplementedError

    @property
    def solved(self) -> NormalEquations:
        """The equations that the weights are to solve, noise taken out where that was asked."""
        return self.equations if self.corrected is None else self.corrected

    @property
    def pull_strength(self) -> float:
        """That of the pull to the present, of light as bright as the view transform makes it."""
        return self.constraints.prefer_current * self.fit.brightness

    @property
    def keeps_color(self) -> Bools:
        """(n,), the lights that are pulled to their colour: free to leave it, and seen to."""
        return self.full.is_free & self.equations.reached.any(axis=1)

    @cached_property
    def pull(self) -> NormalEquations | None:
        """Penalty of leaving the present, or its colours; None where none is asked."""
        return pull_of(
            self.power,
            self.lights.present_weights,
            self.fit,
            prefer_current=self.constraints.prefer_current,
            painted_share=self.painted_share,
            keeps_color=self.keeps_color,
            dimming=self.dimming,
        )

    def pulled(self, equations: NormalEquations) -> NormalEquations:
        """`equations` with what pulls at the weights, if something does."""
        return equations if self.pull is None else equations + self.pull

    def with_reduction(self, reduction: Reduction) -> Self:
        """This problem with that reduction, and the same `full`."""
        return replace(self, reduction=reduction)  # type: ignore[type-var]

    def reduced(self, reduction: Reduction) -> Self:
        """This problem with that reduction, which differs in the whites that lights came to."""
        if self.reduction is self.full:
            full = reduction
        else:
            windows = {k: reduction.knobs[k].window for k in reduction.white_knobs}
            full = self.full.with_windows(windows)
        return replace(self, reduction=reduction, full=full)  # type: ignore[type-var]


@dataclass(frozen=True, kw_only=True)
class SummedProblem(LinearProblem):
    """A painting taken at its word in linear light, of which nothing but sums is known.

    name, lights, power, scene_identity, spp: as of `LinearProblem`. start: (n, 3), the weights to
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
    dimming: Doubles | None = None

    __repr__ = shortly

    @property
    def transform(self) -> None:
        """None: a display has no sums."""

    @property
    def painted_share(self) -> float:
        """1: nothing of what is solved so is in proportion to it."""
        return 1.0

    def objective(self, weights: Doubles) -> Doubles:
        """(3,), what weights (n, 3) miss."""
        return self.equations.objective(weights)

    @property
    def norm2(self) -> Doubles:
        """(3,), what a black picture would miss."""
        return self.equations.target_norm2

    def without_traces(self, weights: Doubles, is_asked: Bools) -> Doubles:
        """Weights (n, 3) as they are: what shows in a pixel, no sum tells."""
        return weights


def reduced_by(
    asked: Constraints, lights: Lights, fit: Fit, gamuts: Gamuts | None = None
) -> Reduction:
    """Reduce the lights to the unknowns that constraints and the fit of their colours leave.

    gamuts: as of `gamuts_for`. Raises ConstraintError for a light that is to be white and cannot be
    what else is asked of it.
    """
    if fit.colors == "white":
        asked = whiten_open_lights(asked, lights)
    reduction = replace(reduce_to(asked, lights), is_joined=fit.colors == "gentle")
    return reduction if gamuts is None else reduction.with_gamuts(gamuts)
