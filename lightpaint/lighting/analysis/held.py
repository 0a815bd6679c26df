"""What holds the lights of an answer: zero, being kept, and what was asked of them.

The multipliers are those of the solver's own certificate, by which it knows that it is done.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.basis.basis import Basis
from lightpaint.colour.color import LUMINANCE
from lightpaint.lighting.bound import Kind, Per
from lightpaint.lighting.constraints.constrained import ConstrainedOptimum
from lightpaint.lighting.constraints.reduction import Reduction, Unknown


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
    found: ConstrainedOptimum
    gradient: Doubles
    power: Doubles
    is_active: tuple[bool, ...]

    @property
    def w(self) -> Doubles:
        return self.found.result.weights


def all_held(o: Answer) -> Iterator[Held]:
    """Everything that holds a light, by zero or by what is asked."""
    with_knob = {k for lights, _ in o.reduction.knobs for k in lights}
    for k, light in enumerate(o.basis.lights):
        if light.is_fixed:
            yield Held((k,), "kept", _freed(o, (k,)), *_by_channel(o, k, 2 * o.gradient[k]))
        elif k not in with_knob and o.is_active[k]:
            kind: Kind = "lock" if o.w[k].any() else "off"
            force = 2 * o.gradient[k]
            if kind == "off":  # which holds it from above only
                force = np.minimum(force.sum() / 3 if light.is_scalar else force, 0) * np.ones(3)
            yield Held((k,), kind, _freed(o, (k,)), *_by_channel(o, k, force))
    for knob, (lights, its) in enumerate(o.reduction.knobs):
        if all(o.reduction.unknowns[i].upper == 0 for i in its) and _is_left_out(o, knob):
            if any(o.is_active[k] for k in lights):
                yield _left_out(o, knob)
            continue
        yield from _at_zero(o, knob)
        if any(o.is_active[k] for k in lights):
            yield _asked(o, knob)


def _is_left_out(o: Answer, knob: int) -> bool:
    return any(o.full.unknowns[i].upper > 0 for i in o.full.knobs[knob][1])


def _left_out(o: Answer, knob: int) -> Held:
    lights, its = o.full.knobs[knob]
    forces = np.minimum([_force(o, o.full.unknowns[i]) for i in its], 0)
    powers = np.array([_power(o, o.full.unknowns[i]) for i in its])
    estimates = np.square(forces / 2) / np.where(powers > 0, powers, 1)
    multiplier, per = _of_unknowns(o.full, knob, forces)
    # Three channels move by themselves, several primaries get into each other's way.
    estimate = estimates.sum() if per == "emission" else estimates.max(initial=0)
    return Held(lights, "left out", float(estimate), multiplier, per, knob)


def _at_zero(o: Answer, knob: int) -> Iterator[Held]:
    """What of a light is off, and would be less than that."""
    lights, its = o.reduction.knobs[knob]
    unknowns = [o.reduction.unknowns[i] for i in its]
    off = np.array([u.lower == 0 and o.found.x[i] == 0 for u, i in zip(unknowns, its, strict=True)])
    if not off.any() or (not off.all() and not _is_free(unknowns)):
        return  # a light that mixes primaries is on if one of them is
    forces = np.where(off, 2 * np.maximum(o.found.multipliers[list(its)], 0), 0)
    powers = np.array([_power(o, u) for u in unknowns])
    forces = np.where(powers > 0, forces, 0)
    if not forces.any():
        return
    estimates = np.square(forces / 2) / np.where(powers > 0, powers, 1)
    multiplier, per = _of_unknowns(o.reduction, knob, forces)
    estimate = estimates.sum() if per == "emission" else estimates.max()
    yield Held(lights, "zero", float(estimate), multiplier, per, knob)


def _asked(o: Answer, knob: int) -> Held:
    """What is asked of a light that has a knob, or of the lights on one dimmer."""
    lights, its = o.reduction.knobs[knob]
    estimate = _freed(o, lights)
    if len(lights) > 1:
        [unknown] = (o.reduction.unknowns[i] for i in its)
        each = tuple(2 * float(rgb @ o.gradient[k]) for k, rgb in unknown.columns)
        return Held(lights, "tie", estimate, each, "dimmer", knob)
    [k] = lights
    unknowns = [o.reduction.unknowns[i] for i in its]
    at_limit = np.array([_is_at_limit(o, i) for i in its])
    forces = np.where(at_limit, 2 * o.found.multipliers[list(its)], 0)
    cap = sum(
        2 * float(o.found.cap_multipliers[j])
        for j, cap in enumerate(o.reduction.caps)
        if cap.unknowns[0] == its[0]
    )
    if forces.any() and _is_free(unknowns):
        # With a limit of luminance besides, a channel feels both.
        return Held(lights, "limits", estimate, _numbers(forces + cap * LUMINANCE), "emission")
    if forces.any():
        multiplier, per = _of_unknowns(o.reduction, knob, forces)
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


def _of_unknowns(reduction: Reduction, knob: int, forces: Doubles) -> tuple[tuple[float, ...], Per]:
    """A multiplier per unit of each unknown, (k,), in the terms of the light."""
    lights, its = reduction.knobs[knob]
    unknowns = [reduction.unknowns[i] for i in its]
    if len(lights) > 1:
        return _numbers(forces), "dimmer"
    if _is_free(unknowns):
        return _numbers(forces), "emission"
    sizes = np.array([float(u.columns[0][1] @ LUMINANCE) for u in unknowns])
    # Of several primaries, the one that brings most.
    rates = forces / sizes
    return (float(rates[np.argmax(np.abs(rates))]),), "luminance"


def _is_free(unknowns: list[Unknown]) -> bool:
    """Whether a light has three channels, each by itself."""
    return len(unknowns) == 3 and all(
        len(u.columns) == 1 and (u.columns[0][1] == axis).all()
        for u, axis in zip(unknowns, np.eye(3), strict=True)
    )


def _force(o: Answer, unknown: Unknown) -> float:
    return 2 * sum(float(rgb @ o.gradient[k]) for k, rgb in unknown.columns)


def _power(o: Answer, unknown: Unknown) -> float:
    return sum(float(np.square(rgb) @ o.power[k]) for k, rgb in unknown.columns)


def _numbers(values: Doubles) -> tuple[float, ...]:
    return tuple(float(v) for v in values)
