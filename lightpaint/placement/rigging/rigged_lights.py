"""The rigging of a lights file, applied to the lights of a scene."""

import difflib
from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from typing import Any

import numpy as np

from lightpaint.arrays import Position
from lightpaint.errors import ConstraintError, SceneError
from lightpaint.lighting.constraints.constraints import is_pattern
from lightpaint.placement.free_space import as_position
from lightpaint.placement.freedom import Freedom
from lightpaint.placement.lights_to_place import free_light
from lightpaint.placement.rigging.rigging import Rigging
from lightpaint.placement.rigging.rigging_values import names_of
from lightpaint.scene.lights.light import Light
from lightpaint.scene.scene import Scene
from lightpaint.screen import some_names


def freedoms_of(rigging: Rigging, scene: Scene) -> dict[str, Freedom]:
    """Return the freedom of each light that may move, by name.

    Each key of a pattern is for those of its lights that can do it. Raises ConstraintError for
    names that nothing has, and for lights that cannot move.
    """
    for _, where in (*rigging.new, *rigging.pairs):
        raise ConstraintError(f"{where}: only lights that are there can be placed so far")
    tables: dict[str, dict[str, Any]] = {}
    places: dict[str, str] = {}
    for name, table, where in rigging.lights:
        matches = _matches(name, scene, where)
        for key, value in table.items():
            refused = []
            for light in matches:
                try:
                    free_light(scene, light.name, _freedom({key: value}, light, rigging, where))
                except SceneError as error:
                    refused.append(str(error))
                    continue
                tables.setdefault(light.name, {})[key] = value
                places[light.name] = where
            if len(refused) == len(matches):
                raise ConstraintError(f"{where}.{key}: {refused[0]}")
    return {
        name: _freedom(table, scene.light(name), rigging, places[name])
        for name, table in tables.items()
    }


def _matches(name: str, scene: Scene, where: str) -> list[Light]:
    """Return the light of that name, else all that match it as a pattern."""
    lights = [light for light in scene.lights if not light.is_fixed]
    if exact := [light for light in scene.lights if light.name == name]:
        return exact
    matches = [x for x in lights if is_pattern(name) and fnmatchcase(x.name, name)]
    if not matches:
        names = [light.name for light in lights]
        close = difflib.get_close_matches(name, names, n=1)
        hint = f"did you mean {close[0]!r}? There" if close else "there"
        raise ConstraintError(f"{where}: no light {name!r}; {hint} are {some_names(names)}")
    return matches


def _freedom(table: Mapping[str, Any], light: Light, rigging: Rigging, where: str) -> Freedom:
    """Return the freedom that the keys `move`, `aim` and `cone` give a light."""
    move = table.get("move", {})
    move = move if isinstance(move, Mapping) else {"within": move}
    within, box, line = move.get("within"), move.get("box"), None
    if "along" in move and (here := light.members[0].site.position) is not None:
        way = np.array(move["along"], dtype=float)
        way *= move["within"] / np.linalg.norm(way)
        line, within = (as_position(here - way), as_position(here + way)), None
    if "on" in move:
        [name] = names_of(move["on"], f"{where}.move.on")
        line = _segment(_place(name, rigging, f"{where}.move.on")["line"])
    return Freedom(
        within=within,
        box=None if box is None else _segment(box),
        line=line,
        aim=table.get("aim", False),
        cone=table.get("cone"),
    )


def _place(name: str, rigging: Rigging, where: str) -> Mapping[str, Any]:
    """Return the last rail or surface of that name. Raises ConstraintError if there is none."""
    named = {its: table for its, table, _ in rigging.on}
    if name not in named:
        there = f"there are {some_names(named)}" if named else "there is none"
        raise ConstraintError(f"{where}: no rail or surface {name!r}; {there}: add [on.{name}]")
    return named[name]


def _segment(ends: Sequence[Sequence[float]]) -> tuple[Position, Position]:
    return as_position(ends[0]), as_position(ends[1])
