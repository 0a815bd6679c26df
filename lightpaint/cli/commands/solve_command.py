"""`lightpaint solve`: one painting or several, their variations, and a gallery of all."""

from collections.abc import Sequence
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Any

from lightpaint.basis import Basis
from lightpaint.cli.commands.answer_text import Table, show_look, spoken_settings
from lightpaint.cli.output import documents, tables, terminal
from lightpaint.cli.output.lines import CommandOutcome
from lightpaint.cli.tolerances import Tolerances
from lightpaint.display_text import some_of
from lightpaint.errors import LOOK_ERRORS
from lightpaint.pipeline import Job, Look, PaintedView, frames_to_write, relight_frames, run
from lightpaint.placement import PlacementRecord, record_of
from lightpaint.relit import EXPORTS
from lightpaint.report import spoken_turn

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
    frames: str | None = None,
) -> CommandOutcome:
    """Run `lightpaint solve SCENE|BASIS TARGET...` or `SCENE --target SENSOR=TARGET...`.

    look_set: the set of looks, if there are several. frames: of a shot to write, as
    `parse_frames` reads them.
    """
    chosen_frames = [frames_to_write(job, frames) for job in jobs]
    listen, shared = terminal.TerminalListener(), _SharedWork()
    results: list[tuple[Job, PaintedView, Look]] = []
    frame_files: list[Path] = []
    # The remarks of all jobs come before the first one runs; the listener drops repeats.
    for remark in (remark for job in jobs for remark in job.remarks):
        listen.say(remark)
    for job, job_frames in zip(jobs, chosen_frames, strict=True):
        listen.note(f"files read; {spoken_settings(job.fit)}")
        is_variation = look_set is not None and job.folder in look_set.variation_names
        job = shared.prepare(job, is_variation=is_variation)
        try:
            with listen:
                looks = run(job, listen, bases=None if shared.bases is None else [*shared.bases])
            shared.take_from(looks)
            if look_set is not None:
                bases = [look.basis for look in looks]
                look_set.finish_look(job, looks[0].lighting, bases, listen)
        except LOOK_ERRORS as error:
            if look_set is None or not look_set.continues_after(job, error):
                raise
            continue
        _show(job, looks, table)
        if job_frames:
            frame_files += _write_frames(job, job_frames, listen)
        results += [(job, view, look) for view, look in zip(job.views, looks, strict=True)]
    if look_set is not None:
        look_set.show(shared.bases or [])
    if jobs and not jobs[0].scenes and jobs[0].groups is None:
        terminal.say("solved from a saved basis, without a render: lightpaint relight makes one")
    return _outcome(results, tolerances, look_set, frame_files)


def _write_frames(job: Job, frames: Sequence[int], listen: terminal.TerminalListener) -> list[Path]:
    """Write frames of a shot, and print which."""
    try:
        with listen:
            files = relight_frames(job, frames=frames, progress=listen)
    except KeyboardInterrupt:
        raise KeyboardInterrupt("frames that are written stay; the same command goes on") from None
    count = f" to {files[-1].name}, {len(files)} files" if len(files) > 1 else ""
    terminal.write(f"frames: {files[0]}{count}")
    return files


class _SharedWork:
    """Results that the jobs of one command share: several paintings of one scene its bases, and
    variations the places of lights.
    """

    def __init__(self) -> None:
        self.bases: list[Basis] | None = None
        self._placement: PlacementRecord | None = None

    def prepare(self, job: Job, *, is_variation: bool) -> Job:
        """Return the next job: a variation has the places that were found for its original."""
        if self._placement is None:
            return job
        if is_variation:
            return job.with_placement(self._placement)
        # The bases are from lights which another painting moved.
        self.bases, self._placement = None, None
        return job

    def take_from(self, looks: Sequence[Look]) -> None:
        """Keep the results of a job for those that follow."""
        self.bases = [look.basis for look in looks]
        if (placement := looks[0].placement) is not None and not placement.is_empty:
            self._placement = record_of(placement)


def _outcome(
    results: Sequence[tuple[Job, PaintedView, Look]],
    tolerances: Tolerances,
    look_set: "LookSet | None",
    frame_files: Sequence[Path],
) -> CommandOutcome:
    """Print the requirements that are not met, and return the results for programs."""
    shortfalls = [
        f"{view.folder} {text}"
        for _, view, look in results
        for text in tolerances.shortfalls(look.analysis.appearance)
    ]
    if shortfalls:
        terminal.complain("solve", some_of(shortfalls, joint="; "))
    variations = [] if look_set is None else look_set.shifted_looks

    def document() -> dict[str, Any]:
        results_document: dict[str, Any] = {
            "results": [documents.result_document(*x, tolerances) for x in results]
        }
        if frame_files:
            results_document["frames"] = [str(file) for file in frame_files]
        return results_document | ({"variations": variations} if variations else {})

    has_failures = look_set is not None and look_set.failures
    answers = [look.planes for *_, look in results if look.planes is not None]
    has_missed_wishes = any(x.missed and not x.are_ignored for x in answers)
    return CommandOutcome(document, 1 if shortfalls or has_missed_wishes or has_failures else 0)


def _show(job: Job, looks: Sequence[Look], table: Table) -> None:
    """Print the results of one job."""
    for view, look in zip(job.views, looks, strict=True):
        if job.by_sensor or len(looks) > 1:
            terminal.write("")
            terminal.write(f"{'frame ' * bool(job.sequence)}{view.folder.name}:")
        show_look(look, view.folder, table=table)
        if look is not looks[-1]:
            continue
        # Suggestions are of all views together.
        if look.move_suggestion is not None:
            text = spoken_turn(look.move_suggestion)
            option = f"--aim {quote(f'{look.move_suggestion.name}={look.move_suggestion.aim}')}"
            terminal.write(f"{text} Let it turn: {option}")
        if look.suggestions is not None:
            tables.show_suggestions(look.suggestions, cd_per_unit=job.settings.cd_per_unit)
    if job.groups is not None:
        exports = ", ".join(name for name in EXPORTS if (job.folder / name).is_file())
        terminal.write(f"for other programs: {exports}")
