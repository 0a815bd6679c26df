"""Requests for lights that may move, in the terms of riggers: rails, new lights.

A lights file, the options of the command line and `Rigging.of` share keys and values. They are
checked here, once: one clear line names the key of a wrong value. docs/formats.md lists them.
"""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from lightpaint.display_text import some_of
from lightpaint.errors import ConstraintError
from lightpaint.files import one_line
from lightpaint.keywords import keywords
from lightpaint.lighting import LightConstraint, check_keys, is_pattern
from lightpaint.placement.freedom import EDGE
from lightpaint.scene import FARTHEST
from lightpaint.scene.lights.lights_file import MOVES, SceneRequests
from lightpaint.sentences import SourceKey
from lightpaint.validation import MAX_LISTED, MAX_NAME, Check, is_number, parse_number

#: A table of keys and values, and the name of its source in errors; the same with a name before it.
Table = tuple[Mapping[str, Any], SourceKey]
NamedTable = tuple[str, Mapping[str, Any], SourceKey]

#: Maximum length of an error, which may quote a long value.
MAX_MESSAGE_LENGTH = 1000

#: Kinds of new lights.
LIGHT_KINDS = ("point", "spot", "panel")

#: Keys of a light to add for its constraints.
NEW_CONSTRAINTS = ("limits", "color", "kelvin", "duv", "primaries")

#: Maximum number of lights that one table adds: a larger number is a typing error.
MAX_COUNT = 100

#: Syntax of `mirror`: a plane across an axis.
_PLANE = re.compile(r"\s*([xyz])\s*=\s*(\S+)\s*")


@keywords()
@dataclass(frozen=True)
class Rigging:
    """The freedom of lights to move, and lights to add.

    Attributes:
        lights: Name or pattern, its keys `move`, `aim` and `cone` with their values, and the name
            of their source in errors. Later entries replace the same keys of earlier ones; `of`
            puts patterns before names.
        on: Rails and surfaces in the same form: `line`, or `shapes` and maybe `clear`.
        new: Tables of lights to add.
        pairs: Tables of lights that mirror each other.

    Examples:
        >>> lp.Rigging.of({"spot_*": {"aim": 30}}, new=[{"kind": "spot", "count": 2}])
        Rigging(spot_* aim 30; new 2 spot)
    """

    lights: tuple[NamedTable, ...] = ()
    on: tuple[NamedTable, ...] = ()
    new: tuple[Table, ...] = ()
    pairs: tuple[Table, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.lights or self.new)

    def __repr__(self) -> str:
        parts = [f"{name} {_spoken(table)}" for name, table, _ in self.lights]
        parts += [f"new {t.get('count', 1)} {t.get('kind', t.get('like'))}" for t, _ in self.new]
        parts += [f"pair {' + '.join(table['lights'])}" for table, _ in self.pairs]
        return f"Rigging({some_of(parts, '; ', room=600)})"

    @classmethod
    def of(
        cls,
        light: Mapping[str, Mapping[str, Any]] | None = None,
        *,
        on: Mapping[str, Mapping[str, Any]] | None = None,
        new: Sequence[Mapping[str, Any]] = (),
        pair: Sequence[Mapping[str, Any]] = (),
        where: str = "",
    ) -> "Rigging":
        """Make a rigging from the tables of a lights file.

        light: name or pattern → its keys `move`, `aim` and `cone`. on: rails and surfaces by name.
        new, pair: lights to add; mirrored lights. where: the name of the source in errors.

        Raises ConstraintError, naming the light, the key and what is expected.
        """
        source = SourceKey(where)
        lights = []
        for name, table in _table(light, source / "light").items():
            key = source / "light" / name
            check_keys(table, MOVES, key)
            if "move" in table:
                _check_places(table["move"], key / "move")
            _check_values(table, TURNS, key)
            lights.append((name, dict(table), key))
        lights.sort(key=lambda entry: not is_pattern(entry[0]))
        named = []
        for name, table in _table(on, source / "on").items():
            key = source / "on" / name
            _check_on(table, key)
            named.append((name, dict(table), key))
        added = _tables(new, source / "new")
        for table, place in added:
            _check_new(table, place)
        pairs = _tables(pair, source / "pair")
        for table, place in pairs:
            _check_pair(table, place)
        return cls(lights=tuple(lights), on=tuple(named), new=added, pairs=pairs)

    def and_then(self, others: "Rigging") -> "Rigging":
        """Return this rigging with `others`, whose rails, surfaces and keys take precedence."""
        return Rigging(
            lights=tuple(x for x in self.lights if x not in others.lights) + others.lights,
            on=tuple(x for x in self.on if x not in others.on) + others.on,
            new=tuple(x for x in self.new if x not in others.new) + others.new,
            pairs=tuple(x for x in self.pairs if x not in others.pairs) + others.pairs,
        )


def rigging_of(requests: SceneRequests) -> Rigging:
    """Return the rigging that the keys of a lights file describe. Raises ConstraintError."""
    keys = requests.keys
    light = keys.get("light")
    if isinstance(light, Mapping):
        light = {
            name: {key: value for key, value in table.items() if key in MOVES}
            for name, table in light.items()
            if isinstance(table, Mapping) and any(key in MOVES for key in table)
        }
    else:
        light = None  # constraints_file.py reports the error
    try:
        return Rigging.of(
            light,
            on=keys.get("on"),
            new=keys.get("new", ()),
            pair=keys.get("pair", ()),
            where=requests.source,
        )
    except ConstraintError as error:
        raise ConstraintError(one_line(error.sentence, limit=MAX_MESSAGE_LENGTH)) from None


def _table(value: Any, where: SourceKey) -> Mapping[str, Any]:
    if value is None:
        return {}
    if not isinstance(value, Mapping) or not all(isinstance(x, Mapping) for x in value.values()):
        raise ConstraintError(where, f" is {value!r}: expected tables [{where.path}.NAME]")
    if len(value) > MAX_LISTED:
        raise ConstraintError(where, f" has {len(value)} names: at most {MAX_LISTED} are read")
    return value


def _tables(value: Any, where: SourceKey) -> tuple[Table, ...]:
    is_list = isinstance(value, Sequence) and not isinstance(value, str)
    if not is_list or not all(isinstance(table, Mapping) for table in value):
        raise ConstraintError(where, f" is {value!r}: expected tables [[{where.path}]]")
    if len(value) > MAX_LISTED:
        raise ConstraintError(where, f" lists {len(value)}: at most {MAX_LISTED} are read")
    several = len(value) > 1
    return tuple((dict(table), where / k if several else where) for k, table in enumerate(value, 1))


def _spoken(table: Mapping[str, Any]) -> str:
    return ", ".join(f"{key} {_text(value)}" for key, value in table.items())


def _text(value: Any) -> str:
    if isinstance(value, Mapping):
        return _spoken(value)
    if isinstance(value, Sequence) and not isinstance(value, str):
        return " ".join(map(_text, value))
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return f"{value:g}" if is_number else str(value)


def _is_name(value: Any) -> bool:
    return isinstance(value, str) and 0 < len(value) <= MAX_NAME


def _is_list(value: Any, count: int) -> bool:
    return isinstance(value, Sequence) and not isinstance(value, str) and len(value) == count


def _is_point(value: Any) -> bool:
    return _is_list(value, 3) and all(is_number(x) and abs(x) <= FARTHEST for x in value)


def _is_segment(value: Any) -> bool:
    return _is_list(value, 2) and all(map(_is_point, value))


def _is_range(value: Any, least: float) -> bool:
    """Return whether it is two angles in degrees, above `least`."""
    return _is_list(value, 2) and all(map(is_number, value)) and least < value[0] <= value[1] < 90


def _are_names(value: Any) -> bool:
    listed = (value,) if isinstance(value, str) else value
    is_list = isinstance(listed, Sequence) and 0 < len(listed) <= MAX_LISTED
    return is_list and all(map(_is_name, listed))


def _are_sides(value: Any) -> bool:
    sides = [value, value] if is_number(value) else value
    return (
        _is_list(sides, 2) and all(map(is_number, sides)) and 0 < sides[0] <= sides[1] <= FARTHEST
    )


_NAME = Check(_is_name, "the name of a light")
_NAMES = Check(_are_names, 'a name or a list of names, ["a", "b"]')
_BOX = Check(_is_segment, "two corners, [[x, y, z], [x, y, z]]")

#: Keys of permitted places.
PLACES = {
    "within": Check(lambda x: is_number(x) and 0 < x <= FARTHEST, "a distance > 0, like 1.0"),
    "box": _BOX,
    "along": Check(lambda x: _is_point(x) and any(x), "a direction, like [0, 0, 1]"),
    "on": _NAMES,
}
#: Keys of a rail or surface.
RAILS = {
    "line": Check(
        lambda x: _is_segment(x) and list(x[0]) != list(x[1]),
        "two different points, [[x, y, z], [x, y, z]]",
    ),
    "shapes": _NAMES,
    "clear": Check(
        lambda x: is_number(x) and 0 <= x <= FARTHEST, "the distance from the surface, like 0.1"
    ),
}
#: Keys of a light's directions, cone and beam.
TURNS = {
    "aim": Check(
        lambda x: isinstance(x, bool) or (is_number(x) and 0 < x <= 180),
        "degrees from 0 to 180, or true for any direction",
    ),
    "cone": Check(lambda x: _is_range(x, 1), "two angles, from 1 to 90 degrees, like [10, 45]"),
    "beam": Check(
        lambda x: isinstance(x, bool) or _is_range(x, EDGE),
        f"two angles, from {EDGE:g} to 90 degrees, like [5, 20], or true for any in the cone",
    ),
}
#: Keys of a light to add, for its place and pose.
NEW_LIGHTS = {
    "kind": Check(lambda x: x in LIGHT_KINDS, f"one of {', '.join(LIGHT_KINDS)}"),
    "like": _NAME,
    "name": _NAME,
    "count": Check(
        lambda x: type(x) is int and 1 <= x <= MAX_COUNT, f"a whole number from 1 to {MAX_COUNT}"
    ),
    "on": _NAMES,
    "box": _BOX,
    "apart": Check(lambda x: is_number(x) and 0 <= x <= FARTHEST, "a distance >= 0, like 0.5"),
    "in_view": Check(lambda x: isinstance(x, bool), "true or false"),
    "size": Check(_are_sides, "the smallest and the largest side, like [0.3, 0.6]"),
    **TURNS,
}


def _check_values(table: Mapping[str, Any], checks: Mapping[str, Check], where: SourceKey) -> None:
    """Raise ConstraintError for the first invalid value of a key that has a check."""
    for key, check in checks.items():
        if key in table and not check.is_valid(table[key]):
            raise _wrong(where / key, table[key], check.expectation)


def _check_on(table: Mapping[str, Any], where: SourceKey) -> None:
    """Raise ConstraintError unless it is a rail, or a surface of shapes."""
    check_keys(table, RAILS, where)
    if ("line" in table) == ("shapes" in table):
        raise ConstraintError(
            where,
            f" has {'both line and' if 'line' in table else 'neither line nor'} shapes: "
            "expected line, two points of a rail, or shapes, a list of names",
        )
    _check_values(table, RAILS, where)
    if {"line", "clear"} <= table.keys():
        raise ConstraintError(where / "clear", " is for shapes: a rail hangs where its line is")


def _check_new(table: Mapping[str, Any], where: SourceKey) -> None:
    """Raise ConstraintError unless it describes lights to add."""
    check_keys(table, (*NEW_LIGHTS, *NEW_CONSTRAINTS), where)
    if ("kind" in table) == ("like" in table):
        raise ConstraintError(
            where,
            f" has {'both kind and' if 'kind' in table else 'neither kind nor'} like: "
            f"expected kind, {', '.join(LIGHT_KINDS)}, or like, the name of a light",
        )
    _check_values(table, {"kind": NEW_LIGHTS["kind"]}, where)
    kind = table.get("kind", "")
    if "on" in table and "box" in table:
        raise ConstraintError(where, " has both on and box: leave one out")
    if "size" in table and kind not in ("panel", ""):
        raise ConstraintError(where / "size", f" is for panels: a {kind} has no size")
    for key in ("cone", "beam"):
        if kind in ("point", "panel") and key in table:
            raise ConstraintError(where, f" has the key {key!r}: a {kind} has none")
    if kind == "point" and "aim" in table:
        raise ConstraintError(where, " has the key 'aim': a point light points nowhere")
    _check_values(table, NEW_LIGHTS, where)
    LightConstraint.of(constraint_of(table), where=where)


def constraint_of(table: Mapping[str, Any]) -> dict[str, Any]:
    """Return the constraint keys of a light to add."""
    return {key: value for key, value in table.items() if key in NEW_CONSTRAINTS}


def _check_pair(table: Mapping[str, Any], where: SourceKey) -> None:
    """Raise ConstraintError unless it names two lights and a plane between them."""
    check_keys(table, ("lights", "mirror"), where)
    lights: Any = table.get("lights")
    if not (_is_list(lights, 2) and all(map(_is_name, lights)) and lights[0] != lights[1]):
        raise _wrong(where / "lights", lights, 'the names of two lights, ["left", "right"]')
    mirror_of(table.get("mirror"), where / "mirror")


def mirror_of(value: Any, where: SourceKey) -> tuple[int, float]:
    """Return the axis, 0 to 2, and the coordinate of a plane like `x = 0`."""
    match = _PLANE.fullmatch(value) if isinstance(value, str) and len(value) < MAX_NAME else None
    try:
        at = parse_number(match[2]) if match else math.nan
    except ValueError:
        at = math.nan
    if match is None or not abs(at) <= FARTHEST:
        raise _wrong(where, value, 'a plane like "x = 0"')
    return "xyz".index(match[1]), at


def names_of(value: Any, where: SourceKey) -> tuple[str, ...]:
    """Return a name, or a list of names."""
    if not _are_names(value):
        raise _wrong(where, value, _NAMES.expectation)
    return (value,) if isinstance(value, str) else tuple(value)


def _check_places(value: Any, where: SourceKey) -> None:
    """Raise ConstraintError unless it describes permitted places."""
    if is_number(value):
        value = {"within": value}
    if not isinstance(value, Mapping):
        raise _wrong(where, value, "a distance, like 1.0, or a table, { within = 1.0 }")
    check_keys(value, PLACES, where)
    given_keys = [key for key in PLACES if key in value]
    if given_keys not in (["within"], ["box"], ["on"], ["within", "along"]):
        raise ConstraintError(
            where,
            f" has {' and '.join(given_keys) or 'nothing'}: expected one of within, box, "
            "on, along and within",
        )
    _check_values(value, PLACES, where)


def _wrong(where: SourceKey, value: Any, expected: str) -> ConstraintError:
    return ConstraintError(where, f" is {one_line(repr(value))}: expected {expected}")
