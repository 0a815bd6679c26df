"""The thread of a notebook's kernel, which sends the messages of all threads."""

import asyncio
import contextvars
from collections.abc import Callable


class KernelThread:
    """The event loop and context of the cell that created it; without a loop, any thread."""

    def __init__(self) -> None:
        self._loop = _running_loop()
        self._context = contextvars.copy_context()

    def call(self, act: Callable[[], None]) -> None:
        """Call `act` soon in the loop, in its context; at once without a loop."""
        if self._loop is None:
            act()
        elif not self._loop.is_closed():
            self._loop.call_soon_threadsafe(act, context=self._context)


def _running_loop() -> asyncio.AbstractEventLoop | None:
    try:
        return asyncio.get_running_loop()
    except RuntimeError:
        return None
