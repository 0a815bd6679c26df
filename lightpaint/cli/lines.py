"""What goes to the terminal, line by line: the one place in the package that prints.

Names, paths and the words of libraries come from files, where anything may stand. What would steer
a terminal, or pass for a line of its own, is shown instead (`screen.visible`).
"""

import os
import sys

from lightpaint.errors import OutputError
from lightpaint.screen import visible

#: Characters of a line on stderr; what is longer was in no sentence.
LONGEST = 4000


def out(line: str) -> None:
    """A line of results, to stdout. Work goes on if whoever read them has left (`| head`)."""
    try:
        print(visible(line), flush=True)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except OSError as error:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise OutputError(f"cannot write to standard output: {error.strerror}") from error


def err(line: str) -> None:
    """A line of progress, a remark or an error, to stderr."""
    print(cut(line), file=sys.stderr, flush=True)


def cut(line: str) -> str:
    """As `err` shows it."""
    shown = visible(line[: LONGEST + 1])
    return shown if len(shown) <= LONGEST else f"{shown[:LONGEST]} …"
