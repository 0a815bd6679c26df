"""Engines run work items: this process, processes beside it (processes.py), or a cluster
(cluster.py).
"""

from collections.abc import Iterator, Sequence
from typing import Protocol

from lightpaint.batch.work.work import run_item
from lightpaint.batch.work.work_items import ItemResult, WorkItem
from lightpaint.batch.work.worker_cache import WorkerCache
from lightpaint.progress import Listener

#: How often an item is tried, where workers die over it.
MAX_TRIES = 3

#: Failure of an item that all workers die over.
LOST_TEXT = "its worker was killed, or ran out of memory"


class Engine(Protocol):
    """An engine for work items that do not wait for each other."""

    @property
    def is_apart(self) -> bool:
        """True if it works in other processes, which have no basis in memory."""

    @property
    def is_gone(self) -> bool:
        """True once nobody is left to do anything, which is no look's failure."""

    @property
    def workers(self) -> int:
        """Number of items that it runs at a time, as far as is known."""

    def run(self, items: Sequence[WorkItem]) -> Iterator[ItemResult]:
        """Yield the result of each item as it is done, in any order.

        An item over which a worker dies is done again, elsewhere. Closing the iterator ends the
        work.
        """


class InProcess:
    """An engine that runs items here, one after the other."""

    is_apart = False
    is_gone = False
    workers = 1

    def __init__(self, cache: WorkerCache, listen: Listener) -> None:
        self._cache, self._listen = cache, listen

    def run(self, items: Sequence[WorkItem]) -> Iterator[ItemResult]:
        """Run the items in their order, as of `Engine`."""
        try:
            for item in items:
                yield run_item(item, self._cache, self._listen)
        finally:
            self._cache.release_renderer()
