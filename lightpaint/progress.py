"""Reports on the progress of long work, and a way to cancel it.

Long work reports through a plain callable, so that a terminal, a notebook and a test can all
listen; the caller chooses which. Listeners of the pipeline may receive remarks, too.

Loops deep inside a computation know no listener. They count their steps (`with_progress`), and the
`stage` that they belong to, which the pipeline opens, reports them: `solving: 12 of 40 blocks`.
"""

import math
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from threading import Lock
from typing import Protocol, TypeVar

from lightpaint.sentences import Sentence

#: For stages that cannot be shortened.
NO_ADVICE = Sentence()

Step = TypeVar("Step")

#: Seconds that a stage lasts before it reports: a shorter one needs no progress.
QUIET_S = 1.0

#: Seconds beyond which a stage announces how long it takes, and the share of a loop's steps from
#: which this is estimated.
LONG_S, ESTIMATE_SHARE = 60.0, 0.05


class Progress(Protocol):
    """A callable that is called after each finished piece of work.

    Calls may come from any thread, one at a time.
    """

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


class Pace:
    """The pace of counted work, from which the time that is left follows.

    first: number of its steps that were done before.
    """

    def __init__(self, first: int = 0) -> None:
        self._first, self._begin_s = first, time.monotonic()

    def left_s(self, done: int, total: int) -> float | None:
        """Return the seconds that the remaining steps will take; None before the first is done."""
        steps = done - self._first
        return (time.monotonic() - self._begin_s) * (total - done) / steps if steps > 0 else None


def spoken_duration(seconds: float) -> str:
    """Return a duration as people say it, rounded up: `12 s`, `3 min`, `5 h`."""
    if seconds < 120:
        return f"{math.ceil(seconds)} s"
    return f"{math.ceil(seconds / 60)} min" if seconds < 7200 else f"{math.ceil(seconds / 3600)} h"


class Announcement:
    """The remark on work of more than a minute, made once, when a share of its steps is done.

    advice: how to skip or shorten it, like ` (report=False skips it)`.
    """

    def __init__(self, label: str, advice: Sentence) -> None:
        self._label, self._advice, self._is_made = label, advice, False

    def remark(self, spent_s: float, left_s: float | None, share: float) -> Sentence | None:
        """Return the remark if it is to be made now. share: of the steps that are done."""
        if left_s is None or share < ESTIMATE_SHARE:
            return None
        return self.of(spent_s + left_s)

    def of(self, expected_s: float, advice: Sentence = NO_ADVICE) -> Sentence | None:
        """Return the remark on work of so many seconds, if it is to be made.

        advice: instead of the advice on all work of this label.
        """
        if self._is_made or expected_s <= LONG_S:
            return None
        self._is_made = True
        duration = spoken_duration(expected_s)
        is_plural = self._label.endswith("s") and not self._label.endswith("sis")
        verb = "take" if is_plural else "takes"
        return Sentence(f"{self._label} {verb} {duration} or more", advice or self._advice)


class _Stage:
    """A stage of a longer work, which reports the loops within it.

    Loops may run within each other and side by side; the one that began first is reported.
    """

    def __init__(
        self, label: str, listen: Listener, advice: Sentence, voice: "Lock | None" = None
    ) -> None:
        self.label, self.listen, self.advice = label, listen, advice
        #: Held while the listener is called, which need not know about threads.
        self.voice = Lock() if voice is None else voice
        self._begin_s, self._announcement = time.monotonic(), Announcement(label, advice)
        #: Held by the loop that is reported.
        self.turn = Lock()
        #: That loop: its pace, the steps that are done, all steps, and their unit.
        self.loop: tuple[Pace, int, int, str] | None = None
        self._shown: tuple[Pace, int, int, str] | None = None

    def announce(self, expected_s: float, advice: Sentence) -> None:
        """Say how long the stage takes, if that is long; once."""
        with self.voice:
            if (remark := self._announcement.of(expected_s, advice)) is not None:
                self.listen.say(remark)

    def report(self, pace: Pace, done: int, total: int, unit: str) -> None:
        """Report the steps of the loop, once the stage lasts long enough."""
        spent_s = time.monotonic() - self._begin_s
        if spent_s < QUIET_S:
            return
        self._shown = pace, done, total, unit
        with self.voice:
            remark = self._announcement.remark(spent_s, pace.left_s(done, total), done / total)
            if remark is not None:
                self.listen.say(remark)
            token = _PACE.set(pace)
            try:
                self.listen(self.label, done, total, unit)
            finally:
                _PACE.reset(token)

    def repeat(self) -> None:
        """Report where the loop stands, unless that is known: a step takes long. A stage that has
        shown no loop has one step.
        """
        loop = self.loop
        if loop is None and self._shown is None:
            loop = Pace(), 0, 1, "steps"
        if loop not in (None, self._shown):
            self.report(*loop)


_PACE: ContextVar[Pace | None] = ContextVar("pace", default=None)


def pace_of_report() -> Pace | None:
    """Return the pace of the loop that is reported to the listener that asks, if it is known."""
    return _PACE.get()


_STAGE: ContextVar[_Stage | None] = ContextVar("stage", default=None)


@contextmanager
def stage(
    label: str, progress: Progress | None = None, advice: Sentence = NO_ADVICE
) -> Iterator[None]:
    """Report the loops of the work within as loops of the stage `label`, if it lasts a second.

    progress: receives the reports; by default the receiver of the stage around this one, and nobody
    where there is none. advice: how to skip or shorten the stage, like ` (report=False skips it)`,
    for the remark on one of more than a minute.
    """
    outer = _STAGE.get()
    if progress is None and outer is None:
        yield
        return
    if progress is not None:
        inner = _Stage(label, listener(progress), advice)
    else:
        assert outer is not None
        inner = _Stage(label, outer.listen, advice or outer.advice, outer.voice)
    token = _STAGE.set(inner)
    try:
        yield
    finally:
        _STAGE.reset(token)


def announce(expected_s: float, advice: Sentence = NO_ADVICE) -> None:
    """Say how long the present stage takes, before its first step, if that is more than a minute.

    expected_s: seconds, from an estimate of its own. advice: how to skip or shorten it.
    """
    current = _STAGE.get()
    if current is not None:
        current.announce(expected_s, advice)


def still_working() -> None:
    """Show the present stage, if it lasts a second, while a call goes on that counts no steps."""
    if (current := _STAGE.get()) is not None:
        current.repeat()


@contextmanager
def counting(total: int, unit: str | None) -> Iterator[Callable[[], None]]:
    """Yield a function to call, from any thread, after each of the `total` steps of a loop.

    unit: the plural of its steps; None if they differ, so that their number tells nothing.
    """
    current = _STAGE.get()
    if unit is None or current is None or not current.turn.acquire(blocking=False):
        yield lambda: None
        return
    pace, done, counter = Pace(), 0, Lock()
    current.loop = (pace, 0, total, unit) if total else None

    def advance() -> None:
        nonlocal done
        with counter:
            done += 1
            current.loop = pace, done, total, unit
        current.report(pace, done, total, unit)

    try:
        yield advance
    finally:
        current.loop = None
        current.turn.release()


def with_progress(steps: Sequence[Step], unit: str = "blocks") -> Iterator[Step]:
    """Yield the steps of a loop, reporting them to the stage that the loop belongs to.

    The work can be cancelled before each step. unit: the plural of the steps.
    """
    check = cancellation_check()
    with counting(len(steps), unit) as advance:
        for step in steps:
            check()
            yield step
            advance()
