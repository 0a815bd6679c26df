"""A lock that gives Mitsuba to one thread at a time.

Threads that used it at the same time would corrupt each other's results: what Dr.Jit records
involves all materials and lights of the process, even the materials and lights of a scene that
another thread is still loading. So threads take turns at loading and tracing, and work in pieces.
Between pieces, low-priority threads let others go first.
"""

from collections import deque
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from threading import Condition, get_ident, local
from time import monotonic

from lightpaint.signals import interruptible_between_pieces

#: Seconds of waiting after which even a low-priority thread gets a turn.
MAX_WAIT_S = 2.0


class Turns:
    """A fair, reentrant lock with two priorities.

    Threads take turns in the order of arrival. Low-priority threads wait for all others, but at
    most for MAX_WAIT_S.
    """

    def __init__(self) -> None:
        self._changed = Condition()
        self._holder: int | None = None
        self._depth = 0
        self._waiting = deque[object]()  # threads of normal priority
        self._low_priority_since: dict[
            object, float
        ] = {}  # low-priority threads, with the time since when they wait
        self._lent_count = 0  # number of threads that are lending their turn
        self._next_thread: object | None = None  # the thread whose turn it is, until it takes it
        self._thread_state = local()

    @contextmanager
    def acquired(self) -> Iterator[None]:
        """Wait for a turn, and hold it within the block."""
        if self._holder == get_ident():
            self._depth += 1
        else:
            self._take(depth=1)
        try:
            yield
        finally:
            if self._holder == get_ident():  # false if it was interrupted while its turn was lent
                self._depth -= 1
                if not self._depth:
                    self._leave()

    @contextmanager
    def low_priority(self) -> Iterator[None]:
        """Give this thread low priority within the block."""
        was_low_priority, self._thread_state.is_low_priority = self._is_low_priority, True
        try:
            yield
        finally:
            self._thread_state.is_low_priority = was_low_priority

    @property
    def is_held(self) -> bool:
        """True if this thread has the turn."""
        return self._holder == get_ident()

    @contextmanager
    def around_lending(self, entered: Callable[[], AbstractContextManager[None]]) -> Iterator[None]:
        """Enter a context while this thread's turn is lent within the block.

        The thread has its turn when it enters, and again when it leaves, unless the wait for the
        turn was interrupted.
        """
        before = self._around_lending
        self._thread_state.around_lending = entered
        try:
            yield
        finally:
            self._thread_state.around_lending = before

    @property
    def _around_lending(self) -> Callable[[], AbstractContextManager[None]]:
        return getattr(self._thread_state, "around_lending", nullcontext)

    @contextmanager
    def aside(self) -> Iterator[None]:
        """Lend this thread's turn, if it has one, to others within the block.

        This avoids a deadlock when they wait for one another. The turn of a normal thread is never
        lent to a low-priority one.
        """
        if self._holder != get_ident():
            yield
            return
        with self._around_lending(), self._lent():
            yield

    @contextmanager
    def _lent(self) -> Iterator[None]:
        depth, urgent = self._depth, not self._is_low_priority
        self._leave(urgent)
        try:
            yield
        finally:
            try:
                self._take(depth)
            finally:
                with self._changed:
                    self._lent_count -= urgent
                    self._call()

    def let_others(self) -> None:
        """Between pieces of work, make a low-priority thread wait until no other thread wants a
        turn.
        """
        if self._is_low_priority and self._waiting:
            with self.aside():
                pass

    @property
    def _is_low_priority(self) -> bool:
        return getattr(self._thread_state, "is_low_priority", False)

    def _take(self, depth: int) -> None:
        ticket = object()
        with self._changed:
            if self._is_low_priority:
                self._low_priority_since[ticket] = monotonic()
            else:
                self._waiting.append(ticket)
            try:
                self._call()
                self._changed.wait_for(lambda: self._next_thread is ticket)
                self._holder, self._depth = get_ident(), depth
            finally:
                if self._low_priority_since.pop(ticket, None) is None:
                    self._waiting.remove(ticket)
                if self._next_thread is ticket:
                    self._next_thread = None
                self._call()  # an interrupted thread must not block others

    def _call(self) -> None:
        """Choose the next thread if nobody has a turn; only once, since the choice depends on
        time.
        """
        if self._holder is None and self._next_thread is None:
            self._next_thread = self._next()
            self._changed.notify_all()

    def _next(self) -> object | None:
        """Return the ticket of the next thread; None if no thread waits."""
        low_priority_thread = next(iter(self._low_priority_since), None)
        if (
            low_priority_thread is not None
            and monotonic() - self._low_priority_since[low_priority_thread] > MAX_WAIT_S
        ):
            return low_priority_thread
        if self._waiting:
            return self._waiting[0]
        return None if self._lent_count else low_priority_thread

    def _leave(self, away: bool = False) -> None:
        with self._changed:
            self._holder, self._depth = None, 0
            self._lent_count += away
            self._call()


#: The lock of Mitsuba for all threads of this process.
MITSUBA = Turns()


@contextmanager
def tracing() -> Iterator[Callable[[], None]]:
    """Hold Mitsuba and defer Ctrl-C; yield a function that admits both, to be called between
    pieces.
    """
    with MITSUBA.acquired(), interruptible_between_pieces() as let_interrupts_through:

        def between() -> None:
            let_interrupts_through()
            MITSUBA.let_others()

        yield between
