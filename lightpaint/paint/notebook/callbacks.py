"""Traits of the notebook's painter that cells set and observe, and callbacks that may fail.

Imported only where ipywidgets is installed.
"""

import traceback
from collections.abc import Callable
from dataclasses import dataclass, field
from types import TracebackType
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import traitlets

from lightpaint.files import first_line

Readable = TypeVar("Readable")
Assignable = TypeVar("Assignable")


class LiveTrait(traitlets.Any, Generic[Readable, Assignable]):  # type: ignore[misc]
    """A trait that the session sets with `set_trait`; assignments in cells become requests."""

    if TYPE_CHECKING:

        def __get__(self, obj: Any, cls: Any = None) -> Readable: ...

    def __set__(self, obj: Any, value: Assignable) -> None:
        obj._assign(self.name, value)


@dataclass(frozen=True)
class Callback:
    """A function that observes changes; an error in it does not stop other callbacks.

    warn: receives its error in one line.
    """

    handler: Callable[[Any], Any]
    warn: Callable[[str], None] = field(compare=False)

    def __call__(self, change: Any) -> None:
        try:
            self.handler(change)
        except Exception as error:
            # The traceback begins at the callback's own line.
            traceback.print_exception(error.with_traceback(_from_caller(error)))
            text = f"{type(error).__name__}: {first_line(error)}"
            self.warn(f"a callback of painter.{change['name']} failed: {text}")


def _from_caller(error: Exception) -> TracebackType | None:
    frames = error.__traceback__
    return frames and (frames.tb_next or frames)
