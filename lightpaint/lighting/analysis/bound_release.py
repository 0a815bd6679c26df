"""What letting go of one thing alone would bring, of all that holds the lights back.

The gains are exact: the problem is solved again without that one thing. For which of them that
is worth while is decided by what moving these lights alone would bring, a lower limit of it.
"""

from dataclasses import replace

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.lighting.analysis.active_bounds import Answer, Held, all_held
from lightpaint.lighting.answer.active_bound import Bound, Tint
from lightpaint.lighting.constraints.knobs import Knob
from lightpaint.lighting.constraints.reduced_problem import solve_reduced
from lightpaint.lighting.constraints.reduction import Reduction
from lightpaint.lighting.constraints.white_neighbours import move_to_best_white, next_whites
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.solution import Solution

#: Bounds for which the problem is solved again, those that seem to matter most: so many, and of
#: large problems about as many as WORK has unknowns, at least so many.
RELEASED, WORK, FEWEST = 32, 2048, 4

#: By how much greener or pinker than its whites, in Duv, a light has to be for anybody to see it.
SEEN = 0.003

#: Share of ‖Ψ‖² below which a gain is round-off.
SMALLEST = 1e-12


def bounds_of(solution: Solution) -> tuple[tuple[Bound, ...], int]:
    """What holds the lights of `solution`, the largest gain first, and how many more there are.

    For these, which seem to matter less, the problem was not solved again.
    """
    problem = solution.problem
    equations = problem.pulled(problem.solved)
    answer = _answer(solution, equations)
    least = SMALLEST * float(solution.equations.target_norm2.sum())
    held = [h for h in all_held(answer) if h.estimate > least]
    held.sort(key=lambda h: -h.estimate)
    before, bounds = _value(problem.solved, answer.w), []
    size = len(answer.reduction.unknowns) // len(answer.reduction.channel_groups)
    for h in held[: min(max(WORK // max(size, 1), FEWEST), RELEASED)]:
        reduction, x = _without(answer, h)
        if h.kind == "left out" and reduction.knobs[h.knob].whites is not None:
            freed = next_whites(equations, reduction, answer.w, only=[h.knob])[1]
        else:
            freed = solve_reduced(equations, reduction, answer.w, x=x)
        gain = before - _value(problem.solved, freed.weights)
        if problem.pull is None:
            gain = max(gain, 0.0)  # but for round-off it is
        tint = _tint(answer, h, freed.weights)
        names = tuple(solution.basis.names[k] for k in h.lights)
        label = answer.full.labels[h.lights[0]]
        held_by = h.kind if h.kind in ("zero", "kept", "left out") else label
        bounds.append(Bound(names, h.kind, held_by, gain, h.multiplier, h.per, tint))
    return tuple(sorted(bounds, key=lambda bound: -bound.gain)), len(held) - len(bounds)


def _answer(solution: Solution, equations: NormalEquations) -> Answer:
    reduction = solution.problem.about_answer
    found = solve_reduced(equations, reduction, solution.weights)
    lit = equations.reached
    return Answer(
        solution.basis,
        reduction,
        solution.problem.full,
        found,
        np.where(lit, equations.gradient(found.weights), 0),
        np.where(lit, np.einsum("cii->ic", equations.M), 0),
        tuple(light.is_active for light in solution.lighting.lights),
    )


def _tint(o: Answer, held: Held, freed: Doubles) -> Tint:
    """To which side of its range of white a light goes in weights (n, 3) that let it go."""
    its = [knob.whites for knob in o.full.knobs if knob.lights == held.lights]
    if held.kind != "colour" or not its or (whites := its[0]) is None:
        return ""
    [green] = whites.greener(freed[list(held.lights)])
    if abs(green) <= SEEN:
        return ""
    return "greener" if green > 0 else "pinker"


def _value(equations: NormalEquations, w: Doubles) -> float:
    """The objective less ‖Ψ‖², without its round-off."""
    quadratic = np.einsum("ic,cij,jc->", w, equations.M, w, optimize=True)
    return float(quadratic - 2 * np.einsum("ci,ic->", equations.b, w))


def _without(o: Answer, held: Held) -> tuple[Reduction, Doubles]:
    """The reduction with that alone let go, and the answer in its unknowns."""
    knobs, x = [*o.reduction.knobs], o.found.x
    if held.kind == "left out":
        knobs[held.knob] = move_to_best_white(o.full.knobs[held.knob], o.gradient)
    elif held.kind == "zero":
        knob, its = knobs[held.knob], o.reduction.places[held.knob]
        below = tuple(
            replace(u, lower=-np.inf, upper=0.0) if x[i] == 0 else u
            for u, i in zip(knob.unknowns, its, strict=True)
        )
        knobs[held.knob] = replace(knob, unknowns=below)
    if held.kind in ("left out", "zero"):
        return replace(o.reduction, knobs=tuple(knobs)), x
    left = [k for k, knob in enumerate(knobs) if not set(knob.lights) & set(held.lights)]
    weights = o.reduction.fixed_weights.copy()
    weights[list(held.lights)] = 0
    freed = [Knob.of_any_colour(k, is_scalar=o.basis.lights[k].is_scalar) for k in held.lights]
    values = [x[list(o.reduction.places[k])] for k in left]
    values += [o.w[k.lights[0], : len(k.unknowns)] for k in freed]
    made = replace(o.reduction, fixed_weights=weights, knobs=(*(knobs[k] for k in left), *freed))
    return made, np.concatenate(values)
