"""The gallery of one `solve` command's looks, without a manifest."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from lightpaint.basis.basis import Basis
from lightpaint.batch.gallery.gallery import write_gallery
from lightpaint.batch.gallery.small_planes import write_planes
from lightpaint.batch.gallery.summary import SummaryRow
from lightpaint.batch.manifest.entries import LookEntry
from lightpaint.batch.plan.journal import JournalLine
from lightpaint.batch.plan.plan import Plan, PlannedLook, PlanStep
from lightpaint.batch.work.task import Kind, Task
from lightpaint.pipeline.job.job import Job
from lightpaint.pipeline.job.sources import BasisFile, GroupsFile, SceneFile


def entry_of(job: Job, folder: Path | None = None, variation: str = "") -> LookEntry:
    """Return a gallery's entry for a look.

    `job` solved the look or, if `folder` is given, the look was derived from the job's answer.
    variation: its word.
    """
    scenes = tuple(scene for scene in job.scenes if isinstance(scene, SceneFile))
    basis = job.basis if isinstance(job.basis, BasisFile | GroupsFile) else None
    return LookEntry(
        (folder or job.folder).name,
        "",
        scenes,
        basis,
        by_sensor=job.by_sensor,
        variation=variation,
        combined_looks=() if folder is None else (job.folder.name,),
    )


def write_solve_gallery(
    folder: Path, entries: Sequence[LookEntry], failures: Mapping[str, str], bases: Sequence[Basis]
) -> list[SummaryRow]:
    """Write the gallery of the looks in `folder`, by the names of their folders there.

    failures: reasons by name. bases: one for each view, shared by all looks.
    """
    looks, lines = [], {}
    keys = tuple(json.dumps({"view": k}) for k in range(len(bases)))
    for key, basis in zip(keys, bases, strict=True):
        write_planes(folder, key, basis)
    for entry in entries:
        name = entry.name
        fingerprint = "" if name in failures else _content(folder / name / "lighting.json")
        step = PlanStep(Task(name, "answer", "", bases=keys), fingerprint, True)
        looks.append(PlannedLook(entry, folder / name, (step,)))
        line_key: tuple[str, Kind] = (name, "answer")
        state = "failed" if name in failures else "done"
        lines[line_key] = JournalLine(name, "answer", state, fingerprint, failures.get(name, ""))  # type: ignore[arg-type]
    names = frozenset(entry.name for entry in entries)
    plan = Plan(Path(folder.resolve().name), folder, tuple(looks), {}, names)
    return write_gallery(folder, plan, lines)


def _content(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else ""
