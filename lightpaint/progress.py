"""Telling whoever waits how far long work has come, and letting them stop it.

Rooms report through a plain callable, so that a terminal, a notebook and a test can all
listen; which of them listens is the caller's choice. Who listens to the corridor may hear
remarks, too.
"""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Protocol

#: What asks a process to end: Ctrl-C; `kill`, docker stop, Slurm, timeout; a closing terminal.
ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class Progress(Protocol):
    """Called after each finished piece of work."""

    def __call__(self, label: str, done: int, total: int, unit: str = "passes") -> None:
        """`done` of `total` pieces of the work named `label` are finished.

        unit: what is counted; given only where it is not passes.
        """


class Listener(Progress, Protocol):
    """Hears how far the work has come, and what is worth knowing of it."""

    def say(self, text: str) -> None:
        """A remark, in plain text."""


class _Silent:
    """Listens to nothing."""

    def __call__(self, label: str, done: int, total: int, unit: str = "passes") -> None:
        """Hear no progress."""

    def say(self, text: str) -> None:
        """Hear no remark."""


#: Whoever does not listen.
silent = _Silent()


@dataclass(frozen=True)
class _Split:
    """Progress goes to one, remarks to another."""

    progress: Progress
    remarks: Callable[[str], None]

    def __call__(self, label: str, done: int, total: int, unit: str = "passes") -> None:
        self.progress(label, done, total, unit)

    def say(self, text: str) -> None:
        self.remarks(text)


def listener(progress: Progress) -> Listener:
    """`progress` as a listener: a plain callable lets remarks pass."""
    return _Split(progress, getattr(progress, "say", silent.say))


class Interrupted(KeyboardInterrupt):
    """Ctrl-C, after what was done has been kept. Its text says how to go on."""


def labelled(listen: Listener, name: str) -> Listener:
    """`listen` whose labels say of what: `verification of balcony`."""

    def report(label: str, done: int, total: int, unit: str = "passes") -> None:
        listen(f"{label} of {name}", done, total, unit)

    return _Split(report, listen.say)


@contextmanager
def interruptible_between_pieces() -> Iterator[Callable[[], None]]:
    """Hold Ctrl-C and the like back, and yield a function that lets them through.

    An interrupt inside Dr.Jit's tracing surfaces as some other error and leaves half-recorded
    loops behind; between two passes it is clean. A signal that is ignored, that ends the process
    at once, or that a program around this one handles outside Python, is left alone.
    """
    # Signals arrive in the main thread; None stands for a handler that is not Python's.
    elsewhere = threading.current_thread() is not threading.main_thread()
    found = {number: signal.getsignal(number) for number in (() if elsewhere else ENDING)}
    handlers = {number: its for number, its in found.items() if callable(its)}
    pending: list[int] = []

    def let_through() -> None:
        while pending:
            number = pending.pop(0)
            handlers[signal.Signals(number)](number, None)

    for number in handlers:
        signal.signal(number, lambda number, _frame: pending.append(number))
    try:
        yield let_through
        let_through()
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
