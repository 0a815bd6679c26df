"""`lightpaint solve`: one painting or several, their variations, and a gallery of all."""

from collections.abc import Sequence
from shlex import quote
from typing import TYPE_CHECKING, Any

from lightpaint.cli.commands.answer_text import Table, show_look, spoken_settings
from lightpaint.cli.output import documents, tables, terminal
from lightpaint.cli.output.output_mode import CommandOutcome
from lightpaint.cli.tolerances import Tolerances
from lightpaint.display_text import some_of
from lightpaint.errors import LOOK_ERRORS
from lightpaint.pipeline.job.job import Job
from lightpaint.pipeline.pipeline import run
from lightpaint.pipeline.results.results import Look
from lightpaint.placement.placement_record import PlacementRecord, record_of
from lightpaint.relit.export.exports import EXPORTS
from lightpaint.report.page.suggestion_section import spoken_turn

if TYPE_CHECKING:
    from lightpaint.cli.solve_variations import LookSet

#: No requirements.
NO_REQUIREMENTS = Tolerances()


def solve(
    *,
    jobs: Sequence[Job],
    table: Table = "short",
    tolerances: Tolerances = NO_REQUIREMENTS,
    look_set: "LookSet | None" = None,
) -> CommandOutcome:
    """Run `lightpaint solve SCENE|BASIS TARGET...` or `SCENE --target SENSOR=TARGET...`.

    look_set: the set of looks, if there are several.
    """
    listen, results, shortfalls, bases = terminal.TerminalListener(), [], [], None
    placement_record: PlacementRecord | None = None
    # The remarks of all jobs come before the first one runs; the listener drops repeats.
    for remark in (remark for job in jobs for remark in job.remarks):
        listen.say(remark)
    for job in jobs:
        listen.note(f"files read; {spoken_settings(job.fit)}")
        if (
            look_set is not None
            and job.folder in look_set.variation_names
            and placement_record is not None
        ):
            job = job.with_placement(placement_record)
        elif placement_record is not None:
            # The basis is that of lights which another painting moved.
            bases, placement_record = None, None
        try:
            with listen:
                looks = run(job, listen, bases=None if bases is None else list(bases))
            # Several paintings of one scene share its basis, and variations the places of lights.
            bases = [look.basis for look in looks]
            if (placement := looks[0].placement) is not None and not placement.is_empty:
                placement_record = record_of(placement)
            if look_set is not None:
                look_set.finish_look(job, looks[0].lighting, bases)
        except LOOK_ERRORS as error:
            if look_set is None or not look_set.continues_after(job, error):
                raise
            continue
        _show(job, looks, table)
        for view, look in zip(job.views, looks, strict=True):
            results.append((job, view, look))
            shortfalls += [
                f"{view.folder} {x}" for x in tolerances.shortfalls(look.analysis.appearance)
            ]
    if look_set is not None:
        look_set.show(bases or [])
    if jobs and not jobs[0].scenes and jobs[0].groups is None:
        terminal.say("solved from a saved basis, without a render: lightpaint relight makes one")
    if shortfalls:
        terminal.complain("solve", some_of(shortfalls, joint="; "))
    variations = [] if look_set is None else look_set.shifted_looks

    def document() -> dict[str, Any]:
        results_document = {"results": [documents.result_document(*x, tolerances) for x in results]}
        return results_document | ({"variations": variations} if variations else {})

    return CommandOutcome(
        document,
        1 if shortfalls or (look_set is not None and look_set.failures) else 0,
    )


def _show(job: Job, looks: Sequence[Look], table: Table) -> None:
    """Print the results of one job."""
    for view, look in zip(job.views, looks, strict=True):
        if job.by_sensor:
            terminal.write("")
            terminal.write(f"{look.basis.origin.sensor}:")
        show_look(look, view.folder, table=table)
        if look.move_suggestion is not None:
            text = spoken_turn(look.move_suggestion)
            option = f"--aim {quote(f'{look.move_suggestion.name}={look.move_suggestion.aim}')}"
            terminal.write(f"{text} Let it turn: {option}")
        if look.suggestions is not None:
            tables.show_suggestions(look.suggestions, cd_per_unit=job.settings.cd_per_unit)
    if job.groups is not None:
        exports = ", ".join(name for name in EXPORTS if (job.folder / name).is_file())
        terminal.write(f"for other programs: {exports}")
