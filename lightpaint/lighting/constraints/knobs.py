"""What turns by itself, and the unknowns that this is: made of what is asked of lights."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.basis.lights import BasisLight
from lightpaint.colour.color import luminance
from lightpaint.colour.color_hull import ColorHull
from lightpaint.colour.white_range import WhiteRange
from lightpaint.errors import ConstraintError
from lightpaint.lighting.constraints.constraints import LightConstraint, Tie
from lightpaint.lighting.constraints.emission_limits import (
    ROUND_OFF,
    check_grey,
    check_room,
    dimmer_limits,
    mix_limits,
)
from lightpaint.lighting.constraints.values import Lock


@dataclass(frozen=True)
class Unknown:
    """One x. columns: (light, (3,) emission of it at x = 1) for each light that it moves."""

    columns: tuple[tuple[int, Doubles], ...]
    lower: float = 0.0
    upper: float = np.inf


@dataclass(frozen=True)
class Knob:
    """What turns by itself: a light, or several on one dimmer.

    limit: coefficients, least and most of a sum over its unknowns, if one is limited.
    whites: the range of white of a light that keeps to one. window: between which of these its two
    unknowns mix at present (white_neighbours.py).
    gamut: the colours that the light mixes, if it would otherwise leave them: all of them, or those
    towards one `side` (gamut_bounds.py).
    """

    lights: tuple[int, ...]
    unknowns: tuple[Unknown, ...]
    limit: tuple[tuple[float, ...], float, float] | None = None
    whites: WhiteRange | None = None
    window: tuple[int, int] = (0, 0)
    gamut: ColorHull | None = None
    side: int | None = None

    @cached_property
    def is_free(self) -> bool:
        """Whether it is a light of three channels, each by itself."""
        return len(self.unknowns) == 3 and all(
            len(u.columns) == 1 and (u.columns[0][1] == axis).all()
            for u, axis in zip(self.unknowns, np.eye(3), strict=True)
        )

    def off(self) -> "Knob":
        """It at 0."""
        return replace(
            self, unknowns=tuple(replace(u, lower=0.0, upper=0.0) for u in self.unknowns)
        )

    def within(self, window: tuple[int, int]) -> "Knob":
        """Return the knob as a mix of two other whites of its range."""
        assert self.whites is not None
        return self._mixing(self.whites.colors[list(window)], window)

    def along_tangent(self, reach: float) -> "Knob":
        """Return the knob on the straight line of its window, drawn out by `reach` mireds."""
        assert self.whites is not None
        return self._mixing(self.whites.tangent(self.window, reach), self.window)

    def within_gamut(self, gamut: ColorHull, side: int | None = None) -> "Knob":
        """Return the knob as a mix of the primaries of a gamut. side: of the part towards it."""
        [light] = self.lights
        primaries = gamut.primaries if side is None else gamut.fan(side)
        limit = self.limit
        if limit is not None:
            limit = ((1.0,) * len(primaries), *limit[1:])
        unknowns = tuple(Unknown(((light, rgb),)) for rgb in primaries)
        return replace(self, unknowns=unknowns, limit=limit, gamut=gamut, side=side)

    def _mixing(self, colors: Doubles, window: tuple[int, int]) -> "Knob":
        [light] = self.lights
        unknowns = tuple(
            replace(u, columns=((light, rgb),))
            for u, rgb in zip(self.unknowns, colors, strict=True)
        )
        return replace(self, unknowns=unknowns, window=window)

    @classmethod
    def of_any_colour(cls, light: int, *, is_scalar: bool = False) -> "Knob":
        """A light of which nothing is asked."""
        colours = np.ones((1, 3)) if is_scalar else np.eye(3)
        return cls((light,), tuple(Unknown(((light, rgb),)) for rgb in colours))


def mix_of(k: int, light: BasisLight, one: LightConstraint) -> Knob:
    """A light of several primaries, of which each is dimmed by itself."""
    colours = np.eye(3) if one.primaries is None else np.array(one.primaries)
    lower, upper, least, most = mix_limits(one, light, len(colours))
    unknowns = [
        Unknown(((k, rgb),), float(low), float(high))
        for rgb, low, high in zip(colours, lower, upper, strict=True)
    ]
    coefficients = np.asarray(luminance(colours), np.float64)
    darkest, brightest = float(coefficients @ lower), float(coefficients @ upper)
    check_room(one, light, max(least, darkest), most)
    check_room(one, light, least, min(most, brightest))
    window = (0, one.whites.last) if one.whites is not None else (0, 0)
    if least == 0 and np.isinf(most):
        return Knob((k,), tuple(unknowns), None, one.whites, window)
    # Round-off may have parted ends that are the same.
    most = max(most, darkest)
    least = min(least, most, brightest)
    limit = tuple(map(float, coefficients)), least, most
    return Knob((k,), tuple(unknowns), limit, one.whites, window)


def dimmer_of(k: int, light: BasisLight, one: LightConstraint) -> Knob:
    """A light of one colour, which is dimmed."""
    if light.is_scalar and one.primaries is not None:
        raise ConstraintError(
            f"{one.where} asks for a colour, and {light.name!r} can only be dimmed as a whole: "
            "use lock, limits, tie or off"
        )
    direction = np.ones(3) if one.primaries is None else np.array(one.primaries[0])
    check_grey(one, light)
    lower, upper = dimmer_limits(one, direction, light)
    check_room(one, light, lower, upper)
    # Round-off may have parted ends that are the same.
    return Knob((k,), (Unknown(((k, direction),), min(lower, upper), upper),))


def tie_of(
    tie: Tie,
    members: Sequence[int],
    names: str,
    lights: Sequence[BasisLight],
    asked: Sequence[LightConstraint | None],
) -> Knob:
    """One unknown for all members; at 1 they have their present luminances.

    A member that is held holds the dimmer: the unknown's limits meet.
    """
    columns, lower, upper = [], 0.0, np.inf
    for k in members:
        light, one = lights[k], asked[k] or LightConstraint()
        if one.primaries and len(one.primaries) > 1:
            raise ConstraintError(
                f"{one.where} asks for {one.label}, and {light.name!r} is on the dimmer of {names}"
                ": a tied light has one color; leave it out of the tie"
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
        check_grey(one, light)
        least, most = dimmer_limits(one, direction, light)
        if one.is_held:
            emission = np.zeros(3) if one.lock is None else locked_at(light, one.lock, one.where)
            least = most = float(luminance(emission) / luminance(present))
            direction = emission / most if most > 0 else direction
        lower, upper = max(lower, least), min(upper, most)
        columns.append((k, direction))
    if lower > upper * (1 + ROUND_OFF):
        raise ConstraintError(
            f"{tie.where}: what is asked of {names} cannot be had on one dimmer: one light "
            f"asks for at least {lower:.4g} times the present, another for at most {upper:.4g}"
        )
    return Knob(tuple(members), (Unknown(tuple(columns), min(lower, upper), upper),))


def locked_at(light: BasisLight, lock: Lock, where: str) -> Doubles:
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
