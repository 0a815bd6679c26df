"""What ends the command line from outside: each kind of signal alike, with a word and no traceback.

A library leaves signals to the program that it is part of; this is the program.
"""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def hearing(came: list[int]) -> Iterator[None]:
    """Raise KeyboardInterrupt for Ctrl-C and the like, and add the signal's number to `came`.

    Ctrl-C is heard also where a shell that runs scripts has started this in its background, and had
    it ignored; what `nohup` and `trap` have others ignored for stays ignored.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def end(number: int, _frame: FrameType | None) -> None:
        came.append(number)
        raise KeyboardInterrupt

    numbers = [signal.SIGINT]
    numbers += [
        number
        for number in (signal.SIGTERM, signal.SIGHUP)
        if signal.getsignal(number) is not signal.SIG_IGN
    ]
    before = {number: signal.signal(number, end) for number in numbers}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, signal.SIG_DFL if handler is None else handler)
