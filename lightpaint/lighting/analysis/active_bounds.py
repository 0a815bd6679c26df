"""The bounds that hold the lights of an answer, and the gain of releasing each of them alone.

The gains are exact: each comes from a new solve without that bound. Only bounds with large
estimates are solved for; an estimate is the gain of moving these lights alone, a lower limit.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.basis import Basis
from lightpaint.colour import LUMINANCE
from lightpaint.lighting.answer.certificate import Bound, Kind, Per, Tint
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.unknowns.knobs import Knob, Unknown
from lightpaint.lighting.unknowns.reduced_problem import ReducedOptimum, solve_reduced
from lightpaint.lighting.unknowns.reduction import Reduction
from lightpaint.lighting.unknowns.white_mixes import move_to_best_white, next_whites

#: Maximum number of bounds to release; for large problems, about MAX_UNKNOWNS unknowns in all; the
#: fewest bounds.
MAX_RELEASED, MAX_UNKNOWNS, MIN_RELEASED = 32, 2048, 4

#: Visible difference of a light from its whites to green or pink, in Duv.
VISIBLE_DUV = 0.003

#: Share of ‖Ψ‖² below which a gain is round-off.
MIN_GAIN = 1e-12


@dataclass(frozen=True)
class ActiveBound:
    """A bound that may be released, before its gain is computed.

    estimate: of the gain, by moving its lights alone. knob: its place among the knobs of the
    reduction, if it has one.
    """

    lights: tuple[int, ...]
    kind: Kind
    estimate: float
    multiplier: tuple[float, ...]
    per: Per
    knob: int = -1


@dataclass(frozen=True)
class BoundedAnswer:
    """An answer under `reduction`, with the gradient M w − b of the minimised objective.

    w, gradient, power (M_ii): (n, 3). Where a light does not reach, gradient and power are 0.
    """

    basis: Basis
    reduction: Reduction
    full: Reduction
    optimum: ReducedOptimum
    gradient: Doubles
    power: Doubles
    is_active: tuple[bool, ...]

    @property
    def w(self) -> Doubles:
        """The weights, (n, 3)."""
        return self.optimum.weights


def find_active_bounds(o: BoundedAnswer) -> Iterator[ActiveBound]:
    """Yield every bound that holds a light: zero, or a constraint."""
    for k, light in enumerate(o.basis.lights):
        if light.is_fixed:
            yield ActiveBound(
                (k,), "kept", _release_estimate(o, (k,)), *_by_channel(o, k, 2 * o.gradient[k])
            )
        elif k not in o.reduction.movable and o.is_active[k]:
            kind: Kind = "lock" if o.w[k].any() else "off"
            force = 2 * o.gradient[k]
            if kind == "off":  # which bounds it from above only
                force = np.minimum(force.sum() / 3 if light.is_scalar else force, 0) * np.ones(3)
            yield ActiveBound((k,), kind, _release_estimate(o, (k,)), *_by_channel(o, k, force))
    for place, (knob, full) in enumerate(zip(o.reduction.knobs, o.full.knobs, strict=True)):
        is_active = any(o.is_active[k] for k in knob.lights)
        left_out = all(x.upper == 0 for x in knob.unknowns)
        if left_out and any(x.upper > 0 for x in full.unknowns):
            if is_active:
                yield _unchosen_bound(o, place)
            continue
        yield from _zero_bounds(o, place)
        if is_active:
            yield _constraint_bound(o, place)


def _unchosen_bound(o: BoundedAnswer, place: int) -> ActiveBound:
    knob = o.full.knobs[place]
    forces = np.minimum([_force(o, x) for x in knob.unknowns], 0)
    powers = np.array([_power(o, x) for x in knob.unknowns])
    estimates = np.square(forces / 2) / np.where(powers > 0, powers, 1)
    multiplier, per = _light_multiplier(knob, forces)
    # Three channels move independently, several primaries interact.
    estimate = estimates.sum() if per == "emission" else estimates.max(initial=0)
    return ActiveBound(knob.lights, "left out", float(estimate), multiplier, per, place)


def _zero_bounds(o: BoundedAnswer, place: int) -> Iterator[ActiveBound]:
    """Yield the bound at zero of a light that would rather be negative."""
    knob, unknowns = o.reduction.knobs[place], list(o.reduction.places[place])
    is_off = (o.reduction.lower[unknowns] == 0) & (o.optimum.x[unknowns] == 0)
    if not is_off.any() or (not is_off.all() and not knob.is_free):
        return  # a light that mixes primaries is on if one of them is
    forces = np.where(is_off, 2 * np.maximum(o.optimum.multipliers[unknowns], 0), 0)
    powers = np.array([_power(o, x) for x in knob.unknowns])
    forces = np.where(powers > 0, forces, 0)
    if not forces.any():
        return
    estimates = np.square(forces / 2) / np.where(powers > 0, powers, 1)
    multiplier, per = _light_multiplier(knob, forces)
    estimate = estimates.sum() if per == "emission" else estimates.max()
    yield ActiveBound(knob.lights, "zero", float(estimate), multiplier, per, place)


def _constraint_bound(o: BoundedAnswer, place: int) -> ActiveBound:
    """Return the constraint on a light that has a knob, or on the lights of one dimmer."""
    knob, unknowns = o.reduction.knobs[place], list(o.reduction.places[place])
    lights, estimate = knob.lights, _release_estimate(o, knob.lights)
    if len(lights) > 1 and len(unknowns) > 1:  # emitters of a lamp with a limit of all together
        caps = zip(o.reduction.caps, o.optimum.cap_multipliers, strict=True)
        force = sum(2 * float(x) for cap, x in caps if cap.unknowns[0] == unknowns[0])
        return ActiveBound(lights, "limits", estimate, (force,), "luminance")
    if len(lights) > 1:
        [unknown] = knob.unknowns
        multipliers = tuple(2 * float(rgb @ o.gradient[k]) for k, rgb in unknown.columns)
        return ActiveBound(lights, "tie", estimate, multipliers, "dimmer", place)
    [k] = lights
    at_limit = np.array([_is_at_limit(o, i) for i in unknowns])
    forces = np.where(at_limit, 2 * o.optimum.multipliers[unknowns], 0)
    cap = sum(
        2 * float(o.optimum.cap_multipliers[j])
        for j, cap in enumerate(o.reduction.caps)
        if cap.unknowns[0] == unknowns[0]
    )
    if forces.any() and knob.is_free:
        # With a limit of luminance, too, both affect the channel.
        return ActiveBound(
            lights, "limits", estimate, _numbers(forces + cap * LUMINANCE), "emission"
        )
    if forces.any():
        multiplier, per = _light_multiplier(knob, forces)
        return ActiveBound(lights, "limits", estimate, multiplier, per)
    if cap:
        return ActiveBound(lights, "limits", estimate, (cap,), "luminance")
    return ActiveBound(lights, "colour", estimate, *_by_channel(o, k, 2 * o.gradient[k]))


def _is_at_limit(o: BoundedAnswer, i: int) -> bool:
    """Return whether an unknown is at a limit of a constraint."""
    unknown, x = o.reduction.unknowns[i], o.optimum.x[i]
    return bool(x >= unknown.upper or x <= unknown.lower != 0)


def _release_estimate(o: BoundedAnswer, lights: tuple[int, ...]) -> float:
    """Estimate the fall of the objective if these lights may have any emission, without
    interaction.
    """
    total = 0.0
    for k in lights:
        g, p, w = o.gradient[k], o.power[k], o.w[k]
        if o.basis.lights[k].is_scalar:
            g, p, w = g.sum(keepdims=True), p.sum(keepdims=True), w[:1]
        # To zero at most, where the objective still falls.
        down = np.minimum(np.where(p > 0, g / np.where(p > 0, p, 1), 0), w)
        total += float((2 * g * down - p * np.square(down)).sum())
    return total


def _by_channel(o: BoundedAnswer, k: int, force: Doubles) -> tuple[tuple[float, ...], Per]:
    if o.basis.lights[k].is_scalar:
        return (float(np.sum(force)),), "luminance"
    return _numbers(force), "emission"


def _light_multiplier(knob: Knob, forces: Doubles) -> tuple[tuple[float, ...], Per]:
    """Convert a multiplier per unit of each unknown, (k,), into the terms of the light."""
    if len(knob.lights) > 1:
        return _numbers(forces), "dimmer"
    if knob.is_free:
        return _numbers(forces), "emission"
    sizes = np.array([float(x.columns[0][1] @ LUMINANCE) for x in knob.unknowns])
    # Of several primaries, the one with the largest gain.
    rates = forces / sizes
    return (float(rates[np.argmax(np.abs(rates))]),), "luminance"


def _force(o: BoundedAnswer, unknown: Unknown) -> float:
    return 2 * sum(float(rgb @ o.gradient[k]) for k, rgb in unknown.columns)


def _power(o: BoundedAnswer, unknown: Unknown) -> float:
    return sum(float(np.square(rgb) @ o.power[k]) for k, rgb in unknown.columns)


def _numbers(values: Doubles) -> tuple[float, ...]:
    return tuple(float(v) for v in values)


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
        np.where(lit, optimum.gradient(equations), 0),
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
