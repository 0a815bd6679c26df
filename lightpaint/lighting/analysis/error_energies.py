"""Energies of an error and of its parts, summed over a picture band by band."""

from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import Doubles, Floats
from lightpaint.colour.color import luminance
from lightpaint.images.bands import bands_of
from lightpaint.lighting.analysis.noise.painting_grain import channel_grain
from lightpaint.lighting.analysis.noise.residuals import Residuals
from lightpaint.lighting.solution import Solution
from lightpaint.threads import parallel_map


@dataclass(frozen=True)
class ErrorEnergies:
    """Sums over pixels. total, out_of_reach, noise, ignored: as in `Diagnosis`, uncut. painted:
    Σ D Ψ².
    """

    total: float
    out_of_reach: float
    noise: float
    ignored: float
    painted: float

    @classmethod
    def of(
        cls,
        solution: Solution,
        predicted: Floats,
        forbidden: Floats,
        unreachable_map: Doubles,
        ignored_map: Doubles,
    ) -> "ErrorEnergies":
        """Sum, band by band, and fill the maps: (h, w, 3) and (h, w)."""
        [target] = solution.problem.views.targets
        residuals, loss, width = Residuals.of(solution), solution.problem.loss, predicted.shape[1]

        def sums(rows: slice) -> Doubles:
            D, importance = (
                x[rows].astype(np.float64) for x in (solution.weight, solution.importance)
            )
            image, mixed = solution.image[rows].astype(np.float64), predicted[rows]
            missed = image - mixed
            unreachable = missed - forbidden[rows]
            # This excludes noise that the painting shares, where it equals the current look.
            noise = residuals.noise(slice(rows.start * width, rows.stop * width))
            uncounted = _uncounted(importance, target.image[rows])
            outside = target.image[rows].astype(np.float64) - mixed
            is_linear = solution.problem.is_linear
            residual = outside if is_linear else loss.cut(lambda x: x[rows]).residual(mixed)
            unreachable_map[rows] = unreachable
            ignored_map[rows] = uncounted * luminance(outside)
            return np.array(
                [
                    (D * np.square(missed)).sum(),
                    (D * np.square(unreachable)).sum(),
                    (D * np.square(noise.reshape(missed.shape))).sum(),
                    (uncounted[..., None] * np.square(residual)).sum(),
                    (D * np.square(image)).sum(),
                ]
            )

        energies = np.sum(parallel_map(sums, bands_of(predicted.shape)), axis=0).tolist()
        total, out_of_reach, noise, ignored, painted = energies
        return cls(total, out_of_reach, noise, ignored, painted)


def _uncounted(importance: Doubles, image: Floats) -> Doubles:
    """Return the share of pixels, (h, w), that does not count, in which `image` has a colour."""
    # Black target pixels have no colour to miss.
    return np.where(np.any(image > 0, axis=-1), np.maximum(1 - importance, 0), 0)


def grain_power(solution: Solution, unreachable: Doubles) -> float:
    """Return the power of the painting's noise in the part out of reach.

    Grain is measured with the weights of the fit: otherwise a mean would give dark pixels the grain
    of bright neighbours, and more than the whole error.
    """
    counted, weight = solution.importance > 0, solution.weight
    power = 0.0
    for c in range(3):
        root_weight = np.sqrt(weight[..., c % weight.shape[2]].astype(np.float64))
        root_weight *= unreachable[..., c]
        power += float(channel_grain(root_weight, counted).sum())
    return power
