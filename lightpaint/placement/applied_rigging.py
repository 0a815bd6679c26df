"""The rigging of a lights file, applied to the lights of a scene."""

from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from typing import Any

import numpy as np

from lightpaint.arrays import Position, as_position
from lightpaint.display_text import some_names, with_similar_name
from lightpaint.errors import ConstraintError, SceneError
from lightpaint.lighting import Constraints, is_pattern
from lightpaint.placement.freedom import Freedom
from lightpaint.placement.lights_to_place import followers_of, free_light, new_lights_of
from lightpaint.placement.new_lights import MirroredPair, NewLights, RiggedLights
from lightpaint.placement.rigging import Rigging, constraint_of, names_of
from lightpaint.scene import Light, Scene
from lightpaint.sentences import Lead, SourceKey


def rigged_lights(rigging: Rigging, scene: Scene) -> RiggedLights:
    """Return `rigging` applied to the lights of `scene`.

    Raises ConstraintError for unknown names, and for lights that cannot move like this.
    """
    freedoms = freedoms_of(rigging, scene)
    pairs = [_pair(table, where, scene, freedoms) for table, where in rigging.pairs]
    new = [_new_lights(table, where, scene, rigging) for table, where in rigging.new]
    tables = {}
    for light in new_lights_of(scene, new):
        table, where = rigging.new[next(k for k, x in enumerate(new) if x is light.group)]
        if constraint := constraint_of(table):
            tables[light.name] = (constraint, where)
    requests = tuple((name, table, where) for name, (table, where) in tables.items())
    return RiggedLights(freedoms, tuple(new), tuple(pairs), Constraints(requests))


def check_rigging(rigging: Rigging, scene: Scene) -> None:
    """Raise ConstraintError for names that no light or shape of `scene` has.

    Names in pairs and surfaces count, too, whether or not a search would use them.
    """
    for name, table, where in rigging.lights:
        _matches(name, scene, where / next(iter(table)) if table else where)
    lights = [light.name for light in scene.lights]
    for table, where in rigging.pairs:
        for name in table["lights"]:
            if name not in lights:
                raise _unknown("light", name, lights, where / "lights")
    for _, table, where in rigging.on:
        where_shapes = where / "shapes"
        for pattern in names_of(table["shapes"], where_shapes) if "shapes" in table else ():
            if not _shapes(pattern, scene):
                shapes = [*dict.fromkeys(scene.shape_names)]
                raise _unknown("shape", pattern, shapes, where_shapes)


def freedoms_of(rigging: Rigging, scene: Scene) -> dict[str, Freedom]:
    """Return the freedom of each light that may move, by name.

    Each key of a pattern applies to the matching lights that allow it. Raises ConstraintError for
    unknown names, and for lights that cannot move.
    """
    tables: dict[str, dict[str, Any]] = {}
    places: dict[str, SourceKey] = {}
    for name, table, where in rigging.lights:
        matches = _matches(name, scene, where / next(iter(table)) if table else where)
        for key, value in table.items():
            refused: list[SceneError] = []
            for light in matches:
                try:
                    freedom = _freedom({key: value}, light, scene, rigging, where)
                    free_light(scene, light.name, freedom)
                except SceneError as error:
                    refused.append(error)
                    continue
                tables.setdefault(light.name, {})[key] = value
                places[light.name] = where
            if len(refused) == len(matches):
                raise ConstraintError(where / key, ": ", refused[0])
    return {
        name: _freedom(table, scene.light(name), scene, rigging, places[name])
        for name, table in tables.items()
    }


def _matches(name: str, scene: Scene, where: SourceKey) -> list[Light]:
    """Return the light of that name, else all that match it as a pattern."""
    lights = [light for light in scene.lights if not light.is_fixed]
    if exact := [light for light in scene.lights if light.name == name]:
        return exact
    matches = [x for x in lights if is_pattern(name) and fnmatchcase(x.name, name)]
    if not matches:
        raise _unknown("light", name, [light.name for light in lights], where)
    return matches


def _freedom(
    table: Mapping[str, Any], light: Light, scene: Scene, rigging: Rigging, where: SourceKey
) -> Freedom:
    """Return the freedom that the keys `move`, `aim`, `cone` and `beam` give a light."""
    move = table.get("move", {})
    move = move if isinstance(move, Mapping) else {"within": move}
    places: dict[str, Any] = {}
    if "along" in move and (position := light.members[0].site.position) is not None:
        way = np.array(move["along"], dtype=float)
        way *= move["within"] / np.linalg.norm(way)
        places["line"] = (as_position(position - way), as_position(position + way))
    elif "within" in move:
        places["within"] = move["within"]
    if "box" in move:
        places["box"] = _segment(move["box"])
    if "on" in move:
        places |= _places_on(move["on"], scene, rigging, where / "move" / "on")
    return Freedom(**places, **_turns(table))


def _turns(table: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields of a freedom to turn, and to open the cone and the beam."""
    return {
        "aim": table.get("aim", False),
        "cone": table.get("cone"),
        "beam": table.get("beam", False),
    }


def _new_lights(
    table: Mapping[str, Any], where: SourceKey, scene: Scene, rigging: Rigging
) -> NewLights:
    """Return the lights that a table of `new` may add."""
    places: dict[str, Any] = {}
    if "on" in table:
        places = _places_on(table["on"], scene, rigging, where / "on")
    if "box" in table:
        places["box"] = _segment(table["box"])
    size = table.get("size")
    like = table.get("like")
    try:
        new = NewLights(
            kind=table.get("kind", "point"),
            like=like,
            count=table.get("count", 1),
            freedom=Freedom(**places, **_turns(table)),
            apart=table.get("apart", 0.0),
            in_view=table.get("in_view"),
            name=table.get("name", f"new_{like or table['kind']}"),
            size=(size, size) if isinstance(size, int | float) else size,
        )
        new_lights_of(scene, [new])
    except SceneError as error:
        raise ConstraintError(Lead(where), error) from None
    return new


def _pair(
    table: Mapping[str, Any], where: SourceKey, scene: Scene, freedoms: dict[str, Freedom]
) -> MirroredPair:
    """Return a mirrored pair; its first light has the freedom."""
    first, second = table["lights"]
    if first not in freedoms and second in freedoms:
        first, second = second, first
    try:
        pair = MirroredPair((first, second), table["mirror"])
        followers_of(scene, freedoms, [pair])
    except SceneError as error:
        raise ConstraintError(Lead(where), error) from None
    return pair


def surfaces_of(rigging: Rigging, scene: Scene) -> tuple[str, ...]:
    """Return the names of mounts for lights: rails and surfaces, then shapes with an id."""
    named = (name for name in scene.shape_names if not name.startswith("_"))
    return tuple(dict.fromkeys([*(name for name, _, _ in rigging.on), *named]))


def freedom_on(names: Sequence[str], scene: Scene, rigging: Rigging) -> Freedom:
    """Return the freedom to hang on rails, surfaces and shapes of these names.

    Raises ConstraintError for unknown names.
    """
    return Freedom(**_places_on(list(names), scene, rigging, SourceKey("", "on")))


def _places_on(names: Any, scene: Scene, rigging: Rigging, where: SourceKey) -> dict[str, Any]:
    """Return rails and surfaces of these names as fields of a freedom.

    A name is the name of a table `[on.NAME]`, or else of shapes of the scene.
    """
    tables = {name: table for name, table, _ in rigging.on}
    rails, surfaces, clear = [], list[str](), list[float]()
    for name in names_of(names, where):
        table = tables.get(name, {"shapes": [name]})
        if "line" in table:
            rails.append(_segment(table["line"]))
            continue
        clear += [table["clear"]] if table.get("clear") else []
        for pattern in names_of(table["shapes"], where):
            if not (shapes := _shapes(pattern, scene)):
                known_names = [*tables, *dict.fromkeys(scene.shape_names)]
                raise _unknown("rail, surface or shape", pattern, known_names, where)
            surfaces += shapes
    places: dict[str, Any] = {"rails": tuple(rails)} if rails else {}
    if surfaces:
        places["surfaces"] = tuple(dict.fromkeys(surfaces))
        places["clear"] = max(clear, default=None)
    return places


def _shapes(pattern: str, scene: Scene) -> list[str]:
    """Return the names of the shapes that match a pattern."""
    return [x for x in dict.fromkeys(scene.shape_names) if fnmatchcase(x, pattern)]


def _unknown(kind: str, name: str, known_names: Sequence[str], where: SourceKey) -> ConstraintError:
    """Return the error for a name that nothing of a kind has."""
    hint = with_similar_name(f"there are {some_names(known_names)}", name, known_names)
    return ConstraintError(Lead(where), f"no {kind} {name!r}; {hint}")


def _segment(ends: Sequence[Sequence[float]]) -> tuple[Position, Position]:
    return as_position(ends[0]), as_position(ends[1])
