"""What a worker of a Dask cluster is asked to do for a batch. All of it runs in one thread.

Mitsuba is one for a process: of several tasks that Dask gives a worker at a time one is at work.
"""

import ctypes
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from lightpaint.batch.cluster.parcels import Parcel, ParcelStore
from lightpaint.batch.work.work import do
from lightpaint.batch.work.work_items import Done, spoken
from lightpaint.batch.work.worker_cache import WorkerCache
from lightpaint.progress import silent
from lightpaint.scene.runtime.kernel_threads import limit_threads
from lightpaint.version import __version__

#: Of glibc's mallopt: what it sets, and bytes, as they come to by themselves where nobody sets any.
KEPT = {-1: 2**26, -3: 2**25}  # M_TRIM_THRESHOLD, M_MMAP_THRESHOLD


def _keep_memory() -> None:
    """Keep what arrays of a few hundred kilobytes have been in for the next ones.

    Dask has its workers give it back at once (MALLOC_TRIM_THRESHOLD_): the system then clears it
    for each block of pixels anew, which takes longer than the arithmetic.
    """
    with suppress(AttributeError, OSError):
        mallopt = ctypes.CDLL(None).mallopt
        for what, size in KEPT.items():
            mallopt(what, size)


class _Here:
    """What this process has at hand."""

    def __init__(self) -> None:
        self.thread = ThreadPoolExecutor(1, "lightpaint")
        self.held, self.run = WorkerCache(), ""
        self.stores: dict[str, ParcelStore] = {}

    def store(self, worker: Any) -> ParcelStore:
        """The files of that worker; they are deleted with its folder."""
        folder = str(worker.local_directory)
        return self.stores.setdefault(folder, ParcelStore(Path(folder) / "lightpaint"))


_HERE = _Here()


def versions() -> dict[str, str]:
    """Of what decides on the last bit of a result."""
    from importlib.metadata import version

    found = {name: version(name) for name in ("mitsuba", "drjit", "numpy")}
    return {"lightpaint": __version__, **found}


def put(sum_: str, data: bytes, is_first: bool, is_last: bool, dask_worker: Any = None) -> None:
    """Take a piece of a file into this worker's store."""
    _HERE.store(dask_worker).put(sum_, data, is_first=is_first, is_last=is_last)


def do_parcel(parcel: Parcel) -> Done | list[str]:
    """What comes of an errand; or the SHA-256 of files that have to be sent before."""
    from distributed import get_worker

    return _HERE.thread.submit(_do, parcel, get_worker()).result()


def _do(parcel: Parcel, worker: Any) -> Done | list[str]:
    store = _HERE.store(worker)
    if lacking := store.lacking(parcel):
        return lacking
    if _HERE.run != parcel.run:
        # Files of another batch may have the same names, and are others.
        _HERE.held.rest()
        _HERE.held, _HERE.run = WorkerCache(), parcel.run
        threadpool_limits(worker.state.nthreads, "blas")
        limit_threads(worker.state.nthreads)
        _keep_memory()
    worker.log_event(parcel.run, {"errand": spoken(parcel.errand), "worker": worker.address})
    return store.done(parcel, lambda errand: do(errand, _HERE.held, silent))
