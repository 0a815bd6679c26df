"""The number of threads of kernels: all, or fewer if workers share a machine.

On one thread a kernel adds up in the same order each time, reproducible to the last bit. The limit
is set only while kernels run: with one thread Mitsuba's reader of EXR files would deadlock.
"""

from collections.abc import Iterator
from contextlib import contextmanager

from lightpaint.threads import limit_jobs

_limit: int | None = None


def limit_threads(count: int | None) -> None:
    """Limit kernels, and other parallel work, of this process to `count` threads; None for all.

    The limit holds for `parallel_map` too.
    """
    global _limit
    _limit = count
    limit_jobs(count)


@contextmanager
def kernels(threads: int | None = None) -> Iterator[None]:
    """Run the kernels of this block on no more threads than the process may use.

    threads: a lower limit.
    """
    limit = min((x for x in (_limit, threads) if x is not None), default=None)
    if limit is None:
        yield
        return
    import drjit as dr

    before = dr.thread_count()
    if limit >= before:
        yield
        return
    dr.set_thread_count(limit)
    try:
        yield
        # Kernels run asynchronously: wait for them.
        dr.sync_thread()
    finally:
        dr.set_thread_count(before)
