"""`lightpaint batch`: plans, runs and prints."""

import os
import shlex
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from lightpaint.batch import (
    FILES,
    LOOK_PARAMETER,
    BatchOutcome,
    ItemResult,
    Plan,
    PlannedLook,
    RunOptions,
    SummaryRow,
    counts_text,
    estimate,
    plan_batch,
    run_batch,
    summary_document,
    write_openjd,
    write_starter_manifest,
)
from lightpaint.cli.output import documents, terminal
from lightpaint.cli.output.lines import CommandOutcome
from lightpaint.cli.output.vocabulary import spoken_of_manifest
from lightpaint.display_text import some_of, visible
from lightpaint.errors import BatchError, OutputError
from lightpaint.files import scene_name
from lightpaint.sentences import Sentence

#: Maximum number of looks that are listed at the end; of more only unfinished ones.
MAX_LISTED = 40


def batch(
    *,
    paths: list[str],
    output: Path | None,
    is_first: bool,
    is_dry: bool,
    form: str | None,
    name_patterns: list[str],
    run_options: RunOptions,
    force: bool,
    log: Path | None,
) -> CommandOutcome:
    """Run `lightpaint batch looks.toml -o DIR`, or `--init SCENE PAINTING...`."""
    if is_first:
        return _write_first_manifest(output or Path("looks.toml"), paths[0], paths[1:], force=force)
    if form is not None and len(paths) != 2:
        raise BatchError("the folder of the job is missing: give looks.toml --export openjd DIR")
    if form is None and len(paths) > 1:
        raise BatchError(f"{len(paths)} manifests: give one, or --init SCENE PAINTING...")
    folder = output or Path(scene_name(Path(paths[0])))
    command = _command_in(folder, paths[0])
    plan = plan_batch(paths[0], folder, force=force, command=command).select(*name_patterns)
    if is_dry:
        return _show_plan(plan)
    if form is not None:
        return _export(plan, Path(paths[1]), force=force)
    note = _log(log)
    manifest, output_folder = (str(Path(x).absolute()) for x in (paths[0], folder))
    words = ["lightpaint", "batch", manifest, "-o", output_folder]
    note(f"{shlex.join(words)}: {len(plan.chosen_looks)} looks")
    outcome = _run(plan, run_options, note, known=_say_remarks(plan, note))
    note(f"done {len(outcome.done)}, failed {len(outcome.failed)}")
    return _outcome(plan, outcome)


def _command_in(folder: Path, manifest: str) -> str:
    """Return the command that runs a batch from its own folder, for the reports.

    It is the same however often and wherever the batch is run, so equal batches have equal reports.
    """
    path = os.path.relpath(os.path.realpath(manifest), os.path.realpath(folder))
    return shlex.join(["lightpaint", "batch", path, "-o", "."])


def _write_first_manifest(
    path: Path, scene: str, paintings: list[str], *, force: bool
) -> CommandOutcome:
    """Write a first manifest, and print how to run it."""
    write_starter_manifest(path, scene, paintings, force=force)
    terminal.write(f"{path}: {len(paintings)} looks; run them with")
    terminal.write(f"lightpaint batch {shlex.quote(str(path))}")
    return CommandOutcome(lambda: {"manifest": str(path), "looks": len(paintings)})


def _say_remarks(plan: Plan, note: Callable[[str], Any]) -> list[str]:
    """Say the remarks of a plan and of its looks, each once, and return those that are shown.

    note: adds a line to the log.
    """
    of_looks = (x for look in plan.chosen_looks for x in look.remarks)
    remarks = list(dict.fromkeys(map(spoken_of_manifest, (*plan.remarks, *of_looks))))
    for remark in remarks:
        note(remark)
    for remark in remarks[:MAX_LISTED]:
        terminal.say(remark)
    if len(remarks) > MAX_LISTED:
        terminal.say(f"and {len(remarks) - MAX_LISTED} more remarks, each when its look is done")
    return remarks[:MAX_LISTED]


class _LoggedListener(terminal.TerminalListener):
    """A listener whose remarks stand in the log as well.

    note: adds a line to it. known: remarks that it has, and that are shown.
    """

    def __init__(self, note: Callable[[str], Any], known: Sequence[str]) -> None:
        super().__init__()
        self._note, self._known = note, known

    def say(self, text: str) -> None:
        """Show a remark, and log it."""
        spoken = spoken_of_manifest(text)
        if spoken not in self._known:
            self._note(spoken)
            self.show(spoken)

    def show(self, text: str) -> None:
        """Show a remark that the log has in other words."""
        super().say(text)


def _run(
    plan: Plan, run_options: RunOptions, note: Callable[[str], Any], *, known: Sequence[str]
) -> BatchOutcome:
    """Run a plan, and say which look is done. note, known: as for `_LoggedListener`."""
    listen = _LoggedListener(note, known)

    def on_step(look: PlannedLook, result: ItemResult) -> None:
        name, time_text = f"{look.entry.name}: {result.kind}", time_left(result)
        if result.failure:
            note(f"{name} failed: {result.failure}")
            return
        note(f"{name} done in {result.spent_s:.2f} s")
        listen.show(f"{name} done in {result.spent_s:.1f} s{time_text}")

    def time_left(result: ItemResult) -> str:
        return "" if result.left_s is None else f", {spoken_time(result.left_s)} left"

    with listen:
        return run_batch(plan, run_options, listen, on_step=on_step)


def _export(plan: Plan, folder: Path, *, force: bool) -> CommandOutcome:
    """Write a job for a farm, and print how to run it here."""
    path = write_openjd(folder, plan, command=("--only", LOOK_PARAMETER, "--apart"), force=force)
    terminal.write(f"{path}: {len(plan.chosen_looks)} looks; run them here with")
    terminal.write(f"openjd run {shlex.quote(str(path))}")
    return CommandOutcome(lambda: documents.files_document(folder, [path]))


def _outcome(plan: Plan, outcome: BatchOutcome) -> CommandOutcome:
    """Print the results of a run, and return them for programs."""
    _show(plan, outcome.rows)
    folder = plan.folder
    for name, reason in list(outcome.failed.items())[:MAX_LISTED]:
        terminal.complain("batch", Sentence(f"{name}: ", reason))
    if len(outcome.failed) > MAX_LISTED:
        terminal.complain("batch", f"and {len(outcome.failed) - MAX_LISTED} more, in summary.csv")
    if outcome.skipped:
        count = len(outcome.skipped)
        sentence = "1 look was" if count == 1 else f"{count} looks were"
        terminal.say(f"{sentence} done earlier and {'is' if count == 1 else 'are'} unchanged")
    if outcome.waiting:
        terminal.complain("batch", f"stopped before {some_of(outcome.waiting)}")
    if outcome.rows:
        terminal.write(f"{folder / FILES[0]}: {counts_text(outcome.rows)}")
    return CommandOutcome(
        lambda: {
            "folder": str(folder),
            "files": [str(folder / name) for name in FILES if outcome.rows],
            **_document(outcome),
        },
        1 if outcome.failed or outcome.waiting else 0,
    )


def _document(outcome: BatchOutcome) -> dict[str, Any]:
    """Return the summary with the seconds that looks took, which no file of a batch holds."""
    document, seconds = summary_document(outcome.rows), outcome.spent_s
    looks = [
        {**look, "seconds": seconds[look["look"]]} if look["look"] in seconds else look
        for look in document["looks"]
    ]
    return {**document, "looks": looks}


def _show(plan: Plan, rows: list[SummaryRow]) -> None:
    """Print a row for each look; of very many, only the unfinished ones."""
    shown_rows = (
        rows
        if len(rows) <= MAX_LISTED
        else [row for row in rows if row.state != "done"][:MAX_LISTED]
    )
    if not shown_rows:
        return
    table = terminal.table("look", "state", "ΔE", "render", "folder")
    for row in shown_rows:
        agreement = "" if row.agrees is None else "agrees" if row.agrees else "disagrees"
        delta_e = "" if row.delta_e is None else f"{row.delta_e:.1f}"
        table.row(row.look, row.state, delta_e, agreement, str(plan.folder / row.folder))
    terminal.print_table(table)


def _show_plan(plan: Plan) -> CommandOutcome:
    """Print what would be done and its cost, without doing it."""
    table, looks = terminal.table("look", "what", "of"), []
    for look in plan.chosen_looks:
        action = look.failure or ("done earlier" if look.is_done else ", ".join(look.entry.want))
        paintings = (_short_path(x.path) for x in look.entry.paintings)
        inputs = ", ".join([*paintings, *look.entry.combined_looks])
        table.row(look.entry.name, visible(action), inputs or look.entry.lighting)
        document = {"look": look.entry.name, "is_done": look.is_done, "want": look.entry.want}
        looks.append({**document, "why": look.failure} if look.failure else document)
    terminal.print_table(table)
    cost, lux, bases = estimate(plan), " and lux" * bool(plan.measurements), ""
    if cost.bases_s:
        bases = f"bases{lux} {spoken_time(cost.bases_s)} unless they are in the cache, "
    terminal.write(
        f"{bases}looks {spoken_time(cost.looks_s)}, by one process on two cores; "
        f"{cost.memory / 1e9:.1f} GB of memory"
    )
    failed_names = [look.entry.name for look in plan.chosen_looks if look.failure]
    if failed_names:
        terminal.complain("batch", f"cannot be done: {some_of(failed_names)}")
    return CommandOutcome(lambda: {"looks": looks, **vars(cost)}, 1 if failed_names else 0)


def _short_path(path: str) -> str:
    """Return a path without `..` in it, from the current folder if it leads into that."""
    short, here = Path(os.path.normpath(path)), Path.cwd()
    return str(short.relative_to(here) if short.is_relative_to(here) else short)


def spoken_time(seconds: float) -> str:
    """Return a duration as `0:07`, `12:30`, `3:05:00`."""
    total_s = round(seconds)
    hours, minutes, seconds_left = total_s // 3600, total_s // 60 % 60, total_s % 60
    return f"{hours}:{minutes:02}:{seconds_left:02}" if hours else f"{minutes}:{seconds_left:02}"


def _log(path: Path | None) -> Callable[[str], Any]:
    """Return a function that appends a line with its time to the log, if there is one."""

    def note(text: str) -> None:
        if path is None:
            return
        time = datetime.now(UTC).isoformat(timespec="seconds")
        try:
            with path.open("a", encoding="utf-8") as file:
                file.write(f"{time} {visible(text)}\n")
        except OSError as error:
            raise OutputError(f"cannot write {path}: {error.strerror or error}") from error

    return note
