"""Options of the command line, declared in the annotations of the fields that they set.

    refine: Annotated[int, whole(0, 100), Option("--refine K", "render …", theme="Lights")] = 0

The type, the choices and the default of the option are as in the field. Its name in errors, its
place in `--help` and its page of the reference follow from it.
"""

from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY, dataclass, fields
from functools import cache
from inspect import get_annotations
from typing import Any, Literal

from lightpaint.validation import SWITCH, Check, checks_of

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
