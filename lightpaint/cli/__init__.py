# PYTHON_ARGCOMPLETE_OK
"""The command line: one sub-command per room. Parses, calls, prints; no more.

Results go to stdout, progress and remarks to stderr. Exit code 0: done; 1: `verify` found
a disagreement; 2: something the user can mend, said in one line; 130: interrupted.
"""

import io
import os
import sys
import traceback
import warnings
from collections.abc import Sequence

from lightpaint.cli import lines
from lightpaint.cli.parser import command_parser
from lightpaint.cli.words import spoken
from lightpaint.errors import LightpaintError


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return the exit code."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    for stream in (sys.stdout, sys.stderr):
        # A terminal that lacks a character shows another, and loses no result over it.
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
    parser = command_parser()
    if "_ARGCOMPLETE" in os.environ:  # a shell asks what could be typed
        from lightpaint.cli.completion import complete

        complete(parser)
    options = parser.parse_args(given)
    try:
        # What a command needs is imported when it runs: --help answers at once.
        from lightpaint.cli import commands
        from lightpaint.cli.options import values_of
        from lightpaint.scene.variant import SlowBackendWarning

        # The commands say it in their own words.
        warnings.simplefilter("ignore", SlowBackendWarning)
        return int(getattr(commands, options.command)(**values_of(options, given)))
    except LightpaintError as error:
        lines.err(f"lightpaint {options.command}: {spoken(str(error))}")
        return 2
    except KeyboardInterrupt as interrupt:
        how_to_go_on = f": {interrupt}" if str(interrupt) else ""
        lines.err(f"lightpaint {options.command}: interrupted{how_to_go_on}")
        return 130
    except Exception:
        # A mistake of lightpaint's own, told whole; its text may repeat what a file says.
        for line in traceback.format_exc().splitlines():
            lines.err(line)
        return 1
