"""Several looks of one `solve`: variations beside each answer, and a gallery of all."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from lightpaint.batch.gallery import check_gallery
from lightpaint.batch.made import shifted_folders, sibling_folder, siblings
from lightpaint.batch.plan import ALONE
from lightpaint.errors import OutputError
from lightpaint.job import Job
from lightpaint.result_folder import ResultFolder


@dataclass(frozen=True)
class Several:
    """What several looks of one command are to each other.

    together: folder of a gallery of all. keep_going: whether one that is bad fails alone. called:
    by folder, what is a variation of another. made: by the folder of an answer, the variations that
    are made of it, and where they go.
    """

    together: Path | None = None
    keep_going: bool = False
    called: Mapping[Path, str] = field(default_factory=dict)
    made: Mapping[Path, Mapping[str, ResultFolder]] = field(default_factory=dict)


def several_of(
    jobs: Sequence[Job],
    words: Sequence[str],
    failed: dict[str, str],
    *,
    is_shown: bool,
    output: Path | None,
    keep_going: bool,
    force: bool,
) -> tuple[list[Job], Several]:
    """All jobs, those of variations behind the looks that they vary, and what goes with them.

    words: variations. failed: receives why, by the name of its folder, where one of them cannot be
    done and the others go on. is_shown: whether there is a gallery. output: as it was given.
    """
    _check_apart([job.folder for job in jobs], words)
    found: list[Job] = []
    called: dict[Path, str] = {}
    made: dict[Path, Mapping[str, ResultFolder]] = {}
    for job in jobs:
        try:
            anew, places = siblings(job, words), shifted_folders(job, words)
        except ALONE as error:
            if not keep_going:
                raise
            failed[job.folder.name] = str(error)
            continue
        found += [job, *anew.values()]
        called |= {sibling.folder: word for word, sibling in anew.items()}
        made[job.folder] = places
    together = None
    if is_shown:
        together = _together(output, [job.folder for job in jobs], force=force)
    return found, Several(together, keep_going, called, made)


def _check_apart(folders: Sequence[Path], words: Sequence[str]) -> None:
    """Raise OutputError where a variation would go to the folder of another painting."""
    for folder in (sibling_folder(x, word) for x in folders for word in words):
        if folder in folders:
            raise OutputError(
                f"a variation and a painting would both go to {folder}: solve them apart, each "
                "with its own folder=..."
            )


def _together(output: Path | None, folders: Sequence[Path], *, force: bool) -> Path | None:
    """Where the gallery of all looks goes: beside their folders.

    None where none was named and somebody else's page lies there.
    """
    place = folders[0].parent if folders else output or Path()
    try:
        check_gallery(place, force=force)
    except OutputError:
        if output is not None:
            raise
        return None
    return place
