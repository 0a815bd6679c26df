"""The thread in which a session handles requests, one at a time."""

import asyncio
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any, TypeVar

from lightpaint.progress import cancellable

_Result = TypeVar("_Result")


class SessionThread:
    """A thread for the work of one session.

    check_open: raises PaintError once the session has ended; work in progress is abandoned then.
    """

    def __init__(self, check_open: Callable[[], None]) -> None:
        self._check_open = check_open
        self._worker = ThreadPoolExecutor(1, "lightpaint-session")

    async def run(self, work: Callable[..., _Result], *arguments: Any) -> _Result:
        """Run work after all earlier work, and return its result. Raises what `check_open` does."""
        self._check_open()
        loop = asyncio.get_running_loop()
        return await loop.run_in_executor(
            self._worker, partial(self._run_while_open, work, *arguments)
        )

    async def close(self) -> None:
        """Wait for the work in progress, and drop what waits."""
        await asyncio.to_thread(self._worker.shutdown, cancel_futures=True)

    def _run_while_open(self, work: Callable[..., _Result], *arguments: Any) -> _Result:
        with cancellable(self._check_open):
            return work(*arguments)
