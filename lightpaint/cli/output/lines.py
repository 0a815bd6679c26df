"""Lines for the terminal: the only module of the package that prints.

Names, paths and texts of libraries may contain anything. Characters that would control a terminal,
or look like a new line, are made visible (`screen.visible`).
"""

import os
import sys
from collections.abc import Mapping
from typing import Any

from lightpaint.cli.output.output_mode import output_mode
from lightpaint.display_text import visible
from lightpaint.errors import OutputError
from lightpaint.images.formats.library_output import unsilenced

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
