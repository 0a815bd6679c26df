"""Who does errands: this process, processes beside it (processes.py), or a cluster (cluster.py)."""

from collections.abc import Iterator, Sequence
from typing import Protocol

from lightpaint.batch.work.work import do
from lightpaint.batch.work.work_items import Done, Errand
from lightpaint.batch.work.worker_cache import WorkerCache
from lightpaint.progress import Listener

#: How often an errand is given to a worker, where workers die over it.
TRIES = 3

#: What is said of one that they all die over.
LOST = "its worker was killed, or ran out of memory"


class Engine(Protocol):
    """Does errands that do not wait for each other."""

    @property
    def is_apart(self) -> bool:
        """Whether it works in other processes, which have no basis at hand."""

    @property
    def is_gone(self) -> bool:
        """Whether nobody is there any more to do anything, which is no look's failure."""

    @property
    def workers(self) -> int:
        """How many errands it does at a time, as far as is known."""

    def run(self, errands: Sequence[Errand]) -> Iterator[Done]:
        """What came of each, as it is done, in any order.

        What a worker dies over is done again, elsewhere. Ending it early ends the work.
        """


class InProcess:
    """One after the other, here."""

    is_apart = False
    is_gone = False
    workers = 1

    def __init__(self, held: WorkerCache, listen: Listener) -> None:
        self._held, self._listen = held, listen

    def run(self, errands: Sequence[Errand]) -> Iterator[Done]:
        """As of `Engine`, in the order of the errands."""
        try:
            for errand in errands:
                yield do(errand, self._held, self._listen)
        finally:
            self._held.rest()
