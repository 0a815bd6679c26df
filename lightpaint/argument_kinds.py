"""Values compared with type annotations, and both in words, for errors."""

import inspect
import sys
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from functools import cache
from numbers import Integral, Real
from os import PathLike
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin

#: Words for the kinds of values.
_WORDS: dict[Any, str] = {
    NoneType: "None",
    bool: "True or False",
    float: "a number",
    int: "a whole number",
    str: "a text",
    Path: "a path",
    Mapping: "a mapping",
    dict: "a dict",
    Sequence: "a sequence",
    Iterable: "a sequence",
    list: "a list",
    tuple: "a tuple",
}


@cache
def kinds_of(call: Callable[..., Any]) -> dict[str, Any]:
    """Return the annotations of a function's arguments by name, as far as they are known.

    An annotation that only type checkers can read is left out, unless it is a kind of array.
    """
    from lightpaint import arrays  # late, as it needs NumPy

    kinds = {}
    namespace = {**vars(arrays), **vars(sys.modules[call.__module__])}
    for name, parameter in inspect.signature(call).parameters.items():
        kind = parameter.annotation
        if isinstance(kind, str):
            try:
                kind = eval(kind, namespace)
            except (AttributeError, NameError, SyntaxError, TypeError):
                continue
        if kind is not parameter.empty and parameter.kind not in (
            parameter.VAR_POSITIONAL,
            parameter.VAR_KEYWORD,
        ):
            kinds[name] = kind
    return kinds


def is_of_kind(value: Any, kind: Any) -> bool:
    """Return False for a value that an annotation rules out, or an item of a list or a mapping."""
    origin = get_origin(kind)
    if origin in (UnionType, Union):
        return any(is_of_kind(value, alternative) for alternative in get_args(kind))
    if origin is Literal:
        return isinstance(value, str | int)  # the function itself knows which
    if not _have_kind(value, origin, get_args(kind)):
        return False
    kind = origin or kind
    if kind is None:
        return value is None
    if not isinstance(kind, type) or getattr(kind, "_is_protocol", False):
        return True  # Any, or a protocol that no instance can be compared with
    if kind in (float, int):
        expected = Real if kind is float else Integral
        return isinstance(value, expected) and not isinstance(value, bool)
    if kind is bool:
        return isinstance(value, bool) or type(value).__name__ == "bool"  # NumPy's
    if kind is Path:
        return isinstance(value, PathLike)
    if kind is list or kind is tuple:
        return isinstance(value, list | tuple)
    if kind.__name__ == "ndarray":
        return hasattr(value, "__array__")
    return isinstance(value, kind)


def _have_kind(value: Any, origin: Any, inner: tuple[Any, ...]) -> bool:
    """Return False if items of a list or values of a mapping are not of the kind `inner` says."""
    if origin in (Sequence, Collection, Iterable) and isinstance(value, str | bytes):
        return inner[0] in (str, Any)  # its letters
    if origin in (Mapping, dict) and isinstance(value, Mapping):
        return all(is_of_kind(item, inner[1]) for item in value.values())
    is_list = origin in (Sequence, Collection, list) or (origin is tuple and inner[1:] == (...,))
    if is_list and isinstance(value, list | tuple):
        return all(is_of_kind(item, inner[0]) for item in value)
    return True


def describe_value(value: Any) -> str:
    """Return a value's kind in words: `a dict`, `an Estimate`, `None`."""
    if value is None:
        return "None"
    if isinstance(value, bool | int | float):
        return repr(value) if len(repr(value)) < 40 else "a number of many digits"
    inner = next((x for x in _items(value) if x is not None), None)
    of = "" if inner is None else f" of {type(inner).__name__}"
    return f"{_with_article(type(value).__name__)}{of}"


def _items(value: Any) -> Iterable[Any]:
    if isinstance(value, Mapping):
        return value.values()
    return value if isinstance(value, list | tuple) else ()


def describe_kind(kind: Any) -> str:
    """Return an annotation in words: `a Basis`, `a text or a path`."""
    if get_origin(kind) in (UnionType, Union):
        words = dict.fromkeys(describe_kind(alternative) for alternative in get_args(kind))
        return " or ".join(words)
    if get_origin(kind) is Literal:
        return " or ".join(map(repr, get_args(kind)))
    whole, kind = kind, get_origin(kind) or kind
    if kind is None:
        return "None"
    if getattr(kind, "__name__", "") == "ndarray":
        return "an array"
    if inner := [x for x in get_args(whole) if x is not ...]:
        of = describe_kind(inner[-1])
        return f"{_WORDS.get(kind, _with_article(kind.__name__))} of {of.split(' ', 1)[-1]}"
    return _WORDS.get(kind) or _with_article(getattr(kind, "__name__", str(kind)))


def _with_article(noun: str) -> str:
    return f"{'an' if noun[:1].lower() in 'aeiou' else 'a'} {noun}"
