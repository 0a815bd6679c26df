"""Options of a batch run."""

from dataclasses import dataclass
from typing import Annotated

from lightpaint.validation import Option, a, check_fields, number, whole

#: Maximum number of processes, and of repetitions of a step: larger numbers are typing errors.
MAX_WORKERS, MAX_RETRY = 1024, 100


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
    Raises LightpaintError for an invalid value.
    """

    workers: Annotated[
        int,
        whole(1, MAX_WORKERS),
        Option(
            "--workers N",
            "number of processes that share the looks",
            default="%(default)s",
            theme="Machines",
        ),
    ] = 1
    keep_going: Annotated[
        bool,
        Option("--stop-early", "start nothing more after a look has failed", theme="Looks"),
    ] = True
    retry: Annotated[
        int,
        whole(0, MAX_RETRY),
        Option(
            "--retry N",
            "try a failed step up to N more times",
            default="%(default)s",
            theme="Looks",
        ),
    ] = 0
    shares_folder: Annotated[
        bool,
        Option(
            "--apart",
            "with --only: share the folder with processes that do other looks at the same time; "
            "the next run without this option writes the gallery",
            theme="Machines",
        ),
    ] = False
    cluster: Annotated[
        str | None,
        a(str, "the address of a scheduler"),
        Option(
            "--cluster ADDRESS",
            "let workers of a Dask cluster do the looks, and parts of bases; ADDRESS is the one of "
            "its scheduler, like tcp://scheduler:8786",
            theme="Machines",
        ),
    ] = None
    shared_fs: Annotated[
        bool,
        Option(
            "--shared-fs",
            "with --cluster: send no files, because workers see them all under the same paths",
            theme="Machines",
        ),
    ] = False
    task_limit_s: Annotated[
        float | None,
        number("seconds"),
        Option(
            "--task-limit SECONDS",
            "end a step after this time: its look fails, and the others go on. With --cluster, "
            "another worker tries it",
            default="20 times what it is expected to take, at least 300",
            theme="Machines",
        ),
    ] = None

    def __post_init__(self) -> None:
        check_fields(self)
