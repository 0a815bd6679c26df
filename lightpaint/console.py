"""How the command line speaks: tables to stdout, progress and remarks to stderr."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

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
    Console(highlight=False, width=None if sys.stdout.isatty() else 200).print(made)


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

        def report(label: str, done: int, total: int) -> None:
            if label not in tasks:
                tasks[label] = bars.add_task(label, total=total)
            bars.update(tasks[label], completed=done, total=total)

        yield report


def _report_line(label: str, done: int, total: int) -> None:
    if done == 0:
        print(f"{label}: {total} passes", file=sys.stderr, flush=True)
