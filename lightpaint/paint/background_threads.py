"""Background work of a session: low-priority threads, the exact solve, and delayed writes."""

import os
import sys
import time
import traceback
from collections.abc import Callable
from contextlib import suppress
from threading import Condition, Event, Thread, current_thread, get_native_id
from typing import Any

from lightpaint.errors import LightpaintError, NothingToUndoError
from lightpaint.files import first_line
from lightpaint.paint.protocol import Message, Notice, Tone
from lightpaint.paint.store.session_file import Store

#: Seconds after a stroke before the exact solve starts.
SOLVE_DELAY_S = 0.2

#: Seconds between attempts to write.
RETRY_S = 2.0

#: Niceness of all work but strokes, on Linux, where each thread has its own.
NICENESS = 10

#: Longest wait, in seconds, for a pass of a render to end.
JOIN_TIMEOUT_S = 60.0


class StoppedError(Exception):
    """Signal that ends a task whose result is no longer needed."""


class _Loop:
    """A thread's loop that waits for something to do, until it is stopped."""

    def __init__(self, report: Callable[[Message], None]) -> None:
        self._report = report
        self._condition = Condition()
        self._is_open = True

    def stop(self) -> None:
        """End the loop."""
        with self._condition:
            self._is_open = False
            self._condition.notify_all()


class ExactSolveLoop(_Loop):
    """A thread's loop that finds the exact answer whenever the brush rests.

    solve: finds the answer and publishes it. report: receives errors.
    """

    def __init__(self, solve: Callable[[], None], report: Callable[[Message], None]) -> None:
        super().__init__(report)
        self._solve = solve
        self._has_changed = False

    def notify(self) -> None:
        """Note that the session has changed."""
        with self._condition:
            self._has_changed = True
            self._condition.notify_all()

    def run(self) -> None:
        """Solve after each change, until `stop`.

        The loop yields to strokes by abandoning its solve. A lower priority would not suffice:
        other threads would wait for a lock, or the interpreter, held by this thread while it is not
        scheduled.
        """
        while True:
            with self._condition:
                self._condition.wait_for(lambda: self._has_changed or not self._is_open)
                if not self._is_open:
                    return
                self._has_changed = False
            time.sleep(SOLVE_DELAY_S)
            with self._condition:
                if self._has_changed:
                    continue
            try:
                self._solve()
            except Exception as error:
                # A bug here must not end the session: the next stroke is answered again.
                self._report(Notice(text=error_text(error), tone="warn"))


class LatestWork(_Loop):
    """A thread's loop over the latest item given to it; earlier items are dropped.

    work: called with the item. report: receives errors.
    """

    def __init__(self, work: Callable[[Any], None], report: Callable[[Message], None]) -> None:
        super().__init__(report)
        self._work = work
        self._latest: Any = None

    def give(self, latest: Any) -> None:
        """Replace the next item; None for none."""
        with self._condition:
            self._latest = latest
            self._condition.notify_all()

    def run(self) -> None:
        """Work on given items, until `stop` or an error."""
        while True:
            with self._condition:
                self._condition.wait_for(lambda: self._latest is not None or not self._is_open)
                if not self._is_open:
                    return
                latest, self._latest = self._latest, None
            try:
                self._work(latest)
            except StoppedError:
                return
            except Exception as error:
                self._report(Notice(text=error_text(error), tone="warn"))
                return


class UnsavedRetry:
    """A thread's loop that retries writes which a full disk has refused.

    store: returns the store; None before there is one. report: receives a message with a tone when
    something cannot be written, and another once all is written.
    """

    def __init__(
        self, store: Callable[[], Store | None], report: Callable[[str, Tone], None]
    ) -> None:
        self._store, self._report = store, report
        self._is_over = Event()

    def stop(self) -> None:
        """End the loop. Closing the store reports losses."""
        self._is_over.set()

    def run(self) -> None:
        """Retry every `RETRY_S` seconds, until `stop`."""
        was_reported = False
        while not self._is_over.wait(RETRY_S):
            store = self._store()
            unsaved = None if store is None else store.flush()
            if unsaved is not None and not was_reported:
                self._report(unsaved, "warn")
            elif unsaved is None and was_reported:
                self._report("all that was painted is kept again", "info")
            was_reported = unsaved is not None


class BackgroundThreads:
    """The threads of one studio, which it joins at its end. report: receives their errors."""

    def __init__(self, report: Callable[[Message], None]) -> None:
        self._report = report
        self._threads: list[Thread] = []

    def start(self, work: Callable[[], None], name: str) -> None:
        """Run `work` in a new thread."""
        thread = Thread(target=work, name=f"lightpaint-{name}", daemon=True)
        self._threads = [old for old in self._threads if old.is_alive()] + [thread]
        thread.start()

    def start_low_priority(self, work: Callable[[], None], name: str) -> None:
        """Run `work` in a thread of low priority, and report its errors."""

        def run() -> None:
            lower_priority()
            try:
                work()
            except StoppedError:
                pass
            except Exception as error:
                self._report(Notice(text=error_text(error), tone="warn", task=name))

        self.start(run, name)

    def join_all(self) -> None:
        """Wait for all threads but the calling one, for at most `JOIN_TIMEOUT_S` seconds."""
        end_s = time.monotonic() + JOIN_TIMEOUT_S
        for thread in self._threads:
            # A thread that has not started yet, after an early Ctrl-C, cannot be joined.
            if thread is not current_thread() and thread.is_alive():
                thread.join(max(0.0, end_s - time.monotonic()))


def error_tone(error: BaseException) -> Tone:
    """Return the tone in which a page shows an error."""
    return "info" if isinstance(error, NothingToUndoError) else "warn"


def error_text(error: Exception, *, at_length: bool = True) -> str:
    """Return a message for an error.

    at_length: whether the traceback of a bug in lightpaint is printed to the terminal.
    """
    if isinstance(error, LightpaintError):
        return str(error)
    if at_length:
        traceback.print_exception(error)
    return f"this failed inside lightpaint: {type(error).__name__}: {first_line(error)}"


def lower_priority() -> None:
    """Make this thread, and those that it starts, leave the processors to more urgent ones."""
    if sys.platform == "linux":
        with suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, get_native_id(), NICENESS)
