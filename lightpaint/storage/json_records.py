"""Strict reading of JSON and TOML from outside: values have the expected types, or an error is
raised.
"""

import json
import math
import tomllib
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import MISSING, Field, asdict, fields, is_dataclass
from functools import cache
from types import NoneType, UnionType
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

from lightpaint.display_text import some_names
from lightpaint.sentences import SourceKey

#: Maximum length of a string in characters, and maximum number of values in a list or an object.
MAX_CHARACTERS, MAX_VALUES = 2**14, 2**17

#: Maximum of the squared number of dots in a line of TOML, summed over lines. The parser's time for
#: a dotted key grows with the square of its parts, 24 ns each.
MAX_DOTS = 10**8

#: Origins of annotations such as `int | None`; with a Literal inside it is the second.
UNIONS = (UnionType, Union)

_Record = TypeVar("_Record")

#: Returns the types of a dataclass's fields by name, once for the many records of a file.
_kinds_of: Callable[[Any], dict[str, Any]] = cache(get_type_hints)
_fields_of: Callable[[Any], tuple[Field[Any], ...]] = cache(fields)


@cache
def _parts_of(kind: Any) -> tuple[Any, tuple[Any, ...]]:
    """Return the origin and the arguments of an annotation, once for all values of a file."""
    return get_origin(kind), get_args(kind)


def strict_json(text: str) -> Any:
    """Parse JSON without Python's extensions.

    Raises ValueError for invalid JSON, NaN and Infinity, numbers beyond float64, text that is not
    Unicode (a lone surrogate), a repeated key in an object, and excessive nesting.
    """
    try:
        data = json.loads(
            text,
            object_pairs_hook=_unique_keys,
            parse_constant=_refuse_constant,
            parse_float=_finite_float,
            parse_int=_bounded_int,
        )
        if "\\u" in text:  # only an escape can produce a lone surrogate in decoded text
            json.dumps(data, ensure_ascii=False).encode()
    except RecursionError:
        raise ValueError("it is nested too deeply") from None
    except UnicodeEncodeError as error:
        raise ValueError(f"it has text that is not Unicode: {error.reason}") from None
    return data


def strict_toml(text: str) -> dict[str, Any]:
    """Parse TOML.

    Raises ValueError for invalid TOML, and for lines that would take the parser extremely long.
    """
    dots = [line.count(".") for line in text.splitlines()]
    if sum(n * n for n in dots) > MAX_DOTS:
        line = dots.index(max(dots)) + 1
        raise ValueError(f"line {line} has too many dots, {max(dots)}, for a key or names")
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise ValueError("it is nested too deeply") from None


def _unique_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    # Python's parser would silently keep the last of several equal keys.
    record = dict(pairs)
    if len(record) < len(pairs):
        raise ValueError(f"a key is repeated among {some_names(key for key, _ in pairs)}")
    return record


def _refuse_constant(text: str) -> Any:
    raise ValueError(f"{text} is not a number of JSON")


def _finite_float(text: str) -> float:
    number = float(text)
    if not math.isfinite(number):
        raise ValueError(f"{text} is too large")
    return number


def _bounded_int(text: str) -> int:
    _finite_float(text)
    return int(text)


def read_record(
    kind: type[_Record],
    data: Any,
    *,
    required: Collection[str] = (),
    others: bool = False,
    is_exact: bool = False,
) -> _Record:
    """Build the dataclass `kind` from a JSON object with its fields by name.

    Each value must match the field's annotation: an int is a whole number >= 0, and neither
    booleans nor strings are accepted as numbers. A field may be missing if it has a default and is
    not in `required`. others: whether unknown keys are ignored. is_exact: whether unknown keys are
    rejected in nested records too.
    Raises ValueError, without naming the file, and the errors of `kind` itself.
    """
    if not isinstance(data, dict):
        raise ValueError(f"{data!r} is not an object")
    kinds, values = _kinds_of(kind), dict[str, Any]()
    record_fields = _fields_of(kind)
    names = {field.name for field in record_fields}
    if not others and (unknown_keys := [key for key in data if key not in names]):
        raise ValueError(f"the key {unknown_keys[0]!r} is unknown")
    for field in record_fields:
        name = field.name
        if name in data:
            try:
                values[name] = _read(kinds[name], data[name], is_exact)
            except TypeError:
                raise ValueError(
                    f"{name} is {_expected(kinds[name])}, not {data[name]!r}"
                ) from None
        elif name in required or (field.default is MISSING and field.default_factory is MISSING):
            raise ValueError(f"the key {name} is missing")
    return kind(**values)


def fields_of(record: Any, *optional: str) -> dict[str, Any]:
    """Return a dataclass's fields for JSON by name; `optional` fields only if not at their
    default.
    """
    default = {field.name: field.default for field in fields(record)}
    return {
        name: value
        for name, value in asdict(record).items()
        if name not in optional or getattr(record, name) != default[name]
    }


def _read(kind: Any, value: Any, is_exact: bool) -> Any:
    """Return `value` converted to the annotation `kind`. Raises TypeError if it does not match."""
    outer, inner = _parts_of(kind)
    if kind is Any:
        return value
    # Types are compared exactly, since isinstance would accept True as the number 1.
    if kind is float and type(value) in (int, float):
        return float(value)
    if kind is int and type(value) is int and value >= 0:
        return value
    if kind is bool and type(value) is bool:
        return value
    if kind is str and type(value) is str and len(value) <= MAX_CHARACTERS:
        return value
    if kind is SourceKey and type(value) is str and len(value) <= MAX_CHARACTERS:
        return SourceKey.of(value)
    if outer is Literal and type(value) is str and value in inner:
        return value
    if outer in UNIONS:
        return _read_one_of(inner, value, is_exact)
    if type(value) in (list, dict) and len(value) > MAX_VALUES:
        raise ValueError(f"it lists {len(value)} values: expected at most {MAX_VALUES}")
    if outer in (tuple, Sequence) and type(value) is list:
        is_open = outer is Sequence or inner[-1] is ...
        kinds = inner[:1] * len(value) if is_open else inner
        if len(kinds) == len(value):
            return tuple(
                _read(*kind_and_value, is_exact)
                for kind_and_value in zip(kinds, value, strict=True)
            )
    if outer is Mapping and type(value) is dict:
        return {key: _read(inner[1], entry, is_exact) for key, entry in value.items()}
    if isinstance(kind, type) and is_dataclass(kind):
        return read_record(kind, value, others=not is_exact, is_exact=is_exact)
    raise TypeError


def _read_one_of(kinds: tuple[Any, ...], value: Any, is_exact: bool) -> Any:
    """Return `value` as the first matching annotation; None is tried last."""
    if value is None and NoneType in kinds:
        return None
    for kind in kinds:
        with suppress(TypeError):
            return _read(kind, value, is_exact)
    raise TypeError


def _expected(kind: Any) -> str:
    """Return the values that an annotation allows, as text."""
    outer, inner = get_origin(kind), get_args(kind)
    if outer is Literal:
        return ("one of " if inner[1:] else "") + ", ".join(map(repr, inner))
    if outer in UNIONS:
        return " or ".join(
            _expected(alternative) for alternative in inner if alternative is not NoneType
        )
    if outer in (tuple, Sequence):
        number = "" if outer is Sequence or inner[-1] is ... else f"{len(inner)} of: "
        return f"a list ({number}{_expected(inner[0])})"
    words = {
        str: "a text",
        SourceKey: "a text",
        bool: "true or false",
        float: "a number",
        int: "a whole number >= 0",
    }
    return words.get(kind, "an object")
