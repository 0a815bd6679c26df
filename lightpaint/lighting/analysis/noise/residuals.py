"""The residual of an answer and the noise of its prediction, for any pixels."""

from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import Doubles, Floats, Indices
from lightpaint.lighting.solution import Solution


@dataclass(frozen=True)
class Residuals:
    """The residual of an answer, and the noise of its prediction, for any pixels.

    The noise is Σ w_i h_i minus the part that Ψ shares where it equals the current look.

    image: (p, 3), Ψ. predicted: (p, 3), Σ w_i Φ_i. half: (p, 3), Σ w_i h_i. current: (p, 3), noise
    of the current look; None where nothing follows it. share: (p, 1) or (p, 3), as far as it does;
    None where `half` has that already.
    """

    image: Floats
    predicted: Floats
    half: Floats
    current: Floats | None
    share: Floats | None

    @classmethod
    def of(cls, solution: Solution) -> "Residuals":
        """Return the residuals of a solution."""
        basis, weights, problem = solution.basis, solution.weights, solution.problem
        predicted, r, share = basis.predict(weights), problem.refinement, problem.squares.share
        half, current = predicted.half_difference, None
        if share.any():
            current = basis.current_noise.reshape(-1, 3)
        if r is not None:
            half = r.noise + basis.noise.mix(weights - r.before)
        image, mixed, half = (x.reshape(-1, 3) for x in (solution.image, predicted.image, half))
        is_shared = current is not None and r is None
        shared = share.reshape(-1, share.shape[2]) if is_shared else None
        return cls(image, mixed, half, current, shared)

    def residual(self, pixels: slice | Indices) -> Doubles:
        """Return Ψ − Σ w_i Φ_i of some pixels, (p, 3)."""
        return self.image[pixels].astype(np.float64) - self.predicted[pixels]

    def noise(self, pixels: slice | Indices) -> Doubles:
        """Return the half difference of the prediction at some pixels, (p, 3)."""
        half = self.half[pixels].astype(np.float64)
        if self.current is None or self.share is None:
            return half
        return half - self.share[pixels] * self.current[pixels]
