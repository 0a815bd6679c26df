"""An engine of worker processes on this machine."""

import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool

from threadpoolctl import threadpool_limits

from lightpaint.batch.distribution.engine import LOST_TEXT, MAX_TRIES
from lightpaint.batch.work.item_execution import run_item
from lightpaint.batch.work.work_items import ItemResult, WorkItem, item_label
from lightpaint.batch.work.worker_cache import WorkerCache
from lightpaint.progress import Listener, silent
from lightpaint.scene.runtime.kernel_threads import limit_threads


class Processes:
    """An engine of several processes. One that dies costs only one try of its own item."""

    is_apart = True
    is_gone = False

    def __init__(self, workers: int, listen: Listener = silent) -> None:
        self.workers, self._listen = workers, listen
        self._pool: ProcessPoolExecutor | None = None

    def __enter__(self) -> "Processes":
        return self

    def __exit__(self, *_: object) -> None:
        self._stop_pool()

    def run(self, items: Sequence[WorkItem]) -> Iterator[ItemResult]:
        """Run the items; see `Engine`."""
        queue, try_counts = list(items), dict.fromkeys((item.name for item in items), 0)
        # When a process dies, any of the running items may be the cause: each is then run alone.
        suspects: list[WorkItem] = []
        try:
            while queue or suspects:
                if queue:
                    yield from self._run_parallel(queue, suspects)
                while suspects:
                    item = suspects.pop(0)
                    try_counts[item.name] += 1
                    lost_items: list[WorkItem] = []
                    yield from self._run_parallel([item], lost_items)
                    if lost_items and try_counts[item.name] < MAX_TRIES:
                        suspects.append(item)
                    elif lost_items:
                        yield ItemResult(item.name, item.kind, LOST_TEXT, is_lost=True)
        except BaseException:
            self._stop_pool()
            raise

    def _run_parallel(
        self, queue: list[WorkItem], lost_items: list[WorkItem]
    ) -> Iterator[ItemResult]:
        """Run the items in `queue`, one for each worker at a time, until a worker dies.

        Removes the started items from `queue`, and adds those that were running to `lost_items`.
        """
        running_items: dict[Future[ItemResult], WorkItem] = {}
        # The pool does not tell which process runs an item, so the display numbers the slots.
        slots: dict[Future[ItemResult], str] = {}
        free_slots = [f"worker {k + 1}" for k in reversed(range(self.workers))]
        pool = self._start_pool()
        while queue or running_items:
            try:
                while queue and len(running_items) < self.workers:
                    future = pool.submit(_run_item, queue[0])
                    running_items[future], slots[future] = queue[0], free_slots.pop()
                    self._listen.at_work(slots[future], item_label(queue[0]))
                    del queue[0]
                futures, _ = wait(running_items, return_when=FIRST_COMPLETED)
                for future in futures:
                    result = future.result()
                    del running_items[future]
                    free_slots.append(slots.pop(future))
                    self._listen.at_work(free_slots[-1], None)
                    yield result
            except BrokenProcessPool:
                lost_items += running_items.values()
                for place in slots.values():
                    self._listen.at_work(place, None)
                self._stop_pool()
                return

    def _start_pool(self) -> ProcessPoolExecutor:
        if self._pool is None:
            threads = max(1, (os.cpu_count() or 1) // self.workers)
            self._pool = ProcessPoolExecutor(
                self.workers,
                # A forked process would lack the renderer's threads.
                mp_context=multiprocessing.get_context("spawn"),
                initializer=_init_worker,
                initargs=(threads,),
            )
        return self._pool

    def _stop_pool(self) -> None:
        """Stop all workers now."""
        pool, self._pool = self._pool, None
        if pool is None:
            return
        workers = list((pool._processes or {}).values())
        pool.shutdown(wait=False, cancel_futures=True)
        for worker in workers:
            worker.terminate()
        for worker in workers:
            worker.join()


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
