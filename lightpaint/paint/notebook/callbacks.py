"""What a notebook's painter tells and is told: objects that are set, and callbacks that hear.

Imported only where ipywidgets is installed.
"""

import traceback
from collections.abc import Callable
from dataclasses import dataclass, field
from types import TracebackType
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import traitlets

from lightpaint.files import first_line

Told = TypeVar("Told")
Given = TypeVar("Given")


class LiveTrait(traitlets.Any, Generic[Told, Given]):  # type: ignore[misc]
    """What the session tells with `set_trait`; what is assigned to it is a wish to the session."""

    if TYPE_CHECKING:

        def __get__(self, obj: Any, cls: Any = None) -> Told: ...

    def __set__(self, obj: Any, value: Given) -> None:
        obj._assign(self.name, value)


@dataclass(frozen=True)
class Callback:
    """A function that is told of changes: whatever it does, others are told as well.

    warn: hears in one line what failed.
    """

    handler: Callable[[Any], Any]
    warn: Callable[[str], None] = field(compare=False)

    def __call__(self, change: Any) -> None:
        try:
            self.handler(change)
        except Exception as error:
            # From the callback's own line on.
            traceback.print_exception(error.with_traceback(_after_this(error)))
            said = f"{type(error).__name__}: {first_line(error)}"
            self.warn(f"a callback of painter.{change['name']} failed: {said}")


def _after_this(error: Exception) -> TracebackType | None:
    here = error.__traceback__
    return here and (here.tb_next or here)
