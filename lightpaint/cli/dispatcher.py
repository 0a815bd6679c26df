"""One command from its words to its exit code."""

import gc
import io
import os
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module

from lightpaint.cli.crash_report import report_fault
from lightpaint.cli.options.parser import command_parser
from lightpaint.cli.output import lines
from lightpaint.cli.output.output_mode import CommandOutcome, Manner, speaking
from lightpaint.cli.output.vocabulary import spoken
from lightpaint.errors import BatchError, LightpaintError

#: Where commands are that are not among the plain ones.
_HOMES = {
    "batch": "batch",
    "cache": "maintenance",
    "doctor": "maintenance",
    "export": "export",
    "lights": "lights",
    "paint": "paint",
    "solve": "solve",
}

#: The scene or the film asks for that, which is no fault of the program.
OUT_OF_MEMORY_TEXT = (
    "this takes more memory than there is: close other programs, or render a smaller film "
    '(--resolution 1/2 takes about a quarter; in a manifest, resolution = "1/2")'
)


def run_command(arguments: Sequence[str] | None, came: Sequence[int]) -> int:
    """Run one command and return the exit code. came: the signals that have been heard."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    for stream in (sys.stdout, sys.stderr):
        # A terminal that lacks a character shows another, and loses no result over it.
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
    parser = command_parser()
    if "_ARGCOMPLETE" in os.environ:  # a shell asks what could be typed
        from lightpaint.cli.options.completion import complete

        complete(parser)
    options = parser.parse_args(given)
    how_to_go_on = ""
    try:
        # What a command needs is imported when it runs: --help answers at once. An interrupt in
        # the middle of it would leave libraries half there, which some do not survive.
        from lightpaint.signals import interruptible_between_pieces

        with _without_garbage(), interruptible_between_pieces():
            from lightpaint.cli.options.command_arguments import values_of
            from lightpaint.cli.output import terminal
            from lightpaint.scene.runtime.variant import SlowBackendWarning

            command = _command(options.command)

        # The commands say it in their own words.
        warnings.simplefilter("ignore", SlowBackendWarning)
        with speaking(Manner(options.as_json, options.is_quiet, options.is_verbose)):
            outcome = command(**values_of(options, given))
            if options.as_json and outcome.told is not None:
                terminal.write_json(outcome.told())
            terminal.note("done")
        return outcome.code
    except KeyboardInterrupt as interrupt:
        how_to_go_on = f": {interrupt}" if str(interrupt) else ""
    except Exception as error:
        # An interrupt in the middle of a library often surfaces as some error of its own.
        if not came:
            return _failed(options.command, error, given)
    lines.err(f"lightpaint {options.command}: interrupted{how_to_go_on}")
    return 130


@contextmanager
def _without_garbage() -> Iterator[None]:
    """What is made here stays, and is not looked through for garbage, now or later."""
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        gc.enable()


def _command(name: str) -> Callable[..., CommandOutcome]:
    """The function of a command, of whose rooms the others have no need."""
    module = import_module(f"lightpaint.cli.commands.{_HOMES.get(name, 'rooms')}")
    return getattr(module, name)  # type: ignore[no-any-return]


def _failed(command: str, error: Exception, given: Sequence[str]) -> int:
    """Say what went wrong, and return the exit code."""
    if isinstance(error, LightpaintError):
        for line in error.mistakes if isinstance(error, BatchError) else (str(error),):
            lines.err(f"lightpaint {command}: {spoken(line)}")
        return 2
    if isinstance(error, MemoryError):
        lines.err(f"lightpaint {command}: {OUT_OF_MEMORY_TEXT}")
        return 2
    return report_fault(f"lightpaint {command}", error, given)
