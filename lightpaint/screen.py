"""What is shown of something long or strange: reprs of one screen, lists cut, notebooks' pages."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import fields, is_dataclass
from importlib import import_module
from typing import Any, TypeVar, cast

#: Characters that are shown of a list, at most; and of one in a message.
ROOM, ROOM_IN_MESSAGE = 800, 300

#: What does not show itself: it steers a terminal, ends the line, or turns the order of what
#: follows. (What only joins letters, as in Persian names or in emoji, is left alone.)
_UNSEEN = re.compile(
    "[\x00-\x1f\x7f-\x9f\xad\u061c\u180e\u200b\u200e\u200f\u2028-\u202e\u2060-\u206f"
    "\ufeff\ufff9-\ufffb\U000e0000-\U000e007f\ud800-\udfff]"
)

_Item = TypeVar("_Item")


def visible(text: str) -> str:
    r"""`text` in one line, with what does not show itself as Python writes it, like `\x1b`."""
    return _UNSEEN.sub(lambda found: ascii(found[0])[1:-1], text)


def some_names(names: Iterable[str], joint: str = ", ") -> str:
    """Names as they stand in a message: as many as fit, and how many more there are."""
    return some_of([_shortened(visible(name)) for name in names], joint, ROOM_IN_MESSAGE)


def _shortened(name: str) -> str:
    return name if len(name) <= ROOM_IN_MESSAGE // 2 else f"{name[: ROOM_IN_MESSAGE // 2]}…"


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


_DRAWN_BY = "lightpaint.report.page.notebook_html"
