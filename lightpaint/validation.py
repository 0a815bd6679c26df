"""Checks of values, each with the text of the expectation for errors."""

import math
from collections.abc import Callable, Mapping
from dataclasses import fields
from numbers import Integral, Real
from typing import Any, get_args

from lightpaint.display_text import brief
from lightpaint.errors import LightpaintError

#: A test of a value, and the text of the expectation if it fails.
Check = tuple[Callable[[Any], bool], str]


#: More than any light emits, yet small enough for sums and products in float32.
BRIGHTEST = 1e30


#: Longest name of a light, a group or a pattern for them, in characters.
MAX_NAME = 1000
#: Lights, groups, patterns or ties that a file or a message may list.
MAX_LISTED = 10_000
#: Colours that one light may mix: more than any fixture has.
MAX_PRIMARIES = 16


def parse_number(text: str | float) -> float:
    """Return the number that a text is, in the digits 0 to 9. Raises ValueError for other text.

    Python itself takes the digits of all scripts, and underscores between them.
    """
    if isinstance(text, str) and (not text.isascii() or "_" in text):
        raise ValueError(f"{text!r} is not a number of the digits 0 to 9")
    return float(text)


def parse_whole_number(text: str) -> int:
    """Return the whole number that a text is; see `parse_number`."""
    parse_number(text)
    return int(text)


def is_amount(value: float) -> bool:
    """Return whether an amount of light or emission is in the range of computations."""
    return 0 <= value <= BRIGHTEST


def is_number(value: Any) -> bool:
    """Return whether a value is an int or a float; a bool is an int to Python alone."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def check_fields(record: Any, expected: Mapping[str, Check]) -> None:
    """Raise LightpaintError for the first field of a dataclass that is not as expected.

    A field that is None by default may be None.
    """
    for field in fields(record):
        value, (is_valid, expectation) = getattr(record, field.name), expected[field.name]
        if not (is_valid(value) or (value is None and field.default is None)):
            found = repr(value) if isinstance(value, int | float | str) else brief(value)
            raise LightpaintError(f"{field.name} is {found}: expected {expectation}")


def whole(least: int, most: float = math.inf) -> Check:
    """Expect a whole number between the two."""

    # bool is an int to Python, and no number to people.
    def is_valid(value: Any) -> bool:
        return isinstance(value, Integral) and not _is_bool(value) and least <= int(value) <= most

    return is_valid, f"a whole number >= {least}" + (f", at most {most}" if most < math.inf else "")


def number(about: str, *, may_be_zero: bool = False) -> Check:
    """Expect a number > 0, or >= 0, in the range of computations. about: the quantity."""

    def is_valid(value: Any) -> bool:
        if not isinstance(value, Real) or _is_bool(value):
            return False
        return 0 < float(value) <= BRIGHTEST or (may_be_zero and value == 0)

    return is_valid, f"{about} {'>= 0' if may_be_zero else '> 0'}, at most {BRIGHTEST:g}"


def between(least: float, most: float, about: str) -> Check:
    """Expect a number between the two, `most` not included. about: the quantity."""

    def is_valid(value: Any) -> bool:
        return isinstance(value, Real) and not _is_bool(value) and least <= float(value) < most

    return is_valid, f"{about} of at least {least:g} and less than {most:g}"


def one_of(expectation: Any) -> Check:
    """Expect one of the words of a Literal."""
    words_known = get_args(expectation)
    expected = " or ".join(map(repr, words_known))
    return lambda value: isinstance(value, str) and value in words_known, expected


def a(kind: type, about: str) -> Check:
    """Expect anything of a type."""
    return lambda value: isinstance(value, kind), about


def _is_bool(value: Any) -> bool:
    return isinstance(value, bool)


SWITCH: Check = (_is_bool, "True or False")
