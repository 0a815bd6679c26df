"""One thread has Mitsuba at a time: two at once in one process spoil what both of them make.

What Dr.Jit records asks all materials and lights there are, also those of a scene that another
thread is still loading. So whoever loads or traces waits for whoever does, and goes on in pieces.
In between, a thread that nobody waits for lets others go first.
"""

from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Condition, get_ident, local
from time import monotonic

from lightpaint.signals import interruptible_between_pieces

#: Seconds after which even somebody at leisure gets a turn among others.
PATIENCE_S = 2.0


class Turns:
    """Turns that threads take at something, in the order in which they come.

    One that has its turn may take it again. Who is at leisure comes last, but now and then.
    """

    def __init__(self) -> None:
        self._changed = Condition()
        self._holder: int | None = None
        self._depth = 0
        self._waiting = deque[object]()  # of those that are waited for
        self._idle: dict[object, float] = {}  # those at leisure that wait, and since when
        self._away = 0  # how many of them let others go on, and come back
        self._called: object | None = None  # whose turn it is, and who has not taken it yet
        self._own = local()

    @contextmanager
    def taken(self) -> Iterator[None]:
        """Wait for a turn, and have it."""
        if self._holder == get_ident():
            self._depth += 1
        else:
            self._take(depth=1)
        try:
            yield
        finally:
            if self._holder == get_ident():  # else it was interrupted while others went on
                self._depth -= 1
                if not self._depth:
                    self._leave()

    @contextmanager
    def at_leisure(self) -> Iterator[None]:
        """Nobody waits for what this thread does meanwhile: others go first."""
        before, self._own.is_at_leisure = self._is_at_leisure, True
        try:
            yield
        finally:
            self._own.is_at_leisure = before

    @contextmanager
    def aside(self) -> Iterator[None]:
        """Let others go on meanwhile, if this thread has its turn: they may wait for one another.

        Who is at leisure does not come in between one that is not.
        """
        if self._holder != get_ident():
            yield
            return
        depth, urgent = self._depth, not self._is_at_leisure
        self._leave(urgent)
        try:
            yield
        finally:
            try:
                self._take(depth)
            finally:
                with self._changed:
                    self._away -= urgent
                    self._call()

    def let_others(self) -> None:
        """Between two pieces: whoever is at leisure waits until no other wants a turn."""
        if self._is_at_leisure and self._waiting:
            with self.aside():
                pass

    @property
    def _is_at_leisure(self) -> bool:
        return getattr(self._own, "is_at_leisure", False)

    def _take(self, depth: int) -> None:
        ticket = object()
        with self._changed:
            if self._is_at_leisure:
                self._idle[ticket] = monotonic()
            else:
                self._waiting.append(ticket)
            try:
                self._call()
                self._changed.wait_for(lambda: self._called is ticket)
                self._holder, self._depth = get_ident(), depth
            finally:
                if self._idle.pop(ticket, None) is None:
                    self._waiting.remove(ticket)
                if self._called is ticket:
                    self._called = None
                self._call()  # whoever is interrupted keeps nobody waiting

    def _call(self) -> None:
        """Say whose turn it is, if nobody has one: once, since by the clock of each who waits it
        might be another's.
        """
        if self._holder is None and self._called is None:
            self._called = self._next()
            self._changed.notify_all()

    def _next(self) -> object | None:
        """Whose turn it is, once nobody has one."""
        idle = next(iter(self._idle), None)
        if idle is not None and monotonic() - self._idle[idle] > PATIENCE_S:
            return idle
        if self._waiting:
            return self._waiting[0]
        return None if self._away else idle

    def _leave(self, away: bool = False) -> None:
        with self._changed:
            self._holder, self._depth = None, 0
            self._away += away
            self._call()


#: At Mitsuba, of all threads of this process.
MITSUBA = Turns()


@contextmanager
def tracing() -> Iterator[Callable[[], None]]:
    """Have Mitsuba, and hold Ctrl-C back; yields what lets both through between two pieces."""
    with MITSUBA.taken(), interruptible_between_pieces() as let_interrupts_through:

        def between() -> None:
            let_interrupts_through()
            MITSUBA.let_others()

        yield between
