"""Measures of a result: shares of energy, and errors as root mean squares."""

import numpy as np

from lightpaint.arrays import Doubles, Floats, Indices
from lightpaint.basis.basis import Basis
from lightpaint.colour.color import LUMINANCE
from lightpaint.images.estimate import Estimate
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.lighting.solution import Solution
from lightpaint.report.page.html import SHOWN, SPARE


def energy_shares(basis: Basis, lighting: Lighting) -> Doubles:
    """Return share of each light in the predicted image's energy, (n,) float64, in basis order.

    Energy is luminance Y summed over all pixels, painted or not: Σ Y(w_i Φ_i) over
    Σ_j Σ Y(w_j Φ_j). The shares sum to 1; where every light is off they are all 0.
    """
    energy = (basis.totals * lighting.weights_for(basis)) @ LUMINANCE
    total = energy.sum()
    return np.asarray(energy / total if total > 0 else np.zeros_like(energy))


def largest_shares(basis: Basis, lighting: Lighting) -> Doubles:
    """Return the larger of the present and the solved share of each light, (n,)."""
    present = energy_shares(basis, Lighting.present(basis))
    return np.maximum(energy_shares(basis, lighting), present)


def most_visible_lights(basis: Basis, lighting: Lighting) -> Indices:
    """Return places of the lights to show of many, those with the largest shares; all of few."""
    count = len(basis.lights)
    if count <= SHOWN + SPARE:
        return np.arange(count)
    shares = largest_shares(basis, lighting)
    return np.sort(np.argsort(-shares, kind="stable")[:SHOWN])


def relative_residual(solution: Solution) -> float:
    """Return the RMS error of the prediction over the RMS of the painting: √(Σ_c E_c / Σ_c ‖Ψ_c‖²).

    E_c: objective of channel c; ‖Ψ_c‖² = Σ_pixels D Ψ_c². All channels together, weighted
    by importance; in display space, both of display values. 0 is a perfect match, 1 is what all
    lights off would give. Without the square root a miss of 10 % of the light would look like
    one of 1 %.
    """
    norm2 = _norm2(solution)
    # A painting that is black wherever it counts is met by darkness alone.
    missed = sum(solution.certificate.objective)
    return float(np.sqrt(missed / norm2)) if norm2 > 0 else float(missed > 0)


def noise_residual(solution: Solution, predicted: Estimate) -> float:
    """Return the part of `relative_residual` that is the basis's own noise."""
    norm2 = _norm2(solution)
    squares = np.square(predicted.half_difference, dtype=np.float64)
    noise2 = float((solution.weight * squares).sum())
    return float(np.sqrt(noise2 / norm2)) if norm2 > 0 else 0.0


def linear_residual(solution: Solution, predicted: Estimate) -> float:
    """Return `relative_residual` in linear light, whatever the space of the fit."""
    D = solution.importance[..., None]
    meant = solution.goal(predicted.image)
    missed2, norm2 = (
        float((D * np.square(x, dtype=np.float64)).sum()) for x in (meant - predicted.image, meant)
    )
    return float(np.sqrt(missed2 / norm2)) if norm2 > 0 else float(missed2 > 0)


def error_in_codes(solution: Solution) -> float:
    """Return the RMS error in display space over pixels and channels, in codes of 255."""
    mean = sum(solution.certificate.objective) / (3 * float(solution.importance.sum()))
    return 255 * float(np.sqrt(mean))


def _norm2(solution: Solution) -> float:
    if not solution.problem.is_linear:
        return float(solution.norm2.sum())
    weighted = solution.importance[..., None] * np.square(solution.image, dtype=np.float64)
    return float(weighted.sum())


def count_at_least_pixels(solution: Solution, predicted: Floats) -> tuple[int, int] | None:
    """Return the number of "at least" pixels, and of those that are brighter; None if there are
    none.
    """
    loss = solution.problem.loss
    counts = (solution.importance > 0)[..., None]
    its, brighter = (loss.exceeds(x) & counts for x in (np.inf, predicted))
    pixels = int(its.any(axis=-1).sum())
    return (pixels, int(brighter.any(axis=-1).sum())) if pixels else None
