"""What asks a process to end: heard as an interrupt, and held back where that would do harm."""

import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

#: Ctrl-C; `kill`, docker stop, Slurm, timeout; a terminal that closes.
ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)

#: Seconds after which a signal that was lost is sent again.
SOON_S = 0.01


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
        with _sent_again(came):
            yield
    finally:
        for number, handler in before.items():
            signal.signal(number, signal.SIG_DFL if handler is None else handler)


@contextmanager
def _sent_again(came: list[int]) -> Iterator[None]:
    """Send a signal again whose KeyboardInterrupt Python has dropped.

    It drops what is raised in a destructor or in the callback of a weak reference, and a signal
    may come just then. came: the signals that have been heard.
    """
    reported, over, is_reporting = sys.unraisablehook, threading.Event(), False

    def send(number: int) -> None:
        while is_reporting:  # it would be dropped again
            time.sleep(SOON_S)
        if not over.wait(SOON_S):
            os.kill(os.getpid(), number)

    def report(dropped: Any) -> None:
        nonlocal is_reporting
        if not (came and isinstance(dropped.exc_value, KeyboardInterrupt)):
            reported(dropped)
            return
        is_reporting = True
        threading.Thread(target=send, args=(came[-1],), daemon=True).start()
        is_reporting = False

    sys.unraisablehook = report
    try:
        yield
    finally:
        sys.unraisablehook = reported
        over.set()


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
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
        # One may have come until just now.
        let_through()
