"""How the command line speaks: tables to stdout, progress and remarks to stderr."""

import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from lightpaint.errors import OutputError
from lightpaint.progress import Progress as Report


def numbers(rgb: tuple[float, float, float]) -> str:
    """Three numbers to read, not to compute with."""
    return " ".join(f"{v:.3g}" for v in rgb)


def table(*columns: str) -> Table:
    """An empty table with these headings."""
    made = Table(box=None, pad_edge=False, header_style="bold")
    for column in columns:
        made.add_column(column, no_wrap=True)
    return made


def print_table(made: Table) -> None:
    """Print to stdout. Piped output has no width: nothing in it is cut."""
    width = None if sys.stdout.isatty() else 1000
    page = Console(highlight=False, width=width, file=io.StringIO(), color_system=None)
    page.print(made)
    text = page.file.getvalue()  # type: ignore[attr-defined]
    write("\n".join(line.rstrip() for line in text.splitlines()))


def write(text: str) -> None:
    """A line of results, to stdout. Work goes on if whoever read them has left (`| head`)."""
    try:
        print(text, flush=True)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except OSError as error:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise OutputError(f"cannot write to standard output: {error.strerror}") from error


def say(text: str) -> None:
    """A remark, to stderr."""
    print(f"lightpaint: {text}", file=sys.stderr)


@contextmanager
def progress() -> Iterator[Report]:
    """Report to the terminal; in a log, one line per piece of work that is finished."""
    if not sys.stderr.isatty():
        yield _report_line
        return
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bars:
        tasks = {}

        def report(label: str, done: int, total: int, unit: str = "passes") -> None:
            if label not in tasks:
                what = label if unit == "passes" else f"{label} ({unit})"
                tasks[label] = bars.add_task(what, total=total)
            bars.update(tasks[label], completed=done, total=total)

        yield report


def _report_line(label: str, done: int, total: int, unit: str = "passes") -> None:
    if done == 0:
        print(f"{label}: {total} {unit}", file=sys.stderr, flush=True)
