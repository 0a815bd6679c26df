"""Lights that went down only to make up for what others spill on unpainted parts."""

import numpy as np

from lightpaint.arrays import Bools, Doubles
from lightpaint.colour import luminance
from lightpaint.lighting.analysis.appearance.constraint_kinds import (
    SINGLE_LIGHT_KINDS,
    ConstraintsByLight,
)
from lightpaint.lighting.loss.lit_pixels import LitPixels
from lightpaint.lighting.loss.painting import unpainted_weight_of
from lightpaint.lighting.loss.painting_loss import PaintingLoss
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.problem import Problem
from lightpaint.lighting.solution import Solution

#: Share of its present luminance below which a light counts as down: two stops.
DOWN = 1 / 4

#: Share of its present luminance that the paint alone would leave a light that is down for the
#: rest.
PAINTED_LEVEL = 1 / 2

#: Share of a light's power that is round-off.
ROUND_OFF = 1e-9


def compensating_lights(solution: Solution) -> tuple[str, ...]:
    """Return the names of lights that are down by two stops or more for unpainted parts alone.

    Where nothing is painted they would have to be darker, and the paint would not: it asks for more
    of them, or does not see them. Lights with constraints of their own are left out. solution: of
    one view; if it is part of one of several views, the paint is that of all of them.
    """
    whole = solution.whole or solution
    problem, weights = whole.problem, whole.weights
    unpainted = unpainted_weight_of(problem.views, problem.fit)
    reference = np.asarray(luminance(problem.reference), np.float64)
    level = luminance(weights) / np.where(reference > 0, reference, 1)
    down = np.flatnonzero((reference > 0) & (level < DOWN) & ~_constrained(problem))
    if unpainted <= 0 or not down.size:
        return ()
    rest = _rest_equations(problem, weights, unpainted)
    wanted = -(problem.equations.gradient(weights) * problem.reference).sum(axis=1)
    wanted_by_rest = -(rest.gradient(weights) * problem.reference).sum(axis=1)
    by_paint = wanted - wanted_by_rest
    power, rest_power = (
        np.einsum("cii,ic->i", x.M, np.square(problem.reference)) for x in (problem.equations, rest)
    )
    seen = power - rest_power  # in the paint
    # The level that the paint alone would give this light, all others as they are.
    alone = level + by_paint / np.where(seen > 0, seen, np.inf)
    for_rest = (wanted_by_rest < 0) & ((alone >= PAINTED_LEVEL) | (seen <= ROUND_OFF * power))
    return tuple(problem.lights.names[k] for k in down if for_rest[k])


def _constrained(problem: Problem) -> Bools:
    """Return, (n,), which lights have constraints of their own, or may be left out."""
    constraints, lights = problem.constraints, problem.lights
    is_constrained = np.array([light.is_fixed for light in lights], dtype=bool)
    kinds = ConstraintsByLight.of(constraints, lights).kinds()
    for kind in (*SINGLE_LIGHT_KINDS, "tie", "sparse"):
        is_constrained[list(kinds.get(kind, ()))] = True
    return is_constrained


def _rest_equations(problem: Problem, weights: Doubles, unpainted: float) -> NormalEquations:
    """Return the squares of unpainted pixels alone, at the picture of weights (n, 3).

    unpainted: the weight of each of them.
    """
    views = problem.views
    importance = views.join(
        [
            np.where(basis.emitters_seen, 0, unpainted * np.maximum(1 - target.importance, 0))
            for basis, target in zip(views.bases, views.targets, strict=True)
        ]
    )
    look = problem.basis.current_look
    held = PaintingLoss(
        painted=look,
        importance=importance,
        share=np.ones(importance.shape),
        current=look,
        at_least=np.zeros(look.shape, bool),
        transform=problem.transform,
    )
    return LitPixels.whole(problem.basis, held).equations_at(weights)
