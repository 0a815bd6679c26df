"""Values from JSON that others wrote: just what was meant to stand there, or refused."""

import json
import math
import tomllib
from collections.abc import Collection, Mapping
from dataclasses import MISSING, asdict, fields, is_dataclass
from types import UnionType
from typing import Any, Literal, TypeVar, get_args, get_origin, get_type_hints

from lightpaint.screen import some_names

#: Longest text that is read, in characters, and most values of a list or an object.
MAX_CHARACTERS, MAX_VALUES = 2**14, 2**17

#: Most dots in a line of TOML, squared and summed over all lines: what the parser takes for a
#: dotted key goes by the square of its parts, 24 ns each.
MAX_DOTS = 10**8

_Record = TypeVar("_Record")


def strict_json(text: str) -> Any:
    """What the JSON in `text` says, and nothing that only Python understands or makes up.

    Raises ValueError for what is no JSON, for NaN and Infinity, for numbers beyond float64, for
    text that is not Unicode (half of a surrogate pair), for a key that stands twice in an object,
    and for what is nested too deeply.
    """
    try:
        data = json.loads(
            text,
            object_pairs_hook=_without_repeats,
            parse_constant=_no_number,
            parse_float=_finite,
            parse_int=_bounded,
        )
        if "\\u" in text:  # the only way by which half a pair gets into decoded text
            json.dumps(data, ensure_ascii=False).encode()
    except RecursionError:
        raise ValueError("it is nested too deeply") from None
    except UnicodeEncodeError as error:
        raise ValueError(f"it has text that is not Unicode: {error.reason}") from None
    return data


def strict_toml(text: str) -> dict[str, Any]:
    """What the TOML in `text` says.

    Raises ValueError for what is no TOML, and for lines that would take the parser forever.
    """
    dots = [line.count(".") for line in text.splitlines()]
    if sum(n * n for n in dots) > MAX_DOTS:
        line = dots.index(max(dots)) + 1
        raise ValueError(f"line {line} has too many dots, {max(dots)}, for a key or names")
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise ValueError("it is nested too deeply") from None


def _without_repeats(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    # JSON itself would silently keep the last of two of one name.
    found = dict(pairs)
    if len(found) < len(pairs):
        raise ValueError(f"a name stands twice among {some_names(key for key, _ in pairs)}")
    return found


def _no_number(text: str) -> Any:
    raise ValueError(f"{text} is no number in JSON")


def _finite(text: str) -> float:
    number = float(text)
    if not math.isfinite(number):
        raise ValueError(f"{text} is too large")
    return number


def _bounded(text: str) -> int:
    _finite(text)
    return int(text)


def read_record(
    kind: type[_Record], data: Any, *, required: Collection[str] = (), others: bool = False
) -> _Record:
    """The dataclass `kind` from an object of a JSON, its fields by name.

    Each value must be what the field's annotation says: for int a whole number >= 0, and neither
    true nor a text for any number. A field may be missing if it has a default and is not
    `required`. others: whether keys that are no fields are passed over, as in records inside
    they always are.

    Raises ValueError, without naming the file, and what `kind` itself raises.
    """
    if not isinstance(data, dict):
        raise ValueError(f"{data!r} is not an object")
    kinds, given = get_type_hints(kind), {}
    if not others and (unknown := [key for key in data if key not in kinds]):
        raise ValueError(f"nothing is called {unknown[0]!r} there")
    for field in fields(kind):  # type: ignore[arg-type]
        name = field.name
        if name in data:
            try:
                given[name] = _read(kinds[name], data[name])
            except TypeError:
                raise ValueError(f"{name} is {_meant(kinds[name])}, not {data[name]!r}") from None
        elif name in required or (field.default is MISSING and field.default_factory is MISSING):
            raise ValueError(f"it lacks {name}")
    return kind(**given)


def fields_of(record: Any, *optional: str) -> dict[str, Any]:
    """A dataclass for a JSON, its fields by name; those that are `optional` where they say more
    than by default.
    """
    default = {field.name: field.default for field in fields(record)}
    return {
        name: value
        for name, value in asdict(record).items()
        if name not in optional or getattr(record, name) != default[name]
    }


def _read(kind: Any, value: Any) -> Any:
    """`value` as the annotation `kind` has it. Raises TypeError if it is something else."""
    outer, inner = get_origin(kind), get_args(kind)
    if kind is Any:
        return value
    # Types and no isinstance: true would pass for the number 1.
    if kind is float and type(value) in (int, float):
        return float(value)
    if kind is int and type(value) is int and value >= 0:
        return value
    if kind is bool and type(value) is bool:
        return value
    if kind is str and type(value) is str and len(value) <= MAX_CHARACTERS:
        return value
    if outer is Literal and type(value) is str and value in inner:
        return value
    if outer is UnionType:  # something, or None
        return None if value is None else _read(inner[0], value)
    if type(value) in (list, dict) and len(value) > MAX_VALUES:
        raise ValueError(f"it lists {len(value)} values, and at most {MAX_VALUES} are read")
    if outer is tuple and type(value) is list:
        kinds = inner[:1] * len(value) if inner[-1] is ... else inner
        if len(kinds) == len(value):
            return tuple(map(_read, kinds, value))
    if outer is Mapping and type(value) is dict:
        return {key: _read(inner[1], one) for key, one in value.items()}
    if isinstance(kind, type) and is_dataclass(kind):
        return read_record(kind, value, others=True)
    raise TypeError


def _meant(kind: Any) -> str:
    """What an annotation asks for, in words."""
    outer, inner = get_origin(kind), get_args(kind)
    if outer is Literal:
        return ("one of " if inner[1:] else "") + ", ".join(map(repr, inner))
    if outer is UnionType:
        return _meant(inner[0])
    if outer is tuple:
        number = "" if inner[-1] is ... else f"{len(inner)} of: "
        return f"a list ({number}{_meant(inner[0])})"
    words = {str: "a text", bool: "true or false", float: "a number", int: "a whole number >= 0"}
    return words.get(kind, "an object")
