"""How a command speaks: in tables or as JSON, with more or less beside its results."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import Any


class Stopwatch:
    """Seconds since it was made, and since it was last looked at."""

    def __init__(self) -> None:
        self._began = self._last = time.perf_counter()

    def look(self) -> tuple[float, float]:
        """(since the last look, in all)."""
        now = time.perf_counter()
        lap, self._last = now - self._last, now
        return lap, now - self._began


@dataclass(frozen=True)
class Manner:
    """as_json: one document on stdout, and nothing else. is_quiet: neither progress nor remarks.

    is_verbose: also what was used, and how long it took. clock: since the command began.
    """

    as_json: bool = False
    is_quiet: bool = False
    is_verbose: bool = False
    clock: Stopwatch = field(default_factory=Stopwatch)


@dataclass(frozen=True)
class CommandOutcome:
    """The outcome of a command. told: the document for programs, made if asked for; None where
    they were told already.
    """

    told: Callable[[], dict[str, Any]] | None
    code: int = 0


_MANNER = ContextVar("manner", default=Manner())  # noqa: B039 (nobody looks at its clock)


def manner() -> Manner:
    """That of the command that runs."""
    return _MANNER.get()


@contextmanager
def speaking(how: Manner) -> Iterator[None]:
    """Speak so within."""
    before = _MANNER.set(how)
    try:
        yield
    finally:
        _MANNER.reset(before)
