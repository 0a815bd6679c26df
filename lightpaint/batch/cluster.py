"""Workers of a Dask cluster, wherever they are: dask-jobqueue's, dask-kubernetes', one's own.

Dask brings errands to workers and back, and knows who lives. Who does what is decided here, so that
a worker is known for every errand: one that dies, or takes too long over it, loses it to another.
"""

import os
import secrets
import socket
import time
from collections import Counter, deque
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from lightpaint.batch import cluster_worker
from lightpaint.batch.cluster_worker import versions as own_versions
from lightpaint.batch.engine import LOST, TRIES
from lightpaint.batch.errands import Done, Errand, spoken
from lightpaint.batch.parcels import Contents, Parcel, packed, pieces, sent_files, unpack
from lightpaint.errors import BatchError, LightpaintError
from lightpaint.files import first_line
from lightpaint.progress import Listener

#: Seconds for the scheduler to answer; between looks at who is there; and between looks at what has
#: come.
ANSWER_S, LOOK_S, POLL_S = 15.0, 1.0, 0.02

#: Seconds that workers have to say what they did, at the end.
LAST_WORDS_S = 2.0

#: Errands that a worker has at a time: while one is done, the next is there already.
DEPTH = 2

#: An errand may take so many times what it is expected to take on one thread, and so long at least.
PATIENCE, LEAST_S = 20.0, 300.0

INSTALL = "pip install 'lightpaint[cluster]'"


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
        self._client: Any = None
        self._workers: list[str] = []
        self._left_out: dict[str, str] = {}
        self._has: dict[str, set[str]] = {}
        self._sent: list[_Sent] = []
        self._failed_at: dict[str, set[str]] = {}
        self._events: deque[dict[str, str]] = deque()
        self._looked_s = 0.0
        self._is_told = False
        #: Which worker has begun what, in turn; an errand that stands there twice was lost once.
        self.begun: list[tuple[str, str]] = []
        self._returned = Counter[tuple[str, str]]()

    @property
    def workers(self) -> int:
        """How many there are now."""
        return max(1, len(self._workers))

    def __enter__(self) -> "Cluster":
        try:
            from distributed import Client
            from distributed.comm import get_address_host_port
        except ImportError as error:
            raise BatchError(f"a cluster needs Dask's distributed: {INSTALL}") from error
        try:
            # A client that finds nobody takes its time, and has last words.
            place = get_address_host_port(self._address, strict=True)
            socket.create_connection(place, timeout=ANSWER_S).close()
            self._client = Client(self._address, timeout=ANSWER_S, set_as_default=False)
        except (OSError, ValueError, TypeError) as error:
            raise BatchError(
                f"no scheduler answers at {self._address}: {first_line(error) or 'none is there'}; "
                "give its address, like tcp://host:8786 (dask scheduler tells it)"
            ) from error
        self._client.subscribe_topic(self._run, lambda event: self._events.append(event[1]))
        self._look_around()
        return self

    def __exit__(self, *_: object) -> None:
        self._recall()
        # What came back was begun; who says so may be slower.
        deadline_s = time.monotonic() + LAST_WORDS_S
        while self._returned - Counter(self.begun) and time.monotonic() < deadline_s:
            time.sleep(POLL_S)
            self._hear()
        with suppress(Exception):
            self._client.close(timeout=2)

    def run(self, errands: Sequence[Errand]) -> Iterator[Done]:
        """As of `Engine`."""
        waiting, tries = deque(errands), Counter[str]()
        readers = Counter(
            os.path.abspath(file) for errand in errands for file in {*errand.needs, *errand.carried}
        )
        common = {file for file, count in readers.items() if count > 1}
        try:
            while waiting or self._sent:
                self._look_around()
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
            with suppress(Exception):
                sent.future.cancel(force=True)
        self._sent = []

    def _look_around(self) -> None:
        """Who is there; each is asked once whether it has what is here."""
        if time.monotonic() - self._looked_s < LOOK_S:
            return
        there = [x for x in self._there() if x not in self._left_out]
        for worker in set(there) - set(self._workers):
            if why := self._why_not(worker):
                self._left_out[worker] = why
                self._listen.say(f"worker {worker} is left out: {why}")
        self._workers = [worker for worker in there if worker not in self._left_out]
        self._has = {worker: self._has.get(worker, set()) for worker in self._workers}
        if not self._workers and not self._is_told:
            self._listen.say(f"waiting for workers at {self._address}")
        self._is_told = not self._workers
        self._looked_s = time.monotonic()

    def _there(self) -> list[str]:
        """Addresses of all workers. Raises BatchError where the scheduler is gone."""
        try:
            if self._client.status == "running":
                return list(self._client.nthreads())
        except Exception as error:
            said = first_line(error)
        else:
            said = self._client.status
        raise BatchError(
            f"the scheduler at {self._address} is gone ({said}); the same command goes on once it "
            "is back"
        )

    def _why_not(self, worker: str) -> str:
        """Why a worker is of no use; "" where it is."""
        try:
            found = self._client.run(cluster_worker.versions, workers=[worker])
        except Exception as error:
            return f"lightpaint does not run there ({first_line(error)})"
        if worker not in found:
            return "it is gone"
        mine, its = own_versions(), found[worker]
        return ", ".join(
            f"it has {name} {its.get(name)}, and here is {mine[name]}"
            for name in mine
            if its.get(name) != mine[name]
        )

    def _hand_out(self, waiting: deque[Errand], common: set[str]) -> Iterator[Done]:
        """Give every worker something to do, and the next thing where there is enough for all."""
        for depth in range(1, DEPTH + 1):
            for worker in self._workers:
                loaded = sum(sent.worker == worker for sent in self._sent)
                enough = depth == 1 or len(waiting) >= len(self._workers)
                errand = self._for(worker, waiting) if loaded < depth and enough else None
                if errand is not None:
                    waiting.remove(errand)
                    try:
                        self._give(errand, worker, common)
                    except LightpaintError as error:
                        yield Done(errand.name, errand.kind, str(error))

    def _for(self, worker: str, waiting: deque[Errand]) -> Errand | None:
        """The next errand that the worker has not failed at, unless all have."""
        for errand in waiting:
            failed_at = self._failed_at.get(errand.name, set())
            if worker not in failed_at or failed_at >= set(self._workers):
                return errand
        return None

    def _give(self, errand: Errand, worker: str, common: set[str]) -> None:
        parcel = packed(errand, self._contents, run=self._run, is_shared=self._is_shared)
        self._ship(parcel, worker, common)
        future = self._client.submit(
            cluster_worker.do_parcel,
            parcel,
            key=f"{self._run}-{errand.kind}-{errand.name}-{secrets.token_hex(4)}",
            workers=[worker],
            pure=False,
        )
        self._sent.append(_Sent(errand, parcel, worker, future))
        self._note_turns()

    def _ship(self, parcel: Parcel, worker: str, common: set[str]) -> None:
        """Send what the worker lacks; what others will need goes to all at once."""
        for file, its in sent_files(parcel):
            if its in self._has.get(worker, set()):
                continue
            to = [worker]
            if file in common:
                to += [x for x in self._workers if x != worker and its not in self._has[x]]
            with open(file, "rb") as opened:
                data = opened.read()
            for piece in pieces(data):
                self._client.run(cluster_worker.put, its, *piece, workers=to, on_error="ignore")
            for one in to:
                self._has.setdefault(one, set()).add(its)

    def _note_turns(self) -> None:
        """Since when the first errand of each worker is."""
        seen = set()
        for sent in self._sent:
            if sent.worker not in seen and sent.since_s is None:
                sent.since_s = time.monotonic()
            seen.add(sent.worker)

    def _hear(self) -> None:
        """What workers say that they have begun."""
        while self._events:
            event = self._events.popleft()
            self.begun.append((event["errand"], event["worker"]))
            for sent in self._sent:
                if (spoken(sent.errand), sent.worker) == self.begun[-1]:
                    sent.since_s = time.monotonic()
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
            self._note_turns()
            self._returned[spoken(sent.errand), sent.worker] += not isinstance(came, list)
            if isinstance(came, list):  # a worker that was begun anew at the same address
                self._has.get(sent.worker, set()).difference_update(came)
                waiting.appendleft(sent.errand)
                continue
            if came.is_lost and tries[came.look] + 1 < TRIES:  # memory, which others may have
                tries[came.look] += 1
                self._failed_at.setdefault(came.look, set()).add(sent.worker)
                waiting.append(sent.errand)
                continue
            if came.files is not None:
                try:
                    unpack(sent.errand, came.files)
                except LightpaintError as error:
                    came = Done(came.look, came.kind, str(error))
            yield came

    def _came(self, sent: _Sent) -> Done | list[str] | None:
        """What came of it; None if it was lost on the way."""
        errand = sent.errand
        try:
            came: Done | list[str] = sent.future.result(timeout=ANSWER_S)
            return came
        except Exception as error:
            if isinstance(error, OSError) or sent.worker not in self._there():
                return None
            if sent.future.status != "error" or type(error).__name__ == "KilledWorker":
                return None
            return Done(errand.name, errand.kind, f"{type(error).__name__}: {first_line(error)}")

    def _lose_the_dead(self, waiting: deque[Errand], tries: Counter[str]) -> None:
        """What workers had that are gone is to be done again."""
        self._hear()
        self._lose([x for x in self._sent if x.worker not in self._workers], waiting, tries)

    def _lose(self, some: Sequence[_Sent], waiting: deque[Errand], tries: Counter[str]) -> None:
        """Take back what workers had."""
        for sent in some:
            with suppress(Exception):
                sent.future.cancel(force=True)
            self._sent.remove(sent)
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
            self._left_out[sent.worker] = "it took too long"
            self._workers.remove(sent.worker)
            self._lose([x for x in self._sent if x.worker == sent.worker], waiting, tries)
            self._end(sent.worker)
            return

    def _end(self, worker: str) -> None:
        """End a worker's process; its nanny begins another."""
        try:
            self._client.restart_workers([worker], timeout=ANSWER_S, raise_for_error=False)
        except Exception:  # it has no nanny
            with suppress(Exception):
                self._client.run(os._exit, 1, workers=[worker], wait=False, on_error="ignore")
