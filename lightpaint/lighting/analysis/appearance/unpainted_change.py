"""The visible change of the unpainted part of the picture."""

from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import Bools, Doubles, Floats, Indices
from lightpaint.basis import Basis
from lightpaint.colour import ciede2000
from lightpaint.lighting.analysis.appearance.display_difference import NO_NAME, PaintComparison
from lightpaint.lighting.analysis.diagnosis import REGIONS
from lightpaint.lighting.constraints.light_constraints import (
    ConstraintKind,
    ConstraintsByLight,
)
from lightpaint.lighting.solution import Solution

#: Smallest unpainted share of the picture for a place to be mentioned.
MIN_PLACE = 0.01

#: Kinds of constraints that fix the level of a light.
FIXING_KINDS: tuple[ConstraintKind, ...] = ("off", "lock")


@dataclass(frozen=True)
class UnpaintedChange:
    """The change of the unpainted part of the picture, in CIEDE2000.

    Attributes:
        delta_e: Its mean over all unpainted pixels.
        worst: Its mean over the object, or the ninth of the picture, that changes most.
        object: The name of that object; "" without a name.
        region: Row and column of that ninth, 0 to 2, if there is no object.
    """

    delta_e: float
    worst: float
    object: str = ""
    region: tuple[int, int] = (1, 1)


def change_from_scene(
    solution: Solution, look: PaintComparison, weights: Doubles, picture: Floats
) -> UnpaintedChange | None:
    """Return the change of unpainted pixels from the current scene; None if they may change freely.

    solution: has the painting and the constraints. look: at the painting. picture: (h, w, 3)
    linear, under lights of weights (n, 3). Both pictures are sums of the same planes, so noise does
    not count as change. Lights fixed by the user are fixed in both.
    """
    [target], basis = solution.problem.views.targets, solution.basis
    if not target.over_look or target.everything:
        return None
    kinds = ConstraintsByLight.of(solution.problem.constraints, basis.lights).kinds()
    reference_weights = basis.current_weights.copy()
    for kind in FIXING_KINDS:
        fixed_lights = list(kinds.get(kind, ()))
        reference_weights[fixed_lights] = weights[fixed_lights]
    is_current = np.array_equal(reference_weights, basis.current_weights)
    now = basis.current_look if is_current else basis.mix(reference_weights)
    return unpainted_change(look, basis, target.importance > 0, now, picture)


def unpainted_change(
    look: PaintComparison, basis: Basis, painted: Bools, before: Floats, after: Floats
) -> UnpaintedChange | None:
    """Return the difference of two pictures over the unpainted part; None if all is painted.

    look: at the painting. painted: (h, w). before, after: (h, w, 3) linear, the two pictures.
    """
    compared = (slice(None, None, look.step), slice(None, None, look.step))
    rest = ~painted[compared]
    if not rest.any():
        return None
    labs = (look.lab(x[compared][rest].astype(np.float64)) for x in (before, after))
    difference = ciede2000(*labs)
    worst, name, region = _worst(basis, compared, rest, difference)
    return UnpaintedChange(float(difference.mean()), worst, name, region)


def _worst(
    basis: Basis, compared: tuple[slice, slice], rest: Bools, difference: Doubles
) -> tuple[float, str, tuple[int, int]]:
    """Return the largest mean of `difference` over one place: its ΔE, object and region."""
    rows, columns = (REGIONS * np.arange(n) // n for n in rest.shape)
    ninth = (REGIONS * rows[:, None] + columns[None, :])[rest]
    enough = MIN_PLACE * rest.size
    worst_region, most = _largest_mean(ninth, difference, REGIONS**2, enough)
    region = (worst_region // REGIONS, worst_region % REGIONS)
    objects = basis.objects
    if objects is None:
        return most, "", region
    has_name = np.array([not NO_NAME.fullmatch(name) for name in objects.names], dtype=bool)
    index = objects.index[compared][rest].astype(np.int64)
    has_object = index >= 0
    if not (has_object.any() and has_name.any()):
        return most, "", region
    worst_object, mean = _largest_mean(
        index[has_object], difference[has_object], len(has_name), enough, has_name
    )
    return (mean, objects.names[worst_object], region) if mean > 0 else (most, "", region)


def _largest_mean(
    index: Indices, values: Doubles, count: int, enough: float, among: Bools | None = None
) -> tuple[int, float]:
    """Return which of `count` places has the largest mean, and that mean.

    index, values: (p,), the place of each pixel, and its value. enough: pixels that a place must
    have. among: (count,), places that may be named; None for all.
    """
    sizes = np.bincount(index, minlength=count)
    means = np.bincount(index, weights=values, minlength=count) / np.maximum(sizes, 1)
    means = np.where((sizes >= enough) & (True if among is None else among), means, 0)
    best = int(np.argmax(means))
    return best, float(means[best])
