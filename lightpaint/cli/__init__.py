# PYTHON_ARGCOMPLETE_OK
"""The command line: parsing, calls of the library, and printing.

Results go to stdout, progress and remarks to stderr. Exit code 0: done; 1: done, but a check failed
(`verify` found a disagreement, an answer is not close enough, or misses wishes for planes); 2: an
error that the user can fix, in one line; 70: a bug in lightpaint; 130: interrupted; 143:
terminated; 129: its terminal has closed.
"""

from collections.abc import Sequence


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return the exit code."""
    received: list[int] = []
    try:
        # Slow imports happen where an interrupt is caught, and held back until they end.
        from lightpaint.signals import interruptible_between_pieces, signals_as_interrupts

        with signals_as_interrupts(received):
            with interruptible_between_pieces():
                from lightpaint.cli.dispatcher import run_command
            code = run_command(arguments, received)
    except KeyboardInterrupt:
        import sys

        sys.stderr.write("lightpaint: interrupted\n")
        code = 130
    except Exception as error:  # before any command ran
        import sys

        from lightpaint.cli.crash_report import report_fault

        words = list(sys.argv[1:] if arguments is None else arguments)
        code = report_fault("", error, words)
    return 128 + received[0] if received and code == 130 else code
