"""Functions that a worker of a Dask cluster runs for a batch, all in one thread.

A process has one Mitsuba, so a worker runs one task at a time, however many Dask gives it.
"""

import ctypes
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from lightpaint.batch.cluster.parcels import Parcel, ParcelStore
from lightpaint.batch.work.item_execution import run_item
from lightpaint.batch.work.work_items import ItemResult, item_label
from lightpaint.batch.work.worker_storage import WorkerCache
from lightpaint.progress import silent
from lightpaint.scene.runtime.kernel_threads import limit_threads
from lightpaint.version import __version__

#: Parameters of glibc's mallopt, with the values it settles at by itself.
MALLOPT_VALUES = {-1: 2**26, -3: 2**25}  # M_TRIM_THRESHOLD, M_MMAP_THRESHOLD


def _keep_memory() -> None:
    """Keep the memory of arrays of a few hundred kilobytes for the next ones.

    Dask's workers return it to the system at once (MALLOC_TRIM_THRESHOLD_). The system then has to
    clear it for each block of pixels, which takes longer than the arithmetic.
    """
    with suppress(AttributeError, OSError):
        mallopt = ctypes.CDLL(None).mallopt
        for parameter, size in MALLOPT_VALUES.items():
            mallopt(parameter, size)


class _WorkerState:
    """State of this process between work items."""

    def __init__(self) -> None:
        self.thread = ThreadPoolExecutor(1, "lightpaint")
        self.cache, self.run = WorkerCache(), ""
        self.stores: dict[str, ParcelStore] = {}

    def store(self, worker: Any) -> ParcelStore:
        """Return the file store of a worker; it is deleted with the worker's folder."""
        folder = str(worker.local_directory)
        return self.stores.setdefault(folder, ParcelStore(Path(folder) / "lightpaint"))


_STATE = _WorkerState()


def versions() -> dict[str, str]:
    """Return the versions of packages that affect the last bit of a result."""
    from importlib.metadata import version

    packages = {name: version(name) for name in ("mitsuba", "drjit", "numpy")}
    return {"lightpaint": __version__, **packages}


def put(digest: str, data: bytes, is_first: bool, is_last: bool, dask_worker: Any = None) -> None:
    """Add a piece of a file to this worker's store."""
    _STATE.store(dask_worker).put(digest, data, is_first=is_first, is_last=is_last)


def do_parcel(parcel: Parcel) -> ItemResult | list[str]:
    """Run an item and return its result, or the SHA-256 of files that are missing."""
    from distributed import get_worker

    return _STATE.thread.submit(_do, parcel, get_worker()).result()


def _do(parcel: Parcel, worker: Any) -> ItemResult | list[str]:
    store = _STATE.store(worker)
    if missing := store.missing(parcel):
        return missing
    if _STATE.run != parcel.run:
        # Files of another batch may have the same names and other contents.
        _STATE.cache.release_renderer()
        _STATE.cache, _STATE.run = WorkerCache(), parcel.run
        threadpool_limits(worker.state.nthreads, "blas")
        limit_threads(worker.state.nthreads)
        _keep_memory()
    worker.log_event(parcel.run, {"item": item_label(parcel.item), "worker": worker.address})
    return store.run_parcel(parcel, lambda item: run_item(item, _STATE.cache, silent))
