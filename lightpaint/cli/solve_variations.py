"""Several looks of one `solve`: variations beside each answer, and a gallery of all."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from lightpaint import batch
from lightpaint.basis import Basis
from lightpaint.cli.output import terminal
from lightpaint.cli.output.documents import files_document
from lightpaint.errors import LOOK_ERRORS, LightpaintError, OutputError
from lightpaint.lighting import Lighting
from lightpaint.pipeline import Job, ResultFolder
from lightpaint.progress import Listener
from lightpaint.sentences import Hint, Sentence


@dataclass
class LookSet:
    """The looks of one command, with their variations and their gallery.

    gallery: folder of their gallery; None if a page of somebody else is there. keep_going: True to
    go on after a failure. variation_names: by folder, the variation of another look.
    derived_folders: by the folder of an answer, the variations computed from it, and their folders.
    failures: names of failed looks, with the reason. entries: the looks in the gallery.
    shifted_looks: documents of the variations computed from answers.
    """

    gallery: Path | None
    keep_going: bool
    variation_names: Mapping[Path, str]
    derived_folders: Mapping[Path, Mapping[str, ResultFolder]]
    failures: dict[str, str]
    entries: list[batch.LookEntry] = field(default_factory=list)
    shifted_looks: list[dict[str, Any]] = field(default_factory=list)

    def finish_look(
        self, job: Job, lighting: Lighting, bases: Sequence[Basis], listen: Listener
    ) -> None:
        """Write the variations that are computed from an answer."""
        self._enter(job)
        for word, place in self.derived_folders.get(job.folder, {}).items():
            batch.publish_shifted(job, word, place, lighting, bases, listen)
            self.entries.append(batch.entry_of(job, place.folder, word))
            files = [file for file in place.files if file.is_file()]
            relation = {"variation": word, "of": str(job.folder)}
            self.shifted_looks.append(files_document(place.folder, files, **relation))

    def continues_after(self, job: Job, error: LightpaintError) -> bool:
        """Return True if the other looks are solved in spite of an error."""
        if not self.keep_going or batch.is_disk_full(error):
            return False
        self._enter(job)
        self.failures[job.folder.name] = error.sentence
        return True

    def show(self, bases: Sequence[Basis]) -> None:
        """Print the failures, and write the gallery."""
        for name, reason in self.failures.items():
            terminal.complain("solve", Sentence(f"{name}: ", reason))
        if self.gallery is None:
            return
        entry_names = {entry.name for entry in self.entries}
        failed_entries = [
            batch.LookEntry(name, "") for name in self.failures if name not in entry_names
        ]
        rows = batch.write_solve_gallery(
            self.gallery, [*self.entries, *failed_entries], self.failures, bases
        )
        terminal.write(f"{self.gallery / batch.FILES[0]}: {batch.counts_text(rows)}")

    def _enter(self, job: Job) -> None:
        if all(entry.name != job.folder.name for entry in self.entries):
            self.entries.append(
                batch.entry_of(job, variation=self.variation_names.get(job.folder, ""))
            )


def look_set(
    jobs: Sequence[Job],
    words: Sequence[str],
    failures: dict[str, str],
    *,
    output: Path | None,
    keep_going: bool,
    force: bool,
) -> tuple[list[Job], LookSet]:
    """Return all jobs, variations after the looks that they vary, and the set of looks.

    words: variations. failures: receives the reason of each failure, by the name of the folder, if
    the others go on. output: the option's value.
    """
    _check_apart([job.folder for job in jobs], words)
    all_jobs: list[Job] = []
    variation_names: dict[Path, str] = {}
    derived_folders: dict[Path, Mapping[str, ResultFolder]] = {}
    for job in jobs:
        try:
            variations, places = batch.variation_jobs(job, words), batch.shifted_folders(job, words)
        except LOOK_ERRORS as error:
            if not keep_going:
                raise
            failures[job.folder.name] = error.sentence
            continue
        all_jobs += [job, *variations.values()]
        variation_names |= {sibling.folder: word for word, sibling in variations.items()}
        derived_folders[job.folder] = places
    gallery = _gallery_folder(output, [job.folder for job in jobs], force=force)
    return all_jobs, LookSet(gallery, keep_going, variation_names, derived_folders, failures)


def _check_apart(folders: Sequence[Path], words: Sequence[str]) -> None:
    """Raise OutputError where a variation would go to the folder of another painting."""
    for folder in (batch.variation_folder(x, word) for x in folders for word in words):
        if folder in folders:
            raise OutputError(
                f"a variation and a painting would both go to {folder}: solve them separately, "
                "each with its own ",
                Hint("folder"),
            )


def _gallery_folder(output: Path | None, folders: Sequence[Path], *, force: bool) -> Path | None:
    """Return the folder for the gallery of all looks, which contains theirs.

    None if no folder was given and it holds a foreign page, or a look.
    """
    place = folders[0].parent if folders else output or Path()
    try:
        if reserved_name := next((x.name for x in folders if batch.is_reserved(x.name)), ""):
            raise OutputError(
                f"{reserved_name} is a folder of the gallery of several looks: give the "
                "painting another name"
            )
        batch.check_gallery(place, force=force)
    except OutputError:
        if output is not None:
            raise
        return None
    return place
