"""What asks a process to end: heard as an interrupt, and held back where that would do harm."""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

#: Ctrl-C; `kill`, docker stop, Slurm, timeout; a terminal that closes.
ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@contextmanager
def hearing(came: list[int]) -> Iterator[None]:
    """Raise KeyboardInterrupt for Ctrl-C and the like, and add the signal's number to `came`.

    For a program, since a library leaves signals to the program that it is part of. Ctrl-C is
    heard also where a script's shell has started this in its background, and had it ignored; other
    signals that are ignored, as `nohup` has it, stay so.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def end(number: int, _frame: FrameType | None) -> None:
        came.append(number)
        raise KeyboardInterrupt

    before = {
        number: signal.signal(number, end)
        for number in ENDING
        if number == signal.SIGINT or signal.getsignal(number) is not signal.SIG_IGN
    }
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, signal.SIG_DFL if handler is None else handler)


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
