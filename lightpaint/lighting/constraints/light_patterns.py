"""Constraints of each light, resolved from names and patterns."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from typing import Any

from lightpaint.basis import BasisLight
from lightpaint.display_text import some_names, with_similar_name
from lightpaint.errors import ConstraintError
from lightpaint.lighting.constraints.constraints import (
    LAMP_KEYS,
    Constraints,
    LightConstraint,
    Tie,
    is_pattern,
    merge_tables,
)
from lightpaint.scene.lights.texels import coarse_name, image_of
from lightpaint.sentences import Hint, Lead, SourceKey


def constraints_by_light(
    constraints: Constraints, lights: Sequence[BasisLight]
) -> list[LightConstraint | None]:
    """Return the constraint on each light, None without one; names win over patterns."""
    made: dict[tuple[int, str], LightConstraint] = {}
    tables = tables_by_light(constraints, lights)
    for table, where in tables:
        if table and (id(table), where) not in made:
            made[id(table), where] = LightConstraint.of(table, where=where)
    return [made.get((id(table), where)) for table, where in tables]


def tables_by_light(
    constraints: Constraints, lights: Sequence[BasisLight]
) -> list[tuple[dict[str, Any], str]]:
    """Return the merged keys and values for each light, and the source of the last of them.

    Lights of the same entries share their table.
    """
    tables: list[tuple[dict[str, Any], str]] = [({}, "")] * len(lights)
    for name, wish, origin in constraints.lights:
        merged: dict[int, dict[str, Any]] = {}
        for k in _match_lights(name, lights, origin, only_keeps=_only_keeps(wish)):
            below = tables[k][0]
            if id(below) not in merged:
                merged[id(below)] = merge_tables(below, wish)
            tables[k] = merged[id(below)], origin
    return tables


def _only_keeps(wish: Mapping[str, Any]) -> bool:
    """Return whether keys only say what a light is or that it stays, as a fixed light does."""
    return wish == {"lock": True} or wish.keys() <= {*LAMP_KEYS}


def constraints_on_parts(
    constraints: Constraints, lights: Sequence[BasisLight]
) -> tuple[Constraints, Constraints]:
    """Return the constraints on single emitters of lamps, by their names, and all others."""
    names = {light.name for light in lights if light.lamp}
    is_part = [name in names for name, _, _ in constraints.lights]
    own = tuple(x for x, is_own in zip(constraints.lights, is_part, strict=True) if is_own)
    rest = tuple(x for x, is_own in zip(constraints.lights, is_part, strict=True) if not is_own)
    return Constraints(lights=own), replace(constraints, lights=rest)


def tied_lights(
    constraints: Constraints, lights: Sequence[BasisLight]
) -> dict[int, tuple[Tie, list[int]]]:
    """Return the tie of each tied light, and the indices of its members in their order."""
    ties: dict[int, tuple[Tie, list[int]]] = {}
    for tie in constraints.ties:
        members = sorted({k for name in tie.lights for k in _match_lights(name, lights, tie.where)})
        listed = some_names(tie.lights)
        if len(members) < 2:
            raise ConstraintError(tie.where, f": {listed} is one light: a tie has at least two")
        for k in members:
            if k in ties:
                raise ConstraintError(
                    tie.where,
                    f": light {lights[k].name!r} is in two ties, "
                    f"{some_names(ties[k][0].lights)} and {listed}: it has one dimmer",
                )
            ties[k] = (tie, members)
    return ties


def lights_of_open_color(constraints: Constraints, lights: Sequence[BasisLight]) -> list[int]:
    """Return the indices of lights that may take any colour under `constraints`."""
    tied = tied_lights(constraints, lights)
    return [
        k
        for k, (light, constraint) in enumerate(
            zip(lights, constraints_by_light(constraints, lights), strict=True)
        )
        if not (light.is_fixed or light.is_scalar or k in tied)
        and (constraint is None or constraint.has_open_color)
    ]


def _match_lights(
    name: str, lights: Sequence[BasisLight], where: str, *, only_keeps: bool = False
) -> list[int]:
    """Return the index of the light of this name, else of all that match it as a pattern, or of
    the texels of the image of this name.
    """
    names = [light.name for light in lights]
    if parts := [k for k, light in enumerate(lights) if light.lamp and light.lamp == name]:
        return parts
    for k, light in enumerate(lights):
        if name == light.name and not light.is_fixed:
            return [k]
        if name != light.name and name not in light.members:
            continue
        if light.is_fixed:
            if only_keeps:
                return []  # which a fixed light does anyway
            raise ConstraintError(
                where,
                f": {name!r} is fixed, since it is not among the lights to adjust: choose it with ",
                Hint("lights"),
                ", or remove its constraint",
            )
        if name not in names:
            raise ConstraintError(
                where, f": {name!r} is part of the light {light.name!r}: constrain that light"
            )
    matches = [
        k for k, x in enumerate(lights) if not x.is_fixed and _is_meant(x.lamp or x.name, name)
    ]
    if not matches:
        adjustable = [x.lamp or x.name for x in lights if not x.is_fixed]
        adjustable = [*dict.fromkeys(adjustable)]
        hint = with_similar_name(f"there are {some_names(adjustable)}", name, adjustable)
        raise ConstraintError(Lead(SourceKey.of(where)), f"no light {name!r}; {hint}")
    return matches


def _is_meant(light: str, name: str) -> bool:
    """Return whether a name or pattern means a light: its image, or the coarse texel in whose place
    a finer one is, mean it too.
    """
    matching = fnmatchcase if is_pattern(name) else str.__eq__
    return name in (light, image_of(light)) or matching(coarse_name(light) or light, name)
