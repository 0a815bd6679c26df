"""Reports on the progress of long work, and a way to cancel it.

Long work reports through a plain callable, so that a terminal, a notebook and a test can all
listen; the caller chooses which. Listeners of the pipeline may receive remarks, too.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Protocol


class Progress(Protocol):
    """A callable that is called after each finished piece of work."""

    def __call__(self, label: str, done: int, total: int, unit: str = "passes") -> None:
        """Report that `done` of `total` pieces of the work named `label` are finished.

        unit: counted unit, if not passes.
        """


class Listener(Progress, Protocol):
    """A receiver of progress, remarks, stages and the state of workers."""

    def say(self, text: str) -> None:
        """Show a remark, in plain text."""

    def note(self, text: str) -> None:
        """Record a finished stage and its resources, for verbose output."""

    def at_work(self, worker: str, task: str | None) -> None:
        """Show the current task of one of several workers; None if it is idle."""


class _Silent:
    """A listener that ignores everything."""

    def __call__(self, label: str, done: int, total: int, unit: str = "passes") -> None:
        """Ignore progress."""

    def say(self, text: str) -> None:
        """Ignore a remark."""

    def note(self, text: str) -> None:
        """Ignore a stage."""

    def at_work(self, worker: str, task: str | None) -> None:
        """Ignore a worker."""


#: The listener that ignores everything.
silent = _Silent()


@dataclass(frozen=True)
class _Split:
    """A listener of four separate callables."""

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

    def at_work(self, worker: str, task: str | None) -> None:
        self.workers(worker, task)


def listener(progress: Progress) -> Listener:
    """Return `progress` as a listener; a plain callable ignores remarks and stages."""
    names = ("say", "note", "at_work")
    return _Split(progress, *(getattr(progress, name, getattr(silent, name)) for name in names))


class Interrupted(KeyboardInterrupt):
    """Ctrl-C, after finished work was saved. Its text says how to continue."""


def labelled(listen: Listener, name: str) -> Listener:
    """Return `listen` with labels that name their object: `verification of balcony`."""

    def report(label: str, done: int, total: int, unit: str = "passes") -> None:
        listen(f"{label} of {name}", done, total, unit)

    def note(text: str) -> None:
        listen.note(f"{text} of {name}")

    return _Split(report, listen.say, note, listen.at_work)


_CHECK: ContextVar[Callable[[], None]] = ContextVar("check", default=lambda: None)


@contextmanager
def cancellable(check: Callable[[], None]) -> Iterator[None]:
    """Allow the work within to be cancelled: whatever it calls runs `check` now and then.

    check: raises the exception that ends the work, from any thread that takes part in it.
    """
    token = _CHECK.set(check)
    try:
        yield
    finally:
        _CHECK.reset(token)


def cancellation_check() -> Callable[[], None]:
    """Return the function that raises if the work that this is part of was cancelled."""
    return _CHECK.get()
