"""Checks of values, each with the text of the expectation for errors, its JSON schema and, where it
is declared in the annotation of a field, its option of the command line.

A field of a record says what it takes in its annotation: `bool` and `Literal` by themselves,
anything else by `Annotated[int | None, whole(2, 64)]`.

    refine: Annotated[int, whole(0, 100), Option("--refine K", "render …", theme="Lights")] = 0

The type, the choices and the default of the option are the field's. Its name in errors, its
place in `--help` and its page of the reference follow from it.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY, dataclass, field, fields
from functools import cache
from inspect import get_annotations
from numbers import Integral, Real
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

from lightpaint.display_text import brief
from lightpaint.errors import LightpaintError

#: Maximum number of pixels of a film, and maximum samples per pixel: larger ones are typing errors.
MAX_PIXELS, MAX_SPP = 2**28, 2**20

#: Most texels of an image: each is a light with pictures of its own.
MAX_TEXELS = 4096

#: Purposes of options, in the order in which `--help` shows them.
Theme = Literal[
    "Painting",
    "What the painting means",
    "Lights",
    "Scene and camera",
    "How much to render",
    "Verification",
    "Shots, looks and advice",
    "Looks",
    "Machines",
    "Console",
    "Page",
    "Results",
]

#: More than any light emits, yet small enough for sums and products in float32.
BRIGHTEST = 1e30

#: Longest name of a light, a group or a pattern for them, in characters.
MAX_NAME = 1000

#: Lights, groups, patterns or ties that a file or a message may list.
MAX_LISTED = 10_000

#: Colours that one light may mix: more than any fixture has.
MAX_PRIMARIES = 16


@dataclass(frozen=True)
class Check:
    """A test of a value.

    expectation: text of what was expected, for errors. schema: JSON schema of valid values; empty
    for values that JSON does not have. unit: of a number; "" without one.
    """

    is_valid: Callable[[Any], bool]
    expectation: str
    schema: Mapping[str, Any] = field(default_factory=dict)
    unit: str = ""


def parse_number(text: str | float) -> float:
    """Return the number that a text in the digits 0 to 9 stands for. Raises ValueError for others.

    Python itself takes the digits of all scripts, and underscores between them.
    """
    if isinstance(text, str) and (not text.isascii() or "_" in text):
        raise ValueError(f"{text!r} is not a number of the digits 0 to 9")
    return float(text)


def parse_whole_number(text: str) -> int:
    """Return the whole number that a text is; see `parse_number`."""
    parse_number(text)
    return int(text)


def parse_share(text: str) -> float:
    """Return the share that a text is, `2%` or `0.02`. Raises ValueError for other text."""
    number_text = text.strip().removesuffix("%")
    try:
        return parse_number(number_text) / (1 if number_text == text.strip() else 100)
    except ValueError:
        raise ValueError(f"{text!r} is not a share like 2% or 0.02") from None


def is_amount(value: float) -> bool:
    """Return whether an amount of light or emission is in the range of computations."""
    return 0 <= value <= BRIGHTEST


def is_number(value: Any) -> bool:
    """Return whether a value is an int or a float; a bool is an int to Python alone."""
    return isinstance(value, int | float) and not isinstance(value, bool)


@cache
def checks_of(kind: Any) -> Mapping[str, Check]:
    """Return the check of each field of a dataclass, as its annotation says it."""
    hints = get_type_hints(kind, include_extras=True)
    return {x.name: _check_of(hints[x.name]) for x in fields(kind)}


def _check_of(hint: Any) -> Check:
    if get_origin(hint) is Annotated:
        hint, *said = get_args(hint)
        if checks := [x for x in said if isinstance(x, Check)]:
            return checks[0]
    if get_origin(hint) in (UnionType, Union):  # of one kind and None
        [hint] = (x for x in get_args(hint) if x is not NoneType)
    if hint is bool:
        return SWITCH
    if get_origin(hint) is Literal:
        return one_of(hint)
    raise TypeError(f"{hint!r} does not say which values it takes")


def check_fields(record: Any) -> None:
    """Raise LightpaintError for the first field of a dataclass with a value that it does not take.

    A field that is None by default may be None.
    """
    checks = checks_of(record.__class__)
    for field_ in fields(record):
        value, check = getattr(record, field_.name), checks[field_.name]
        if not (check.is_valid(value) or (value is None and field_.default is None)):
            found = repr(value) if isinstance(value, int | float | str) else brief(value)
            raise LightpaintError(f"{field_.name} is {found}: expected {check.expectation}")


def whole(least: int, most: float = math.inf) -> Check:
    """Expect a whole number between the two."""

    # bool is an int to Python, and no number to people.
    def is_valid(value: Any) -> bool:
        return isinstance(value, Integral) and not _is_bool(value) and least <= int(value) <= most

    expectation, schema = f"a whole number >= {least}", {"type": "integer", "minimum": least}
    if most == math.inf:
        return Check(is_valid, expectation, schema)
    return Check(is_valid, f"{expectation}, at most {most}", {**schema, "maximum": most})


def number(unit: str = "", *, about: str = "", may_be_zero: bool = False) -> Check:
    """Expect a number > 0, or >= 0, in the range of computations.

    unit: of the quantity. about: the quantity, if it has no unit.
    """

    def is_valid(value: Any) -> bool:
        if not isinstance(value, Real) or _is_bool(value):
            return False
        return 0 < float(value) <= BRIGHTEST or (may_be_zero and value == 0)

    expectation = f"{unit or about} {'>= 0' if may_be_zero else '> 0'}, at most {BRIGHTEST:g}"
    least = {"minimum" if may_be_zero else "exclusiveMinimum": 0}
    schema = {"type": "number", **least, "maximum": BRIGHTEST}
    return Check(is_valid, expectation, schema, unit)


def between(least: float, most: float, about: str) -> Check:
    """Expect a number between the two, `most` not included. about: the quantity."""

    def is_valid(value: Any) -> bool:
        return isinstance(value, Real) and not _is_bool(value) and least <= float(value) < most

    expectation = f"{about} of at least {least:g} and less than {most:g}"
    schema = {"type": "number", "minimum": least, "exclusiveMaximum": most}
    return Check(is_valid, expectation, schema)


def one_of(expectation: Any) -> Check:
    """Expect one of the words of a Literal."""
    words_known = get_args(expectation)
    return Check(
        lambda value: isinstance(value, str) and value in words_known,
        " or ".join(map(repr, words_known)),
        {"enum": [*words_known]},
    )


def a(kind: type, about: str) -> Check:
    """Expect anything of a type."""
    schema = {"type": _JSON_TYPES[kind]} if kind in _JSON_TYPES else {}
    return Check(lambda value: isinstance(value, kind), about, schema)


#: Names of types in JSON.
_JSON_TYPES = {str: "string", list: "array", dict: "object"}


def _is_bool(value: Any) -> bool:
    return isinstance(value, bool)


def check_shape(
    name: str,
    array: Any,
    expected: tuple[int, ...],
    axes: str,
    *,
    error: type[LightpaintError] = LightpaintError,
) -> None:
    """Raise `error` for an array of another shape. axes: what they are, in words."""
    import numpy as np  # late: most checks are of plain values

    if (shape := np.shape(array)) != expected:
        raise error(f"{name} of the shape {shape}: expected {expected}, {axes}")


SWITCH = Check(_is_bool, "True or False", {"type": "boolean"})


@dataclass(frozen=True)
class Option:
    """An option of the command line that sets a field.

    usage: the name, and what stands for a value that is not one of a few words: `--spp N`. The
    option of a switch turns it from its default: one that is True by default has a name like
    `--no-verify`; one that is None by default gets a second option, with `no`. help: what it does,
    in a clause. theme: what it is for. default: the default in words. bare: the value if the option
    is given without one; None if that is an error. least: the smallest number that may be given, if
    the field takes smaller ones. parse: makes the value from the option's text, or raises
    ValueError in words; if None, the field's check says how.
    """

    usage: str
    help: str
    _: KW_ONLY
    theme: Theme
    default: str = ""
    bare: Any = None
    least: int | None = None
    parse: Callable[[str], Any] | None = None

    @property
    def name(self) -> str:
        """Its name, with dashes."""
        return self.usage.partition(" ")[0]

    @property
    def metavar(self) -> str | None:
        """The name of its value in the help; None for a switch, or for one of a few words."""
        return self.usage.partition(" ")[2] or None


@dataclass(frozen=True)
class FieldOption:
    """The option of a field, with the field's name, default value and check."""

    field: str
    default: Any
    check: Check
    option: Option

    @property
    def name_of_false(self) -> str:
        """The option that switches the field off; "" if it has a value, or is off by default."""
        if self.check is not SWITCH or self.default is False:
            return ""
        return self.option.name if self.default else f"--no-{self.option.name.removeprefix('--')}"


@cache
def options_of(record: type) -> Mapping[str, FieldOption]:
    """Return the options that the fields of a dataclass declare, by the names of the fields."""
    annotations: dict[str, Any] = {}
    for kind in reversed(record.__mro__):
        annotations |= get_annotations(kind)
    defaults = {x.name: x.default for x in fields(record)}
    return {
        name: FieldOption(name, defaults[name], checks_of(record)[name], option)
        for name, annotation in annotations.items()
        for option in getattr(annotation, "__metadata__", ())
        if isinstance(option, Option)
    }
