"""Who does the tasks: this process, or several beside it. Another engine would be a third."""

import json
import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict
from typing import Protocol

from threadpoolctl import threadpool_limits

from lightpaint.batch.task import Done, Task
from lightpaint.batch.work import Held, do
from lightpaint.progress import Listener, silent

#: How often a task is given to a worker, where workers die over it.
TRIES = 2


class Executor(Protocol):
    """Does tasks that do not wait for each other."""

    @property
    def is_apart(self) -> bool:
        """Whether it works in other processes, which have no basis at hand."""

    def run(self, tasks: Sequence[Task]) -> Iterator[Done]:
        """What came of each, as it is done, in any order. Ending it early ends the work."""


class InProcess:
    """One after the other, here."""

    is_apart = False

    def __init__(self, held: Held, listen: Listener) -> None:
        self._held, self._listen = held, listen

    def run(self, tasks: Sequence[Task]) -> Iterator[Done]:
        """As of `Executor`, in the order of the tasks."""
        for task in tasks:
            yield do(task, self._held, self._listen)


class Processes:
    """Several at a time, in worker processes. One that dies takes nothing along but its own try."""

    is_apart = True

    def __init__(self, workers: int) -> None:
        self._workers = workers
        self._pool: ProcessPoolExecutor | None = None

    def __enter__(self) -> "Processes":
        return self

    def __exit__(self, *_: object) -> None:
        self._end()

    def run(self, tasks: Sequence[Task]) -> Iterator[Done]:
        """As of `Executor`."""
        waiting, tries = list(tasks), dict.fromkeys((task.look for task in tasks), 0)
        # Of several that were at work when one died nobody knows which did: each goes alone.
        suspects: list[Task] = []
        try:
            while waiting or suspects:
                if waiting:
                    yield from self._together(waiting, suspects)
                while suspects:
                    task = suspects.pop(0)
                    tries[task.look] += 1
                    alone: list[Task] = []
                    yield from self._together([task], alone)
                    if alone and tries[task.look] < TRIES:
                        suspects.append(task)
                    elif alone:
                        said = "its worker was killed, or ran out of memory"
                        yield Done(task.look, task.kind, said, is_lost=True)
        except BaseException:
            self._end()
            raise

    def _together(self, waiting: list[Task], lost: list[Task]) -> Iterator[Done]:
        """Empty `waiting`, as many at a time as there are workers, until one of them dies."""
        running: dict[Future[str], Task] = {}
        pool = self._started()
        while waiting or running:
            try:
                while waiting and len(running) < self._workers:
                    running[pool.submit(_work, waiting[0].to_json())] = waiting[0]
                    del waiting[0]
                finished, _ = wait(running, return_when=FIRST_COMPLETED)
                for future in finished:
                    done = _read(future.result())
                    del running[future]
                    yield done
            except BrokenProcessPool:
                lost += running.values()
                self._end()
                return

    def _started(self) -> ProcessPoolExecutor:
        if self._pool is None:
            threads = max(1, (os.cpu_count() or 1) // self._workers)
            self._pool = ProcessPoolExecutor(
                self._workers,
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


_HELD = Held()


def _begin(threads: int) -> None:
    """A worker begins: Ctrl-C is for the process that gives the work, and ends this one, too."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, str(threads))
    threadpool_limits(threads, "blas")
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """A worker whose parent was killed would wait for work for ever, or go on with what is lost."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _work(text: str) -> str:
    """In a worker: do what the text says, and say what came of it."""
    task = Task.from_json(text)
    _HELD.only(task.bases)
    return json.dumps(asdict(do(task, _HELD, silent)))


def _read(text: str) -> Done:
    return Done(**json.loads(text))
