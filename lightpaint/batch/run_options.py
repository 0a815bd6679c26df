"""Options and outcome of a batch run."""

from dataclasses import dataclass, field

from lightpaint.batch.gallery.summary import SummaryRow


@dataclass(frozen=True)
class RunOptions:
    """Options of a run.

    workers: processes; 1 for this process alone. keep_going: whether to continue with the other
    looks after a failure. retry: how often a failed step is tried again. shares_folder: whether
    other processes do other looks of the plan at the same time in the same folder; the last one
    writes the gallery.
    cluster: address of a Dask scheduler whose workers do the work. shared_fs: whether they see the
    same files under the same paths. task_limit_s: seconds after which a step is ended: it fails, or
    a cluster counts its worker as hung and lets another try it.
    """

    workers: int = 1
    keep_going: bool = True
    retry: int = 0
    shares_folder: bool = False
    cluster: str | None = None
    shared_fs: bool = False
    task_limit_s: float | None = None


@dataclass
class BatchOutcome:
    """Outcome of a run. done, failed: names of looks, and reasons. skipped: done earlier.

    waiting: not started. rows: of all looks, as in the summary.
    """

    done: list[str] = field(default_factory=list)
    failed: dict[str, str] = field(default_factory=dict)
    skipped: list[str] = field(default_factory=list)
    waiting: list[str] = field(default_factory=list)
    rows: list[SummaryRow] = field(default_factory=list)
