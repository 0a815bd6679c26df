"""Lights that keep to a range of white or to a gamut, and the neighbouring colours that each mixes.

The whites of a range lie on a curve, so that the mixes of all of them are not a convex set. The
mixes of two neighbours are. Each step solves such a convex problem, certified as any other, and
finds the lights that would gain by other neighbours: those at the end of theirs that would go on
from there, those that are off and would be on with another white, and at last single lights that
would be better with a white elsewhere in their range. Wide windows over many whites, which get
narrower, lead near the end quickly. No step between neighbours raises the objective, and in the end
none lowers it.

A gamut is a polygon of many corners, and many mixes of them give the same colour. Exact answers of
few lights use all corners. Under the moving brush, and with many lights, each light mixes the
corners of one triangle, made of the centre and one side, and moves to the next triangle when it
reaches the edge. The end is the same; a thousand lights have three thousand unknowns instead of
twice as many, which are determined.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from lightpaint.arrays import Doubles, Indices
from lightpaint.colour import ColorHull, Lamp, WhiteRange
from lightpaint.lighting.algebra.required_sums import CLOSE
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.unknowns.knobs import Knob, brightest_whites
from lightpaint.lighting.unknowns.reduced_problem import ReducedOptimum, solve_reduced
from lightpaint.lighting.unknowns.reduction import Reduction

#: Widths of windows, in pieces of the range, before they are of one piece.
WINDOW_WIDTHS: tuple[int, ...] = (8, 2)

#: Maximum number of steps between neighbours.
MAX_STEPS = 200

#: Share of the largest slope, and of the objective, that is round-off.
ROUND_OFF = 1e-9

#: Number of lights kept within their gamuts beyond which each mixes the corners of a triangle.
MANY_CONFINED = 64

#: Ends of windows, by the places of their knobs.
Windows = Mapping[int, tuple[int, int]]


@dataclass(frozen=True)
class _WhiteLights:
    """Lights that share a range of white. knobs: (k,), places in the reduction; lights: (k,).

    least: (k, 1), most: (k, m), limits of their luminances in the m whites. unit: (m,), the
    luminance of an unknown of 1, which is the luminance of the brightest mix of a lamp of emitters.
    """

    whites: WhiteRange
    knobs: Indices
    lights: Indices
    least: Doubles
    most: Doubles
    unit: Doubles


@dataclass
class Multipliers:
    """The multipliers of requirements, (m,), in the last of some similar problems, with which the
    next solve begins; None before the first. Updated in place.

    close: the largest miss of a requirement to end at, relative to its size.
    """

    close: float = CLOSE
    required: Doubles | None = None

    def solve(
        self,
        equations: NormalEquations,
        reduction: Reduction,
        start: Doubles,
        **options: Any,
    ) -> ReducedOptimum:
        """Solve as `solve_reduced` does, and keep the multipliers."""
        options |= {"required": self.required, "close": self.close}
        optimum = solve_reduced(equations, reduction, start, **options)
        self.required = optimum.required
        return optimum


def solve_on_locus(
    equations: NormalEquations,
    reduction: Reduction,
    start: Doubles,
    *,
    steps: int | None = None,
    near: Multipliers | None = None,
    **options: Any,
) -> tuple[Reduction, ReducedOptimum]:
    """Solve as `solve_reduced` does, and choose the two whites of each light, or the side of its
    gamut.

    Return the reduction with the whites and sides that lights came to, and its optimum.

    start: (n, 3). A reduction whose lights still mix the ends of their ranges is solved like that
    first; another one continues from the whites nearest to the start. steps: the most steps from
    there to other whites or sides, for an answer under a moving brush, where the next one
    continues; None for as many as help. near: the multipliers of a similar problem. options: of
    `solve_reduced`.
    """
    near = Multipliers() if near is None else near
    if not reduction.white_knobs:
        if steps is not None:
            reduction = reduction.confined_to_sides(_repainted_sides(reduction))
        return next_whites(equations, reduction, start, steps=steps, near=near, **options)
    groups, weights, widths = _groups(reduction), start, WINDOW_WIDTHS
    if steps is not None:
        widths, steps = WINDOW_WIDTHS[:1], steps - 1
    elif all(_is_whole(reduction, k) for k in reduction.white_knobs):
        weights = near.solve(equations, reduction, _snap(groups, start), **options).weights
    for width in widths:
        reduction = reduction.with_windows(_windows_about(groups, weights, width))
        weights = near.solve(equations, reduction, _snap(groups, weights), **options).weights
    reduction = center_windows(reduction, weights)
    return next_whites(equations, reduction, weights, steps=steps, near=near, **options)


def next_whites(
    equations: NormalEquations,
    reduction: Reduction,
    start: Doubles,
    *,
    steps: int | None = None,
    near: Multipliers | None = None,
    only: Collection[int] | None = None,
    **options: Any,
) -> tuple[Reduction, ReducedOptimum]:
    """Solve for two whites of each light, and continue to their neighbours.

    only: the knobs that move, if not all do. For the other arguments and the result see
    `solve_on_locus`.
    """
    near, groups = Multipliers() if near is None else near, _groups(reduction, only)
    most = MANY_CONFINED if steps is None and reduction.requirements is None else 0
    optimum = near.solve(equations, reduction, _snap(groups, start), **options)
    for _ in range(MAX_STEPS if steps is None else steps):
        sides = _next_gamut_parts(equations, reduction, optimum, most)
        is_done = bool(sides) or not groups
        windows = {} if is_done else _better_windows(equations, reduction, groups, optimum)
        if not (windows or sides):
            break
        reduction = reduction.with_windows(windows).confined_to_sides(sides)
        optimum = near.solve(equations, reduction, _snap(groups, optimum.weights), **options)
    return reduction, optimum


def center_windows(reduction: Reduction, weights: Doubles) -> Reduction:
    """Return the reduction with windows of one piece about the whites nearest to weights (n, 3)."""
    return reduction.with_windows(_windows_about(_groups(reduction), weights, 1))


def snap_to_whites(reduction: Reduction, weights: Doubles) -> Doubles:
    """Return weights (n, 3) with the nearest white for each light with a range of whites.

    Lights keep their brightness.
    """
    return _snap(_groups(reduction), weights) if reduction.white_knobs else weights


def _knobs_outside_gamuts(reduction: Reduction, weights: Doubles) -> list[int]:
    """Return places of knobs whose lights have colours, in weights (n, 3), outside their gamuts.

    Lights first may have any colour: if all colours then lie in their gamuts, the answer is the
    best under gamuts, too, and has fewer unknowns.
    """
    if not (free_knobs := reduction.gamut_knobs):
        return []
    assert reduction.gamuts is not None
    lights = [reduction.knobs[k].lights[0] for k in free_knobs]
    beyond = reduction.gamuts.lights_outside(weights, np.array(lights))
    return [k for k, light in zip(free_knobs, lights, strict=True) if light in beyond]


def _next_gamut_parts(
    equations: NormalEquations, reduction: Reduction, optimum: ReducedOptimum, most: int
) -> dict[int, int | None]:
    """Return places of the knobs to keep within their gamuts, or within another triangle of them,
    by its side; None for a whole gamut.

    most: lights that are kept within whole gamuts.
    """
    beyond = _knobs_outside_gamuts(reduction, optimum.weights)
    if not reduction.has_sides and len(beyond) + len(reduction.confined_knobs) <= most:
        return dict.fromkeys(beyond)
    sides: dict[int, int | None] = {**_sides_outside(reduction, beyond, optimum.weights)}
    for k in reduction.confined_knobs:
        knob = reduction.knobs[k]
        if knob.side is None and knob.gamut is not None:
            sides[k] = knob.gamut.side_towards(optimum.weights[knob.lights[0]])
    return sides | _next_sides(equations, reduction, optimum)


def clip_to_gamuts(reduction: Reduction, weights: Doubles) -> Doubles:
    """Return weights (n, 3) with the nearest colour of its gamut for lights that keep to one."""
    knobs, gamuts = reduction.gamut_knobs + reduction.confined_knobs, reduction.gamuts
    if gamuts is None or not knobs:
        return weights
    clipped = weights.copy()
    lights = np.array([reduction.knobs[k].lights[0] for k in knobs])
    for light in gamuts.lights_outside(weights, lights):
        clipped[light] = gamuts[light].nearest(weights[light])
    return clipped


def _groups(reduction: Reduction, only: Collection[int] | None = None) -> list[_WhiteLights]:
    """Group lights by their ranges. only: the knobs, by their places, if not all count."""
    by_range: dict[tuple[WhiteRange, Lamp | None], list[int]] = {}
    for k in reduction.white_knobs if only is None else only:
        knob = reduction.knobs[k]
        assert knob.whites is not None
        by_range.setdefault((knob.whites, knob.lamp), []).append(k)
    groups = []
    for (whites, lamp), places in by_range.items():
        unit = np.ones(1 + whites.last) if lamp is None else brightest_whites(lamp, whites)
        limits = [reduction.knobs[k].limit for k in places]
        most = np.array([np.inf if limit is None else limit[2] for limit in limits])
        groups.append(
            _WhiteLights(
                whites,
                np.array(places, dtype=np.intp),
                np.array([reduction.knobs[k].lights[0] for k in places], dtype=np.intp),
                np.array([0.0 if limit is None else limit[1] for limit in limits])[:, None],
                most[:, None] * unit,
                unit,
            )
        )
    return groups


def _is_whole(reduction: Reduction, k: int) -> bool:
    knob = reduction.knobs[k]
    assert knob.whites is not None
    return knob.whites.last > 1 and knob.window == (0, knob.whites.last)


def _windows_about(groups: Sequence[_WhiteLights], weights: Doubles, width: int) -> Windows:
    windows = {}
    for group in groups:
        places = group.whites.places(weights[group.lights])
        for k, place in zip(group.knobs.tolist(), places.tolist(), strict=True):
            windows[k] = group.whites.window(place, width)
    return windows


def _snap(groups: Sequence[_WhiteLights], weights: Doubles) -> Doubles:
    snapped = weights.copy()
    for group in groups:
        snapped[group.lights] = group.whites.nearest(weights[group.lights])
    return snapped


def _better_windows(
    equations: NormalEquations,
    reduction: Reduction,
    groups: Sequence[_WhiteLights],
    optimum: ReducedOptimum,
) -> Windows:
    """Return windows of the lights that would gain by other whites; none where no light would.

    First all that move to the next white, none of which has to give up its current mix; only
    then the one light that gains most by a jump.
    """
    gradient = optimum.gradient(equations)
    # The noise correction may leave a black picture with less than nothing.
    power = np.maximum(np.einsum("cii->ic", equations.M), 0)
    # The slope of a light that is round-off, in units of its own picture.
    root = np.sqrt(power.sum(axis=1))
    size = np.abs(equations.b.T / np.sqrt(np.where(power > 0, power, 1))).max(initial=0)
    tolerances = ROUND_OFF * root * size
    windows: dict[int, tuple[int, int]] = {}
    for group in groups:
        slopes = gradient[group.lights] @ group.whites.colors.T * group.unit
        for j, k in enumerate(group.knobs.tolist()):
            window = reduction.knobs[k].window
            x = optimum.x[list(reduction.places[k])]
            tolerance = float(tolerances[group.lights[j]] * group.unit.max())
            next_window = _next_window(slopes[j], window, x, tolerance)
            if next_window != window:
                windows[k] = next_window
    return windows or _distant_window(equations, reduction, groups, optimum, gradient)


def _next_window(
    slopes: Doubles, window: tuple[int, int], x: Doubles, tolerance: float
) -> tuple[int, int]:
    """Return the next window of a light with mix x, (2,). slopes: (k,), of all whites."""
    first, last = window
    if not x.any():
        best = int(np.argmin(slopes))
        if slopes[best] >= -tolerance or first <= best <= last:
            return window
        return (best, best + 1) if best < len(slopes) - 1 else (best - 1, best)
    if x[1] == 0 and first > 0 and slopes[first - 1] < slopes[first] - tolerance:
        return first - 1, first
    if x[0] == 0 and last < len(slopes) - 1 and slopes[last + 1] < slopes[last] - tolerance:
        return last, last + 1
    return window


def _distant_window(
    equations: NormalEquations,
    reduction: Reduction,
    groups: Sequence[_WhiteLights],
    optimum: ReducedOptimum,
    gradient: Doubles,
) -> Windows:
    """Return the window of the one light that, moved alone, gains most by a white elsewhere."""
    best, windows = ROUND_OFF * float(np.abs(equations.target_norm2).sum()), {}
    for group in groups:
        colors, w = group.whites.colors, optimum.weights[group.lights]
        own_matrix = np.einsum("cii,cd->icd", equations.M, np.eye(3))[group.lights]
        if equations.coupling is not None:
            own_matrix = own_matrix + equations.coupling[group.lights]
        right = np.einsum("icd,id->ic", own_matrix, w) - gradient[group.lights]
        now = np.einsum("ic,icd,id->i", w, own_matrix, w) - 2 * (w * right).sum(axis=1)
        q, r = np.einsum("kc,icd,kd->ik", colors, own_matrix, colors), right @ colors.T
        lit = q > 0
        Y = np.clip(np.where(lit, r / np.where(lit, q, 1), 0), group.least, group.most)
        gains = np.where(lit, now[:, None] - (np.square(Y) * q - 2 * Y * r), 0)
        j, k = np.unravel_index(int(np.argmax(gains)), gains.shape)
        knob, white = int(group.knobs[j]), int(k)
        first, last = reduction.knobs[knob].window
        if gains[j, k] > best and not first <= white <= last:
            best = float(gains[j, k])
            windows = {knob: group.whites.window(float(white), 1)}
    return windows


def tangent_reduction(reduction: Reduction, reach: float) -> Reduction:
    """Return the reduction with each light of a range on the line through its two whites.

    reach: mireds by which it may leave them along that line. Analyses of an answer, how firmly it
    is determined and which bounds hold it, refer to the curve at this place, not to a piece of it.
    """
    if not reduction.white_knobs:
        return reduction
    knobs = [*reduction.knobs]
    for k in reduction.white_knobs:
        knobs[k] = knobs[k].along_tangent(reach)
    return replace(reduction, knobs=tuple(knobs))


def move_to_best_white(knob: Knob, gradient: Doubles) -> Knob:
    """Return a knob that is off at the white of its range that helps most. gradient: (n, 3)."""
    if knob.whites is None:
        return knob
    slopes = knob.whites.colors @ gradient[knob.lights[0]]
    if knob.lamp is not None:
        slopes = slopes * brightest_whites(knob.lamp, knob.whites)
    best = int(np.argmin(slopes))
    return knob.with_window(knob.whites.window(float(best), 1))


def _repainted_sides(reduction: Reduction) -> dict[int, int]:
    """Return places of the knobs whose gamuts the painting has changed, and their sides of now."""
    sides, gamuts = {}, reduction.gamuts
    for k in reduction.confined_knobs:
        gamut, side, light = _confined_gamut(reduction, k)
        assert gamuts is not None
        if gamuts[light] is not gamut:
            sides[k] = gamuts[light].side_towards(gamut.fan(side)[1:].sum(axis=0))
    return sides


def _sides_outside(
    reduction: Reduction, beyond: Collection[int], weights: Doubles
) -> dict[int, int]:
    """Return the sides where the lights of some knobs leave their gamuts, by place of the knob."""
    sides, gamuts = {}, reduction.gamuts
    for k in beyond:
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
    gradient = optimum.gradient(equations)
    for k in reduction.confined_knobs:
        if reduction.knobs[k].side is None:
            continue
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
