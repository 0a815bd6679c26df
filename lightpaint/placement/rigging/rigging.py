"""Requests for lights that may move, in the terms of riggers: rails, new lights.

A lights file, the options of the command line and `Rigging.of` share keys and values. They are
checked here, once; docs/formats.md lists them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from lightpaint.display_text import some_of
from lightpaint.errors import ConstraintError
from lightpaint.files import one_line
from lightpaint.keywords import keywords
from lightpaint.lighting.constraints.constraints import is_pattern
from lightpaint.placement.rigging.rigging_values import (
    check_move,
    check_new,
    check_on,
    check_pair,
)
from lightpaint.scene.lights.lights_file import MOVES, SceneRequests
from lightpaint.sentences import SourceKey
from lightpaint.validation import MAX_LISTED

#: A table of keys and values, and the name of its source in errors; the same with a name before it.
Table = tuple[Mapping[str, Any], SourceKey]
NamedTable = tuple[str, Mapping[str, Any], SourceKey]

#: Maximum length of an error, which may quote a long value.
MAX_MESSAGE_LENGTH = 1000


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
    @keywords()
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
            check_move(table, key)
            lights.append((name, dict(table), key))
        lights.sort(key=lambda entry: not is_pattern(entry[0]))
        named = []
        for name, table in _table(on, source / "on").items():
            key = source / "on" / name
            check_on(table, key)
            named.append((name, dict(table), key))
        added = _tables(new, source / "new")
        for table, place in added:
            check_new(table, place)
        pairs = _tables(pair, source / "pair")
        for table, place in pairs:
            check_pair(table, place)
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
