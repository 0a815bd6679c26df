"""Threads: one for products of small blocks, several for independent jobs."""

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import contextmanager, suppress
from contextvars import copy_context
from functools import cache
from itertools import count
from threading import Event, Thread, local
from typing import Any, TypeVar

# The controller finds the libraries that are loaded, and NumPy must be among them.
import numpy as np  # noqa: F401
from threadpoolctl import ThreadpoolController

from lightpaint.progress import cancellable, cancellation_check, counting, still_working

#: Seconds between two checks whether work was cancelled while a call runs apart.
CHECK_S = 0.1

Job = TypeVar("Job")
Result = TypeVar("Result")


@cache
def _controller() -> ThreadpoolController:
    return ThreadpoolController()


def find_loaded_libraries() -> None:
    """Limit libraries that were loaded after the first call of `one_thread` to one thread for good:
    SciPy has a BLAS of its own.

    Blocks that are limited already do not know these libraries, whose threads would then wait for
    each other while jobs run side by side.
    """
    known = {x.filepath for x in _controller().lib_controllers}
    _controller.cache_clear()
    for library in _controller().lib_controllers:
        if library.filepath not in known and library.user_api == "blas":
            library.set_num_threads(1)


_limits = local()


@contextmanager
def one_thread() -> Iterator[None]:
    """Limit NumPy's BLAS to one thread within the block, or within a function that it decorates.

    On small arrays its threads wait for each other longer than they work, and the way they split a
    sum decides its last bits. Setting the limit takes a tenth of a millisecond, so blocks within
    such a block of the same thread leave it as it is.
    """
    if getattr(_limits, "is_one", False):
        yield
        return
    _limits.is_one = True
    try:
        with _controller().limit(limits=1, user_api="blas"):
            yield
    finally:
        _limits.is_one = False


def linear_algebra() -> tuple[str, str]:
    """Return NumPy's BLAS with its version, and its kernel: `openblas 0.3.31`, `Haswell`.

    Kernels add in different orders, so results differ in their last digits. "" if unknown: an
    unlisted library, or one that names no kernel.
    """
    libraries = [x for x in _controller().info() if x.get("user_api") == "blas"]
    # SciPy brings its own BLAS: NumPy's comes first.
    libraries.sort(key=lambda library: "numpy" not in library["filepath"])
    if not libraries:
        return "", ""
    first = libraries[0]
    return f"{first['internal_api']} {first.get('version') or ''}".strip(), str(
        first.get("architecture") or ""
    )


class _CancelledError(Exception):
    """The end of jobs that are cancelled because another one failed or was interrupted."""


def parallel_map(
    work: Callable[[Job], Result], jobs: Iterable[Job], *, unit: str | None = None
) -> list[Result]:
    """Return `work(job)` for each job, several at a time with BLAS on one thread; results in order.

    Results are equal, bit for bit, to the results of one job after the other. Of several errors the
    error of the first job is raised. A job may call this function itself. Cancelled work ends
    before the next job. unit: the plural of jobs that take equally long, whose number is reported
    as progress.
    """
    remaining_jobs = list(jobs)
    results: list[Any] = [None] * len(remaining_jobs)
    errors: dict[int, Exception] = {}
    turns = count()
    has_ended, check = Event(), cancellation_check()

    def check_both() -> None:
        check()
        if has_ended.is_set():
            raise _CancelledError

    def take_turns() -> None:
        while not has_ended.is_set() and (k := next(turns)) < len(remaining_jobs):
            try:
                with cancellable(check_both):
                    check_both()
                    results[k] = work(remaining_jobs[k])
                    advance()
            except Exception as error:
                errors[k] = error

    with one_thread(), counting(len(remaining_jobs), unit) as advance:
        # One thread more than processors, so that three channels share two of them evenly.
        max_helpers = (os.cpu_count() or 1) if _limit is None else _limit - 1
        helper_count = min(max_helpers, len(remaining_jobs) - 1)
        helpers = [_pool().submit(copy_context().run, take_turns) for _ in range(helper_count)]
        # A helper that has not begun by then has nothing to do, and others may need its thread.
        try:
            take_turns()
            for helper in helpers:
                if not helper.cancel():
                    helper.result()
        except BaseException:
            # Jobs that have begun are cancelled; an interrupt waits for no others.
            has_ended.set()
            wait([helper for helper in helpers if not helper.cancel()])
            raise
    if errors:
        raise errors[min(errors)]
    return results


def run_apart(work: Callable[..., Result], *arguments: Any) -> Result:
    """Return `work(*arguments)`, a call of seconds that nothing can interrupt, as of LAPACK.

    It runs in a thread of its own, and the stage that it belongs to is shown. If the calling thread
    is interrupted, or its work cancelled, the call is left to itself, and its result is dropped.
    """
    check, outcome = cancellation_check(), Future[Result]()

    def run() -> None:
        try:
            outcome.set_result(work(*arguments))
        except BaseException as error:
            outcome.set_exception(error)

    Thread(target=copy_context().run, args=(run,), name="lightpaint-apart", daemon=True).start()
    while not wait([outcome], CHECK_S).done:
        check()
        still_working()
    return outcome.result()


def start_in_background(work: Callable[[], None], *, name: str) -> None:
    """Start `work` in a thread of this name; `end_background_work` cancels it."""
    has_ended = Event()

    def check() -> None:
        if has_ended.is_set():
            raise _CancelledError

    def run() -> None:
        try:
            with cancellable(check), suppress(_CancelledError):
                work()
        finally:
            _background.discard(has_ended)

    _background.add(has_ended)
    Thread(target=run, name=name).start()


def end_background_work() -> None:
    """Cancel what runs in the background, since the program waits for it when it exits."""
    for has_ended in list(_background):
        has_ended.set()


#: The events that end the work in the background.
_background: set[Event] = set()


def limit_jobs(count: int | None) -> None:
    """Limit the jobs that run at a time in this process to `count`; None for no limit."""
    global _limit
    _limit = count


_limit: int | None = None

#: Pools by the niceness of their threads.
_pools: dict[int, ThreadPoolExecutor] = {}


def _pool() -> ThreadPoolExecutor:
    """Return the lasting pool of threads: starting threads takes longer than many a job.

    There is one pool for each niceness: on Linux threads inherit the niceness of the thread which
    starts them.
    """
    nice = os.getpriority(os.PRIO_PROCESS, 0) if hasattr(os, "getpriority") else 0
    if nice not in _pools:
        _pools[nice] = ThreadPoolExecutor((os.cpu_count() or 1) + 1, f"side-by-side-{nice}")
    return _pools[nice]


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_pools.clear)  # a fork copies no threads
