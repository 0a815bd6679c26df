"""The workers of a Dask cluster: their addresses, their files and their events.

Before Dask connects, this machine and a scheduler at a `tls://` address check that they trust each
other, since a refused Dask client reports that late, or waits for half a minute. Dask finds
certificates by its own configuration (`distributed.comm.tls`), as its schedulers and workers do.
"""

import asyncio
import gc
import logging
import os
import socket
import ssl
import time
from collections import deque
from collections.abc import Callable, Collection
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from lightpaint.batch import parcels
from lightpaint.batch.parcels import Parcel, files_to_send, pieces
from lightpaint.batch.parcels import versions as own_versions
from lightpaint.errors import BatchError, LightpaintError
from lightpaint.files import call_with_timeout, first_line
from lightpaint.progress import Listener

#: Seconds for the scheduler to answer, to reconnect, and between refreshes of the workers.
ANSWER_S, GONE_S, LOOK_S = 15.0, 3.0, 1.0
#: Seconds after which a silent scheduler is given up; sending much data takes it long.
SILENT_S = 60.0

#: Errors that Dask raises when a scheduler ends in the middle of something.
DASK_ERRORS = (Exception, asyncio.CancelledError)

#: Loggers that are silenced: errors of connections are reported here, in a line.
SILENCED_LOGGERS = (
    "distributed.client",
    "distributed.comm",
    "distributed.core",
    "distributed.utils",
)

_Result = TypeVar("_Result")

INSTALL = "pip install 'lightpaint[cluster]'"

#: Advice on configuring certificates.
CONFIGURE_HINT = (
    "DASK_DISTRIBUTED__COMM__TLS__CA_FILE and DASK_DISTRIBUTED__COMM__TLS__CLIENT__CERT name them "
    "(and ...__CLIENT__KEY, where the key is in a file of its own)"
)


class ClusterWorkers:
    """The workers of the scheduler at `address`. topic: of the events that they report."""

    def __init__(self, address: str, listen: Listener, topic: str) -> None:
        self._address, self._listen = address, listen
        self._client: Any = _connect(address)
        #: Addresses of the workers that can be given work.
        self.addresses: list[str] = []
        #: Whether the scheduler is gone.
        self.is_gone = False
        #: Events that workers have reported, oldest first.
        self.events: deque[dict[str, str]] = deque()
        self._left_out: dict[str, str] = {}
        self._files_at: dict[str, set[str]] = {}
        self._looked_s = 0.0
        self._is_waiting = False
        try:
            subscribe = self._client.subscribe_topic
            self._ask(lambda: subscribe(topic, lambda event: self.events.append(event[1])))
            self.refresh()
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Disconnect."""
        with suppress(*DASK_ERRORS):
            self._client.close(timeout=2)

    def is_known(self, worker: str) -> bool:
        """Return whether the scheduler knows a worker now."""
        return worker in self._all_addresses()

    def submit(self, parcel: Parcel, worker: str, key: str) -> Any:
        """Submit an item to a worker that has its files; return a future of the result."""
        options: dict[str, Any] = {"key": key, "workers": [worker], "pure": False}
        return self._ask(lambda: self._client.submit(parcels.do_parcel, parcel, **options))

    def forget_files(self, worker: str, sums: Collection[str]) -> None:
        """Forget that a worker has these files."""
        self._files_at.get(worker, set()).difference_update(sums)

    def refresh(self) -> None:
        """Update the list of workers, and ask each new one for its versions."""
        if time.monotonic() - self._looked_s < LOOK_S:
            return
        addresses = [x for x in self._all_addresses() if x not in self._left_out]
        for worker, reason in self._reasons_against(
            sorted(set(addresses) - set(self.addresses))
        ).items():
            self._left_out[worker] = reason
            self._listen.say(f"worker {worker} is left out: {reason}")
        self.addresses = [worker for worker in addresses if worker not in self._left_out]
        self._files_at = {worker: self._files_at.get(worker, set()) for worker in self.addresses}
        if not self.addresses and not self._is_waiting:
            self._listen.say(f"waiting for workers at {self._address}")
        self._is_waiting = not self.addresses
        self._looked_s = time.monotonic()

    def _all_addresses(self) -> list[str]:
        """Return the addresses of all workers. Raises BatchError if the scheduler is gone."""
        return list(self._ask(self._client.nthreads))

    def _ask(self, work: Callable[[], _Result]) -> _Result:
        """Call `work`, which asks the scheduler, and return the answer.
        Raises BatchError if the scheduler is gone.
        """
        import dask

        status = self._client.status
        if status == "running":
            try:
                # Dask would try for 30 s to reach a scheduler that has ended.
                with dask.config.set({"distributed.comm.timeouts.connect": f"{GONE_S}s"}):
                    return call_with_timeout(work, SILENT_S)
            except DASK_ERRORS as error:
                status = _reason(error)
        self.is_gone = True
        raise BatchError(
            f"the scheduler at {self._address} is gone ({status}): once it is back, "
            "run the same command to continue"
        )

    def _reasons_against(self, workers: list[str]) -> dict[str, str]:
        """Return the new workers that cannot be used, and why."""
        if not workers:
            return {}
        ask = partial(self._client.run, parcels.versions, workers=workers)
        replies = self._ask(partial(ask, on_error="return"))
        own_packages, reasons = own_versions(), {}
        for worker, reply in replies.items():
            if isinstance(reply, Exception):
                reasons[worker] = f"lightpaint does not run there ({first_line(reply)})"
            elif differing_names := [
                name for name in own_packages if reply.get(name) != own_packages[name]
            ]:
                reasons[worker] = ", ".join(
                    f"it has {name} {reply.get(name)}, and here is {own_packages[name]}"
                    for name in differing_names
                )
        return reasons

    def send_files(self, parcel: Parcel, worker: str, common: set[str]) -> None:
        """Send a worker the files that it lacks; those in `common` go to all workers at once."""
        for file, digest in files_to_send(parcel):
            if digest in self._files_at.get(worker, set()):
                continue
            receivers = [worker]
            if file in common:
                receivers += [
                    x for x in self.addresses if x != worker and digest not in self._files_at[x]
                ]
            try:
                data = Path(file).read_bytes()
            except OSError as error:
                raise BatchError(f"cannot read {file}: {error.strerror or error}") from None
            for piece in pieces(data):
                put = partial(self._client.run, parcels.put, digest, *piece, workers=receivers)
                self._ask(partial(put, on_error="ignore"))
            for receiver in receivers:
                self._files_at.setdefault(receiver, set()).add(digest)

    def end(self, worker: str, reason: str) -> None:
        """End a worker's process; its nanny starts another."""
        self._left_out[worker] = reason
        if worker in self.addresses:
            self.addresses.remove(worker)
        try:
            self._client.restart_workers([worker], timeout=ANSWER_S, raise_for_error=False)
        except DASK_ERRORS:  # it has no nanny
            with suppress(*DASK_ERRORS):
                self._client.run(os._exit, 1, workers=[worker], wait=False, on_error="ignore")


def _reason(error: BaseException) -> str:
    """Return the message of an error, without the system's error number."""
    return str(getattr(error, "strerror", None) or first_line(error))


def _connect(address: str) -> Any:
    """Return a client of the scheduler. Raises BatchError."""
    try:
        from distributed import Client
        from distributed.comm import get_address_host_port
    except ImportError as error:
        raise BatchError(f"a cluster needs Dask's distributed: {INSTALL}") from error
    for name in SILENCED_LOGGERS:
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    try:
        # Dask's client is slow to report that nobody listens or that it is refused, and logs more.
        place = get_address_host_port(address, strict=True)
        with socket.create_connection(place, timeout=ANSWER_S) as connection:
            _check_trust(address, connection)
        collect_lost_clients()
        # Dask would wait for ever for a server that accepts the connection and stays silent.
        make = partial(Client, address, timeout=ANSWER_S, set_as_default=False)
        return call_with_timeout(make, ANSWER_S + GONE_S)
    except LightpaintError:
        raise
    except DASK_ERRORS as error:
        raise BatchError(
            f"no scheduler answers at {address}: {_reason(error) or 'none is there'}; give its "
            "address, like tcp://host:8786 or tls://host:8786 (dask scheduler tells it)"
        ) from error


def collect_lost_clients() -> None:
    """Close Dask's clients that did not reach their scheduler, and that nothing refers to any more.

    A client closes itself when it is collected, under a lock of Dask's that the start of another
    one holds. If it were collected during that, both would wait for ever (distributed 2026.8.0).
    """
    gc.collect()


def _check_trust(address: str, connection: socket.socket) -> None:
    """Raise BatchError, with advice, unless Dask's configuration can connect to `address`.

    connection: a new connection to the scheduler there; a TLS handshake uses it up. Raises OSError
    if it breaks off.
    """
    security = _security(address)
    if not address.startswith("tls://"):
        if security.require_encryption:
            raise BatchError(
                f"Dask's configuration wants encryption here, and {address} has none: give a "
                "scheduler's tls:// address, or turn distributed.comm.require-encryption off"
            )
        return
    context = _context(address, security)
    try:
        with context.wrap_socket(connection) as secure:
            # The scheduler reports a refused certificate in its first message after the handshake.
            secure.recv(1)
    except ssl.SSLCertVerificationError as error:
        reason = error.verify_message
    except ssl.SSLError as error:
        if error.reason in ("WRONG_VERSION_NUMBER", "RECORD_LAYER_FAILURE", "HTTP_REQUEST"):
            raise BatchError(
                f"no TLS is spoken at {address}: a scheduler that was started without certificates "
                f"is at {address.replace('tls://', 'tcp://', 1)}"
            ) from None
        reason = (error.reason or first_line(error)).replace("_", " ").lower()
    else:
        return
    raise BatchError(
        f"the scheduler at {address} and this machine do not trust each other's certificates "
        f"({reason}): both have to be signed by an authority that the other one names; "
        f"{CONFIGURE_HINT}"
    )


def _security(address: str) -> Any:
    from distributed.security import Security

    try:
        return Security()
    except (ImportError, TypeError, ValueError) as error:
        raise BatchError(f"Dask's configuration for {address}: {first_line(error)}") from None


def _context(address: str, security: Any) -> ssl.SSLContext:
    try:
        context = security.get_connection_args("client")["ssl_context"]
    except (OSError, ValueError) as error:
        # Python does not say which of the files it is.
        files = security.get_tls_config_for_role("client")
        names = ", ".join(str(files[x])[:200] for x in ("ca_file", "cert", "key") if files[x])
        reason = error.strerror if isinstance(error, FileNotFoundError) else first_line(error)
        raise BatchError(
            f"the certificates for {address} cannot be used: {reason} ({names}); each is a PEM "
            "file, and a certificate needs its key"
        ) from None
    if not isinstance(context, ssl.SSLContext):
        raise BatchError(f"{address} needs certificates: {CONFIGURE_HINT}")
    return context
