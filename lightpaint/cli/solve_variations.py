"""Several looks of one `solve`: variations beside each answer, and a gallery of all."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from lightpaint.basis.basis import Basis
from lightpaint.batch.gallery.gallery import counts_text
from lightpaint.batch.gallery.solve_gallery import entry_of, write_solve_gallery
from lightpaint.batch.manifest.entries import LookEntry
from lightpaint.batch.manifest.folder_names import FILES, check_gallery, is_reserved
from lightpaint.batch.work.derived_looks import (
    publish_shifted,
    shifted_folders,
    variation_folder,
    variation_jobs,
)
from lightpaint.batch.work.work import is_disk_full
from lightpaint.cli.output import terminal
from lightpaint.cli.output.documents import files_document
from lightpaint.errors import LOOK_ERRORS, OutputError
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.pipeline.job import Job
from lightpaint.pipeline.result_folder import ResultFolder


@dataclass
class Several:
    """What several looks of one command are to each other.

    together: folder of a gallery of all; None where somebody else's page lies there. keep_going:
    whether one that is bad fails alone. called: by folder, what is a variation of another. made: by
    the folder of an answer, the variations that are made of it, and where they go. failed: names of
    those that cannot be done, and why. entries: what the gallery shows. shifted: documents of the
    variations that are made of answers.
    """

    together: Path | None
    keep_going: bool
    called: Mapping[Path, str]
    made: Mapping[Path, Mapping[str, ResultFolder]]
    failed: dict[str, str]
    entries: list[LookEntry] = field(default_factory=list)
    shifted: list[dict[str, Any]] = field(default_factory=list)

    def is_done(self, job: Job, lighting: Lighting, bases: Sequence[Basis]) -> None:
        """Make the variations of an answer that are made of it."""
        self._enter(job)
        for word, place in self.made.get(job.folder, {}).items():
            publish_shifted(job, word, place, lighting, bases)
            self.entries.append(entry_of(job, place.folder, word))
            files = [file for file in place.files if file.is_file()]
            about = {"variation": word, "of": str(job.folder)}
            self.shifted.append(files_document(place.folder, files, **about))

    def goes_on(self, job: Job, error: Exception) -> bool:
        """Whether the others are solved all the same."""
        if not self.keep_going or is_disk_full(error):
            return False
        self._enter(job)
        self.failed[job.folder.name] = str(error)
        return True

    def show(self, bases: Sequence[Basis]) -> None:
        """Say what failed, and write the gallery."""
        for name, why in self.failed.items():
            terminal.complain("solve", f"{name}: {why}")
        if self.together is None:
            return
        named = {entry.name for entry in self.entries}
        lost = [LookEntry(name, "") for name in self.failed if name not in named]
        rows = write_solve_gallery(self.together, [*self.entries, *lost], self.failed, bases)
        terminal.write(f"{self.together / FILES[0]}: {counts_text(rows)}")

    def _enter(self, job: Job) -> None:
        if all(entry.name != job.folder.name for entry in self.entries):
            self.entries.append(entry_of(job, variation=self.called.get(job.folder, "")))


def several_of(
    jobs: Sequence[Job],
    words: Sequence[str],
    failed: dict[str, str],
    *,
    output: Path | None,
    keep_going: bool,
    force: bool,
) -> tuple[list[Job], Several]:
    """All jobs, those of variations behind the looks that they vary, and what goes with them.

    words: variations. failed: receives why, by the name of its folder, where one of them cannot be
    done and the others go on. output: as it was given.
    """
    _check_apart([job.folder for job in jobs], words)
    found: list[Job] = []
    called: dict[Path, str] = {}
    made: dict[Path, Mapping[str, ResultFolder]] = {}
    for job in jobs:
        try:
            anew, places = variation_jobs(job, words), shifted_folders(job, words)
        except LOOK_ERRORS as error:
            if not keep_going:
                raise
            failed[job.folder.name] = str(error)
            continue
        found += [job, *anew.values()]
        called |= {sibling.folder: word for word, sibling in anew.items()}
        made[job.folder] = places
    together = _together(output, [job.folder for job in jobs], force=force)
    return found, Several(together, keep_going, called, made, failed)


def _check_apart(folders: Sequence[Path], words: Sequence[str]) -> None:
    """Raise OutputError where a variation would go to the folder of another painting."""
    for folder in (variation_folder(x, word) for x in folders for word in words):
        if folder in folders:
            raise OutputError(
                f"a variation and a painting would both go to {folder}: solve them apart, each "
                "with its own folder=..."
            )


def _together(output: Path | None, folders: Sequence[Path], *, force: bool) -> Path | None:
    """Where the gallery of all looks goes: beside their folders.

    None where none was named and somebody else's page, or a look, lies there.
    """
    place = folders[0].parent if folders else output or Path()
    try:
        if taken := next((x.name for x in folders if is_reserved(x.name)), ""):
            raise OutputError(
                f"{taken} is where the gallery of several looks has files of its own: give the "
                "painting another name"
            )
        check_gallery(place, force=force)
    except OutputError:
        if output is not None:
            raise
        return None
    return place
