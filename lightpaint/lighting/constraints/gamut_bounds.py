"""Lights at the bounds of their gamuts, found while the brush moves.

A gamut is a polygon of many corners, of which a colour is a mix in many ways: exact answers take
all of them. Under the brush each light mixes those of one triangle, of the middle and one side,
and goes on to the next one when it comes to its end.
"""

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.colour.color_hull import ColorHull
from lightpaint.lighting.algebra.optimum import Method
from lightpaint.lighting.constraints.reduced_problem import ReducedOptimum, solve_reduced
from lightpaint.lighting.constraints.reduction import Reduction
from lightpaint.lighting.constraints.white_neighbours import beyond_gamuts
from lightpaint.lighting.normal_equations import NormalEquations

#: Times that lights go on to other sides for one answer, at most.
TURNS = 3


def solve_near_sides(
    equations: NormalEquations, reduction: Reduction, start: Doubles, *, method: Method
) -> tuple[Reduction, Doubles]:
    """Solve with each light kept within its gamut towards the side where it would leave it.

    start: (n, 3). Return the reduction with the sides that lights came to, and the weights (n, 3).
    """
    reduction = reduction.kept_near(_repainted(reduction))
    found = solve_reduced(equations, reduction, start, method=method)
    for _ in range(TURNS):
        sides = _beyond(reduction, found.weights) | _onward(equations, reduction, found)
        if not sides:
            break
        reduction = reduction.kept_near(sides)
        found = solve_reduced(equations, reduction, found.weights, method=method)
    return reduction, found.weights


def _repainted(reduction: Reduction) -> dict[int, int]:
    """Return places of the knobs whose gamuts the painting has changed, and their sides of now."""
    sides, gamuts = {}, reduction.gamuts
    for k in reduction.kept_knobs:
        its, side, light = _kept(reduction, k)
        assert gamuts is not None
        if gamuts[light] is not its:
            sides[k] = gamuts[light].side_towards(its.fan(side)[1:].sum(axis=0))
    return sides


def _beyond(reduction: Reduction, weights: Doubles) -> dict[int, int]:
    """Return places of the knobs of lights that leave their gamuts, and the sides where they do."""
    sides, gamuts = {}, reduction.gamuts
    for k in beyond_gamuts(reduction, weights):
        assert gamuts is not None
        light = reduction.knobs[k].lights[0]
        sides[k] = gamuts[light].side_towards(weights[light])
    return sides


def _onward(
    equations: NormalEquations, reduction: Reduction, found: ReducedOptimum
) -> dict[int, int]:
    """Return places of the knobs that would gain beyond the ends of their sides, and the next ones.

    A mix of both ends of a side is best in the whole gamut where it is so in its triangle: what
    rises towards the middle, and is level along a side, rises towards all other corners.
    """
    sides: dict[int, int] = {}
    if not reduction.kept_knobs:
        return sides
    gradient = equations.gradient(found.weights)
    for k in reduction.kept_knobs:
        its, side, light = _kept(reduction, k)
        x = found.x[list(reduction.places[k])]
        if x[1] and x[2]:
            continue
        slopes = its.primaries @ gradient[light]
        best, count = int(np.argmin(slopes)), len(slopes)
        first, last = side % count, (side + 1) % count
        if slopes[best] >= min(slopes[first], slopes[last], 0.0):
            continue
        if not x.any():
            sides[k] = best
        else:
            sides[k] = side - 1 if x[2] == 0 else side + 1
    return sides


def _kept(reduction: Reduction, k: int) -> tuple[ColorHull, int, int]:
    """Return the gamut that a knob is kept within, towards which side, and its light."""
    knob = reduction.knobs[k]
    assert knob.gamut is not None
    assert knob.side is not None
    return knob.gamut, knob.side, knob.lights[0]
