"""Checks of the arguments of public functions, and the system's refusals in one line.

An unknown name is reported with the nearest known one. Kinds are compared only once a call has
failed, so that anything which works as an array or a mapping is one.
"""

import difflib
import inspect
from collections.abc import Callable, Collection, Mapping
from dataclasses import fields
from functools import wraps
from typing import Any, TypeVar

from lightpaint.argument_kinds import describe_kind, describe_value, is_of_kind, kinds_of
from lightpaint.display_text import some_names
from lightpaint.errors import ArgumentError, KeywordError, LightpaintError, refusal_of

_Call = TypeVar("_Call", bound=Callable[..., Any])


def keywords(*passed_on: type) -> Callable[[_Call], _Call]:
    """Make a function, or a class when it is called, explain arguments that it cannot take.

    It raises KeywordError for an unknown name: Python's own TypeError suggests no near name before
    3.13, and knows nothing of arguments that are passed on. An error of Python or of a library
    becomes an ArgumentError if an argument is not of the kind that its annotation says, and an
    AccessError if the system has refused a file.

    passed_on: dataclasses that the function passes its `**` on to. A function with `**` and no such
    dataclass is left alone: the function that it passes them to checks them.
    """

    def decorate(call: _Call) -> _Call:
        inner: Any = call.__init__ if isinstance(call, type) else call  # type: ignore[misc]
        parameters = inspect.signature(inner).parameters
        names = _names(parameters) | {x.name for kind in passed_on for x in fields(kind) if x.init}

        if not passed_on and any(x.kind is x.VAR_KEYWORD for x in parameters.values()):
            return call

        @wraps(inner)
        def checked(*args: Any, **kwargs: Any) -> Any:
            for name in kwargs:
                if name not in names:
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

        if isinstance(call, type):
            call.__init__ = checked  # type: ignore[misc]
            return call
        return checked  # type: ignore[return-value]

    return decorate


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
