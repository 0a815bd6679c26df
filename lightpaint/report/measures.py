"""An answer with everything that its report contains, from which pages and numbers are made; and
its measures: shares of energy, errors as root mean squares, and errors of lights.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import Doubles, Floats, in_any_channel
from lightpaint.basis import Basis
from lightpaint.colour import LUMINANCE
from lightpaint.images import Estimate, sum_by_bands
from lightpaint.lighting import (
    Appearance,
    Choices,
    Diagnosis,
    Lighting,
    PlanesAnswer,
    Solution,
    SurfaceColor,
    Uncertainty,
)
from lightpaint.placement.suggestion import MoveSuggestion, Suggestion
from lightpaint.relit.verification import Verification
from lightpaint.report.hung_light import HungLights
from lightpaint.target import Target

#: Share of a picture's light from which on a light's error counts in proportion to the light.
LEAST_SHARE = 0.05


@dataclass(frozen=True, kw_only=True)
class ReportedAnswer:
    """The answer to a painting, with its analysis as far as it is known.

    basis, target, solution: of one view. predicted: Σ w_i Φ_i. verification: None without a render
    that checks the prediction. command: the shell command that made the result. uncertainty,
    diagnosis, unconstrained, suggestions, hung: without them the report has no such section.
    turn: the turn of a spot that would help most, if any. appearance: the result of
    `compare_appearance`, if known. color_choices: the answers of other colours, if known. planes:
    what it gives on measuring planes, if there are any. surfaces: colours of objects under it, if
    it has spectra. job_remarks: remarks on scene, lights and painting.
    """

    basis: Basis
    target: Target
    solution: Solution
    predicted: Estimate
    verification: Verification | None
    command: str = ""
    uncertainty: Uncertainty | None = None
    diagnosis: Diagnosis | None = None
    unconstrained: Solution | None = None
    suggestions: Sequence[Suggestion] | None = None
    turn: MoveSuggestion | None = None
    hung: HungLights | None = None
    appearance: Appearance | None = None
    color_choices: Choices = ()
    planes: PlanesAnswer | None = None
    surfaces: Sequence[SurfaceColor] = ()
    job_remarks: Sequence[str] = ()


def energy_shares(basis: Basis, lighting: Lighting) -> Doubles:
    """Return each light's share of the predicted image's energy, (n,) float64, in basis order.

    Energy is luminance Y summed over all pixels, painted or not: Σ Y(w_i Φ_i) over
    Σ_j Σ Y(w_j Φ_j). The shares sum to 1; where every light is off they are all 0.
    """
    energy = (basis.totals * lighting.weights_for(basis)) @ LUMINANCE
    total = energy.sum()
    return np.asarray(energy / total if total > 0 else np.zeros_like(energy))


def relative_residual(solution: Solution) -> float:
    """Return the RMS error of the prediction over the RMS of the painting: √(Σ_c E_c / Σ_c ‖Ψ_c‖²).

    E_c: objective of channel c; ‖Ψ_c‖² = Σ_pixels D Ψ_c². All channels together, weighted
    by importance; in display space, both of display values. 0 is a perfect match, 1 the value with
    all lights off. Without the square root an error of 10 % of the light would look like one of 1
    %.
    """
    norm2 = _norm2(solution)
    # A painting that is black wherever it counts is met by darkness alone.
    missed = sum(solution.certificate.objective)
    return float(np.sqrt(missed / norm2)) if norm2 > 0 else float(missed > 0)


def noise_residual(solution: Solution, predicted: Estimate) -> float:
    """Return the part of `relative_residual` that is the basis's own noise."""
    norm2 = _norm2(solution)

    def power(weight: Floats, half: Floats) -> Floats:
        return np.asarray((weight * np.square(half, dtype=np.float64)).sum())

    noise2 = float(sum_by_bands(power, solution.weight, predicted.half_difference))
    return float(np.sqrt(noise2 / norm2)) if norm2 > 0 else 0.0


def linear_residual(solution: Solution, predicted: Estimate) -> float:
    """Return `relative_residual` in linear light, whatever the space of the fit."""

    def powers(D: Floats, goal: Floats, image: Floats) -> Floats:
        squares = np.square(goal - image, dtype=np.float64), np.square(goal, dtype=np.float64)
        return np.array([(D[..., None] * x).sum() for x in squares])

    goal = solution.goal(predicted.image)
    missed2, norm2 = sum_by_bands(powers, solution.importance, goal, predicted.image).tolist()
    return float(np.sqrt(missed2 / norm2)) if norm2 > 0 else float(missed2 > 0)


def error_in_codes(solution: Solution) -> float:
    """Return the RMS error in display space over pixels and channels, in codes of 255."""
    mean = sum(solution.certificate.objective) / (3 * float(solution.importance.sum()))
    return 255 * float(np.sqrt(mean))


def _norm2(solution: Solution) -> float:
    if not solution.problem.is_linear:
        return float(solution.norm2.sum())

    def power(D: Floats, image: Floats) -> Floats:
        return np.asarray((D[..., None] * np.square(image, dtype=np.float64)).sum())

    return float(sum_by_bands(power, solution.importance, solution.image))


def count_at_least_pixels(solution: Solution, predicted: Floats) -> tuple[int, int] | None:
    """Return the number of "at least" pixels, and of those that are brighter; None if there are
    none.
    """
    loss = solution.problem.loss
    counts = (solution.importance > 0)[..., None]
    may_exceed, brighter = (loss.exceeds(x) & counts for x in (np.inf, predicted))
    pixels = int(in_any_channel(may_exceed).sum())
    return (pixels, int(in_any_channel(brighter).sum())) if pixels else None


def brightness(uncertainty: Uncertainty) -> tuple[Doubles, Doubles, Doubles]:
    """Return the luminance of each light as solved, and the ends of its 95 % interval, (n,) each.

    Only known channels count.
    """
    # One path carries all channels, so that their errors go together.
    is_known = np.isfinite(uncertainty.scatter)
    ends = (uncertainty.weights, *uncertainty.interval)
    solved, low, high = (np.where(is_known, end, 0) @ LUMINANCE for end in ends)
    return solved, low, high


def relative_errors(uncertainty: Uncertainty) -> Doubles:
    """Return the half width of each light's 95 % interval over its luminance, (n,).

    It is not finite if the light is off and may be on; 0 without error.
    """
    solved, low, high = brightness(uncertainty)
    side = np.maximum(solved - low, high - solved)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(side > 0, side / solved, 0.0)


def picture_errors(basis: Basis, uncertainty: Uncertainty) -> Doubles:
    """Return the half width of each light's 95 % interval, relative to its contribution, (n,).

    All in luminance summed over the picture. A light with less than LEAST_SHARE of the picture's
    light counts as if it had that share, so only visible errors are large. 0 if unknown.
    """
    low, high = uncertainty.interval
    side = np.maximum(uncertainty.weights - low, high - uncertainty.weights)
    side = np.where(np.isfinite(side), side, 0)
    error, total_power = ((basis.totals * x) @ LUMINANCE for x in (side, uncertainty.weights))
    power_sum = total_power.sum()
    return np.asarray(
        error / np.maximum(total_power, LEAST_SHARE * power_sum) if power_sum > 0 else 0 * error
    )


def most_uncertain(basis: Basis, solution: Solution, uncertainty: Uncertainty) -> int | None:
    """Return the light whose error changes the picture most, if it is determined; None if none
    is."""
    errors = relative_errors(uncertainty)
    effect = np.where(np.isfinite(errors) & ~uncertainty.untold, errors, 0) * energy_shares(
        basis, solution.lighting
    )
    return int(np.argmax(effect)) if effect.any() else None


def is_by_painting(uncertainty: Uncertainty, k: int) -> bool:
    """Return whether the error of light k is for the most part by noise of the painting."""
    parts = uncertainty.painting_scatter[k], uncertainty.scatter[k], uncertainty.bias[k]
    painting, scatter, bias = (float(np.nansum(np.square(x))) for x in parts)
    return painting > scatter + bias


def halving_spp(basis: Basis, uncertainty: Uncertainty, k: int) -> int:
    """Return the samples per pixel that halve the error of light k.

    Scatter falls with the root of the samples, bias with their number.
    """
    scatter, bias = (np.nansum(np.square(x[k])) for x in (uncertainty.scatter, uncertainty.bias))
    # scatter / m + bias / m² = (scatter + bias) / 4
    total = scatter + bias
    times = 2 * (scatter + np.sqrt(scatter**2 + total * bias)) / total if total > 0 else 1.0
    exact = times * basis.origin.mean_spp
    power = 2 ** int(np.floor(np.log2(exact)) - 2)
    return int(np.ceil(exact / power) * power) if power >= 1 else int(np.ceil(exact))
