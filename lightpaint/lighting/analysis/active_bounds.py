"""What holds the lights of an answer: zero, being kept, and what was asked of them.

The multipliers are those of the solver's own certificate, by which it knows that it is done.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.basis.basis import Basis
from lightpaint.colour.color import LUMINANCE
from lightpaint.lighting.answer.active_bound import Kind, Per
from lightpaint.lighting.constraints.knobs import Knob, Unknown
from lightpaint.lighting.constraints.reduced_problem import ReducedOptimum
from lightpaint.lighting.constraints.reduction import Reduction


@dataclass(frozen=True)
class Held:
    """What may be let go, before it is known what that brings.

    estimate: of the objective, by moving its lights alone. knob: its place among those of the
    reduction, if it has one there.
    """

    lights: tuple[int, ...]
    kind: Kind
    estimate: float
    multiplier: tuple[float, ...]
    per: Per
    knob: int = -1


@dataclass(frozen=True)
class Answer:
    """The answer, as `reduction` has it, and the gradient M w − b there, of what is minimised.

    w, gradient, power (M_ii): (n, 3). Where a light does not reach, gradient and power are 0.
    """

    basis: Basis
    reduction: Reduction
    full: Reduction
    found: ReducedOptimum
    gradient: Doubles
    power: Doubles
    is_active: tuple[bool, ...]

    @property
    def w(self) -> Doubles:
        return self.found.weights


def all_held(o: Answer) -> Iterator[Held]:
    """Everything that holds a light, by zero or by what is asked."""
    with_knob = {k for knob in o.reduction.knobs for k in knob.lights}
    for k, light in enumerate(o.basis.lights):
        if light.is_fixed:
            yield Held((k,), "kept", _freed(o, (k,)), *_by_channel(o, k, 2 * o.gradient[k]))
        elif k not in with_knob and o.is_active[k]:
            kind: Kind = "lock" if o.w[k].any() else "off"
            force = 2 * o.gradient[k]
            if kind == "off":  # which holds it from above only
                force = np.minimum(force.sum() / 3 if light.is_scalar else force, 0) * np.ones(3)
            yield Held((k,), kind, _freed(o, (k,)), *_by_channel(o, k, force))
    for place, (knob, full) in enumerate(zip(o.reduction.knobs, o.full.knobs, strict=True)):
        is_active = any(o.is_active[k] for k in knob.lights)
        left_out = all(x.upper == 0 for x in knob.unknowns)
        if left_out and any(x.upper > 0 for x in full.unknowns):
            if is_active:
                yield _left_out(o, place)
            continue
        yield from _at_zero(o, place)
        if is_active:
            yield _asked(o, place)


def _left_out(o: Answer, place: int) -> Held:
    knob = o.full.knobs[place]
    forces = np.minimum([_force(o, x) for x in knob.unknowns], 0)
    powers = np.array([_power(o, x) for x in knob.unknowns])
    estimates = np.square(forces / 2) / np.where(powers > 0, powers, 1)
    multiplier, per = _of_unknowns(knob, forces)
    # Three channels move by themselves, several primaries get into each other's way.
    estimate = estimates.sum() if per == "emission" else estimates.max(initial=0)
    return Held(knob.lights, "left out", float(estimate), multiplier, per, place)


def _at_zero(o: Answer, place: int) -> Iterator[Held]:
    """What of a light is off, and would be less than that."""
    knob, its = o.reduction.knobs[place], list(o.reduction.places[place])
    off = (o.reduction.lower[its] == 0) & (o.found.x[its] == 0)
    if not off.any() or (not off.all() and not knob.is_free):
        return  # a light that mixes primaries is on if one of them is
    forces = np.where(off, 2 * np.maximum(o.found.multipliers[its], 0), 0)
    powers = np.array([_power(o, x) for x in knob.unknowns])
    forces = np.where(powers > 0, forces, 0)
    if not forces.any():
        return
    estimates = np.square(forces / 2) / np.where(powers > 0, powers, 1)
    multiplier, per = _of_unknowns(knob, forces)
    estimate = estimates.sum() if per == "emission" else estimates.max()
    yield Held(knob.lights, "zero", float(estimate), multiplier, per, place)


def _asked(o: Answer, place: int) -> Held:
    """What is asked of a light that has a knob, or of the lights on one dimmer."""
    knob, its = o.reduction.knobs[place], list(o.reduction.places[place])
    lights, estimate = knob.lights, _freed(o, knob.lights)
    if len(lights) > 1:
        [unknown] = knob.unknowns
        each = tuple(2 * float(rgb @ o.gradient[k]) for k, rgb in unknown.columns)
        return Held(lights, "tie", estimate, each, "dimmer", place)
    [k] = lights
    at_limit = np.array([_is_at_limit(o, i) for i in its])
    forces = np.where(at_limit, 2 * o.found.multipliers[its], 0)
    cap = sum(
        2 * float(o.found.cap_multipliers[j])
        for j, cap in enumerate(o.reduction.caps)
        if cap.unknowns[0] == its[0]
    )
    if forces.any() and knob.is_free:
        # With a limit of luminance besides, a channel feels both.
        return Held(lights, "limits", estimate, _numbers(forces + cap * LUMINANCE), "emission")
    if forces.any():
        multiplier, per = _of_unknowns(knob, forces)
        return Held(lights, "limits", estimate, multiplier, per)
    if cap:
        return Held(lights, "limits", estimate, (cap,), "luminance")
    return Held(lights, "colour", estimate, *_by_channel(o, k, 2 * o.gradient[k]))


def _is_at_limit(o: Answer, i: int) -> bool:
    """Whether an unknown is at a limit that was asked for."""
    unknown, x = o.reduction.unknowns[i], o.found.x[i]
    return bool(x >= unknown.upper or x <= unknown.lower != 0)


def _freed(o: Answer, lights: tuple[int, ...]) -> float:
    """What the objective falls by if these may have any emission, and no two of them meet."""
    total = 0.0
    for k in lights:
        g, p, w = o.gradient[k], o.power[k], o.w[k]
        if o.basis.lights[k].is_scalar:
            g, p, w = g.sum(keepdims=True), p.sum(keepdims=True), w[:1]
        # To zero at most, where the objective still falls.
        down = np.minimum(np.where(p > 0, g / np.where(p > 0, p, 1), 0), w)
        total += float((2 * g * down - p * np.square(down)).sum())
    return total


def _by_channel(o: Answer, k: int, force: Doubles) -> tuple[tuple[float, ...], Per]:
    if o.basis.lights[k].is_scalar:
        return (float(np.sum(force)),), "luminance"
    return _numbers(force), "emission"


def _of_unknowns(knob: Knob, forces: Doubles) -> tuple[tuple[float, ...], Per]:
    """A multiplier per unit of each unknown, (k,), in the terms of the light."""
    if len(knob.lights) > 1:
        return _numbers(forces), "dimmer"
    if knob.is_free:
        return _numbers(forces), "emission"
    sizes = np.array([float(x.columns[0][1] @ LUMINANCE) for x in knob.unknowns])
    # Of several primaries, the one that brings most.
    rates = forces / sizes
    return (float(rates[np.argmax(np.abs(rates))]),), "luminance"


def _force(o: Answer, unknown: Unknown) -> float:
    return 2 * sum(float(rgb @ o.gradient[k]) for k, rgb in unknown.columns)


def _power(o: Answer, unknown: Unknown) -> float:
    return sum(float(np.square(rgb) @ o.power[k]) for k, rgb in unknown.columns)


def _numbers(values: Doubles) -> tuple[float, ...]:
    return tuple(float(v) for v in values)
