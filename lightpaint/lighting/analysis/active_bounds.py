"""The bounds that hold the lights of an answer: zero, being fixed, and constraints.

The multipliers are those of the solver's own certificate.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.basis.basis import Basis
from lightpaint.colour.color import LUMINANCE
from lightpaint.lighting.answer.certificate import Kind, Per
from lightpaint.lighting.unknowns.knobs import Knob, Unknown
from lightpaint.lighting.unknowns.reduced_problem import ReducedOptimum
from lightpaint.lighting.unknowns.reduction import Reduction


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
    with_knob = {k for knob in o.reduction.knobs for k in knob.lights}
    for k, light in enumerate(o.basis.lights):
        if light.is_fixed:
            yield ActiveBound(
                (k,), "kept", _release_estimate(o, (k,)), *_by_channel(o, k, 2 * o.gradient[k])
            )
        elif k not in with_knob and o.is_active[k]:
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
