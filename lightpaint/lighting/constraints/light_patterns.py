"""Which lights are meant: names and patterns, and what is asked of each by all of them."""

import difflib
from collections.abc import Sequence
from fnmatch import fnmatchcase
from typing import Any

from lightpaint.basis.lights import BasisLight
from lightpaint.errors import ConstraintError
from lightpaint.lighting.constraints.constraints import (
    Constraints,
    LightConstraint,
    Tie,
    is_pattern,
    overlaid,
)
from lightpaint.screen import some_names


def of_each_light(
    constraints: Constraints, lights: Sequence[BasisLight]
) -> list[LightConstraint | None]:
    """All that is asked of each light, patterns below names."""
    return [
        LightConstraint.of(asked, where=where) if asked else None
        for asked, where in asked_of_each(constraints, lights)
    ]


def asked_of_each(
    constraints: Constraints, lights: Sequence[BasisLight]
) -> list[tuple[dict[str, Any], str]]:
    """The same as keys and values, and where the last of them stands."""
    asked: list[tuple[dict[str, Any], str]] = [({}, "") for _ in lights]
    for name, wish, origin in constraints.lights:
        for k in _found(name, lights, origin, only_keeps=wish == {"lock": True}):
            asked[k] = overlaid(asked[k][0], wish), origin
    return asked


def tied_lights(
    constraints: Constraints, lights: Sequence[BasisLight]
) -> dict[int, tuple[Tie, list[int]]]:
    """The tie of each light that is in one, and its members in their order."""
    tie_of: dict[int, tuple[Tie, list[int]]] = {}
    for tie in constraints.ties:
        members = sorted({k for name in tie.lights for k in _found(name, lights, tie.where)})
        listed = some_names(tie.lights)
        if len(members) < 2:
            raise ConstraintError(f"{tie.where}: {listed} is one light: a tie has at least two")
        for k in members:
            if k in tie_of:
                raise ConstraintError(
                    f"{tie.where}: light {lights[k].name!r} is in two ties, "
                    f"{some_names(tie_of[k][0].lights)} and {listed}: it has one dimmer"
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
        raise ConstraintError(f"{where}: no light {name!r}; {hint} are {some_names(there)}")
    return found
