"""An engine whose workers belong to a Dask cluster, such as dask-jobqueue's or dask-kubernetes'.

Dask transports work items to workers and back, and knows which workers are alive. This module
assigns items to workers. If a worker dies or takes too long over an item, another one gets it.
"""

import os
import secrets
import time
from collections import Counter, deque
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from lightpaint.batch.dask_workers import ANSWER_S, DASK_ERRORS, ClusterWorkers
from lightpaint.batch.engine import LOST_TEXT, MAX_TRIES
from lightpaint.batch.parcels import FileHashes, pack, unpack
from lightpaint.batch.work.item_execution import is_disk_full
from lightpaint.batch.work.work_items import ItemResult, WorkItem, item_label
from lightpaint.errors import LightpaintError
from lightpaint.files import first_line
from lightpaint.progress import Listener

#: Seconds between polls for results.
POLL_S = 0.02

#: Seconds for the last events of workers, at the end.
FINAL_EVENTS_S = 2.0

#: Items that a worker has at a time: the next one arrives while it works on the first.
ITEMS_PER_WORKER = 2

#: Time limit of an item: a multiple of its expected time on one thread, and a minimum in seconds.
LIMIT_FACTOR, MIN_LIMIT_S = 20.0, 300.0


@dataclass
class _Assignment:
    """A work item assigned to a worker. since_s: when it became that worker's first."""

    item: WorkItem
    worker: str
    future: Any
    since_s: float | None = None


class Cluster:
    """An engine of the workers at `address`.

    is_shared: whether workers see the local files under the same paths. limit_s: seconds that an
    item may take; by default many times its expected time.
    """

    is_apart = True

    def __init__(
        self,
        address: str,
        listen: Listener,
        *,
        is_shared: bool = False,
        limit_s: float | None = None,
    ) -> None:
        self._address, self._listen = address, listen
        self._is_shared, self._limit_s = is_shared, limit_s
        self._run, self._contents = f"lightpaint-{secrets.token_hex(6)}", FileHashes()
        self._workers: ClusterWorkers
        self._assignments: list[_Assignment] = []
        self._failed_at: dict[str, set[str]] = {}
        #: Pairs of item and worker in the order of starts; an item that occurs twice was lost once.
        self.starts: list[tuple[str, str]] = []
        self._result_counts = Counter[tuple[str, str]]()

    @property
    def is_gone(self) -> bool:
        """True once the scheduler is gone; see `Engine`."""
        return self._workers.is_gone

    @property
    def workers(self) -> int:
        """Number of workers at the moment."""
        return max(1, len(self._workers.addresses))

    def __enter__(self) -> "Cluster":
        self._workers = ClusterWorkers(self._address, self._listen, self._run)
        return self

    def __exit__(self, *_: object) -> None:
        self._cancel_all()
        # The events of items that have already returned may still be on their way.
        deadline_s = time.monotonic() + FINAL_EVENTS_S
        while self._result_counts - Counter(self.starts) and time.monotonic() < deadline_s:
            time.sleep(POLL_S)
            self._read_events()
        self._workers.close()

    def run(self, items: Sequence[WorkItem]) -> Iterator[ItemResult]:
        """Run the items; see `Engine`."""
        queue, try_counts = deque(items), Counter[str]()
        readers = Counter(
            os.path.abspath(file)
            for item in items
            for file in {*item.input_files, *item.local_files}
        )
        common_files = {file for file, count in readers.items() if count > 1}
        try:
            while queue or self._assignments:
                self._workers.refresh()
                self._take_back_from_dead(queue, try_counts)
                yield from self._give_up(queue, try_counts)
                yield from self._assign(queue, common_files)
                yield from self._collect(queue, try_counts)
                self._end_hung_workers(queue, try_counts)
                time.sleep(POLL_S)
        finally:
            self._cancel_all()

    def _cancel_all(self) -> None:
        """Cancel all assignments."""
        for assignment in self._assignments:
            with suppress(*DASK_ERRORS):
                assignment.future.cancel(force=True)
        self._assignments = []

    def _assign(self, queue: deque[WorkItem], common_files: set[str]) -> Iterator[ItemResult]:
        """Give every worker an item, and a second one if there are enough for all."""
        load_counts = Counter(assignment.worker for assignment in self._assignments)
        for depth in range(1, ITEMS_PER_WORKER + 1):
            for worker in self._workers.addresses:
                has_enough = depth == 1 or len(queue) >= len(self._workers.addresses)
                item = (
                    self._next_for(worker, queue)
                    if load_counts[worker] < depth and has_enough
                    else None
                )
                if item is not None:
                    queue.remove(item)
                    load_counts[worker] += 1
                    try:
                        self._submit(item, worker, common_files)
                    except LightpaintError as error:
                        yield ItemResult(item.name, item.kind, error.sentence)

    def _next_for(self, worker: str, queue: deque[WorkItem]) -> WorkItem | None:
        """Return the next item that the worker has not failed at, unless all workers have."""
        for item in queue:
            failed_at = self._failed_at.get(item.name, set())
            if worker not in failed_at or failed_at >= set(self._workers.addresses):
                return item
        return None

    def _submit(self, item: WorkItem, worker: str, common_files: set[str]) -> None:
        parcel = pack(item, self._contents, run=self._run, is_shared=self._is_shared)
        self._workers.send_files(parcel, worker, common_files)
        key = f"{self._run}-{item.kind}-{item.name}-{secrets.token_hex(4)}"
        future = self._workers.submit(parcel, worker, key)
        self._assignments.append(_Assignment(item, worker, future))
        self._start_clocks()

    def _start_clocks(self) -> None:
        """Start the clock of each worker's first item."""
        workers = set()
        for assignment in self._assignments:
            if assignment.worker not in workers and assignment.since_s is None:
                assignment.since_s = time.monotonic()
            workers.add(assignment.worker)

    def _read_events(self) -> None:
        """Read which items workers have begun."""
        while self._workers.events:
            event = self._workers.events.popleft()
            if not _is_event(event):  # another client of the scheduler sent it
                continue
            self.starts.append((event["item"], event["worker"]))
            for assignment in self._assignments:
                if (item_label(assignment.item), assignment.worker) == self.starts[-1]:
                    assignment.since_s = time.monotonic()
                    self._listen.at_work(f"worker {assignment.worker}", item_label(assignment.item))
            self._listen.note(f"{event['item']} begun by {event['worker']}")

    def _collect(self, queue: deque[WorkItem], try_counts: Counter[str]) -> Iterator[ItemResult]:
        """Yield results that have arrived."""
        self._read_events()
        for assignment in list(self._assignments):
            if assignment.future.status in ("cancelled", "lost"):
                self._take_back([assignment], queue, try_counts)
                continue
            if assignment.future.status not in ("finished", "error"):
                continue
            result = self._result_of(assignment)
            if result is None:
                continue
            self._assignments.remove(assignment)
            self._note_idle(assignment.worker)
            self._start_clocks()
            self._result_counts[item_label(assignment.item), assignment.worker] += not isinstance(
                result, list
            )
            if isinstance(result, list):  # the worker restarted at the same address
                self._workers.forget_files(assignment.worker, result)
                queue.appendleft(assignment.item)
                continue
            if (
                result.is_lost and try_counts[result.look] + 1 < MAX_TRIES
            ):  # it ran out of memory, and another worker may have more
                try_counts[result.look] += 1
                self._failed_at.setdefault(result.look, set()).add(assignment.worker)
                queue.append(assignment.item)
                continue
            yield result if result.files is None else _unpack_result(assignment.item, result)

    def _note_idle(self, worker: str) -> None:
        """Tell the listener of a worker that has nothing to do."""
        if all(assignment.worker != worker for assignment in self._assignments):
            self._listen.at_work(f"worker {worker}", None)

    def _result_of(self, assignment: _Assignment) -> ItemResult | list[str] | None:
        """Return the result of an assignment; None if it was lost on the way."""
        item = assignment.item
        try:
            result: ItemResult | list[str] = assignment.future.result(timeout=ANSWER_S)
            if not _is_answer(result, item):
                failure = f"worker {assignment.worker} answers with something else"
                return ItemResult(item.name, item.kind, failure)
            return result
        except DASK_ERRORS as error:
            if isinstance(error, OSError) or not self._workers.is_known(assignment.worker):
                return None
            if assignment.future.status != "error" or type(error).__name__ == "KilledWorker":
                return None
            return ItemResult(item.name, item.kind, f"{type(error).__name__}: {first_line(error)}")

    def _take_back_from_dead(self, queue: deque[WorkItem], try_counts: Counter[str]) -> None:
        """Take back the items of workers that are gone."""
        self._read_events()
        self._take_back(
            [x for x in self._assignments if x.worker not in self._workers.addresses],
            queue,
            try_counts,
        )

    def _take_back(
        self, assignments: Sequence[_Assignment], queue: deque[WorkItem], try_counts: Counter[str]
    ) -> None:
        """Take back items from their workers."""
        for assignment in assignments:
            with suppress(*DASK_ERRORS):
                assignment.future.cancel(force=True)
            self._assignments.remove(assignment)
            self._note_idle(assignment.worker)
            if assignment.since_s is not None:  # the worker had begun it
                try_counts[assignment.item.name] += 1
                name = item_label(assignment.item)
                self._listen.say(f"{name}: worker {assignment.worker} is lost; trying elsewhere")
            queue.appendleft(assignment.item)
        self._start_clocks()

    def _give_up(self, queue: deque[WorkItem], try_counts: Counter[str]) -> Iterator[ItemResult]:
        """Yield failures for items that have lost too many workers."""
        for item in [x for x in queue if try_counts[x.name] >= MAX_TRIES]:
            queue.remove(item)
            yield ItemResult(item.name, item.kind, LOST_TEXT, is_lost=True)

    def _end_hung_workers(self, queue: deque[WorkItem], try_counts: Counter[str]) -> None:
        """End workers that take too long over an item."""
        for assignment in list(self._assignments):
            limit_s = self._limit_s or max(MIN_LIMIT_S, LIMIT_FACTOR * assignment.item.expected_s)
            if assignment.since_s is None or time.monotonic() - assignment.since_s < limit_s:
                continue
            name = item_label(assignment.item)
            self._listen.say(f"{name}: worker {assignment.worker} takes more than {limit_s:.0f} s")
            self._take_back(
                [x for x in self._assignments if x.worker == assignment.worker], queue, try_counts
            )
            self._workers.end(assignment.worker, "it took too long")
            return


def _is_event(event: Any) -> bool:
    """Return whether an event reports the item that a worker has begun."""
    return isinstance(event, dict) and all(
        isinstance(event.get(key), str) for key in ("item", "worker")
    )


def _is_answer(result: Any, item: WorkItem) -> bool:
    """Return whether a result has the form of a worker's answer to an item."""
    if isinstance(result, list):
        return all(isinstance(digest, str) for digest in result)
    if not isinstance(result, ItemResult) or (result.look, result.kind) != (item.name, item.kind):
        return False
    files = result.files or {}
    return isinstance(files, dict) and all(
        isinstance(name, str) and isinstance(data, bytes) for name, data in files.items()
    )


def _unpack_result(item: WorkItem, result: ItemResult) -> ItemResult:
    """Write the files of a result to their place, and return the result."""
    try:
        unpack(item, result.files or {})
    except LightpaintError as error:
        return ItemResult(result.look, result.kind, error.sentence, is_disk_full(error))
    return result
