"""What goes to the terminal, line by line: the one place in the package that prints.

Names, paths and the words of libraries come from files, where anything may stand. What would steer
a terminal, or pass for a line of its own, is shown instead (`screen.visible`).
"""

import os
import sys

from lightpaint.errors import OutputError
from lightpaint.images.formats.library_output import unsilenced
from lightpaint.screen import visible

#: Characters of a line on stderr; what is longer was in no sentence.
LONGEST = 4000


def out(line: str, *, swatch: str | None = None) -> None:
    """A line of results, to stdout. Work goes on if whoever read them has left (`| head`).

    swatch: a colour like `#ffaa66`, of which a block stands before the line; "" for room for one.
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
    """A line of progress, a remark or an error, to stderr."""
    with unsilenced():
        print(cut(line), file=sys.stderr, flush=True)


def cut(line: str) -> str:
    """As `err` shows it."""
    shown = visible(line[: LONGEST + 1])
    return shown if len(shown) <= LONGEST else f"{shown[:LONGEST]} …"
