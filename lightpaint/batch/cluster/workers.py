"""The workers of a Dask cluster: who is there, what each has, and what it says."""

import asyncio
import logging
import os
import socket
import time
from collections import deque
from collections.abc import Callable, Collection
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from lightpaint.batch.cluster import worker as cluster_worker
from lightpaint.batch.cluster.parcels import Parcel, pieces, sent_files
from lightpaint.batch.cluster.tls import check_trust
from lightpaint.batch.cluster.worker import versions as own_versions
from lightpaint.errors import BatchError, LightpaintError
from lightpaint.files import first_line, in_time
from lightpaint.progress import Listener

#: Seconds for the scheduler to answer, to be found again, and between looks at who is there.
ANSWER_S, GONE_S, LOOK_S = 15.0, 3.0, 1.0
#: Seconds after which one that is at an answer, as while much is sent, is given up.
SILENT_S = 60.0

#: What Dask raises where a scheduler ends in the middle of something.
GOING = (Exception, asyncio.CancelledError)

#: Whose words on a connection stand here, in a line; they have last ones after the end, too.
SPOKEN_FOR = ("distributed.client", "distributed.comm", "distributed.core", "distributed.utils")

_Made = TypeVar("_Made")

INSTALL = "pip install 'lightpaint[cluster]'"


class ClusterWorkers:
    """Those that the scheduler at `address` knows. topic: under which they tell what they begin."""

    def __init__(self, address: str, listen: Listener, topic: str) -> None:
        self._address, self._listen = address, listen
        self._client: Any = _connected(address)
        #: Addresses of those that can be given work.
        self.there: list[str] = []
        #: Whether the scheduler is.
        self.is_gone = False
        #: What they tell.
        self.events: deque[dict[str, str]] = deque()
        self._left_out: dict[str, str] = {}
        self._has: dict[str, set[str]] = {}
        self._looked_s = 0.0
        self._is_told = False
        try:
            hear = self._client.subscribe_topic
            self._asked(lambda: hear(topic, lambda event: self.events.append(event[1])))
            self.look_around()
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Leave them alone."""
        with suppress(*GOING):
            self._client.close(timeout=2)

    def is_there(self, worker: str) -> bool:
        """Whether the scheduler knows it now."""
        return worker in self._known()

    def submit(self, parcel: Parcel, worker: str, key: str) -> Any:
        """Give a worker an errand, whose files it has; a future of what comes of it."""
        how: dict[str, Any] = {"key": key, "workers": [worker], "pure": False}
        return self._asked(lambda: self._client.submit(cluster_worker.do_parcel, parcel, **how))

    def lacks(self, worker: str, sums: Collection[str]) -> None:
        """It says that it does not have those files any more."""
        self._has.get(worker, set()).difference_update(sums)

    def look_around(self) -> None:
        """Who is there; each is asked once whether it has what is here."""
        if time.monotonic() - self._looked_s < LOOK_S:
            return
        there = [x for x in self._known() if x not in self._left_out]
        for worker, why in self._unfit(sorted(set(there) - set(self.there))).items():
            self._left_out[worker] = why
            self._listen.say(f"worker {worker} is left out: {why}")
        self.there = [worker for worker in there if worker not in self._left_out]
        self._has = {worker: self._has.get(worker, set()) for worker in self.there}
        if not self.there and not self._is_told:
            self._listen.say(f"waiting for workers at {self._address}")
        self._is_told = not self.there
        self._looked_s = time.monotonic()

    def _known(self) -> list[str]:
        """Addresses of all workers. Raises BatchError where the scheduler is gone."""
        return list(self._asked(self._client.nthreads))

    def _asked(self, work: Callable[[], _Made]) -> _Made:
        """Ask the scheduler, and return its answer. Raises BatchError where it is gone."""
        import dask

        said = self._client.status
        if said == "running":
            try:
                # Dask would try to reach one that has ended for 30 s.
                with dask.config.set({"distributed.comm.timeouts.connect": f"{GONE_S}s"}):
                    return in_time(work, SILENT_S)
            except GOING as error:
                said = _reason(error)
        self.is_gone = True
        raise BatchError(
            f"the scheduler at {self._address} is gone ({said}); the same command goes on once it "
            "is back"
        )

    def _unfit(self, workers: list[str]) -> dict[str, str]:
        """Which of those that have come are of no use, and why."""
        if not workers:
            return {}
        ask = partial(self._client.run, cluster_worker.versions, workers=workers)
        found = self._asked(partial(ask, on_error="return"))
        mine, unfit = own_versions(), {}
        for worker, its in found.items():
            if isinstance(its, Exception):
                unfit[worker] = f"lightpaint does not run there ({first_line(its)})"
            elif others := [name for name in mine if its.get(name) != mine[name]]:
                unfit[worker] = ", ".join(
                    f"it has {name} {its.get(name)}, and here is {mine[name]}" for name in others
                )
        return unfit

    def ship(self, parcel: Parcel, worker: str, common: set[str]) -> None:
        """Send what the worker lacks; what others will need goes to all at once."""
        for file, its in sent_files(parcel):
            if its in self._has.get(worker, set()):
                continue
            to = [worker]
            if file in common:
                to += [x for x in self.there if x != worker and its not in self._has[x]]
            try:
                data = Path(file).read_bytes()
            except OSError as error:
                raise BatchError(f"cannot read {file}: {error.strerror or error}") from None
            for piece in pieces(data):
                put = partial(self._client.run, cluster_worker.put, its, *piece, workers=to)
                self._asked(partial(put, on_error="ignore"))
            for one in to:
                self._has.setdefault(one, set()).add(its)

    def end(self, worker: str, why: str) -> None:
        """End a worker's process; its nanny begins another."""
        self._left_out[worker] = why
        if worker in self.there:
            self.there.remove(worker)
        try:
            self._client.restart_workers([worker], timeout=ANSWER_S, raise_for_error=False)
        except GOING:  # it has no nanny
            with suppress(*GOING):
                self._client.run(os._exit, 1, workers=[worker], wait=False, on_error="ignore")


def _reason(error: BaseException) -> str:
    """Return what an error says, without the system's number for it."""
    return str(getattr(error, "strerror", None) or first_line(error))


def _connected(address: str) -> Any:
    """A client of the scheduler there. Raises BatchError."""
    try:
        from distributed import Client
        from distributed.comm import get_address_host_port
    except ImportError as error:
        raise BatchError(f"a cluster needs Dask's distributed: {INSTALL}") from error
    for name in SPOKEN_FOR:
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    try:
        # A client that finds nobody, or is not let in, takes its time, and has last words.
        place = get_address_host_port(address, strict=True)
        with socket.create_connection(place, timeout=ANSWER_S) as connection:
            check_trust(address, connection)
        # One that takes the connection and says nothing would be waited for without end.
        make = partial(Client, address, timeout=ANSWER_S, set_as_default=False)
        return in_time(make, ANSWER_S + GONE_S)
    except LightpaintError:
        raise
    except GOING as error:
        raise BatchError(
            f"no scheduler answers at {address}: {_reason(error) or 'none is there'}; give its "
            "address, like tcp://host:8786 or tls://host:8786 (dask scheduler tells it)"
        ) from error
