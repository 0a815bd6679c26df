"""Telling whoever waits how far long work has come, and letting them stop it.

Rooms report through a plain callable, so that a terminal, a notebook and a test can all
listen; which of them listens is the caller's choice. Who listens to the corridor may hear
remarks, too.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Protocol


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

    def note(self, text: str) -> None:
        """A stage that is done, and what was used in it: for who wants to know all."""

    def at_work(self, worker: str, what: str | None) -> None:
        """What one of several workers does now; None for nothing."""


class _Silent:
    """Listens to nothing."""

    def __call__(self, label: str, done: int, total: int, unit: str = "passes") -> None:
        """Hear no progress."""

    def say(self, text: str) -> None:
        """Hear no remark."""

    def note(self, text: str) -> None:
        """Hear no stage."""

    def at_work(self, worker: str, what: str | None) -> None:
        """Hear of no worker."""


#: Whoever does not listen.
silent = _Silent()


@dataclass(frozen=True)
class _Split:
    """Progress goes to one, remarks to another, stages to a third, what workers do to a fourth."""

    progress: Progress
    remarks: Callable[[str], None]
    stages: Callable[[str], None]
    workers: Callable[[str, str | None], None]

    def __call__(self, label: str, done: int, total: int, unit: str = "passes") -> None:
        self.progress(label, done, total, unit)

    def say(self, text: str) -> None:
        self.remarks(text)

    def note(self, text: str) -> None:
        self.stages(text)

    def at_work(self, worker: str, what: str | None) -> None:
        self.workers(worker, what)


def listener(progress: Progress) -> Listener:
    """`progress` as a listener: a plain callable lets remarks and stages pass."""
    heard = ("say", "note", "at_work")
    return _Split(progress, *(getattr(progress, name, getattr(silent, name)) for name in heard))


class Interrupted(KeyboardInterrupt):
    """Ctrl-C, after what was done has been kept. Its text says how to go on."""


def labelled(listen: Listener, name: str) -> Listener:
    """`listen` whose labels say of what: `verification of balcony`."""

    def report(label: str, done: int, total: int, unit: str = "passes") -> None:
        listen(f"{label} of {name}", done, total, unit)

    def note(text: str) -> None:
        listen.note(f"{text} of {name}")

    return _Split(report, listen.say, note, listen.at_work)


_CHECK: ContextVar[Callable[[], None]] = ContextVar("check", default=lambda: None)


@contextmanager
def while_wanted(check: Callable[[], None]) -> Iterator[None]:
    """Work that may be given up: what it calls asks `check` now and then.

    check: raises whatever is to end the work, from whichever thread takes part in it.
    """
    token = _CHECK.set(check)
    try:
        yield
    finally:
        _CHECK.reset(token)


def wanted() -> Callable[[], None]:
    """What tells, by raising, whether the work that this is part of is wanted no more."""
    return _CHECK.get()
