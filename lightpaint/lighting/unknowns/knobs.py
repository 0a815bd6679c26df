"""Knobs, the lights and dimmers that turn by themselves, with the unknowns of each."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.basis import BasisLight
from lightpaint.colour import ColorHull, Lamp, Preference, WhiteRange, luminance
from lightpaint.display_text import some_names
from lightpaint.errors import ConstraintError
from lightpaint.lighting.constraints.constraint_table import LightConstraint, Tie
from lightpaint.lighting.constraints.values import Level, Lock
from lightpaint.sentences import SourceKey

#: Share by which a lower limit may exceed an upper one before they contradict: round-off.
ROUND_OFF = 1e-12

#: Luminance of a mix of slots, relative to the brightest one, that is round-off of a lamp that is
#: off.
DARK = 1e-6


def _dimmer_limits(
    constraint: LightConstraint, direction: Doubles, light: BasisLight
) -> tuple[float, float]:
    """Return bounds on x for an emission of x times `direction`."""
    lower, upper = 0.0, np.inf
    for level, is_least in ((constraint.least, True), (constraint.most, False)):
        if level is None:
            continue
        if isinstance(level.amount, tuple):
            with np.errstate(divide="ignore", invalid="ignore"):
                bounds = np.array(level.amount) / direction
            # A light without a channel satisfies any upper limit there, and no lower one.
            bounds = np.where(direction > 0, bounds, np.inf)
            if is_least:
                bounds = np.where((direction == 0) & (np.array(level.amount) == 0), 0, bounds)
            bound = float(bounds.max() if is_least else bounds.min())
        else:
            bound = _luminance(level, light, constraint) / float(luminance(direction))
        lower, upper = (max(lower, bound), upper) if is_least else (lower, min(upper, bound))
    return lower, upper


def _mix_limits(
    constraint: LightConstraint, light: BasisLight, count: int
) -> tuple[Doubles, Doubles, float, float]:
    """Return bounds on the unknowns, and on the luminance of their sum."""
    lower, upper = np.zeros(count), np.full(count, np.inf)
    levels = constraint.least, constraint.most
    if constraint.primaries is not None:
        return lower, upper, *_luminance_limits(constraint, light, "mixes primaries")
    for level, is_least in zip(levels, (True, False), strict=True):
        if level is not None and isinstance(level.amount, tuple):
            lower, upper = (
                (np.array(level.amount), upper) if is_least else (lower, np.array(level.amount))
            )
    _check_room(constraint, light, lower, upper)
    least, most = _luminance_limits(constraint, light)
    return lower, upper, least, most


def _luminance_limits(
    constraint: LightConstraint, light: BasisLight, mixes: str = ""
) -> tuple[float, float]:
    """Return bounds on the luminance of a light. mixes: what it does, if it cannot have bounds of
    its channels.
    """
    least, most = 0.0, np.inf
    for level, is_least in ((constraint.least, True), (constraint.most, False)):
        if level is None:
            continue
        if isinstance(level.amount, tuple):
            if mixes:
                raise ConstraintError(
                    constraint.where / "limits",
                    f" has {level} for a light that {mixes}: give a "
                    "luminance like 2.5 or a share like 40%",
                )
            continue
        value = _luminance(level, light, constraint)
        least, most = (value, most) if is_least else (least, value)
    return least, most


def _luminance(level: Level, light: BasisLight, constraint: LightConstraint) -> float:
    assert not isinstance(level.amount, tuple)
    if not level.is_share:
        return level.amount
    now = float(luminance(np.array(light.emission)))
    if now == 0:
        raise ConstraintError(
            constraint.where / "limits",
            f" has {level} of the current luminance, but "
            f"{light.name!r} is currently off: give a number",
        )
    return level.amount * now


def _check_grey(constraint: LightConstraint, light: BasisLight) -> None:
    """Refuse limits per channel for a light that has one weight for all of them."""
    for level in (constraint.least, constraint.most):
        if light.is_scalar and level is not None and isinstance(level.amount, tuple):
            raise ConstraintError(
                constraint.where / "limits",
                f" has {level}, and {light.name!r} can only be dimmed as a whole: give one number",
            )


def _check_room(constraint: LightConstraint, light: BasisLight, lower: Any, upper: Any) -> None:
    """Refuse limits that leave nothing between them."""
    if (np.asarray(lower) > np.asarray(upper) * (1 + ROUND_OFF)).any() or np.isinf(lower).any():
        raise ConstraintError(
            constraint.where,
            f" asks {light.name!r} for {constraint.label}, which leaves it no "
            f"emission "
            "at all: widen the limits",
        )


@dataclass(frozen=True)
class Unknown:
    """An unknown x of the solve. columns: (light, its (3,) emission at x = 1) for each light that
    it moves.
    """

    columns: tuple[tuple[int, Doubles], ...]
    lower: float = 0.0
    upper: float = np.inf


@dataclass(frozen=True)
class ColorWheel:
    """A colour wheel, whose slots are the unknowns of a knob.

    lamp: of which they are the emitters. lower, upper: (e,), bounds of each while it shines; the
    first is above the second for a slot that limits exclude.
    """

    lamp: Lamp
    lower: Doubles
    upper: Doubles

    def has_color(self, emission: Doubles) -> bool:
        """Return whether an emission (3,) is more than round-off."""
        return float(luminance(emission)) > DARK * float(self.lamp.levels.max())

    def slot_for(self, color: Doubles) -> int:
        """Return the place of the allowed slot closest to a colour (3,)."""
        return self.lamp.slot_for(color, self.lower <= self.upper)


@dataclass(frozen=True)
class Knob:
    """An independent control of the lighting: a light, or several on one dimmer.

    limit: coefficients, minimum and maximum of a limited sum over its unknowns.
    whites: the range of white of a light that keeps to one. window: the two of these
    that its two unknowns currently mix (white_mixes.py). lamp: what mixes these whites from
    emitters, if it does; an unknown of 1 is then as bright as the lamp can be in that white.
    gamut: the gamut that confines the light, if it would leave it otherwise: all of it, or the part
    towards one `side` (white_mixes.py).
    wheel: a colour wheel that has still to come to one of its slots, of which the unknowns are a
    mix until then.
    """

    lights: tuple[int, ...]
    unknowns: tuple[Unknown, ...]
    limit: tuple[tuple[float, ...], float, float] | None = None
    whites: WhiteRange | None = None
    window: tuple[int, int] = (0, 0)
    gamut: ColorHull | None = None
    side: int | None = None
    lamp: Lamp | None = None
    wheel: ColorWheel | None = None

    @cached_property
    def has_any_colour(self) -> bool:
        """True if the channels of a light have no constraint."""
        return self.is_free and all(x.lower == 0 and np.isinf(x.upper) for x in self.unknowns)

    @cached_property
    def is_free(self) -> bool:
        """True for a light whose three channels turn independently."""
        return len(self.unknowns) == 3 and all(
            len(u.columns) == 1 and (u.columns[0][1] == axis).all()
            for u, axis in zip(self.unknowns, np.eye(3), strict=True)
        )

    def has_drives_of(self, lamp: Lamp) -> bool:
        """Return whether its unknowns are the drives of a lamp's emitters."""
        colors = [x.columns[0][1] for x in self.unknowns]
        return len(self.lights) == 1 and np.array_equal(colors, lamp.columns)

    def switched_off(self) -> "Knob":
        """Return the knob fixed at 0."""
        return replace(
            self, unknowns=tuple(replace(u, lower=0.0, upper=0.0) for u in self.unknowns)
        )

    @property
    def has_open_wheel(self) -> bool:
        """True if a wheel has still to come to a slot, and the light may be on."""
        return self.wheel is not None and any(x.upper > 0 for x in self.unknowns)

    def solved_color(self, weights: Doubles) -> Doubles:
        """Return the emission (3,) that the mix of slots has in weights (n, 3) of lights, or of
        emitters that are lights.
        """
        assert self.wheel is not None
        if len(self.lights) == 1:
            return np.asarray(weights[self.lights[0]])
        lamp = self.wheel.lamp
        return lamp.mix(weights[list(self.lights), 0] / lamp.levels)

    def at_slot(self, slot: int) -> "Knob":
        """Return the knob of a wheel that stays at a slot, by its place."""
        assert self.wheel is not None
        bounds = [(0.0, 0.0)] * len(self.unknowns)
        bounds[slot] = float(self.wheel.lower[slot]), float(self.wheel.upper[slot])
        unknowns = tuple(
            replace(x, lower=low, upper=high)
            for x, (low, high) in zip(self.unknowns, bounds, strict=True)
        )
        return replace(self, unknowns=unknowns, limit=None, wheel=None)

    def with_window(self, window: tuple[int, int]) -> "Knob":
        """Return the knob as a mix of two other whites of its range."""
        assert self.whites is not None
        colors = self.whites.colors[list(window)]
        if self.lamp is not None:
            colors = colors * brightest_whites(self.lamp, self.whites)[list(window), None]
        return self._mixing(colors, window)

    def along_tangent(self, reach: float) -> "Knob":
        """Return the knob on the straight line of its window, drawn out by `reach` mireds."""
        assert self.whites is not None
        colors = self.whites.tangent(self.window, reach)
        if self.lamp is not None:
            # Beside the locus a lamp may mix nothing: there the window's own brightness serves.
            own = brightest_whites(self.lamp, self.whites)[list(self.window)]
            found = np.array([self.lamp.brightest(color) for color in colors])
            colors = colors * np.where(found > 0, found, own)[:, None]
        return self._mixing(colors, self.window)

    def confined(self, gamut: ColorHull, side: int | None = None) -> "Knob":
        """Return the knob as a mix of the primaries of a gamut. side: of the part towards it."""
        [light] = self.lights
        primaries = gamut.primaries if side is None else gamut.fan(side)
        limit = self.limit
        if limit is not None:
            limit = ((1.0,) * len(primaries), *limit[1:])
        unknowns = tuple(Unknown(((light, rgb),)) for rgb in primaries)
        return replace(self, unknowns=unknowns, limit=limit, gamut=gamut, side=side)

    def dimming(self, color: Doubles) -> "Knob":
        """Return the knob as a dimmer of one colour, (3,), linear with luminance 1."""
        [light] = self.lights
        least, most = (0.0, np.inf) if self.limit is None else self.limit[1:]
        return replace(self, unknowns=(Unknown(((light, color),), least, most),), limit=None)

    def _mixing(self, colors: Doubles, window: tuple[int, int]) -> "Knob":
        [light] = self.lights
        unknowns = tuple(
            replace(u, columns=((light, rgb),))
            for u, rgb in zip(self.unknowns, colors, strict=True)
        )
        return replace(self, unknowns=unknowns, window=window)

    @classmethod
    def of_any_colour(cls, light: int, *, is_scalar: bool = False) -> "Knob":
        """Make the knob of a light without constraints."""
        colours = np.ones((1, 3)) if is_scalar else np.eye(3)
        return cls((light,), tuple(Unknown(((light, rgb),)) for rgb in colours))


@dataclass(frozen=True)
class SlotChoice:
    """A slot of a colour wheel: the knob of a light, and its lamp if the slot changes that."""

    knob: Knob
    lamp: Lamp | None = None


@dataclass(frozen=True)
class SlotChoices:
    """The slots that a colour wheel can have. at: the place of the one that it has.

    is_filter: whether they are in front of emitters that mix; the first one then is open.
    """

    options: tuple[SlotChoice, ...]
    at: int = 0
    is_filter: bool = False

    @classmethod
    def of_wheel(cls, knob: Knob, slot: int) -> "SlotChoices":
        """Make the choices of a wheel whose slots are emitters. slot: that it has."""
        wheel = knob.wheel
        assert wheel is not None
        places = np.flatnonzero(wheel.lower <= wheel.upper).tolist()
        options = tuple(SlotChoice(knob.at_slot(place)) for place in places)
        return cls(options, places.index(slot))


@lru_cache(64)
def brightest_whites(lamp: Lamp, whites: WhiteRange) -> Doubles:
    """Return the luminance, (m,), with which a lamp mixes each white of a range at most."""
    found = np.array([lamp.brightest(color) for color in whites.colors])
    found.setflags(write=False)
    return found


def white_lamp_knob(k: int, light: BasisLight, constraint: LightConstraint, lamp: Lamp) -> Knob:
    """Make the knob of a lamp of emitters that keeps to a range of white.

    What a lamp can mix is convex: between two whites it is at least as bright as the line between
    the luminances of its brightest mixes.
    """
    whites = constraint.whites
    assert whites is not None
    brightest = brightest_whites(lamp, whites)
    if not brightest.all():
        kelvin = 1e6 / float(whites.mireds[np.argmin(brightest)])
        raise ConstraintError(
            constraint.where / "kelvin",
            f" goes from {whites.low:g} to {whites.high:g} K, and the emitters of {light.name!r}, "
            f"{', '.join(lamp.names)}, cannot mix {kelvin:.0f} K: narrow the range",
        )
    unknowns = tuple(Unknown(((k, color),)) for color in whites.colors[[0, -1]])
    window = (0, whites.last)
    return Knob((k,), unknowns, ((1.0, 1.0), 0.0, 1.0), whites, lamp=lamp).with_window(window)


def mixing_knob(k: int, light: BasisLight, constraint: LightConstraint) -> Knob:
    """Make the knob of a light of several primaries with independent dimmers."""
    colours = np.eye(3) if constraint.primaries is None else np.array(constraint.primaries)
    lower, upper, least, most = _mix_limits(constraint, light, len(colours))
    unknowns = [
        Unknown(((k, rgb),), float(low), float(high))
        for rgb, low, high in zip(colours, lower, upper, strict=True)
    ]
    coefficients = np.asarray(luminance(colours), np.float64)
    darkest, brightest = float(coefficients @ lower), float(coefficients @ upper)
    _check_room(constraint, light, max(least, darkest), most)
    _check_room(constraint, light, least, min(most, brightest))
    window = (0, constraint.whites.last) if constraint.whites is not None else (0, 0)
    if least == 0 and np.isinf(most):
        return Knob((k,), tuple(unknowns), None, constraint.whites, window)
    # Round-off may have separated equal ends.
    most = max(most, darkest)
    least = min(least, most, brightest)
    limit = tuple(map(float, coefficients)), least, most
    return Knob((k,), tuple(unknowns), limit, constraint.whites, window)


def lamp_of(
    light: BasisLight,
    constraint: LightConstraint | None,
    cd_per_unit: float | None,
    prefer: Preference | None,
) -> Lamp | None:
    """Return the lamp of a light, if its constraint lists emitters."""
    if constraint is None or light.is_fixed:
        return None
    _check_rendering(light, constraint)
    if not constraint.emitters:
        return None
    if light.is_scalar:
        raise ConstraintError(
            constraint.where,
            f" lists emitters, and {light.name!r} can only be dimmed as a whole: leave them out",
        )
    emitters = tuple(x.in_light(light, cd_per_unit) for x in constraint.emitters)
    is_wheel = constraint.wheel is not False
    lamp = Lamp(emitters, constraint.power_share, prefer or "watts", is_wheel, constraint.least_rf)
    return lamp.behind_slot(constraint.slots[0]) if constraint.slots else lamp


def _check_rendering(light: BasisLight, constraint: LightConstraint) -> None:
    """Raise ConstraintError for an Rf of emitters whose spectra are unknown."""
    if constraint.least_rf is None:
        return
    missing = [x.name for x in constraint.emitters if x.spectrum is None]
    if missing or not constraint.emitters:
        unknown = f"its emitters {some_names(missing)}" if missing else "its emitters"
        raise ConstraintError(
            constraint.where / "rf",
            f" is {constraint.least_rf:g}, and nothing says which spectrum {unknown} of "
            f"{light.name!r} have: add emitters, each with its spectrum, to the lights file",
        )


def lamp_knob(k: int, light: BasisLight, constraint: LightConstraint, lamp: Lamp) -> Knob:
    """Make the knob of a lamp, whose unknowns are the drives of its emitters; under limits of power
    and luminance, the corners of what it can emit.
    """
    if lamp.is_wheel:
        return _wheel_knob(k, light, constraint, lamp)
    lower, upper = np.zeros(len(lamp.most)), lamp.most
    unknowns = _unknowns_of(k, lamp.columns, upper)
    least, most = _luminance_limits(constraint, light, "mixes emitters")
    is_unlimited = least == 0 and np.isinf(most)
    if lamp.power_share is not None and is_unlimited:
        return Knob((k,), unknowns, (tuple(map(float, lamp.powers)), 0.0, lamp.power_share))
    if lamp.power_share is not None:
        return _corner_knob(k, light, constraint, lamp, (least, most))
    if is_unlimited:
        return Knob((k,), unknowns)
    coefficients = np.asarray(luminance(lamp.columns), np.float64)
    _check_room(constraint, light, least, min(most, float(coefficients @ upper)))
    _check_room(constraint, light, lower, upper)
    return Knob((k,), unknowns, (tuple(map(float, coefficients)), least, most))


def slots_of_lamp(
    k: int, light: BasisLight, constraint: LightConstraint, cd_per_unit: float | None, lamp: Lamp
) -> SlotChoices:
    """Return the slots of the wheel in front of a lamp's emitters, at the first of them."""
    emitters = tuple(x.in_light(light, cd_per_unit) for x in constraint.emitters)
    bare = replace(lamp, emitters=emitters)
    lamps = [bare.behind_slot(slot) for slot in constraint.slots]
    options = tuple(SlotChoice(lamp_knob(k, light, constraint, x), x) for x in lamps)
    return SlotChoices(options, is_filter=True)


def _unknowns_of(k: int, colors: Doubles, upper: Doubles) -> tuple[Unknown, ...]:
    """Return an unknown of light k for each of some colours (e, 3), from 0 to `upper` (e,)."""
    pairs = zip(colors, upper.tolist(), strict=True)
    return tuple(Unknown(((k, rgb),), 0.0, high) for rgb, high in pairs)


def _corner_knob(
    k: int,
    light: BasisLight,
    constraint: LightConstraint,
    lamp: Lamp,
    limits: tuple[float, float],
) -> Knob:
    """Make the knob of a lamp under two limits, which mixes the corners of what it can emit.

    What bounds, power and luminance allow is convex: its corners, in shares of 1, mix all of it.
    """
    least, most = limits
    corners = lamp.corners(least, most)
    _check_room(constraint, light, least, most if len(corners) else -np.inf)
    if least == 0:  # black is a corner, too, and takes no share
        corners = corners[np.abs(corners).max(axis=1) > 0]
    unknowns = _unknowns_of(k, corners, np.full(len(corners), np.inf))
    return Knob((k,), unknowns, ((1.0,) * len(corners), 1.0 if least > 0 else 0.0, 1.0))


def _wheel_knob(k: int, light: BasisLight, constraint: LightConstraint, lamp: Lamp) -> Knob:
    """Make the knob of a lamp with a colour wheel: at its slot, if the constraint names it, or at
    the one that is closest to a colour.

    Until the slot is chosen, the unknowns are shares of the light of all slots.
    """
    least, most = _luminance_limits(constraint, light, "has a colour wheel")
    lower, upper = least / lamp.levels, np.minimum(lamp.most, most / lamp.levels)
    roomiest = int(np.argmax(upper - lower))
    _check_room(constraint, light, lower[roomiest], upper[roomiest])
    wheel = ColorWheel(lamp, lower, upper)
    unknowns = _unknowns_of(k, lamp.columns, np.where(lower <= upper, upper, 0.0))
    knob = Knob((k,), unknowns, ((1.0,) * len(unknowns), 0.0, 1.0), wheel=wheel)
    if isinstance(constraint.wheel, str):
        slot = lamp.names.index(constraint.wheel)
        _check_room(constraint, light, lower[slot], upper[slot])
        return knob.at_slot(slot)
    if constraint.primaries is not None:
        return knob.at_slot(wheel.slot_for(np.array(constraint.primaries[0])))
    return knob


def dimmer_knob(
    k: int, light: BasisLight, constraint: LightConstraint, lamp: Lamp | None = None
) -> Knob:
    """Make the knob of a light of one colour, which dims. lamp: what mixes it, if known."""
    if light.is_scalar and constraint.primaries is not None:
        raise ConstraintError(
            constraint.where,
            f" asks for a colour, and {light.name!r} can only be dimmed as a "
            f"whole: "
            "use lock, limits, tie or off",
        )
    direction = np.ones(3) if constraint.primaries is None else np.array(constraint.primaries[0])
    _check_grey(constraint, light)
    lower, upper = _dimmer_limits(constraint, direction, light)
    if lamp is not None:
        upper = min(upper, _brightest(lamp, direction, light, constraint))
    _check_room(constraint, light, lower, upper)
    # Round-off may have separated equal ends.
    return Knob((k,), (Unknown(((k, direction),), min(lower, upper), upper),))


def _brightest(lamp: Lamp, color: Doubles, light: BasisLight, constraint: LightConstraint) -> float:
    """Return the largest factor by which a lamp mixes a colour (3,)."""
    most = lamp.brightest(color)
    if most == 0:
        raise ConstraintError(
            constraint.where,
            f" asks {light.name!r} for the colour {' '.join(f'{x:.3g}' for x in color)}, which its "
            f"emitters {', '.join(lamp.names)} cannot mix: choose another",
        )
    return most


def tied_knob(
    tie: Tie,
    members: Sequence[int],
    names: str,
    lights: Sequence[BasisLight],
    constraints: Sequence[LightConstraint | None],
    lamps: Mapping[int, Lamp],
) -> Knob:
    """Make the knob of lights on one dimmer; at 1 they have their current luminances.

    A fixed member fixes the dimmer: the unknown's limits meet. lamps: of some of all lights.
    """
    columns, lower, upper = [], 0.0, np.inf
    for k in members:
        constraint = constraints[k] or LightConstraint()
        direction, least, most = _tied_direction(tie, names, lights[k], constraint)
        if k in lamps and lamps[k].is_wheel:
            direction = _on_wheel(lamps[k], constraint, direction)
        if k in lamps and not constraint.is_fixed:
            most = min(most, _brightest(lamps[k], direction, lights[k], constraint))
        lower, upper = max(lower, least), min(upper, most)
        columns.append((k, direction))
    if lower > upper * (1 + ROUND_OFF):
        raise ConstraintError(
            tie.where,
            f": {names} share a dimmer, but one needs at least {lower:.4g} times its "
            f"current luminance and another allows at most {upper:.4g}: change these limits, or "
            "leave one out",
        )
    return Knob(tuple(members), (Unknown(tuple(columns), min(lower, upper), upper),))


def _tied_direction(
    tie: Tie, names: str, light: BasisLight, constraint: LightConstraint
) -> tuple[Doubles, float, float]:
    """Return the emission (3,) of a tied light at dimmer 1, and the limits of the dimmer for it."""
    current = np.array(light.emission)
    if constraint.primaries and len(constraint.primaries) > 1:
        raise ConstraintError(
            constraint.where,
            f" asks for {constraint.label}, and {light.name!r} is on the "
            f"dimmer of {names}: a tied light has one color; leave it out of the tie",
        )
    if not current.any():
        raise ConstraintError(
            tie.where,
            f": {light.name!r} is currently off, so nothing says how bright it is "
            f"beside the others of {names}: give it an emission, or leave it out",
        )
    color = tie.color or (constraint.primaries[0] if constraint.primaries else None)
    if color is not None and light.is_scalar:
        raise ConstraintError(
            constraint.where or tie.where,
            f" asks for a colour, and {light.name!r} can only be dimmed as a whole",
        )
    direction = current if color is None else np.array(color) * float(luminance(current))
    _check_grey(constraint, light)
    least, most = _dimmer_limits(constraint, direction, light)
    if constraint.is_fixed:
        emission = (
            np.zeros(3)
            if constraint.lock is None
            else locked_emission(light, constraint.lock, constraint.where)
        )
        least = most = float(luminance(emission) / luminance(current))
        direction = emission / most if most > 0 else direction
    return direction, least, most


def fixed_emission(
    light: BasisLight, constraint: LightConstraint, lamp: Lamp | None = None
) -> Doubles:
    """Return the emission (3,) of a light that is off or locked. lamp: what mixes it, if known."""
    if constraint.lock is None:
        return np.zeros(3)
    emission = locked_emission(light, constraint.lock, constraint.where)
    if lamp is not None and lamp.is_wheel:
        emission = _on_wheel(lamp, constraint, emission)
    if lamp is not None and not lamp.can_mix(emission):
        raise ConstraintError(
            constraint.where,
            f" holds {light.name!r} at {_numbers(emission)}, which its emitters "
            f"{', '.join(lamp.names)} cannot mix: {_range_of(lamp, emission)}",
        )
    return emission


def _on_wheel(lamp: Lamp, constraint: LightConstraint, emission: Doubles) -> Doubles:
    """Return an emission (3,) in the colour of the slot that is closest, or the constraint's."""
    if isinstance(constraint.wheel, str):
        slot = lamp.names.index(constraint.wheel)
    else:
        slot = lamp.slot_for(emission)
    return np.asarray(lamp.columns[slot] * luminance(emission) / lamp.levels[slot])


def _range_of(lamp: Lamp, emission: Doubles) -> str:
    """Return what a lamp can mix instead of an emission (3,), and what to do."""
    if (most := lamp.brightest(emission)) > 0:
        return (
            f"in this colour they reach {_numbers(most * emission)}, a level of "
            f"{luminance(most * emission):.4g}; lock it at that at most"
        )
    full = lamp.mix(lamp.most)
    full = min(lamp.brightest(full), 1.0) * full
    return (
        f"they have no light of this colour, and all together reach {_numbers(full)}; lock it at "
        "another colour"
    )


def _numbers(emission: Doubles) -> str:
    return " ".join(f"{x:.4g}" for x in emission)


def locked_emission(light: BasisLight, lock: Lock, where: SourceKey) -> Doubles:
    """Return the emission (3,) that `lock` asks for."""
    current = np.array(light.emission)
    level = lock.level
    if light.is_scalar and lock.color is not None:
        raise ConstraintError(
            where / "lock", f" asks for a colour, and {light.name!r} can only be dimmed as a whole"
        )
    if level is not None and isinstance(level.amount, tuple):
        if light.is_scalar and len(set(level.amount)) > 1:
            raise ConstraintError(
                where / "lock",
                f" is {level}, and {light.name!r} can only be dimmed as a whole: give one number",
            )
        return np.array(level.amount)
    now = float(luminance(current))
    color = current / now if lock.color is None and now > 0 else np.array(lock.color or (1, 1, 1))
    if level is None and lock.color is None:
        return current
    amount = now
    if level is not None:
        assert not isinstance(level.amount, tuple)
        amount = level.amount * (now if level.is_share else 1.0)
    return np.asarray(color * amount)
