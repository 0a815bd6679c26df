# PYTHON_ARGCOMPLETE_OK
"""The command line: one sub-command per room. Parses, calls, prints; no more.

Results go to stdout, progress and remarks to stderr. Exit code 0: done; 1: done, but not as asked
(`verify` found a disagreement, an answer is not close enough); 2: something the user can mend, said
in one line; 70: a fault of lightpaint's own; 130: interrupted, 143: told to end, 129: its terminal
has closed.
"""

from collections.abc import Sequence


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return the exit code."""
    came: list[int] = []
    try:
        # What takes time to import is imported where an interrupt is heard, and waits.
        from lightpaint.signals import interruptible_between_pieces, signals_as_interrupts

        with signals_as_interrupts(came):
            with interruptible_between_pieces():
                from lightpaint.cli.dispatcher import run_command
            code = run_command(arguments, came)
    except KeyboardInterrupt:
        import sys

        sys.stderr.write("lightpaint: interrupted\n")
        code = 130
    except Exception as error:  # before there was a command to answer for it
        import sys

        from lightpaint.cli.crash_report import report_fault

        given = list(sys.argv[1:] if arguments is None else arguments)
        code = report_fault("lightpaint", error, given)
    return 128 + came[0] if came and code == 130 else code
