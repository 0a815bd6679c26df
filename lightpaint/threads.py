"""Threads: one for products of small blocks, several for jobs that have nothing in common."""

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager
from contextvars import copy_context
from functools import cache
from itertools import count
from threading import Event
from typing import Any, TypeVar

# The controller finds the libraries that are loaded: numpy has to be.
import numpy as np  # noqa: F401
from threadpoolctl import ThreadpoolController

from lightpaint.progress import wanted, while_wanted

Job = TypeVar("Job")
Result = TypeVar("Result")


@cache
def _controller() -> ThreadpoolController:
    return ThreadpoolController()


def one_thread() -> AbstractContextManager[object]:
    """Within it, BLAS runs on one thread.

    On small blocks its threads wait for each other longer than they work, and how a sum is
    split among them decides its last bits.
    """
    limits: AbstractContextManager[object] = _controller().limit(limits=1, user_api="blas")
    return limits


def linear_algebra() -> tuple[str, str]:
    """The library under NumPy with its version, and its kernel: `openblas 0.3.31`, `Haswell`.

    Kernels add in different orders, so that results differ in their last digits. "" for what is not
    known: a library that is not listed, or says nothing of a kernel.
    """
    found = [x for x in _controller().info() if x.get("user_api") == "blas"]
    # SciPy has one of its own.
    found.sort(key=lambda library: "numpy" not in library["filepath"])
    if not found:
        return "", ""
    first = found[0]
    return f"{first['internal_api']} {first.get('version') or ''}".strip(), str(
        first.get("architecture") or ""
    )


class _EndedError(Exception):
    """Work of which the rest was given up."""


def side_by_side(work: Callable[[Job], Result], jobs: Iterable[Job]) -> list[Result]:
    """work(job) of each job, several at a time with BLAS on one thread; results in order.

    What comes out has the bits that one job after the other would give. Of several errors the one
    of the first job is raised. A job may have jobs side by side of its own. Work that is wanted no
    more ends before the next job.
    """
    waiting = list(jobs)
    results: list[Any] = [None] * len(waiting)
    errors: dict[int, Exception] = {}
    turns = count()
    ended, check = Event(), wanted()

    def check_both() -> None:
        check()
        if ended.is_set():
            raise _EndedError

    def take_turns() -> None:
        while not ended.is_set() and (k := next(turns)) < len(waiting):
            try:
                with while_wanted(check_both):
                    check_both()
                    results[k] = work(waiting[k])
            except Exception as error:
                errors[k] = error

    with one_thread():
        # One thread more than processors: three channels then share two of them evenly.
        most = (os.cpu_count() or 1) if _limit is None else _limit - 1
        hands = min(most, len(waiting) - 1)
        helpers = [_pool().submit(copy_context().run, take_turns) for _ in range(hands)]
        try:
            take_turns()
        except BaseException:
            ended.set()  # an interrupt waits for no job that has not begun
            raise
        finally:
            # Who has not begun by now finds nothing to do, and others may need all there are.
            for helper in helpers:
                if not helper.cancel():
                    helper.result()
    if errors:
        raise errors[min(errors)]
    return results


def limit_jobs(count: int | None) -> None:
    """Let no more than `count` jobs be done at a time in this process; None for all there is."""
    global _limit
    _limit = count


_limit: int | None = None

#: By the niceness of their threads.
_pools: dict[int, ThreadPoolExecutor] = {}


def _pool() -> ThreadPoolExecutor:
    """Threads that stay, since to begin them anew takes longer than many a job.

    As nice as the one that asks, which on Linux is what those that it begins are.
    """
    nice = os.getpriority(os.PRIO_PROCESS, 0) if hasattr(os, "getpriority") else 0
    if nice not in _pools:
        _pools[nice] = ThreadPoolExecutor((os.cpu_count() or 1) + 1, f"side-by-side-{nice}")
    return _pools[nice]


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_pools.clear)  # threads are not forked
