"""How a batch is done, and what it came to."""

from dataclasses import dataclass, field

from lightpaint.batch.gallery.summary import Row


@dataclass(frozen=True)
class How:
    """How a plan is done.

    workers: processes; 1 for none beside this. keep_going: whether what fails stops nothing else.
    retry: how often a step that failed is tried again. apart: whether others do the other looks of
    the plan at the same time, in the same folder; the gallery is left to who comes last.
    cluster: address of a Dask scheduler whose workers do the work. shared_fs: whether they see the
    same files under the same paths. task_limit_s: seconds after which one of them counts as hung.
    """

    workers: int = 1
    keep_going: bool = True
    retry: int = 0
    apart: bool = False
    cluster: str | None = None
    shared_fs: bool = False
    task_limit_s: float | None = None


@dataclass
class BatchOutcome:
    """What a run came to. done, failed: names of looks, and why. skipped: done earlier.

    waiting: what was not come to. rows: of all looks, as the summary has them.
    """

    done: list[str] = field(default_factory=list)
    failed: dict[str, str] = field(default_factory=dict)
    skipped: list[str] = field(default_factory=list)
    waiting: list[str] = field(default_factory=list)
    rows: list[Row] = field(default_factory=list)
