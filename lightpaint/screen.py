"""What is shown of something long: a repr of no more than one screen, a page in a notebook."""

from collections.abc import Sequence
from dataclasses import fields, is_dataclass
from importlib import import_module
from typing import Any, TypeVar, cast

#: Characters that are shown of a list, at most.
ROOM = 800

_Item = TypeVar("_Item")


def some_of(texts: Sequence[str], joint: str = ", ", room: int = ROOM) -> str:
    """As many of the texts, joined, as fit into `room` characters, and how many are left."""
    shown = ""
    for k, text in enumerate(texts):
        longer = f"{shown}{joint if k else ''}{text}"
        if len(longer) > room:
            more = f"… and {len(texts) - k} more"
            return f"{shown}{joint}{more}" if k else more
        shown = longer
    return shown


class Listed(tuple[_Item, ...]):
    """A tuple whose repr has a line for each item, as far as they fit."""

    __slots__ = ()

    def __repr__(self) -> str:
        return f"({some_of([repr(item) for item in self], joint=',' + chr(10) + ' ')})"


def shortly(value: Any) -> str:
    """The repr of a dataclass on one screen: its arrays by their shapes, and what is long cut."""
    shown = [field.name for field in fields(value) if field.repr]
    room = ROOM // len(shown)
    texts = (f"{name}={_brief(getattr(value, name), room - len(name))}" for name in shown)
    return f"{type(value).__name__}({', '.join(texts)})"


def _brief(value: Any, room: int) -> str:
    if hasattr(value, "dtype") and hasattr(value, "shape"):
        return f"{value.dtype} {value.shape}"
    text = f"{value:.4g}" if isinstance(value, float) else " ".join(repr(value).split())
    if len(text) <= room:
        return text
    return f"{type(value).__name__}(…)" if is_dataclass(value) else text[: max(room, 8) - 1] + "…"


class Shown:
    """What notebooks show as a page or as a picture.

    What draws it is upstairs, in the report, and found by its name when it is asked for: to be
    shown, a room need not know it.
    """

    __slots__ = ()

    def _repr_html_(self) -> str | None:
        return cast(str | None, import_module(_DRAWN_BY).html_of(self))

    def _repr_png_(self) -> bytes | None:
        return cast(bytes | None, import_module(_DRAWN_BY).png_of(self))


_DRAWN_BY = "lightpaint.report.notebook"
