"""What the repr of something long shows: no more than fits on one screen."""

from collections.abc import Sequence
from typing import TypeVar

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
