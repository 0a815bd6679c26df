"""Signals that end a process: turned into interrupts, and held back where one would do harm."""

import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

#: From Ctrl-C; from `kill`, docker stop, Slurm and timeout; from a terminal that closes.
ENDING_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)

#: Seconds after which a lost signal is sent again.
RESEND_DELAY_S = 0.01


@contextmanager
def signals_as_interrupts(received: list[int]) -> Iterator[None]:
    """Raise KeyboardInterrupt for Ctrl-C and the like, and append the signal's number to
    `received`.

    This is for programs: a library leaves signals to the program that it is part of. Ctrl-C raises
    also where a script's shell started this process in the background and made it ignore Ctrl-C;
    other ignored signals, as under `nohup`, stay ignored.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def end(number: int, _frame: FrameType | None) -> None:
        received.append(number)
        raise KeyboardInterrupt

    previous_handlers = {
        number: signal.signal(number, end)
        for number in ENDING_SIGNALS
        if number == signal.SIGINT or signal.getsignal(number) is not signal.SIG_IGN
    }
    try:
        with _resending(received):
            yield
    finally:
        for number, handler in previous_handlers.items():
            signal.signal(number, signal.SIG_DFL if handler is None else handler)


@contextmanager
def _resending(received: list[int]) -> Iterator[None]:
    """Send a signal again if Python has dropped its KeyboardInterrupt.

    Python drops exceptions that are raised in a destructor or in the callback of a weak reference,
    and a signal may arrive just then. received: numbers of the signals that have arrived.
    """
    reported, ended, is_reporting = sys.unraisablehook, threading.Event(), False

    def send(number: int) -> None:
        while is_reporting:  # or it would be dropped again
            time.sleep(RESEND_DELAY_S)
        if not ended.wait(RESEND_DELAY_S):
            os.kill(os.getpid(), number)

    def report(dropped: Any) -> None:
        nonlocal is_reporting
        if not (received and isinstance(dropped.exc_value, KeyboardInterrupt)):
            reported(dropped)
            return
        is_reporting = True
        threading.Thread(target=send, args=(received[-1],), daemon=True).start()
        is_reporting = False

    sys.unraisablehook = report
    try:
        yield
    finally:
        sys.unraisablehook = reported
        ended.set()


@contextmanager
def interruptible_between_pieces() -> Iterator[Callable[[], None]]:
    """Hold Ctrl-C and the like back, and yield a function that lets them through.

    An interrupt inside Dr.Jit's tracing surfaces as some other error and leaves half-recorded loops
    behind; between two passes it is clean. Signals that are ignored, that end the process at once,
    or that are handled outside Python, are left alone.
    """
    # Signals arrive in the main thread; None stands for a handler that is not Python's.
    is_other_thread = threading.current_thread() is not threading.main_thread()
    previous = {
        number: signal.getsignal(number) for number in (() if is_other_thread else ENDING_SIGNALS)
    }
    handlers = {number: handler for number, handler in previous.items() if callable(handler)}
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
        # One may have arrived in the meantime.
        let_through()
