"""A solved problem: the lighting, and what it is the answer to."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from lightpaint.arrays import Doubles, Floats
from lightpaint.lighting.algebra.optimum import Method
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.lighting import Lighting, Quality
from lightpaint.lighting.loss import Loss
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.reweighted import Reweighting

#: What is compared with the painting: light, or what a display shows of it.
Space = Literal["linear", "display"]


@dataclass(frozen=True)
class Refinement:
    """What is known of the noise in the last step to an answer (see refine.py).

    before: (n, 3), the weights that it went from.
    noise: (h, w, 3), half difference of the prediction there, as far as it decided the step.
    lacking: (3, n), what is still to be expected to lack in the gradient.
    share: of the step that the render of the mix decided, 0 to 1; the basis did the rest.
    """

    before: Doubles
    noise: Floats
    lacking: Doubles
    share: float


@dataclass(frozen=True)
class Solution:
    """The lighting that comes closest to a target, and the problem it solves.

    image: (h, w, 3), what was solved for; importance: (h, w), its weights. They differ from
    the target's where unpainted pixels count or emitters are seen.
    equations: of the basis as it is; solved: those that the weights solve, which differ where
    noise was taken out of them.
    current_share: (h, w), or (h, w, 3) after reweighting, how much of `image` is the current
    look, as the basis has it.
    constraints: what was asked of the lights beside being not negative.
    noise_removed: the part of the noise in `equations` that is not in `solved`.
    refinement: the last step by which the answer was improved, if it was.
    is_one_of_several: whether the lighting answers other views too, so that it need not be the
    best for this one.
    method: what it was solved with (see `minimise`), and is again where it is improved.
    tried: with `sparse`, numbers of lights and the weights (n, 3) of the best such.
    loss: what a pixel costs, where that is not one square for each channel: where the painting
    says "at least", or the fit is of what a display shows. reweighting: of the last linear problem
    that stood for it (reweighted.py); image, equations and solved then are of that one.
    """

    lighting: Lighting
    image: Floats
    importance: Floats
    equations: NormalEquations
    solved: NormalEquations
    current_share: Floats
    constraints: Constraints | None = None
    noise_removed: float = 0.0
    refinement: Refinement | None = None
    is_one_of_several: bool = False
    method: Method = "polished"
    tried: tuple[tuple[int, Doubles], ...] = ()
    loss: Loss | None = None
    reweighting: Reweighting | None = None

    @property
    def weight(self) -> Floats:
        """Of a pixel's squared residual, (h, w, 1), or (h, w, 3) where channels differ."""
        D = self.importance[..., None]
        return D if self.reweighting is None else D * self.reweighting.factor

    @property
    def current_shares(self) -> Floats:
        """`current_share` per channel, (h, w, 1) or (h, w, 3)."""
        share = self.current_share
        return share if share.ndim == 3 else share[..., None]

    def meant(self, predicted: Floats) -> Floats:
        """What was to be there, (h, w, 3) linear; `predicted` itself where brighter will do."""
        return self.image if self.loss is None else self.loss.meant(predicted)

    @property
    def norm2(self) -> Doubles:
        """(3,), what a black picture would miss, to hold the objective against."""
        return self.equations.target_norm2 if self.loss is None else self.loss.norm2

    @property
    def energy(self) -> float:
        """What is missed in the problem that `equations` are, all channels together.

        After reweighting that is the last linear one: gains of its solutions are beside this, and
        not beside the objective in the quality, which may be that of a view.
        """
        weights = np.array([light.weight for light in self.lighting.lights])
        return float(self.equations.objective(weights).sum())

    @property
    def space(self) -> Space:
        """In which the prediction was brought close to the painting."""
        return "linear" if self.loss is None or self.loss.view is None else "display"

    @property
    def quality(self) -> Quality:
        """How good the solve is."""
        assert self.lighting.quality is not None
        return self.lighting.quality
