"""Engines that run work items: this process, local worker processes (processes.py), or a cluster
(cluster.py).
"""

from collections.abc import Iterator, Sequence
from typing import Protocol

from lightpaint.batch.work.item_execution import run_item
from lightpaint.batch.work.work_items import ItemResult, WorkItem
from lightpaint.batch.work.worker_cache import WorkerCache
from lightpaint.progress import Listener

#: Number of tries of an item if workers die over it.
MAX_TRIES = 3

#: Failure of an item over which every worker has died.
LOST_TEXT = "its worker was killed, or ran out of memory"


class Engine(Protocol):
    """An engine for work items that do not depend on each other."""

    @property
    def is_apart(self) -> bool:
        """True if it uses other processes, which have no basis in memory."""

    @property
    def is_gone(self) -> bool:
        """True once no worker can be reached, which counts as no look's failure."""

    @property
    def workers(self) -> int:
        """Number of items that it runs at a time, as far as it knows."""

    def run(self, items: Sequence[WorkItem]) -> Iterator[ItemResult]:
        """Yield the result of each item as it is done, in any order.

        If a worker dies over an item, another one tries it. Closing the iterator ends the work.
        """


class InProcess:
    """An engine that runs items in this process, one after the other."""

    is_apart = False
    is_gone = False
    workers = 1

    def __init__(self, cache: WorkerCache, listen: Listener) -> None:
        self._cache, self._listen = cache, listen

    def run(self, items: Sequence[WorkItem]) -> Iterator[ItemResult]:
        """Run the items in their order; see `Engine`."""
        try:
            for item in items:
                yield run_item(item, self._cache, self._listen)
        finally:
            self._cache.release_renderer()
