"""The gain of releasing one bound alone, for each bound that holds the lights back.

The gains are exact: each comes from a new solve without that bound. Only bounds with large
estimates are solved for; an estimate is the gain of moving these lights alone, a lower limit.
"""

from dataclasses import replace

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.lighting.analysis.active_bounds import (
    ActiveBound,
    BoundedAnswer,
    find_active_bounds,
)
from lightpaint.lighting.answer.certificate import Bound, Tint
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.unknowns.knobs import Knob
from lightpaint.lighting.unknowns.reduced_problem import solve_reduced
from lightpaint.lighting.unknowns.reduction import Reduction
from lightpaint.lighting.unknowns.white_mixes import move_to_best_white, next_whites

#: Maximum number of bounds to release; for large problems, about MAX_UNKNOWNS unknowns in all; the
#: fewest bounds.
MAX_RELEASED, MAX_UNKNOWNS, MIN_RELEASED = 32, 2048, 4

#: Visible difference of a light from its whites to green or pink, in Duv.
VISIBLE_DUV = 0.003

#: Share of ‖Ψ‖² below which a gain is round-off.
MIN_GAIN = 1e-12


def bounds_of(solution: Solution) -> tuple[tuple[Bound, ...], int]:
    """Return the bounds on the lights of `solution`, the largest gain first, and the number of
    others.

    The others, with smaller estimates, were not released.
    """
    problem = solution.problem
    equations = problem.with_pull(problem.solved)
    answer = _bounded_answer(solution, equations)
    least = MIN_GAIN * float(solution.equations.target_norm2.sum())
    active = [bound for bound in find_active_bounds(answer) if bound.estimate > least]
    active.sort(key=lambda bound: -bound.estimate)
    objective, bounds = _relative_objective(problem.solved, answer.w), []
    size = len(answer.reduction.unknowns) // len(answer.reduction.channel_groups)
    count = min(max(MAX_UNKNOWNS // max(size, 1), MIN_RELEASED), MAX_RELEASED)
    for active_bound in active[:count]:
        freed = _freed_weights(equations, answer, active_bound)
        gain = objective - _relative_objective(problem.solved, freed)
        if problem.pull is None:
            gain = max(gain, 0.0)  # except for round-off
        names = tuple(solution.basis.names[k] for k in active_bound.lights)
        label = answer.full.labels[active_bound.lights[0]]
        held_by = active_bound.kind if active_bound.kind in ("zero", "kept", "left out") else label
        bounds.append(
            Bound(
                names,
                active_bound.kind,
                held_by,
                gain,
                active_bound.multiplier,
                active_bound.per,
                _tint(answer, active_bound, freed),
            )
        )
    return tuple(sorted(bounds, key=lambda bound: -bound.gain)), len(active) - len(bounds)


def _freed_weights(
    equations: NormalEquations, answer: BoundedAnswer, bound: ActiveBound
) -> Doubles:
    """Solve without one bound; return the weights, (n, 3)."""
    reduction, x = _release(answer, bound)
    if bound.kind == "left out" and reduction.knobs[bound.knob].whites is not None:
        return next_whites(equations, reduction, answer.w, only=[bound.knob])[1].weights
    return solve_reduced(equations, reduction, answer.w, x=x).weights


def _bounded_answer(solution: Solution, equations: NormalEquations) -> BoundedAnswer:
    reduction = solution.problem.local_reduction
    optimum = solve_reduced(equations, reduction, solution.weights)
    lit = equations.reached
    return BoundedAnswer(
        solution.basis,
        reduction,
        solution.problem.full,
        optimum,
        np.where(lit, equations.gradient(optimum.weights), 0),
        np.where(lit, np.einsum("cii->ic", equations.M), 0),
        tuple(light.is_active for light in solution.lighting.lights),
    )


def _tint(answer: BoundedAnswer, bound: ActiveBound, freed: Doubles) -> Tint:
    """Return the side of its range of white to which a light goes in weights (n, 3) after
    release.
    """
    white_ranges = [knob.whites for knob in answer.full.knobs if knob.lights == bound.lights]
    if bound.kind != "colour" or not white_ranges or (whites := white_ranges[0]) is None:
        return ""
    [green] = whites.greener(freed[list(bound.lights)])
    if abs(green) <= VISIBLE_DUV:
        return ""
    return "greener" if green > 0 else "pinker"


def _relative_objective(equations: NormalEquations, w: Doubles) -> float:
    """Return the objective less ‖Ψ‖², without its round-off."""
    quadratic = np.einsum("ic,cij,jc->", w, equations.M, w, optimize=True)
    return float(quadratic - 2 * np.einsum("ci,ic->", equations.b, w))


def _release(answer: BoundedAnswer, bound: ActiveBound) -> tuple[Reduction, Doubles]:
    """Return the reduction without one bound, and the answer in its unknowns."""
    knobs, x = [*answer.reduction.knobs], answer.optimum.x
    if bound.kind == "left out":
        knobs[bound.knob] = move_to_best_white(answer.full.knobs[bound.knob], answer.gradient)
    elif bound.kind == "zero":
        knob, places = knobs[bound.knob], answer.reduction.places[bound.knob]
        below = tuple(
            replace(u, lower=-np.inf, upper=0.0) if x[i] == 0 else u
            for u, i in zip(knob.unknowns, places, strict=True)
        )
        knobs[bound.knob] = replace(knob, unknowns=below)
    if bound.kind in ("left out", "zero"):
        return replace(answer.reduction, knobs=tuple(knobs)), x
    remaining = [k for k, knob in enumerate(knobs) if not set(knob.lights) & set(bound.lights)]
    weights = answer.reduction.fixed_weights.copy()
    weights[list(bound.lights)] = 0
    freed = [
        Knob.of_any_colour(k, is_scalar=answer.basis.lights[k].is_scalar) for k in bound.lights
    ]
    values = [x[list(answer.reduction.places[k])] for k in remaining]
    values += [answer.w[k.lights[0], : len(k.unknowns)] for k in freed]
    released = replace(
        answer.reduction, fixed_weights=weights, knobs=(*(knobs[k] for k in remaining), *freed)
    )
    return released, np.concatenate(values)
