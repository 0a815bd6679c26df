"""Runs one command, from its arguments to its exit code; or completes its words for a shell."""

import argparse
import gc
import io
import os
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module

from lightpaint.cli.crash_report import report_fault
from lightpaint.cli.options.parser import COMMANDS, command_parser
from lightpaint.cli.output import lines
from lightpaint.cli.output.lines import CommandOutcome, OutputMode, using_output_mode
from lightpaint.cli.output.vocabulary import spoken
from lightpaint.errors import BackendError, BatchError, LightpaintError, refusal_of

#: The scene or the film needs too much memory, which is not a bug.
OUT_OF_MEMORY_TEXT = (
    "this needs more memory than there is: close other programs, or render a smaller film "
    '(--resolution 1/2 takes about a quarter; in a manifest, resolution = "1/2")'
)


#: Errors of too little memory, or too low a limit, that are not MemoryError: of Python where no
#: thread or lock can be made, and of the loader where there is no room for a library.
NO_ROOM_TEXTS = (
    "can't start new thread",
    "can't allocate lock",
    "can't allocate read lock",
    "failed to map segment from shared object",
)


def run_command(arguments: Sequence[str] | None, received: Sequence[int]) -> int:
    """Run one command and return the exit code. received: the signals that have arrived."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    _substitute_characters()
    parser = command_parser()
    if not words and "_ARGCOMPLETE" not in os.environ:
        parser.print_help()
        return 0
    if "_ARGCOMPLETE" in os.environ:  # a shell asks for completions
        complete(parser)
    options = parser.parse_args(words)
    mode = OutputMode(options.as_json, options.is_quiet, options.is_verbose, options.json_progress)
    with using_output_mode(mode):
        return _run_parsed(options, words, received)


def _run_parsed(options: argparse.Namespace, words: Sequence[str], received: Sequence[int]) -> int:
    """Run the command of parsed arguments and return the exit code."""
    hint = ""
    try:
        # A command's imports happen when it runs, so that --help answers at once. An interrupt in
        # the middle would leave libraries half imported, which some do not survive.
        from lightpaint.signals import interruptible_between_pieces

        with _without_garbage(), interruptible_between_pieces():
            from lightpaint.cli.options.command_arguments import values_of
            from lightpaint.cli.output import terminal
            from lightpaint.progress import stage
            from lightpaint.scene.runtime.variant import SlowBackendWarning

            command = _command(options.command)

        # The commands report this in their own words.
        warnings.simplefilter("ignore", SlowBackendWarning)
        with terminal.TerminalListener() as listen, stage("reading the files", listen):
            values = values_of(options, words)
        outcome = command(**values)
        if options.as_json and outcome.document is not None:
            terminal.write_json(outcome.document())
        terminal.note("done")
        return outcome.code
    except KeyboardInterrupt as interrupt:
        from lightpaint.threads import end_background_work

        end_background_work()
        hint = f": {interrupt}" if str(interrupt) else ""
    except Exception as error:
        # An interrupt inside a library often surfaces as an error of its own.
        if not received:
            return _report(options.command, error, words)
    lines.complain(options.command, f"interrupted{hint}")
    return 130


def _substitute_characters() -> None:
    """Make a terminal without a character show a substitute instead of failing."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")


@contextmanager
def _without_garbage() -> Iterator[None]:
    """Keep objects that are created within the block out of garbage collection, now and later."""
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        gc.enable()


def _command(name: str) -> Callable[..., CommandOutcome]:
    """Return the function of a command, importing only its own modules."""
    module = import_module(f"lightpaint.cli.commands.{COMMANDS[name].module}")
    return getattr(module, name)  # type: ignore[no-any-return]


def _report(command: str, error: Exception, words: Sequence[str]) -> int:
    """Print the error, and return the exit code."""
    if isinstance(error, LightpaintError):
        for line in error.mistakes if isinstance(error, BatchError) else (error.sentence,):
            lines.complain(command, spoken(line))
        if _is_half_imported(error):
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(2)
        return 2
    if isinstance(error, OSError) and (refusal := refusal_of(error)) is not None:
        lines.complain(command, str(refusal))
        return 2
    if isinstance(error, MemoryError) or any(x in str(error) for x in NO_ROOM_TEXTS):
        lines.complain(command, OUT_OF_MEMORY_TEXT)
        return 2
    return report_fault(command, error, words)


def _is_half_imported(error: LightpaintError) -> bool:
    """Return whether Mitsuba has started in part, which would abort Python at its end."""
    is_missing = isinstance(error.__cause__, ModuleNotFoundError | None)
    return isinstance(error, BackendError) and not is_missing and "mitsuba" not in sys.modules


#: Suffixes of files by the destination of an argument; other arguments take any file.
ENDINGS = {
    "scene": (".xml",),
    "source": (".xml", ".exr"),
    "targets": (".exr", ".png", ".tif", ".tiff", ".jpg", ".jpeg"),
    "masks": (".exr", ".png", ".tif", ".tiff", ".jpg", ".jpeg"),
    "lightings": (".json",),
    "lights_file": (".toml",),
    "lighting": (".json",),
    "planes": (".toml",),
    "observer": (".csv", ".txt", ".dat"),
    "rig": (".mvr",),
}


def complete(parser: argparse.ArgumentParser) -> None:
    """Answer the shell's request for completions, and exit; without argcomplete answer nothing."""
    try:
        import argcomplete
    except ImportError:
        raise SystemExit(1) from None
    for action in _actions(parser):
        if action.dest in ENDINGS:
            files = argcomplete.completers.FilesCompleter(ENDINGS[action.dest])
            action.completer = files  # type: ignore[attr-defined]
    argcomplete.autocomplete(parser, default_completer=argcomplete.completers.FilesCompleter())


def _actions(parser: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    """Yield the arguments of all commands."""
    for action in parser._actions:
        yield action
        if isinstance(action, argparse._SubParsersAction):
            for command in action.choices.values():
                yield from _actions(command)
