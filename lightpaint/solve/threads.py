"""Threads: one for products of small blocks, several for problems that have nothing in common."""

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager
from functools import cache
from threading import Lock
from typing import Any, TypeVar

# The controller finds the libraries that are loaded: numpy has to be.
import numpy as np  # noqa: F401
from threadpoolctl import ThreadpoolController

Job = TypeVar("Job")
Result = TypeVar("Result")


@cache
def _controller() -> ThreadpoolController:
    return ThreadpoolController()


class _OneThread(AbstractContextManager[None]):
    """The limit is one of the process: the first to enter sets it, the last to leave lifts it."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._inside = 0
        self._limit: Any = None

    def __enter__(self) -> None:
        with self._lock:
            if self._inside == 0:
                self._limit = _controller().limit(limits=1, user_api="blas")
            self._inside += 1

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._inside -= 1
            if self._inside == 0:
                self._limit.restore_original_limits()


_ONE_THREAD = _OneThread()


def one_thread() -> AbstractContextManager[None]:
    """Within it, BLAS runs on one thread, also where several threads are within.

    On small blocks its threads wait for each other longer than they work, and how a sum is
    split among them decides its last bits.
    """
    return _ONE_THREAD


def side_by_side(work: Callable[[Job], Result], jobs: Iterable[Job]) -> list[Result]:
    """work(job) of a few jobs, each on a thread of its own with BLAS on one; results in order.

    What comes out has the bits that one job after the other would give.
    """
    jobs = list(jobs)
    with one_thread(), ThreadPoolExecutor(max(len(jobs), 1)) as pool:
        return list(pool.map(work, jobs))
