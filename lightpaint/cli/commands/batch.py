"""`lightpaint batch`: plans, runs and prints."""

import shlex
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from lightpaint.batch.gallery.gallery import counts_text
from lightpaint.batch.gallery.summary import SummaryRow, summary_document
from lightpaint.batch.manifest.folder_names import FILES
from lightpaint.batch.manifest.starter_manifest import write_starter_manifest
from lightpaint.batch.plan.cost_estimate import estimate
from lightpaint.batch.plan.openjd import LOOK_PARAMETER, write_openjd
from lightpaint.batch.plan.plan import Plan, PlannedLook
from lightpaint.batch.plan.planner import plan
from lightpaint.batch.run import run_batch
from lightpaint.batch.run_options import BatchOutcome, RunOptions
from lightpaint.batch.work.work_items import ItemResult
from lightpaint.cli.output import documents, terminal
from lightpaint.cli.output.output_mode import CommandOutcome
from lightpaint.errors import BatchError, OutputError
from lightpaint.files import scene_name
from lightpaint.screen import some_of, visible

#: Most looks that are listed at the end; of more only unfinished ones.
LISTED = 40


def batch(
    *,
    paths: list[str],
    output: Path | None,
    is_first: bool,
    is_dry: bool,
    form: str | None,
    only: str | None,
    run_options: RunOptions,
    force: bool,
    log: Path | None,
) -> CommandOutcome:
    """Run `lightpaint batch looks.toml -o DIR`, or `--init SCENE PAINTING...`."""
    if is_first:
        manifest_file = output or Path("looks.toml")
        write_starter_manifest(manifest_file, paths[0], paths[1:], force=force)
        terminal.write(f"{manifest_file}: {len(paths) - 1} looks; run them with")
        terminal.write(f"lightpaint batch {shlex.quote(str(manifest_file))}")
        return CommandOutcome(lambda: {"manifest": str(manifest_file), "looks": len(paths) - 1})
    if form is not None and len(paths) != 2:
        raise BatchError("the folder of the job is missing: give looks.toml --export openjd DIR")
    if form is None and len(paths) > 1:
        raise BatchError(f"{len(paths)} manifests: give one, or --init SCENE PAINTING...")
    folder = output or Path(scene_name(Path(paths[0])))
    # The same command in all reports, however often and from wherever the batch is run.
    manifest, output_folder = (str(Path(x).absolute()) for x in (paths[0], folder))
    command = shlex.join(["lightpaint", "batch", manifest, "-o", output_folder])
    planned = plan(paths[0], folder, force=force, command=command).select(only)
    if is_dry:
        return _dry(planned)
    if form is not None:
        return _export(planned, Path(paths[1]), force=force)
    of_looks = (x for look in planned.chosen_looks for x in look.remarks)
    remarks = list(dict.fromkeys((*planned.remarks, *of_looks)))
    for remark in remarks[:LISTED]:
        terminal.say(remark)
    if len(remarks) > LISTED:
        terminal.say(f"and {len(remarks) - LISTED} more remarks, each when its look is done")
    listen = terminal.TerminalListener()
    note = _log(log)
    note(f"{command}: {len(planned.chosen_looks)} looks")

    def on_step(look: PlannedLook, done: ItemResult) -> None:
        name, left = f"{look.entry.name}: {done.kind}", time_left(done)
        if done.failure:
            note(f"{name} failed: {done.failure}")
            return
        note(f"{name} done in {done.spent_s:.2f} s")
        listen.say(f"{name} done in {done.spent_s:.1f} s{left}")

    def time_left(done: ItemResult) -> str:
        return "" if done.left_s is None else f", {spoken_time(done.left_s)} left"

    with listen:
        outcome = run_batch(planned, run_options, listen, on_step=on_step)
    note(f"done {len(outcome.done)}, failed {len(outcome.failed)}")
    return _outcome(planned, outcome)


def _export(planned: Plan, folder: Path, *, force: bool) -> CommandOutcome:
    """Write a job for a farm, and print how to run it here."""
    path = write_openjd(folder, planned, command=("--only", LOOK_PARAMETER, "--apart"), force=force)
    terminal.write(f"{path}: {len(planned.chosen_looks)} looks; run them here with")
    terminal.write(f"openjd run {shlex.quote(str(path))}")
    return CommandOutcome(lambda: documents.files_document(folder, [path]))


def _outcome(planned: Plan, outcome: BatchOutcome) -> CommandOutcome:
    """Print the results of a run, and return them for programs."""
    _show(planned, outcome.rows)
    folder = planned.folder
    for name, reason in list(outcome.failed.items())[:LISTED]:
        terminal.complain("batch", f"{name}: {reason}")
    if len(outcome.failed) > LISTED:
        terminal.complain("batch", f"and {len(outcome.failed) - LISTED} more, in summary.csv")
    if outcome.skipped:
        count = len(outcome.skipped)
        done = "1 look was" if count == 1 else f"{count} looks were"
        terminal.say(f"{done} done earlier and {'is' if count == 1 else 'are'} unchanged")
    if outcome.waiting:
        terminal.complain("batch", f"stopped before {some_of(outcome.waiting)}")
    if outcome.rows:
        terminal.write(f"{folder / FILES[0]}: {counts_text(outcome.rows)}")
    return CommandOutcome(
        lambda: {
            "folder": str(folder),
            "files": [str(folder / name) for name in FILES if outcome.rows],
            **summary_document(outcome.rows),
        },
        1 if outcome.failed or outcome.waiting else 0,
    )


def _show(planned: Plan, rows: list[SummaryRow]) -> None:
    """Print a row for each look; of very many, only the unfinished ones."""
    shown = rows if len(rows) <= LISTED else [row for row in rows if row.state != "done"][:LISTED]
    if not shown:
        return
    table = terminal.table("look", "state", "ΔE", "render", "folder")
    for row in shown:
        agrees = "" if row.agrees is None else "agrees" if row.agrees else "disagrees"
        missed = "" if row.delta_e is None else f"{row.delta_e:.1f}"
        table.row(row.look, row.state, missed, agrees, str(planned.folder / row.folder))
    terminal.print_table(table)


def _dry(planned: Plan) -> CommandOutcome:
    """Print what would be done and its cost, without doing it."""
    table, looks = terminal.table("look", "what", "of"), []
    for look in planned.chosen_looks:
        action = look.failure or ("done earlier" if look.is_done else ", ".join(look.entry.want))
        inputs = ", ".join([*(x.path for x in look.entry.paintings), *look.entry.combined_looks])
        table.row(look.entry.name, visible(action), inputs or look.entry.lighting)
        looks.append({"look": look.entry.name, "is_done": look.is_done, "want": look.entry.want})
    terminal.print_table(table)
    needed = estimate(planned)
    terminal.write(
        f"bases {spoken_time(needed.bases_s)} unless they are in the cache, looks "
        f"{spoken_time(needed.looks_s)}, by one process on two cores; "
        f"{needed.memory / 1e9:.1f} GB of memory"
    )
    failed = [look.entry.name for look in planned.chosen_looks if look.failure]
    if failed:
        terminal.complain("batch", f"cannot be done: {some_of(failed)}")
    return CommandOutcome(lambda: {"looks": looks, **vars(needed)}, 1 if failed else 0)


def spoken_time(seconds: float) -> str:
    """Return a duration as `0:07`, `12:30`, `3:05:00`."""
    whole = round(seconds)
    hours, minutes, rest = whole // 3600, whole // 60 % 60, whole % 60
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"


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
