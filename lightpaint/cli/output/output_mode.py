"""The output mode of a command: tables or JSON, quiet or verbose."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import Any


class Stopwatch:
    """A stopwatch with lap times."""

    def __init__(self) -> None:
        self._began = self._last = time.perf_counter()

    def read(self) -> tuple[float, float]:
        """Return seconds since the last reading, and in all."""
        now_s = time.perf_counter()
        lap, self._last = now_s - self._last, now_s
        return lap, now_s - self._began


@dataclass(frozen=True)
class OutputMode:
    """The output mode of a command.

    as_json: one document on stdout, and nothing else. is_quiet: neither progress nor remarks.
    is_verbose: also settings and times. json_progress: what goes to stderr is JSON, an object a
    line. clock: runs since the command began.
    """

    as_json: bool = False
    is_quiet: bool = False
    is_verbose: bool = False
    json_progress: bool = False
    clock: Stopwatch = field(default_factory=Stopwatch)


@dataclass(frozen=True)
class CommandOutcome:
    """The outcome of a command.

    document: creates the document for programs, on request; None if it was printed already.
    """

    document: Callable[[], dict[str, Any]] | None
    code: int = 0


_MANNER = ContextVar("manner", default=OutputMode())  # noqa: B039 (its clock is not used)


def output_mode() -> OutputMode:
    """Return the output mode of the running command."""
    return _MANNER.get()


@contextmanager
def using_output_mode(mode: OutputMode) -> Iterator[None]:
    """Use an output mode within the block."""
    token = _MANNER.set(mode)
    try:
        yield
    finally:
        _MANNER.reset(token)
