"""What goes on beside the brush: threads that give way to it, the exact answer, a full disk."""

import os
import sys
import time
import traceback
from collections.abc import Callable
from contextlib import suppress
from threading import Condition, Event, Thread, current_thread, get_native_id

from lightpaint.errors import LightpaintError, NothingToUndoError
from lightpaint.files import first_line
from lightpaint.paint.protocol import Message, Notice, Tone
from lightpaint.paint.store.store import Store

#: Seconds of rest after a stroke before the exact answer is looked for.
REST_S = 0.2

#: Seconds after which what could not be written is tried again.
TRY_S = 2.0

#: How much less urgent than strokes all else is, where threads can be told apart: on Linux.
NICE = 10

#: Seconds in which a pass of a render ends.
PATIENCE_S = 60.0


class StoppedError(Exception):
    """Somebody does not want it any more."""


class Settling:
    """Has the exact answer found whenever the brush rests, in a thread of its own.

    find: finds it, and says so. say: hears what goes wrong.
    """

    def __init__(self, find: Callable[[], None], say: Callable[[Message], None]) -> None:
        self._find, self._say = find, say
        self._bell = Condition()
        self._is_unsettled, self._is_open = False, True

    def ring(self) -> None:
        """Something has changed."""
        with self._bell:
            self._is_unsettled = True
            self._bell.notify_all()

    def end(self) -> None:
        """Nothing more is to be found."""
        with self._bell:
            self._is_open = False
            self._bell.notify_all()

    def settle(self) -> None:
        """Until the end.

        It gives way by giving up. Were it less urgent than others, who needs the interpreter, or a
        lock, would wait for it as long as they keep it from the processor.
        """
        while True:
            with self._bell:
                self._bell.wait_for(lambda: self._is_unsettled or not self._is_open)
                if not self._is_open:
                    return
                self._is_unsettled = False
            time.sleep(REST_S)
            with self._bell:
                if self._is_unsettled:
                    continue
            try:
                self._find()
            except Exception as error:
                # A mistake of our own ends no session: the next stroke is answered again.
                self._say(Notice(text=told(error), tone="warn"))


class Writing:
    """Tries again to write what a full disk keeps in memory, in a thread of its own.

    store: what is to be written; None before there is one. say: hears, with a tone, that it cannot
    be, and that it is.
    """

    def __init__(self, store: Callable[[], Store | None], say: Callable[[str, Tone], None]) -> None:
        self._store, self._say = store, say
        self._is_over = Event()

    def end(self) -> None:
        """Whoever closes the store says what is lost."""
        self._is_over.set()

    def watch(self) -> None:
        """Until the end."""
        is_told = False
        while not self._is_over.wait(TRY_S):
            store = self._store()
            unsaved = None if store is None else store.flush()
            if unsaved is not None and not is_told:
                self._say(unsaved, "warn")
            elif unsaved is None and is_told:
                self._say("all that was painted is kept again", "info")
            is_told = unsaved is not None


class Threads:
    """Those of one studio, which are waited for at its end. say: hears what fails in one."""

    def __init__(self, say: Callable[[Message], None]) -> None:
        self._say = say
        self._all: list[Thread] = []

    def begin(self, work: Callable[[], None], name: str) -> None:
        """Do it in a thread of its own."""
        thread = Thread(target=work, name=f"lightpaint-{name}", daemon=True)
        self._all = [one for one in self._all if one.is_alive()] + [thread]
        thread.start()

    def later(self, work: Callable[[], None], name: str) -> None:
        """The same at leisure, until somebody stops it; of what fails it is said what that was."""

        def run() -> None:
            give_way()
            try:
                work()
            except StoppedError:
                pass
            except Exception as error:
                self._say(Notice(text=told(error), tone="warn", what=name))

        self.begin(run, name)

    def wait(self) -> None:
        """Until all of them have come to an end, but for the one that asks, or patience has."""
        end_s = time.monotonic() + PATIENCE_S
        for thread in self._all:
            # Who is being started, as where Ctrl-C comes just then, cannot be waited for.
            if thread is not current_thread() and thread.is_alive():
                thread.join(max(0.0, end_s - time.monotonic()))


def tone_of(error: BaseException) -> Tone:
    """Return how a page is told of what could not be done."""
    return "info" if isinstance(error, NothingToUndoError) else "warn"


def told(error: Exception, *, at_length: bool = True) -> str:
    """What to say of it; a mistake of lightpaint's own is told at length where it was started."""
    if isinstance(error, LightpaintError):
        return str(error)
    if at_length:
        traceback.print_exception(error)
    return f"this failed inside lightpaint: {type(error).__name__}: {first_line(error)}"


def give_way() -> None:
    """Let this thread, and those that it starts, leave the processors to more urgent ones."""
    if sys.platform == "linux":
        with suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, get_native_id(), NICE)
