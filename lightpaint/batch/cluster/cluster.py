"""Workers of a Dask cluster, wherever they are: dask-jobqueue's, dask-kubernetes', one's own.

Dask brings errands to workers and back, and knows who lives. Who does what is decided here, so that
a worker is known for every errand: one that dies, or takes too long over it, loses it to another.
"""

import os
import secrets
import time
from collections import Counter, deque
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from lightpaint.batch.cluster.parcels import Contents, Parcel, packed, unpack
from lightpaint.batch.cluster.workers import ANSWER_S, GOING, ClusterWorkers
from lightpaint.batch.work.engine import LOST, TRIES
from lightpaint.batch.work.work import is_full
from lightpaint.batch.work.work_items import Done, Errand, spoken
from lightpaint.errors import LightpaintError
from lightpaint.files import first_line
from lightpaint.progress import Listener

#: Seconds between looks at what has come.
POLL_S = 0.02

#: Seconds that workers have to say what they did, at the end.
LAST_WORDS_S = 2.0

#: Errands that a worker has at a time: while one is done, the next is there already.
DEPTH = 2

#: An errand may take so many times what it is expected to take on one thread, and so long at least.
PATIENCE, LEAST_S = 20.0, 300.0


@dataclass
class _Sent:
    """An errand that a worker has. since_s: since when it is that worker's first."""

    errand: Errand
    parcel: Parcel
    worker: str
    future: Any
    since_s: float | None = None


class Cluster:
    """An engine of the workers at `address`.

    is_shared: whether they see the files that are here under the same paths. limit_s: seconds that
    an errand may take; by default many times what it is expected to take.
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
        self._run, self._contents = f"lightpaint-{secrets.token_hex(6)}", Contents()
        self._at: ClusterWorkers
        self._sent: list[_Sent] = []
        self._failed_at: dict[str, set[str]] = {}
        #: Which worker has begun what, in turn; an errand that stands there twice was lost once.
        self.begun: list[tuple[str, str]] = []
        self._returned = Counter[tuple[str, str]]()

    @property
    def is_gone(self) -> bool:
        """As of `Engine`: whether the scheduler is."""
        return self._at.is_gone

    @property
    def workers(self) -> int:
        """How many there are now."""
        return max(1, len(self._at.there))

    def __enter__(self) -> "Cluster":
        self._at = ClusterWorkers(self._address, self._listen, self._run)
        return self

    def __exit__(self, *_: object) -> None:
        self._recall()
        # What came back was begun; who says so may be slower.
        deadline_s = time.monotonic() + LAST_WORDS_S
        while self._returned - Counter(self.begun) and time.monotonic() < deadline_s:
            time.sleep(POLL_S)
            self._hear()
        self._at.close()

    def run(self, errands: Sequence[Errand]) -> Iterator[Done]:
        """As of `Engine`."""
        waiting, tries = deque(errands), Counter[str]()
        readers = Counter(
            os.path.abspath(file) for errand in errands for file in {*errand.needs, *errand.carried}
        )
        common = {file for file, count in readers.items() if count > 1}
        try:
            while waiting or self._sent:
                self._at.look_around()
                self._lose_the_dead(waiting, tries)
                yield from self._given_up(waiting, tries)
                yield from self._hand_out(waiting, common)
                yield from self._come_back(waiting, tries)
                self._end_what_hangs(waiting, tries)
                time.sleep(POLL_S)
        finally:
            self._recall()

    def _recall(self) -> None:
        """Have nothing more done."""
        for sent in self._sent:
            with suppress(*GOING):
                sent.future.cancel(force=True)
        self._sent = []

    def _hand_out(self, waiting: deque[Errand], common: set[str]) -> Iterator[Done]:
        """Give every worker something to do, and the next thing where there is enough for all."""
        loads = Counter(sent.worker for sent in self._sent)
        for depth in range(1, DEPTH + 1):
            for worker in self._at.there:
                enough = depth == 1 or len(waiting) >= len(self._at.there)
                errand = self._for(worker, waiting) if loads[worker] < depth and enough else None
                if errand is not None:
                    waiting.remove(errand)
                    loads[worker] += 1
                    try:
                        self._give(errand, worker, common)
                    except LightpaintError as error:
                        yield Done(errand.name, errand.kind, str(error))

    def _for(self, worker: str, waiting: deque[Errand]) -> Errand | None:
        """The next errand that the worker has not failed at, unless all have."""
        for errand in waiting:
            failed_at = self._failed_at.get(errand.name, set())
            if worker not in failed_at or failed_at >= set(self._at.there):
                return errand
        return None

    def _give(self, errand: Errand, worker: str, common: set[str]) -> None:
        parcel = packed(errand, self._contents, run=self._run, is_shared=self._is_shared)
        self._at.ship(parcel, worker, common)
        key = f"{self._run}-{errand.kind}-{errand.name}-{secrets.token_hex(4)}"
        future = self._at.submit(parcel, worker, key)
        self._sent.append(_Sent(errand, parcel, worker, future))
        self._note_turns()

    def _note_turns(self) -> None:
        """Since when the first errand of each worker is."""
        seen = set()
        for sent in self._sent:
            if sent.worker not in seen and sent.since_s is None:
                sent.since_s = time.monotonic()
            seen.add(sent.worker)

    def _hear(self) -> None:
        """What workers say that they have begun."""
        while self._at.events:
            event = self._at.events.popleft()
            if not _is_event(event):  # of whoever else knows the scheduler
                continue
            self.begun.append((event["errand"], event["worker"]))
            for sent in self._sent:
                if (spoken(sent.errand), sent.worker) == self.begun[-1]:
                    sent.since_s = time.monotonic()
                    self._listen.at_work(f"worker {sent.worker}", spoken(sent.errand))
            self._listen.note(f"{event['errand']} begun by {event['worker']}")

    def _come_back(self, waiting: deque[Errand], tries: Counter[str]) -> Iterator[Done]:
        """What is done."""
        self._hear()
        for sent in list(self._sent):
            if sent.future.status in ("cancelled", "lost"):
                self._lose([sent], waiting, tries)
                continue
            if sent.future.status not in ("finished", "error"):
                continue
            came = self._came(sent)
            if came is None:
                continue
            self._sent.remove(sent)
            self._rests(sent.worker)
            self._note_turns()
            self._returned[spoken(sent.errand), sent.worker] += not isinstance(came, list)
            if isinstance(came, list):  # a worker that was begun anew at the same address
                self._at.lacks(sent.worker, came)
                waiting.appendleft(sent.errand)
                continue
            if came.is_lost and tries[came.look] + 1 < TRIES:  # memory, which others may have
                tries[came.look] += 1
                self._failed_at.setdefault(came.look, set()).add(sent.worker)
                waiting.append(sent.errand)
                continue
            yield came if came.files is None else _unpacked(sent.errand, came)

    def _rests(self, worker: str) -> None:
        """Tell of a worker that has nothing to do."""
        if all(sent.worker != worker for sent in self._sent):
            self._listen.at_work(f"worker {worker}", None)

    def _came(self, sent: _Sent) -> Done | list[str] | None:
        """What came of it; None if it was lost on the way."""
        errand = sent.errand
        try:
            came: Done | list[str] = sent.future.result(timeout=ANSWER_S)
            if not _is_answer(came, errand):
                said = f"worker {sent.worker} answers with something else"
                return Done(errand.name, errand.kind, said)
            return came
        except GOING as error:
            if isinstance(error, OSError) or not self._at.is_there(sent.worker):
                return None
            if sent.future.status != "error" or type(error).__name__ == "KilledWorker":
                return None
            return Done(errand.name, errand.kind, f"{type(error).__name__}: {first_line(error)}")

    def _lose_the_dead(self, waiting: deque[Errand], tries: Counter[str]) -> None:
        """What workers had that are gone is to be done again."""
        self._hear()
        self._lose([x for x in self._sent if x.worker not in self._at.there], waiting, tries)

    def _lose(self, some: Sequence[_Sent], waiting: deque[Errand], tries: Counter[str]) -> None:
        """Take back what workers had."""
        for sent in some:
            with suppress(*GOING):
                sent.future.cancel(force=True)
            self._sent.remove(sent)
            self._rests(sent.worker)
            if sent.since_s is not None:  # it was at work on that
                tries[sent.errand.name] += 1
                name = spoken(sent.errand)
                self._listen.say(f"{name}: worker {sent.worker} is lost; trying elsewhere")
            waiting.appendleft(sent.errand)
        self._note_turns()

    def _given_up(self, waiting: deque[Errand], tries: Counter[str]) -> Iterator[Done]:
        """What workers were lost over too often."""
        for errand in [x for x in waiting if tries[x.name] >= TRIES]:
            waiting.remove(errand)
            yield Done(errand.name, errand.kind, LOST, is_lost=True)

    def _end_what_hangs(self, waiting: deque[Errand], tries: Counter[str]) -> None:
        """End workers that take too long over something."""
        for sent in list(self._sent):
            limit_s = self._limit_s or max(LEAST_S, PATIENCE * sent.errand.expected_s)
            if sent.since_s is None or time.monotonic() - sent.since_s < limit_s:
                continue
            name = spoken(sent.errand)
            self._listen.say(f"{name}: worker {sent.worker} takes over {limit_s:.0f} s")
            self._lose([x for x in self._sent if x.worker == sent.worker], waiting, tries)
            self._at.end(sent.worker, "it took too long")
            return


def _is_event(event: Any) -> bool:
    """Return whether it says what a worker has begun."""
    return isinstance(event, dict) and all(
        isinstance(event.get(key), str) for key in ("errand", "worker")
    )


def _is_answer(came: Any, errand: Errand) -> bool:
    """Return whether it is what a worker answers to an errand."""
    if isinstance(came, list):
        return all(isinstance(its, str) for its in came)
    if not isinstance(came, Done) or (came.look, came.kind) != (errand.name, errand.kind):
        return False
    files = came.files or {}
    return isinstance(files, dict) and all(
        isinstance(name, str) and isinstance(data, bytes) for name, data in files.items()
    )


def _unpacked(errand: Errand, came: Done) -> Done:
    """What came of an errand, with what was written brought to its place."""
    try:
        unpack(errand, came.files or {})
    except LightpaintError as error:
        return Done(came.look, came.kind, str(error), is_full(error))
    return came
