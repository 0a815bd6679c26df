"""Lines for the terminal, and the mode of a command that decides which: only this module prints.

Names, paths and texts of libraries may contain anything. Characters that would control a terminal,
or look like a new line, are made visible (`screen.visible`).
"""

import os
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import Any

from lightpaint.display_text import visible
from lightpaint.errors import OutputError
from lightpaint.images.formats import unsilenced

#: Longest line on stderr, in characters: no sentence is longer.
MAX_LINE_LENGTH = 4000


def out(line: str, *, swatch: str | None = None) -> None:
    """Print a line of results to stdout. Work goes on if its reader has left (`| head`).

    swatch: a colour like `#ffaa66` for a block before the line; "" for blank space.
    """
    try:
        with unsilenced():
            print(_block(swatch) + visible(line), flush=True)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except OSError as error:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise OutputError(f"cannot write to standard output: {error.strerror}") from error


def _block(color: str | None) -> str:
    if not color:
        return "" if color is None else "   "
    r, g, b = (int(color[k : k + 2], 16) for k in (1, 3, 5))
    return f"\x1b[38;2;{r};{g};{b}m██\x1b[0m "


def err(line: str) -> None:
    """Print a line of progress, a remark or an error to stderr."""
    with unsilenced():
        print(shortened_line(line), file=sys.stderr, flush=True)


def complain(command: str, text: str) -> None:
    """Print an error to stderr, as a line for people or for programs. command: "" before any."""
    if output_mode().json_progress:
        err_json({"error": text})
    else:
        err(f"{f'lightpaint {command}'.rstrip()}: {text}")


def err_json(document: Mapping[str, Any]) -> None:
    """Print progress, a remark or an error to stderr as a line for programs."""
    import json

    with unsilenced():
        # json escapes all but ASCII, which has one more invisible character.
        print(json.dumps(document).replace("\x7f", "\\u007f"), file=sys.stderr, flush=True)


def shortened_line(line: str) -> str:
    """Return a line as `err` prints it."""
    visible_line = visible(line[: MAX_LINE_LENGTH + 1])
    return (
        visible_line
        if len(visible_line) <= MAX_LINE_LENGTH
        else f"{visible_line[:MAX_LINE_LENGTH]} …"
    )


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
