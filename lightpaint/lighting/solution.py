"""A problem with the lighting that solves it, and its certificate."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from lightpaint.arrays import Bools, Doubles, Floats
from lightpaint.basis import Basis
from lightpaint.colour import luminance
from lightpaint.dataframes import CHANNELS, by_channel, xarray
from lightpaint.display_text import Shown
from lightpaint.keywords import keywords
from lightpaint.lighting.answer.certificate import Certificate
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.lighting.fit import Space
from lightpaint.lighting.loss.reweighting import Reweighting
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.problem import Problem


@keywords()
@dataclass(frozen=True)
class Solution(Shown):
    """The lighting that comes closest to a target, and the problem it solves.

    Attributes:
        problem: The problem, with the squares that stand for its loss at the lighting, and the
            lights that `sparse` has chosen.
        lighting: The emission of each light, with its certificate.
        tried: With `sparse`, numbers of lights and the weights (n, 3) of the best ones.
        reweighting: The history of these squares, for a loss that is not linear.
        whole: For one of several views, the solution of all of them: the lighting need not be
            the best for this view.

    Examples:
        >>> solution = lp.solve(basis, target)
        >>> np.round(solution.lighting.emission["panel"], 2).tolist()
        [2.0, 1.5, 1.0]
        >>> solution.certificate.converged
        True
    """

    problem: Problem
    lighting: Lighting
    tried: tuple[tuple[int, Doubles], ...] = ()
    reweighting: Reweighting | None = None
    whole: "Solution | None" = None

    def __repr__(self) -> str:
        return f"Solution({self.certificate}: {self.lighting})"

    @cached_property
    def weights(self) -> Doubles:
        """(n, 3), in the order of the basis."""
        return np.array([light.weight for light in self.lighting.lights], dtype=np.float64)

    @property
    def reached(self) -> Bools:
        """(n, 3), the channels in which a light reaches anything that counts."""
        return np.array([light.reached for light in self.lighting.lights], dtype=bool)

    @property
    def basis(self) -> Basis:
        """The basis of the solve; of several views, of all together."""
        return self.problem.basis

    @property
    def image(self) -> Floats:
        """(h, w, 3), the goal of the solve."""
        return self.problem.squares.image

    @property
    def weight(self) -> Floats:
        """(h, w, 1), the weight of a pixel's squared residual; (h, w, 3) where channels differ."""
        return self.problem.squares.weight

    @property
    def importance(self) -> Floats:
        """(h, w), the weight of a pixel; not the target's if unpainted pixels count."""
        return self.problem.loss.importance

    @property
    def equations(self) -> NormalEquations:
        """The equations without correction for noise."""
        return self.problem.equations

    def goal(self, predicted: Floats) -> Floats:
        """Return the goal (h, w, 3), linear: the painting; `predicted` itself where brighter will
        do.
        """
        return self.problem.loss.goal(predicted)

    @property
    def norm2(self) -> Doubles:
        """(3,), the loss of a black picture, as a scale for the objective."""
        return self.problem.norm2

    @property
    def energy(self) -> float:
        """The objective of `equations`, all channels together.

        After reweighting these are the last linear problem: compare gains of its solutions with
        this, not with the objective in the certificate, which may be the objective of a display.
        """
        return float(self.equations.objective(self.weights).sum())

    @property
    def space(self) -> Space:
        """The space in which prediction and painting were compared."""
        return self.problem.space

    @property
    def certificate(self) -> Certificate:
        """The proof of how good the solve is."""
        assert self.lighting.certificate is not None
        return self.lighting.certificate

    def to_dataframe(self) -> Any:
        """Return the table of `Lighting.to_dataframe`, with the former emission of each light.

        The solutions of an `Analysis` and of `with_error_bars` have errors; the solution of `solve`
        has none, and NaN in their place.

        was_red, was_green, was_blue: its emission in the scene. stops: the change of its
        luminance, -inf for a light that is off now. Raises LightpaintError without pandas.
        """
        table = self.lighting.to_dataframe()
        was = np.array([light.emission for light in self.basis.lights], np.float64)
        for name, values in by_channel("was", was.T).items():
            table[name] = values
        with np.errstate(divide="ignore", invalid="ignore"):  # for lights that were off, or are
            table["stops"] = np.log2(table["y"].to_numpy() / luminance(was))
        return table

    def to_xarray(self) -> Any:
        """Return an xarray.Dataset of the linear problem and its answer, with lights by name.

        M: (channel, light, other), ⟨Φ_i, Φ_j⟩. b: (channel, light), ⟨Φ_i, Ψ⟩. weights, current:
        (light, channel). Of one view also target, predicted: (y, x, channel), and importance:
        (y, x); of several, `views` has the arrays of each. Where the loss is not squares of light,
        M, b and target are of the squares that stand for it at the answer. Raises LightpaintError
        without xarray.
        """
        lit, basis = ("light", "channel"), self.basis
        arrays: dict[str, Any] = {
            "M": (("channel", "light", "other"), self.equations.M),
            "b": (("channel", "light"), self.equations.b),
            "weights": (lit, self.weights),
            "current": (lit, basis.current_weights),
        }
        if len(self.problem.views) == 1:
            picture = ("y", "x", "channel")
            arrays["target"] = (picture, self.image)
            arrays["predicted"] = (picture, basis.mix(self.weights))
            arrays["importance"] = (picture[:2], self.importance)
        names = list(basis.names)
        return xarray().Dataset(
            arrays,
            coords={"light": names, "other": names, "channel": list(CHANNELS)},
            attrs={"target": self.problem.name, "space": self.space},
        )

    def with_certificate_fields(self, **fields: Any) -> "Solution":
        """Return the solution with these values in its certificate."""
        certificate = replace(self.certificate, **fields)
        return replace(self, lighting=self.lighting.with_certificate(certificate))

    @cached_property
    def views(self) -> tuple["Solution", ...]:
        """The answer to each view: its own problem, and the error of the one lighting in it."""
        if len(self.problem.views) == 1:
            return (self,)
        return tuple(self._view_solution(k) for k in range(len(self.problem.views)))

    def _view_solution(self, k: int) -> "Solution":
        problem = self.problem.view_problem(k)
        lighting = self.lighting.for_target(problem.name).with_certificate(
            # The error of the joint objective is not this view's.
            self.certificate.with_objective(
                problem.objective(self.weights), problem.norm2, error=None
            )
        )
        return Solution(problem, lighting, self.tried, self.reweighting, self)
