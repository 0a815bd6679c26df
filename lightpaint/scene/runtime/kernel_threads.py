"""The number of threads that run kernels: all, or fewer if workers share a machine.

On one thread a kernel always adds in the same order, so results are reproducible to the last bit.
The limit is set only while kernels run, because Mitsuba's EXR reader deadlocks with one thread.
"""

from collections.abc import Iterator
from contextlib import contextmanager

from lightpaint.threads import limit_jobs

_limit: int | None = None


def limit_threads(count: int | None) -> None:
    """Limit kernels and other parallel work of this process to `count` threads; None for all.

    The limit also applies to `parallel_map`.
    """
    global _limit
    _limit = count
    limit_jobs(count)


@contextmanager
def kernels(threads: int | None = None) -> Iterator[None]:
    """Limit the number of threads for kernels within the block.

    threads: a limit in addition to the limit of the process.
    """
    limit = min((x for x in (_limit, threads) if x is not None), default=None)
    if limit is None:
        yield
        return
    import drjit as dr

    count_before = dr.thread_count()
    if limit >= count_before:
        yield
        return
    dr.set_thread_count(limit)
    try:
        yield
        # Kernels run asynchronously, so wait for them.
        dr.sync_thread()
    finally:
        dr.set_thread_count(count_before)


@contextmanager
def kernels_for_all_sizes() -> Iterator[None]:
    """Compile kernels that add into arrays once for arrays of all sizes within the block.

    By default each thread adds into its own copy of a small array, whose size is part of the
    kernel. So loading would compile one for each mesh without normals, which takes longer than
    running it.
    """
    import drjit as dr

    threshold_before = dr.expand_threshold()
    dr.set_expand_threshold(0)
    try:
        yield
    finally:
        dr.set_expand_threshold(threshold_before)
