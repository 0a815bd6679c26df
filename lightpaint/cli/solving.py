"""What `lightpaint solve` does: one painting or several, their variations, a gallery of all."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from lightpaint.basis.basis import Basis
from lightpaint.batch.entries import Entry
from lightpaint.batch.gallery import FILES, spoken_counts
from lightpaint.batch.made import leave_shifted
from lightpaint.batch.plan import ALONE
from lightpaint.batch.solved import entry_of, write_gallery_of
from lightpaint.batch.work import is_full
from lightpaint.cli import documents, tables, terminal
from lightpaint.cli.answer import Table, show_look, spoken_settings
from lightpaint.cli.manner import Outcome
from lightpaint.cli.several import Several
from lightpaint.cli.wanted import Wanted
from lightpaint.job import Job
from lightpaint.pipeline import run
from lightpaint.relit.export.exports import EXPORTS
from lightpaint.results import Look
from lightpaint.screen import some_of

#: Of an answer of which nothing is asked.
ANY = Wanted()


def solve(
    *,
    jobs: Sequence[Job],
    table: Table = "short",
    wanted: Wanted = ANY,
    failed: dict[str, str] | None = None,
    several: Several | None = None,
) -> Outcome:
    """`lightpaint solve SCENE|BASIS TARGET...` or `SCENE --target SENSOR=TARGET...`

    failed: names of those that cannot be done, and why.
    """
    listen, several, failed = terminal.Listener(), several or Several(), failed or {}
    results, shortfalls, entries, obtained = [], [], [], None
    # Those of all before the first is run, which says its own again: once is enough.
    for remark in (remark for job in jobs for remark in job.remarks):
        listen.say(remark)
    for job in jobs:
        listen.note(f"files read; {spoken_settings(job.fit)}")
        entries.append(entry_of(job, variation=several.called.get(job.folder, "")))
        try:
            with listen:
                looks = run(job, listen, bases=None if obtained is None else list(obtained))
            # Several paintings of one scene share its basis.
            obtained = [look.basis for look in looks]
            for word, place in several.made.get(job.folder, {}).items():
                leave_shifted(job, word, place, looks[0].lighting, obtained)
                entries.append(entry_of(job, place.folder, word))
        except ALONE as error:
            if not several.keep_going or is_full(error):
                raise
            failed[job.folder.name] = str(error)
            continue
        _show(job, looks, table)
        for view, look in zip(job.views, looks, strict=True):
            results.append((job, view, look))
            shortfalls += [f"{view.folder} {x}" for x in wanted.shortfalls(look.analysis.seen)]
    _show_all(several.together, entries, failed, obtained or [])
    if jobs and not jobs[0].scenes and jobs[0].groups is None:
        terminal.say("solved from a saved basis: no render was made; lightpaint relight makes one")
    if shortfalls:
        terminal.complain("solve", some_of(shortfalls, joint="; "))
    return Outcome(
        lambda: {"results": [documents.result_document(*x, wanted) for x in results]},
        1 if shortfalls or failed else 0,
    )


def _show(job: Job, looks: Sequence[Look], table: Table) -> None:
    """What one job came to."""
    for view, look in zip(job.views, looks, strict=True):
        if job.by_sensor:
            terminal.write("")
            terminal.write(f"{look.basis.origin.sensor}:")
        show_look(look, view.folder, table=table)
        if look.suggestions is not None:
            tables.show_suggestions(look.suggestions, cd_per_unit=job.settings.cd_per_unit)
    if job.groups is not None:
        there = ", ".join(name for name in EXPORTS if (job.folder / name).is_file())
        terminal.write(f"for other programs: {there}")


def _show_all(
    together: Path | None,
    entries: list[Entry],
    failed: Mapping[str, str],
    bases: Sequence[Basis],
) -> None:
    """What failed, and the gallery."""
    for name, why in failed.items():
        terminal.complain("solve", f"{name}: {why}")
    if together is None:
        return
    named = {entry.name for entry in entries}
    lost = [Entry(name, "") for name in failed if name not in named]
    rows = write_gallery_of(together, [*entries, *lost], failed, bases)
    terminal.write(f"{together / FILES[0]}: {spoken_counts(rows)}")
