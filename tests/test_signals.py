"""Ctrl-C between two pieces of work, and whose handler stands meanwhile."""

import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from typing import Any

import pytest

from lightpaint.signals import interruptible_between_pieces


@pytest.fixture(autouse=True)
def _own_handler() -> Iterator[None]:
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_an_interrupt_waits_for_the_end_of_a_piece():
    steps_done = []

    def work() -> None:
        with interruptible_between_pieces() as let_through:
            let_through()
            signal.raise_signal(signal.SIGINT)
            steps_done.append("the piece")
            let_through()
            steps_done.append("another")

    with pytest.raises(KeyboardInterrupt):
        work()
    assert steps_done == ["the piece"]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_an_interrupt_in_the_last_piece_is_not_lost():
    with pytest.raises(KeyboardInterrupt), interruptible_between_pieces():
        signal.raise_signal(signal.SIGINT)


def test_an_interrupt_while_handlers_are_put_back_is_not_lost(monkeypatch: pytest.MonkeyPatch):
    """Between the last look at what has come and the handler's return there is a moment."""
    real, is_at_end = signal.signal, []

    def comes_first(number: signal.Signals, handler: Any) -> Any:
        if is_at_end:
            is_at_end.pop()
            signal.raise_signal(signal.SIGINT)
        return real(number, handler)

    def work() -> None:
        with monkeypatch.context() as patch, interruptible_between_pieces():
            patch.setattr(signal, "signal", comes_first)
            is_at_end.append(True)

    with pytest.raises(KeyboardInterrupt):
        work()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_ignored_interrupts_stay_ignored():
    """As under nohup, or in the background of a script."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with interruptible_between_pieces() as let_through:
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
        signal.raise_signal(signal.SIGINT)
        let_through()
    assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN


def test_a_handler_outside_python_is_left_alone(monkeypatch: pytest.MonkeyPatch):
    """It could not be put back: `signal.signal` does not take the None that stands for it."""
    installed: list[Any] = []
    with monkeypatch.context() as patch:
        patch.setattr(signal, "getsignal", lambda _signal: None)
        patch.setattr(signal, "signal", lambda *arguments: installed.append(arguments))
        with interruptible_between_pieces() as let_through:
            let_through()
    assert installed == []


def test_other_threads_get_no_signals():
    log = []

    def work() -> None:
        with interruptible_between_pieces() as let_through:
            let_through()
            log.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert log == [signal.default_int_handler]


def test_what_ends_a_process_otherwise_waits_too():
    """SIGTERM and SIGHUP where a handler of Python's stands; by default they end it at once."""
    signals_received: list[int] = []
    before = {
        number: signal.signal(number, lambda number, _: signals_received.append(number))
        for number in (signal.SIGTERM, signal.SIGHUP)
    }
    try:
        with interruptible_between_pieces() as let_through:
            signal.raise_signal(signal.SIGTERM)
            assert signals_received == []
            let_through()
            assert signals_received == [signal.SIGTERM]
            signal.raise_signal(signal.SIGHUP)
        assert signals_received == [signal.SIGTERM, signal.SIGHUP]
        with interruptible_between_pieces():
            assert signal.getsignal(signal.SIGINT) is not signal.default_int_handler
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        with interruptible_between_pieces():
            assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@pytest.mark.parametrize("late_s", [0.0, 0.3])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_what_comes_in_a_destructor_is_not_lost(number: signal.Signals, late_s: float) -> None:
    """Python drops exceptions that are raised there, and where they are reported.

    late_s: until a thread that is started lets go on whoever has started it, as under load.
    """
    code = f"""
import signal, sys, threading, time
from lightpaint.signals import signals_as_interrupts

start = threading.Thread.start
threading.Thread.start = lambda thread: (start(thread), time.sleep({late_s}))

class Ending:
    def __del__(self):
        signal.raise_signal({int(number)})

came = []
with signals_as_interrupts(came):
    try:
        Ending()
        time.sleep(10)
    except KeyboardInterrupt:
        sys.exit(128 + came[0])
"""
    completed = subprocess.run([sys.executable, "-c", code], check=False, capture_output=True)
    assert completed.returncode == 128 + number
    assert completed.stderr == b""
