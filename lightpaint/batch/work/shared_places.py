"""The work item that places lights for all looks that share them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

from lightpaint.batch.work.task import Task
from lightpaint.batch.work.work_items import PathMap
from lightpaint.batch.work.worker_cache import WorkerCache
from lightpaint.pipeline.job.job import Job
from lightpaint.pipeline.job.job_record import decode_job
from lightpaint.pipeline.placed_lights import find_places
from lightpaint.placement.placement import record_of
from lightpaint.progress import Listener


@dataclass(frozen=True)
class SharedPlacing:
    """An item that searches for places; its value is the record as text.

    tasks: answers of the looks whose paintings decide. bases: keys of the bases of all their views;
    files: where these are saved, "" if they are in memory. fingerprint: of the group.
    """

    name: str
    tasks: tuple[Task, ...]
    bases: tuple[str, ...]
    files: tuple[str, ...]
    fingerprint: str
    expected_s: float
    kind: Literal["places"] = "places"
    output_folder: str = ""

    @property
    def input_files(self) -> tuple[str, ...]:
        """Files of the scene and of the paintings."""
        return tuple(dict.fromkeys(file for task in self.tasks for file in task.source_files))

    @property
    def local_files(self) -> tuple[str, ...]:
        """Saved bases."""
        return tuple(file for file in self.files if file)

    def with_paths(self, move: PathMap) -> "SharedPlacing":
        """Return the same item with other paths."""
        return replace(
            self,
            tasks=tuple(task.with_paths(move) for task in self.tasks),
            files=tuple(file and move(file) for file in self.files),
        )


def find_shared_places(item: SharedPlacing, cache: WorkerCache, listen: Listener) -> str:
    """Return the record of the places that all looks of an item want."""
    for key, file in zip(item.bases, item.files, strict=True):
        cache.load(key, file)
    bases = [basis for key in item.bases if (basis := cache.basis(key)) is not None]
    jobs = [Job(**_fields(task, cache)) for task in item.tasks]
    placement = find_places(jobs, bases, listen)
    looks: Sequence[str] = [task.look for task in item.tasks]
    looks = looks if len(looks) > 1 else ()
    return record_of(placement, looks=looks, made_of=item.fingerprint).to_json()


def _fields(task: Task, cache: WorkerCache) -> dict[str, Any]:
    """Return the fields of a look's job, whose lights are where the scene has them."""
    fields = decode_job(task.job)
    return fields | {"scenes": tuple(map(cache.scene, fields["scenes"])), "placement": None}
