"""Checks of the arguments of public functions, and the system's refusals in one line.

An unknown name is reported with the nearest known one. Kinds are compared only once a call has
failed, so that anything which works as an array or a mapping is one.
"""

import difflib
import inspect
import sys
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import fields
from functools import cache, wraps
from numbers import Integral, Real
from os import PathLike
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Literal, TypeVar, Union, get_args, get_origin
from weakref import WeakSet

from lightpaint.display_text import some_names
from lightpaint.errors import ArgumentError, KeywordError, LightpaintError, refusal_of

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
    if kind is Any or not isinstance(kind, type):
        return True
    if getattr(kind, "_is_protocol", False):
        return all(_has(value, name) for name in _members(kind))
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


def _members(protocol: type) -> list[str]:
    """Return the public attributes and methods that a protocol asks for."""
    bases = [base for base in protocol.__mro__ if getattr(base, "_is_protocol", False)]
    names = [x for base in bases for x in (*vars(base), *vars(base).get("__annotations__", ()))]
    return [name for name in names if not name.startswith("_")]


def _has(value: Any, name: str) -> bool:
    """Return whether a value has an attribute, without computing it."""
    return inspect.getattr_static(value, name, _has) is not _has


def _have_kind(value: Any, origin: Any, inner: tuple[Any, ...]) -> bool:
    """Return False if items of a list or values of a mapping are not of the kind `inner` says."""
    if origin in (Sequence, Collection, Iterable) and isinstance(value, str | bytes):
        return inner[0] in (str, Any)  # its letters
    if origin in (Mapping, dict) and isinstance(value, Mapping):
        return all(is_of_kind(item, inner[1]) for item in value.values())
    is_list = origin in (Sequence, Collection, list) or (origin is tuple and inner[1:] == (...,))
    if is_list and isinstance(value, list | tuple):
        return all(is_of_kind(item, inner[0]) for item in value)
    if origin is tuple and isinstance(value, list | tuple):
        return len(value) == len(inner) and all(map(is_of_kind, value, inner))
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


_Call = TypeVar("_Call", bound=Callable[..., Any])

#: Functions that explain their arguments already.
_EXPLAINED: "WeakSet[Callable[..., Any]]" = WeakSet()


def keywords(*passed_on: type) -> Callable[[_Call], _Call]:
    """Make a function, or a class and its public methods, explain arguments that they cannot take.

    It raises KeywordError for an unknown name: Python's own TypeError suggests no near name before
    3.13, and knows nothing of arguments that are passed on. An error of Python or of a library
    becomes an ArgumentError if an argument is not of the kind that its annotation says, and an
    AccessError if the system has refused a file.

    passed_on: dataclasses that the function passes its `**` on to. A function with `**` and no such
    dataclass may have any name: the function that it passes them to checks them.
    """

    def decorate(call: _Call) -> _Call:
        inner: Any = call.__init__ if isinstance(call, type) else call  # type: ignore[misc]
        parameters = inspect.signature(inner).parameters
        names = _names(parameters) | {x.name for kind in passed_on for x in fields(kind) if x.init}
        takes_any = not passed_on and any(x.kind is x.VAR_KEYWORD for x in parameters.values())

        @wraps(inner)
        def checked(*args: Any, **kwargs: Any) -> Any:
            for name in kwargs:
                if name not in names and not takes_any:
                    # Named after the function that was called, not the decorator.
                    raise _unknown(call.__qualname__, name, names) from None
            try:
                return inner(*args, **kwargs)
            except Exception as error:
                # What a nested call finds wrong is named after this one, if it came from here.
                if isinstance(error, LightpaintError) and not isinstance(error, ArgumentError):
                    raise
                if (explained := _explained(call, inner, args, kwargs, error)) is None:
                    raise
                raise explained from error

        _EXPLAINED.add(checked)
        if isinstance(call, type):
            call.__init__ = checked  # type: ignore[misc]
            _check_methods(call)
            return call
        return checked  # type: ignore[return-value]

    return decorate


def _check_methods(kind: type) -> None:
    """Make the public methods of a class, also those of our bases, explain their arguments."""
    package = __name__.split(".", 1)[0]
    ours = [base for base in kind.__mro__ if base.__module__.split(".", 1)[0] == package]
    for name in dict.fromkeys(name for base in ours for name in vars(base)):
        value = inspect.getattr_static(kind, name)
        if name.startswith("_") or getattr(value, "__func__", value) in _EXPLAINED:
            continue
        if isinstance(value, classmethod | staticmethod):
            setattr(kind, name, type(value)(keywords()(value.__func__)))
        elif inspect.isfunction(value):
            setattr(kind, name, keywords()(value))


def _names(parameters: Mapping[str, inspect.Parameter]) -> set[str]:
    """Return the names that a caller can give; `self` and `cls` are none of them."""
    kinds = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)
    return {x.name for x in parameters.values() if x.kind in kinds} - {"self", "cls"}


def _unknown(call: str, name: str, known: Collection[str]) -> KeywordError:
    similar = difflib.get_close_matches(name, sorted(known), 1)
    hint = f": did you mean {similar[0]!r}?" if similar else f"; it has {some_names(sorted(known))}"
    return KeywordError(f"{call}() has no argument {name!r}{hint}")


def _explained(
    call: Any, inner: Any, args: tuple[Any, ...], kwargs: Mapping[str, Any], error: Exception
) -> LightpaintError | None:
    """Return what an argument of a failed call has to do with it; None if nothing is known."""
    if isinstance(error, OSError) and (refusal := refusal_of(error)) is not None:
        return refusal
    try:
        bound = inspect.signature(inner).bind(*args, **kwargs)
    except TypeError as reason:
        return KeywordError(f"{call.__qualname__}() is called wrongly: {reason}")
    kinds = kinds_of(inner)
    for name, value in bound.arguments.items():
        if name in kinds and not is_of_kind(value, kinds[name]):
            return ArgumentError(
                f"{call.__qualname__}(): {name} is {describe_value(value)}, expected "
                f"{describe_kind(kinds[name])}"
            )
    return None
