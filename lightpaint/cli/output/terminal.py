"""Output of the command line: tables to stdout, progress and remarks to stderr."""

import io
import json
import os
import sys
import textwrap
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    Task,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
)
from rich.table import Table
from rich.text import Text

from lightpaint.cli.output import lines
from lightpaint.cli.output.lines import output_mode
from lightpaint.cli.output.vocabulary import spoken
from lightpaint.display_text import visible
from lightpaint.progress import Pace, pace_of_report, spoken_duration


def numbers(rgb: tuple[float, float, float]) -> str:
    """Return three numbers rounded for reading."""
    return " ".join(f"{v:.3g}" for v in rgb)


class Rows(Table):
    """A table whose cells are plain text, without markup."""

    def row(self, *cells: str, room: int | None = None) -> None:
        """Add a row. room: width to which the first cell is cut."""
        first, *others = (Text(visible(cell)) for cell in cells)
        if room is not None:
            first.truncate(room, overflow="ellipsis")
        self.add_row(first, *others)


def table(*columns: str) -> Rows:
    """Return an empty table with these headings."""
    rows = Rows(box=None, pad_edge=False, header_style="bold")
    for column in columns:
        rows.add_column(column, no_wrap=True)
    return rows


def print_table(rows: Rows, swatches: Sequence[str | None] = ()) -> None:
    """Print a table to stdout. Piped output has no width limit: nothing is cut.

    swatches: a colour like `#ffaa66` for each row, or None. They appear before the rows if the
    terminal can show them.
    """
    if output_mode().as_json:
        return
    width = None if sys.stdout.isatty() else 1000
    page = Console(highlight=False, width=width, file=io.StringIO(), color_system=None)
    page.print(rows)
    table_lines = page.file.getvalue().rstrip().split("\n")  # type: ignore[attr-defined]
    if not (swatches and has_truecolour()):
        write_lines("\n".join(table_lines))
        return
    for row, color in zip(table_lines, (None, *swatches), strict=True):
        lines.out(row.rstrip(), swatch=color or "")


def has_truecolour() -> bool:
    """Return True if stdout is a terminal with all colours, and the user allows them."""
    has_all = os.environ.get("COLORTERM", "").lower() in ("truecolor", "24bit")
    return has_all and not os.environ.get("NO_COLOR") and sys.stdout.isatty()


def write(text: str) -> None:
    """Print a line of results to stdout; nothing in JSON mode."""
    if not output_mode().as_json:
        lines.out(text)


def write_json(document: Mapping[str, Any]) -> None:
    """Print the results to stdout as a document for programs."""
    # json escapes all but ASCII, which has one more invisible character.
    text = json.dumps(document, indent=2, allow_nan=False).replace("\x7f", "\\u007f")
    for line in text.split("\n"):
        lines.out(line)


def tell(text: str) -> None:
    """Print a sentence or two to stdout, wrapped at words on a terminal."""
    if output_mode().as_json or not sys.stdout.isatty():
        write(text)
        return
    for line in textwrap.wrap(visible(text), Console().width, break_on_hyphens=False):
        lines.out(line)


def write_lines(text: str) -> None:
    """Print several lines of results to stdout."""
    for line in text.rstrip().split("\n"):
        write(line.rstrip())


def say(text: str) -> None:
    """Print a remark to stderr."""
    if output_mode().json_progress:
        lines.err_json({"remark": spoken(text)})
    elif not output_mode().is_quiet:
        lines.err(f"lightpaint: {spoken(text)}")


def complain(command: str, text: str) -> None:
    """Print a shortcoming or an error to stderr, even in quiet mode."""
    lines.complain(command, spoken(text))


def note(text: str) -> None:
    """Print a finished stage and its time to stderr, in verbose mode."""
    if output_mode().is_verbose:
        say(_timed(text))


def _timed(text: str) -> str:
    lap, total = output_mode().clock.read()
    return f"{text} [{lap:.2f} s, {total:.2f} s in all]"


#: Least seconds between two JSON lines on the same work, and between two lines of a log.
JSON_INTERVAL_S, LOG_INTERVAL_S = 0.5, 10.0

#: Maximum number of workers with a line each; of more, only their number is shown.
MAX_WORKER_LINES = 8


class _Count(MofNCompleteColumn):
    """A column with the count of finished pieces; empty if there is no total."""

    def render(self, task: Task) -> Text:
        return Text("") if task.total is None else super().render(task)


class _TimeLeft(ProgressColumn):
    """A column with the time that is left; empty before it is known."""

    def render(self, task: Task) -> Text:
        end_s = task.fields.get("end_s")
        if end_s is None or task.finished:
            return Text("")
        return Text(f"{spoken_duration(max(end_s - time.monotonic(), 0))} left")


@dataclass
class _Work:
    """Counted work as last reported. line_s: when a line was last printed; None if never."""

    pace: Pace
    done: int
    total: int
    line_s: float | None = None


class TerminalListener:
    """A listener that shows progress and remarks on stderr, each remark once.

    On a terminal it shows bars while it is entered, and a line for each busy worker; in a log, a
    line for each piece of work that begins, and now and then how far it is. Once it is left by an
    error or an interrupt, it shows no progress: threads may still end their last steps.
    """

    def __init__(self) -> None:
        self._shown_notes: set[str] = set()
        self._bars: Progress | None = None
        self._tasks: dict[str, TaskID] = {}
        self._workers: dict[str, TaskID] = {}
        self._workers_without_line: set[str] = set()  # workers without a line
        self._works: dict[str, _Work] = {}  # by label
        self._is_over = False

    def __enter__(self) -> "TerminalListener":
        mode, self._is_over = output_mode(), False
        if sys.stderr.isatty() and not (mode.is_quiet or mode.json_progress):
            columns = (
                TextColumn("{task.description}", markup=False),
                BarColumn(),
                _Count(),
                TimeElapsedColumn(),
                _TimeLeft(),
            )
            self._bars = Progress(*columns, console=Console(stderr=True), transient=True)
            self._bars.start()
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        self._is_over = kind is not None
        if self._bars is not None:
            self._bars.stop()
        self._bars, self._tasks, self._workers, self._workers_without_line = None, {}, {}, set()

    def __call__(self, label: str, done: int, total: int, unit: str = "passes") -> None:
        """Show that `done` of `total` pieces of the work `label` are finished."""
        if self._is_over:
            return
        work = self._works.get(label)
        if work is None or done < work.done or total != work.total:  # it begins, or begins again
            line_s = None if work is None or done == 0 else work.line_s
            work = self._works[label] = _Work(pace_of_report() or Pace(done), done, total, line_s)
        work.done = done
        left_s = work.pace.left_s(done, total)
        if output_mode().json_progress:
            self._print_json(label, work, unit, left_s)
        elif self._bars is None:
            self._print_line(label, work, unit, left_s)
        else:
            self._draw_bar(label, work, unit, left_s)

    def _draw_bar(self, label: str, work: _Work, unit: str, left_s: float | None) -> None:
        """Draw the bar of some work."""
        assert self._bars is not None
        if label not in self._tasks:
            title = label if unit in ("passes", label) else f"{label} ({unit})"
            self._tasks[label] = self._bars.add_task(visible(title), total=work.total)
        end_s = None if left_s is None else time.monotonic() + left_s
        self._bars.update(self._tasks[label], completed=work.done, total=work.total, end_s=end_s)

    def _print_line(self, label: str, work: _Work, unit: str, left_s: float | None) -> None:
        """Print a line of a log when work begins, and some between."""
        now_s, pieces = time.monotonic(), _counted(work.total, unit)
        if output_mode().is_quiet or (work.done == work.total and work.total > 0):
            return
        if work.done > 0 and work.line_s is not None and now_s < work.line_s + LOG_INTERVAL_S:
            return
        work.line_s = now_s
        if work.done == 0:
            lines.err(f"{label}: {pieces}")
        else:
            left = "" if left_s is None else f", {spoken_duration(left_s)} left"
            lines.err(f"{label}: {work.done} of {pieces}{left}")

    def _print_json(self, label: str, work: _Work, unit: str, left_s: float | None) -> None:
        """Print a JSON line of progress: the first, the last, and some between."""
        now_s, is_between = time.monotonic(), 0 < work.done < work.total
        if is_between and work.line_s is not None and now_s < work.line_s + JSON_INTERVAL_S:
            return
        work.line_s = now_s
        document = {"work": label, "done": work.done, "total": work.total, "unit": unit}
        lines.err_json(document | {"left_s": None if left_s is None else round(left_s, 1)})

    def at_work(self, worker: str, task: str | None) -> None:
        """Show the current task of a worker; None if it is idle."""
        if output_mode().json_progress:
            lines.err_json({"worker": worker, "task": task})
        if self._bars is None:
            return
        if task is None:
            self._workers_without_line.discard(worker)
            if worker in self._workers:
                self._bars.remove_task(self._workers.pop(worker))
        elif worker in self._workers:
            self._bars.reset(self._workers[worker], description=visible(f"{worker}: {task}"))
        elif len(self._workers) < MAX_WORKER_LINES:
            self._workers_without_line.discard(worker)
            self._workers[worker] = self._bars.add_task(visible(f"{worker}: {task}"), total=None)
        else:
            self._workers_without_line.add(worker)
        if self._workers_without_line or "others" in self._tasks:
            others = f"and {len(self._workers_without_line)} more at work"
            if "others" not in self._tasks:
                self._tasks["others"] = self._bars.add_task(others, total=None)
            self._bars.update(
                self._tasks["others"], description=others, visible=bool(self._workers_without_line)
            )

    def say(self, text: str) -> None:
        """Print a remark, above the bars if there are any."""
        if text in self._shown_notes:
            return
        self._shown_notes.add(text)
        if self._bars is None:
            say(text)
            return
        self._bars.console.out(lines.shortened_line(f"lightpaint: {spoken(text)}"), highlight=False)

    def note(self, text: str) -> None:
        """Print a finished stage with its time, in verbose mode."""
        if output_mode().is_verbose:
            self.say(_timed(text))


def _counted(count: int, unit: str) -> str:
    """Return a number of things. unit: their plural, of which the first word counts."""
    plural, _, rest = unit.partition(" ")
    if count == 1:
        plural = {"passes": "pass"}.get(plural, plural.removesuffix("s"))
    return " ".join(filter(None, (str(count), plural, rest)))
