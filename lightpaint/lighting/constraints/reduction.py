"""The unknowns that constraints leave: w = C x + w₀ with bounds on x.

A light that may have any colour has three unknowns; one of fixed colour, or several on one
dimmer, a single one; one that mixes primaries, an unknown for each. What is locked is in w₀
and moves to the right-hand side. Limits are bounds on x, or on its luminance. So whatever is
asked for, the problem stays one convex quadratic.
"""

import difflib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from typing import Any

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.basis.basis import BasisLight
from lightpaint.colour.color import luminance
from lightpaint.errors import ConstraintError
from lightpaint.lighting.algebra.optimum import Cap
from lightpaint.lighting.constraints.constraints import (
    Constraints,
    Level,
    LightConstraint,
    Lock,
    Tie,
    is_pattern,
    overlaid,
)

#: Share by which a lower limit may exceed an upper one before they contradict: round-off.
ROUND_OFF = 1e-12


@dataclass(frozen=True)
class Unknown:
    """One x. columns: (light, (3,) emission of it at x = 1) for each light that it moves."""

    columns: tuple[tuple[int, Doubles], ...]
    lower: float = 0.0
    upper: float = np.inf


@dataclass
class Reduction:
    """What is left to solve for.

    held: (n, 3), w₀: the emission of lights without an unknown; 0 for the others.
    unknowns: in order; caps: limits on sums of them.
    knobs: (lights, unknowns) of what turns by itself: a light, or several on one dimmer.
    labels: for each light what is asked of it in few words; "" for nothing.
    """

    held: Doubles
    labels: list[str]
    unknowns: list[Unknown] = field(default_factory=list)
    caps: list[Cap] = field(default_factory=list)
    knobs: list[tuple[tuple[int, ...], tuple[int, ...]]] = field(default_factory=list)

    def add(self, unknowns: Sequence[Unknown], limits: tuple[Doubles, float, float] | None) -> None:
        """A knob. limits: (coefficients, least, most) of a sum over its unknowns."""
        first = len(self.unknowns)
        its = tuple(range(first, first + len(unknowns)))
        self.unknowns += unknowns
        lights = tuple(dict.fromkeys(light for x in unknowns for light, _ in x.columns))
        self.knobs.append((lights, its))
        if limits is not None:
            coefficients, least, most = limits
            self.caps.append(Cap(its, tuple(map(float, coefficients)), least, most))


def reduce_to(constraints: Constraints, lights: Sequence[BasisLight]) -> Reduction:
    """What `constraints` leave to solve for among `lights`.

    Raises ConstraintError for a light that is not there, and for what cannot be had: a
    colour of a light that has only a dimmer, a light on two dimmers, limits without room.
    """
    asked = _of_each_light(constraints, lights)
    labels = ["" if one is None else one.label for one in asked]
    reduction = Reduction(np.zeros((len(lights), 3)), labels)
    tied = _tied(constraints, lights)
    for k, (light, one) in enumerate(zip(lights, asked, strict=True)):
        if light.is_fixed:
            reduction.held[k] = 1
        elif k in tied:
            tie, members = tied[k]
            if k == members[0]:
                _add_tie(reduction, tie, members, lights, asked)
        elif one is not None and (one.off or one.lock is not None):
            reduction.held[k] = 0 if one.lock is None else _locked(light, one.lock, one.where)
        else:
            _add_light(reduction, k, light, one)
    return reduction


def _add_light(
    reduction: Reduction, k: int, light: BasisLight, asked: LightConstraint | None
) -> None:
    one = asked or LightConstraint()
    if light.is_scalar or (one.primaries is not None and len(one.primaries) == 1):
        reduction.add([_dimmer(k, light, one)], None)
        return
    colours = np.eye(3) if one.primaries is None else np.array(one.primaries)
    lower, upper, least, most = _mix_limits(one, light, len(colours))
    unknowns = [
        Unknown(((k, colours[j]),), float(lower[j]), float(upper[j])) for j in range(len(colours))
    ]
    coefficients = np.asarray(luminance(colours), np.float64)
    is_limited = least > 0 or np.isfinite(most)
    darkest, brightest = float(coefficients @ lower), float(coefficients @ upper)
    _check_room(one, light, max(least, darkest), most)
    _check_room(one, light, least, min(most, brightest))
    # Round-off may have parted ends that are the same.
    most = max(most, darkest)
    least = min(least, most, brightest)
    reduction.add(unknowns, (coefficients, least, most) if is_limited else None)


def _dimmer(k: int, light: BasisLight, one: LightConstraint) -> Unknown:
    """The unknown of a light of one colour."""
    if light.is_scalar and one.primaries is not None:
        raise ConstraintError(
            f"{one.where} asks for a colour, and {light.name!r} can only be dimmed as a whole: "
            "use lock, limits, tie or off"
        )
    direction = np.ones(3) if one.primaries is None else np.array(one.primaries[0])
    _check_grey(one, light)
    lower, upper = _dimmer_limits(one, direction, light)
    _check_room(one, light, lower, upper)
    # Round-off may have parted ends that are the same.
    return Unknown(((k, direction),), min(lower, upper), upper)


def _add_tie(
    reduction: Reduction,
    tie: Tie,
    members: Sequence[int],
    lights: Sequence[BasisLight],
    asked: Sequence[LightConstraint | None],
) -> None:
    """One unknown for all members; at 1 they have their present luminances."""
    names = ", ".join(lights[k].name for k in members)
    columns, lower, upper = [], 0.0, np.inf
    for k in members:
        light, one = lights[k], asked[k] or LightConstraint()
        if one.off or one.lock is not None or (one.primaries and len(one.primaries) > 1):
            raise ConstraintError(
                f"{one.where} asks for {one.label}, and {light.name!r} is on the dimmer of {names}"
                ": a tied light can only have limits and a color; leave it out of the tie"
            )
        present = np.array(light.emission)
        if not present.any():
            raise ConstraintError(
                f"{tie.where}: {light.name!r} is off at present, so nothing says how bright it is "
                f"beside the others of {names}: give it an emission, or leave it out"
            )
        color = tie.color or (one.primaries[0] if one.primaries else None)
        if color is not None and light.is_scalar:
            raise ConstraintError(
                f"{one.where or tie.where} asks for a colour, and {light.name!r} can only be "
                "dimmed as a whole"
            )
        direction = present if color is None else np.array(color) * float(luminance(present))
        _check_grey(one, light)
        least, most = _dimmer_limits(one, direction, light)
        lower, upper = max(lower, least), min(upper, most)
        columns.append((k, direction))
        reduction.labels[k] = ", ".join(filter(None, [f"tied ({names})", one.label]))
    if lower > upper * (1 + ROUND_OFF):
        raise ConstraintError(
            f"{tie.where}: the limits of {names} contradict each other on one dimmer: one light "
            f"asks for at least {lower:.4g} times the present, another for at most {upper:.4g}"
        )
    reduction.add([Unknown(tuple(columns), min(lower, upper), upper)], None)


def _locked(light: BasisLight, lock: Lock, where: str) -> Doubles:
    """The emission that `lock` asks for."""
    present = np.array(light.emission)
    level = lock.level
    if light.is_scalar and lock.color is not None:
        raise ConstraintError(
            f"{where}.lock asks for a colour, and {light.name!r} can only be dimmed as a whole"
        )
    if level is not None and isinstance(level.amount, tuple):
        if light.is_scalar and len(set(level.amount)) > 1:
            raise ConstraintError(
                f"{where}.lock is {level}, and {light.name!r} can only be dimmed as a whole: "
                "give one number"
            )
        return np.array(level.amount)
    now = float(luminance(present))
    color = present / now if lock.color is None and now > 0 else np.array(lock.color or (1, 1, 1))
    if level is None and lock.color is None:
        return present
    amount = now
    if level is not None:
        assert not isinstance(level.amount, tuple)
        amount = level.amount * (now if level.is_share else 1.0)
    return np.asarray(color * amount)


def _dimmer_limits(
    asked: LightConstraint, direction: Doubles, light: BasisLight
) -> tuple[float, float]:
    """Bounds on x for an emission of x times `direction`."""
    lower, upper = 0.0, np.inf
    for level, is_least in ((asked.least, True), (asked.most, False)):
        if level is None:
            continue
        if isinstance(level.amount, tuple):
            with np.errstate(divide="ignore", invalid="ignore"):
                bounds = np.array(level.amount) / direction
            # What has none of a channel keeps to any upper limit there, and to no lower one.
            bounds = np.where(direction > 0, bounds, np.inf)
            if is_least:
                bounds = np.where((direction == 0) & (np.array(level.amount) == 0), 0, bounds)
            bound = float(bounds.max() if is_least else bounds.min())
        else:
            bound = _luminance(level, light, asked) / float(luminance(direction))
        lower, upper = (max(lower, bound), upper) if is_least else (lower, min(upper, bound))
    return lower, upper


def _mix_limits(
    asked: LightConstraint, light: BasisLight, count: int
) -> tuple[Doubles, Doubles, float, float]:
    """Bounds on the unknowns, and on the luminance of their sum."""
    lower, upper = np.zeros(count), np.full(count, np.inf)
    least, most = 0.0, np.inf
    for level, is_least in ((asked.least, True), (asked.most, False)):
        if level is None:
            continue
        if not isinstance(level.amount, tuple):
            value = _luminance(level, light, asked)
            least, most = (value, most) if is_least else (least, value)
        elif asked.primaries is not None:
            raise ConstraintError(
                f"{asked.where}.limits has {level} for a light that mixes primaries: give a "
                "luminance like 2.5 or a share like 40%"
            )
        elif is_least:
            lower = np.array(level.amount)
        else:
            upper = np.array(level.amount)
    _check_room(asked, light, lower, upper)
    return lower, upper, least, most


def _luminance(level: Level, light: BasisLight, asked: LightConstraint) -> float:
    assert not isinstance(level.amount, tuple)
    if not level.is_share:
        return level.amount
    now = float(luminance(np.array(light.emission)))
    if now == 0:
        raise ConstraintError(
            f"{asked.where}.limits has {level} of the present, and {light.name!r} is off at "
            "present: give a number"
        )
    return level.amount * now


def _check_grey(asked: LightConstraint, light: BasisLight) -> None:
    for level in (asked.least, asked.most):
        if light.is_scalar and level is not None and isinstance(level.amount, tuple):
            raise ConstraintError(
                f"{asked.where}.limits has {level}, and {light.name!r} can only be dimmed as a "
                "whole: give one number"
            )


def _check_room(asked: LightConstraint, light: BasisLight, lower: Any, upper: Any) -> None:
    if (np.asarray(lower) > np.asarray(upper) * (1 + ROUND_OFF)).any() or np.isinf(lower).any():
        raise ConstraintError(
            f"{asked.where} asks of {light.name!r} for {asked.label}, which leaves it no emission "
            "at all: widen the limits"
        )


def _of_each_light(
    constraints: Constraints, lights: Sequence[BasisLight]
) -> list[LightConstraint | None]:
    """All that is asked of each light, patterns below names."""
    asked: list[Mapping[str, Any]] = [{} for _ in lights]
    where = ["" for _ in lights]
    for name, wish, origin in constraints.lights:
        for k in _found(name, lights, origin, only_keeps=wish == {"lock": True}):
            asked[k] = overlaid(asked[k], wish)
            where[k] = origin
    return [
        LightConstraint.of(a, where=w) if a else None for a, w in zip(asked, where, strict=True)
    ]


def _tied(
    constraints: Constraints, lights: Sequence[BasisLight]
) -> dict[int, tuple[Tie, list[int]]]:
    """The tie of each light that is in one, and its members in their order."""
    tie_of: dict[int, tuple[Tie, list[int]]] = {}
    for tie in constraints.ties:
        members = sorted({k for name in tie.lights for k in _found(name, lights, tie.where)})
        listed = ", ".join(tie.lights)
        if len(members) < 2:
            raise ConstraintError(f"{tie.where}: {listed} is one light: a tie has at least two")
        for k in members:
            if k in tie_of:
                raise ConstraintError(
                    f"{tie.where}: light {lights[k].name!r} is in two ties, "
                    f"{', '.join(tie_of[k][0].lights)} and {listed}: it has one dimmer"
                )
            tie_of[k] = (tie, members)
    return tie_of


def _found(
    name: str, lights: Sequence[BasisLight], where: str, *, only_keeps: bool = False
) -> list[int]:
    """The light of this name, else all that match it as a pattern."""
    names = [light.name for light in lights]
    for k, light in enumerate(lights):
        if name == light.name and not light.is_fixed:
            return [k]
        if name != light.name and name not in light.members:
            continue
        if light.is_fixed:
            if only_keeps:
                return []  # as it does anyway
            raise ConstraintError(
                f"{where}: {name!r} is not among the lights to adjust, and stays as it is: "
                "choose it with lights=..., or ask nothing of it"
            )
        if name not in names:
            raise ConstraintError(
                f"{where}: {name!r} is part of the light {light.name!r}: ask it of that"
            )
    matching = fnmatchcase if is_pattern(name) else str.__eq__
    found = [k for k, x in enumerate(lights) if not x.is_fixed and matching(x.name, name)]
    if not found:
        there = [light.name for light in lights if not light.is_fixed]
        close = difflib.get_close_matches(name, there, n=1)
        hint = f"did you mean {close[0]!r}? There" if close else "there"
        raise ConstraintError(f"{where}: no light {name!r}; {hint} are {', '.join(there)}")
    return found


def channel_groups(reduction: Reduction) -> list[list[int]]:
    """Channels that one problem couples; apart where no unknown and no cap joins them."""
    touched = [_channels([x]) for x in reduction.unknowns]
    touched += [_channels([reduction.unknowns[k] for k in cap.unknowns]) for cap in reduction.caps]
    groups = [{0}, {1}, {2}]
    for channels in touched:
        joined = [group for group in groups if group & channels]
        groups = [group for group in groups if not group & channels]
        groups.append(set().union(*joined))
    return sorted(sorted(group) for group in groups if group)


def _channels(unknowns: Iterable[Unknown]) -> set[int]:
    return {int(c) for x in unknowns for _, rgb in x.columns for c in np.flatnonzero(rgb)}
