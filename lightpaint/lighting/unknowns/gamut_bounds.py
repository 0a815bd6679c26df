"""Lights at the bounds of their gamuts under the moving brush.

A gamut is a polygon of many corners, and many mixes of them give the same colour. Exact answers use
all corners. Under the brush each light mixes the corners of one triangle, made of the centre and
one side, and moves to the next triangle when it reaches the edge.
"""

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.colour.color_hull import ColorHull
from lightpaint.lighting.algebra.method import Method
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.unknowns.reduced_problem import ReducedOptimum, solve_reduced
from lightpaint.lighting.unknowns.reduction import Reduction
from lightpaint.lighting.unknowns.white_mixes import knobs_outside_gamuts

#: Maximum number of times that lights move to other sides for one answer.
MAX_TURNS = 3


def solve_near_sides(
    equations: NormalEquations, reduction: Reduction, start: Doubles, *, method: Method
) -> tuple[Reduction, Doubles]:
    """Solve with each light kept within its gamut towards the side where it would leave it.

    start: (n, 3). Return the reduction with the sides that lights came to, and the weights (n, 3).
    """
    reduction = reduction.confined_to_sides(_repainted_sides(reduction))
    optimum = solve_reduced(equations, reduction, start, method=method)
    for _ in range(MAX_TURNS):
        sides = _sides_outside(reduction, optimum.weights) | _next_sides(
            equations, reduction, optimum
        )
        if not sides:
            break
        reduction = reduction.confined_to_sides(sides)
        optimum = solve_reduced(equations, reduction, optimum.weights, method=method)
    return reduction, optimum.weights


def _repainted_sides(reduction: Reduction) -> dict[int, int]:
    """Return places of the knobs whose gamuts the painting has changed, and their sides of now."""
    sides, gamuts = {}, reduction.gamuts
    for k in reduction.confined_knobs:
        gamut, side, light = _confined_gamut(reduction, k)
        assert gamuts is not None
        if gamuts[light] is not gamut:
            sides[k] = gamuts[light].side_towards(gamut.fan(side)[1:].sum(axis=0))
    return sides


def _sides_outside(reduction: Reduction, weights: Doubles) -> dict[int, int]:
    """Return places of the knobs of lights that leave their gamuts, and the sides where they do."""
    sides, gamuts = {}, reduction.gamuts
    for k in knobs_outside_gamuts(reduction, weights):
        assert gamuts is not None
        light = reduction.knobs[k].lights[0]
        sides[k] = gamuts[light].side_towards(weights[light])
    return sides


def _next_sides(
    equations: NormalEquations, reduction: Reduction, optimum: ReducedOptimum
) -> dict[int, int]:
    """Return places of the knobs that would gain beyond the ends of their sides, and the next
    sides.

    A mix of both ends of a side that is best in its triangle is best in the whole gamut: an
    objective that rises towards the middle, and is level along a side, rises towards all other
    corners.
    """
    sides: dict[int, int] = {}
    if not reduction.confined_knobs:
        return sides
    gradient = equations.gradient(optimum.weights)
    for k in reduction.confined_knobs:
        gamut, side, light = _confined_gamut(reduction, k)
        x = optimum.x[list(reduction.places[k])]
        if x[1] and x[2]:
            continue
        slopes = gamut.primaries @ gradient[light]
        best, count = int(np.argmin(slopes)), len(slopes)
        first, last = side % count, (side + 1) % count
        if slopes[best] >= min(slopes[first], slopes[last], 0.0):
            continue
        if not x.any():
            sides[k] = best
        else:
            sides[k] = side - 1 if x[2] == 0 else side + 1
    return sides


def _confined_gamut(reduction: Reduction, k: int) -> tuple[ColorHull, int, int]:
    """Return the gamut that a knob is kept within, towards which side, and its light."""
    knob = reduction.knobs[k]
    assert knob.gamut is not None
    assert knob.side is not None
    return knob.gamut, knob.side, knob.lights[0]
