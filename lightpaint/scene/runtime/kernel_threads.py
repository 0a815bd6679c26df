"""On how many threads kernels run: all that there are, or fewer where workers share a machine.

What a kernel adds up on one thread it adds in the same order each time, to the last bit. The limit
holds while kernels run, and not for good: with one thread Mitsuba's reader of EXR files waits for
itself for ever.
"""

from collections.abc import Iterator
from contextlib import contextmanager

from lightpaint.threads import limit_jobs

_limit: int | None = None


def limit_threads(count: int | None) -> None:
    """Let no kernel of this process run on more threads than `count`; None for all there are.

    Nor other work that is done side by side.
    """
    global _limit
    _limit = count
    limit_jobs(count)


def adds_in_order() -> bool:
    """Whether all that kernels of this process add up they add in the same order each time."""
    return _limit == 1


@contextmanager
def kernels(threads: int | None = None) -> Iterator[None]:
    """Run what is traced in this block on no more threads than the process may have.

    threads: fewer still.
    """
    asked = min((x for x in (_limit, threads) if x is not None), default=None)
    if asked is None:
        yield
        return
    import drjit as dr

    before = dr.thread_count()
    if asked >= before:
        yield
        return
    dr.set_thread_count(asked)
    try:
        yield
        # What is not waited for is still running.
        dr.sync_thread()
    finally:
        dr.set_thread_count(before)
