"""Worker processes on this machine."""

import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool

from threadpoolctl import threadpool_limits

from lightpaint.batch.work.engine import LOST, TRIES
from lightpaint.batch.work.work import do
from lightpaint.batch.work.work_items import Done, Errand, spoken
from lightpaint.batch.work.worker_cache import WorkerCache
from lightpaint.progress import Listener, silent
from lightpaint.scene.runtime.kernel_threads import limit_threads


class Processes:
    """Several at a time, in worker processes. One that dies takes nothing along but its own try."""

    is_apart = True
    is_gone = False

    def __init__(self, workers: int, listen: Listener = silent) -> None:
        self.workers, self._listen = workers, listen
        self._pool: ProcessPoolExecutor | None = None

    def __enter__(self) -> "Processes":
        return self

    def __exit__(self, *_: object) -> None:
        self._end()

    def run(self, errands: Sequence[Errand]) -> Iterator[Done]:
        """As of `Engine`."""
        waiting, tries = list(errands), dict.fromkeys((errand.name for errand in errands), 0)
        # Of several that were at work when one died nobody knows which did: each goes alone.
        suspects: list[Errand] = []
        try:
            while waiting or suspects:
                if waiting:
                    yield from self._together(waiting, suspects)
                while suspects:
                    errand = suspects.pop(0)
                    tries[errand.name] += 1
                    alone: list[Errand] = []
                    yield from self._together([errand], alone)
                    if alone and tries[errand.name] < TRIES:
                        suspects.append(errand)
                    elif alone:
                        yield Done(errand.name, errand.kind, LOST, is_lost=True)
        except BaseException:
            self._end()
            raise

    def _together(self, waiting: list[Errand], lost: list[Errand]) -> Iterator[Done]:
        """Empty `waiting`, as many at a time as there are workers, until one of them dies."""
        running: dict[Future[Done], Errand] = {}
        # Which process takes an errand only the pool knows, but so many are at work.
        places: dict[Future[Done], str] = {}
        free = [f"worker {k + 1}" for k in reversed(range(self.workers))]
        pool = self._started()
        while waiting or running:
            try:
                while waiting and len(running) < self.workers:
                    future = pool.submit(_work, waiting[0])
                    running[future], places[future] = waiting[0], free.pop()
                    self._listen.at_work(places[future], spoken(waiting[0]))
                    del waiting[0]
                finished, _ = wait(running, return_when=FIRST_COMPLETED)
                for future in finished:
                    done = future.result()
                    del running[future]
                    free.append(places.pop(future))
                    self._listen.at_work(free[-1], None)
                    yield done
            except BrokenProcessPool:
                lost += running.values()
                for place in places.values():
                    self._listen.at_work(place, None)
                self._end()
                return

    def _started(self) -> ProcessPoolExecutor:
        if self._pool is None:
            threads = max(1, (os.cpu_count() or 1) // self.workers)
            self._pool = ProcessPoolExecutor(
                self.workers,
                # A fork would have half of the renderer's threads.
                mp_context=multiprocessing.get_context("spawn"),
                initializer=_begin,
                initargs=(threads,),
            )
        return self._pool

    def _end(self) -> None:
        """Have all workers end now."""
        pool, self._pool = self._pool, None
        if pool is None:
            return
        workers = list((pool._processes or {}).values())
        pool.shutdown(wait=False, cancel_futures=True)
        for worker in workers:
            worker.terminate()
        for worker in workers:
            worker.join()


_HELD = WorkerCache()


def _begin(threads: int) -> None:
    """A worker begins: Ctrl-C is for the process that gives the work, and ends this one, too."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, str(threads))
    threadpool_limits(threads, "blas")
    limit_threads(threads)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """A worker whose parent was killed would wait for work for ever, or go on with what is lost."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _work(errand: Errand) -> Done:
    """In a worker: do it, and say what came of it."""
    return do(errand, _HELD, silent)
