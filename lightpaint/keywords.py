"""Checks of the names of keyword arguments; an unknown one is reported with the nearest known one.

The same decorator turns refusals of the system into errors of lightpaint.
"""

import difflib
import inspect
from collections.abc import Callable, Collection, Mapping
from dataclasses import fields
from functools import wraps
from typing import Any, TypeVar

from lightpaint.display_text import some_names
from lightpaint.errors import KeywordError, LightpaintError, refusal_of

_Call = TypeVar("_Call", bound=Callable[..., Any])


def keywords(*passed_on: type) -> Callable[[_Call], _Call]:
    """Make a function, or a class when it is called, raise KeywordError for an unknown argument.

    Python's own TypeError suggests no near name before 3.13, and knows nothing of arguments that
    are passed on.

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
            except OSError as error:
                if isinstance(error, LightpaintError) or (refusal := refusal_of(error)) is None:
                    raise
                raise refusal from error

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
