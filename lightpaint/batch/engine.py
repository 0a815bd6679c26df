"""Engines that run work items: this process, worker processes on this machine, or a cluster
(dask_engine.py).
"""

import multiprocessing
import os
import signal
import threading
import time
from collections import Counter, deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from typing import Protocol

from threadpoolctl import threadpool_limits

from lightpaint.batch.work.item_execution import run_item
from lightpaint.batch.work.work_items import ItemResult, WorkItem, item_label
from lightpaint.batch.work.worker_storage import WorkerCache
from lightpaint.progress import Listener, silent
from lightpaint.scene.runtime.kernel_threads import limit_threads

#: Number of tries of an item if workers die over it.
MAX_TRIES = 3

#: Failure of an item over which every worker has died.
LOST_TEXT = "its worker was killed, or ran out of memory"

#: Failure of an item that took longer than allowed.
TOO_LONG_TEXT = "it took longer than {limit_s:g} s: allow more time, or take fewer samples"


class Engine(Protocol):
    """An engine for work items that do not depend on each other."""

    @property
    def is_apart(self) -> bool:
        """True if it uses other processes, which have no basis in memory."""

    @property
    def is_gone(self) -> bool:
        """True once no worker can be reached, which counts as no look's failure."""

    @property
    def workers(self) -> int:
        """Number of items that it runs at a time, as far as it knows."""

    def run(self, items: Sequence[WorkItem]) -> Iterator[ItemResult]:
        """Yield the result of each item as it is done, in any order.

        If a worker dies over an item, another one tries it. Closing the iterator ends the work.
        """


class InProcess:
    """An engine that runs items in this process, one after the other."""

    is_apart = False
    is_gone = False
    workers = 1

    def __init__(self, cache: WorkerCache, listen: Listener) -> None:
        self._cache, self._listen = cache, listen

    def run(self, items: Sequence[WorkItem]) -> Iterator[ItemResult]:
        """Run the items in their order; see `Engine`."""
        try:
            for item in items:
                yield run_item(item, self._cache, self._listen)
        finally:
            self._cache.release_renderer()


@dataclass(frozen=True)
class _ItemRun:
    """A run of an item. slot: number of the process that does it. begin_s: when it was sent."""

    item: WorkItem
    slot: int
    begin_s: float


class Processes:
    """An engine of several processes. One that dies costs only one try of its own item.

    limit_s: seconds that an item may take; a process that takes longer is killed, and its item
    fails.
    """

    is_apart = True
    is_gone = False

    def __init__(
        self, workers: int, listen: Listener = silent, *, limit_s: float | None = None
    ) -> None:
        self.workers, self._listen, self._limit_s = workers, listen, limit_s
        # A pool with several processes would not tell which of them runs an item.
        self._pools: dict[int, ProcessPoolExecutor] = {}

    def __enter__(self) -> "Processes":
        return self

    def __exit__(self, *_: object) -> None:
        self._kill(self._pools)

    def run(self, items: Sequence[WorkItem]) -> Iterator[ItemResult]:
        """Run the items; see `Engine`."""
        queue, free_slots = deque(items), list(reversed(range(self.workers)))
        try_counts: Counter[str] = Counter()
        runs: dict[Future[ItemResult], _ItemRun] = {}
        try:
            while queue or runs:
                while queue and free_slots:
                    run = _ItemRun(queue.popleft(), free_slots.pop(), time.monotonic())
                    runs[self._begin(run)] = run
                finished, _ = wait(runs, self._wait_s(runs.values()), FIRST_COMPLETED)
                for future in finished or self._overdue(runs):
                    run = runs.pop(future)
                    result = self._end(run, future)
                    free_slots.append(run.slot)
                    if result is not None:
                        yield result
                        continue
                    try_counts[run.item.name] += 1
                    if try_counts[run.item.name] < MAX_TRIES:
                        queue.append(run.item)
                    else:
                        yield ItemResult(run.item.name, run.item.kind, LOST_TEXT, is_lost=True)
        except BaseException:
            self._kill(self._pools)
            raise

    def _begin(self, run: _ItemRun) -> "Future[ItemResult]":
        """Send an item to the process of its slot."""
        if run.slot not in self._pools:
            threads = max(1, (os.cpu_count() or 1) // self.workers)
            self._pools[run.slot] = ProcessPoolExecutor(
                1,
                # A forked process would lack the renderer's threads.
                mp_context=multiprocessing.get_context("spawn"),
                initializer=_init_worker,
                initargs=(threads,),
            )
        self._listen.at_work(_label(run), item_label(run.item))
        return self._pools[run.slot].submit(_run_item, run.item)

    def _end(self, run: _ItemRun, future: "Future[ItemResult]") -> ItemResult | None:
        """Return the result of an item that is finished or overdue; None if its process died."""
        try:
            if future.done():
                return future.result()
            self._kill([run.slot])
            reason = TOO_LONG_TEXT.format(limit_s=self._limit_s)
            spent_s = time.monotonic() - run.begin_s
            return ItemResult(run.item.name, run.item.kind, reason, spent_s=spent_s)
        except BrokenProcessPool:
            self._kill([run.slot])
            return None
        finally:
            self._listen.at_work(_label(run), None)

    def _wait_s(self, runs: Iterable[_ItemRun]) -> float | None:
        """Return the seconds until the first item is overdue; None without a limit."""
        if self._limit_s is None:
            return None
        return max(0.0, min(run.begin_s for run in runs) + self._limit_s - time.monotonic())

    def _overdue(self, runs: Mapping["Future[ItemResult]", _ItemRun]) -> list["Future[ItemResult]"]:
        now_s, limit_s = time.monotonic(), self._limit_s or 0.0
        return [future for future, run in runs.items() if now_s - run.begin_s >= limit_s]

    def _kill(self, slots: Iterable[int]) -> None:
        """Kill the processes of these slots; the next items there begin new ones."""
        pools = [self._pools.pop(slot) for slot in list(slots)]
        workers = [worker for pool in pools for worker in (pool._processes or {}).values()]
        for pool in pools:
            pool.shutdown(wait=False, cancel_futures=True)
        for worker in workers:
            worker.kill()
        for worker in workers:
            worker.join()


def _label(run: _ItemRun) -> str:
    return f"worker {run.slot + 1}"


_CACHE = WorkerCache()


def _init_worker(threads: int) -> None:
    """Prepare a worker: it ignores Ctrl-C, which its parent handles by ending it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, str(threads))
    threadpool_limits(threads, "blas")
    limit_threads(threads)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """End this worker with its parent: otherwise it would wait for ever, or work for nobody."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _run_item(item: WorkItem) -> ItemResult:
    """Run an item in a worker."""
    return run_item(item, _CACHE, silent)
