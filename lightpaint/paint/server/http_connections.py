"""HTTP connections to the painter's server; unauthenticated ones are few and short.

Any program that reaches the server can open connections and send nothing, or half a request.
A connection is unauthenticated until it has shown the key. One that requests nothing is closed
soon, and if there are too many, the oldest is closed, so that a page always gets through.

Import it only if uvicorn is installed.
"""

import asyncio
import socket
from collections.abc import Callable
from typing import Any, ClassVar

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

#: Seconds for a connection to send a whole request, at first and after each answer.
REQUEST_TIMEOUT_S = 10.0

#: Maximum number of connections without the key; a browser opens six at a time.
MAX_UNAUTHENTICATED = 128


class BoundedHttp(H11Protocol):
    """An HTTP connection, until it becomes a socket of messages."""

    #: Whether a request shows the key.
    is_allowed: Callable[[Any], bool]
    #: Connections without the key, the oldest first.
    unauthenticated: ClassVar[dict["BoundedHttp", None]]

    _deadline: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Accept a connection, and send answers on it without delay."""
        super().connection_made(transport)
        if (connection := transport.get_extra_info("socket")) is not None:
            # Otherwise the end of an answer waits until its beginning is acknowledged: 40 ms.
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.unauthenticated[self] = None
        self._start_deadline()
        if len(self.unauthenticated) > MAX_UNAUTHENTICATED:
            next(iter(self.unauthenticated))._abort()

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget the connection."""
        self._forget()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Read a part of a request."""
        previous_scope = self.scope
        super().data_received(data)
        if self.scope is previous_scope or self not in self.unauthenticated:
            return
        if self.is_allowed(self.scope):
            self._forget()
        else:
            self._start_deadline()

    def handle_websocket_upgrade(self, event: h11.Request) -> None:
        """Hand the connection over to the socket's guard, which checks the key again."""
        self._forget()
        super().handle_websocket_upgrade(event)

    def on_response_complete(self) -> None:
        """Wait for the next request."""
        super().on_response_complete()
        if self in self.unauthenticated:
            self._start_deadline()

    def _start_deadline(self) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
        self._deadline = self.loop.call_later(REQUEST_TIMEOUT_S, self._on_deadline)

    def _on_deadline(self) -> None:
        is_answered = self.cycle is None or self.cycle.response_complete
        if not is_answered or self.transport.get_write_buffer_size():
            self._start_deadline()  # the answer may take long
        else:
            self._abort()

    def _forget(self) -> None:
        self.unauthenticated.pop(self, None)
        if self._deadline is not None:
            self._deadline.cancel()
            self._deadline = None

    def _abort(self) -> None:
        self._forget()
        self.transport.abort()


def bounded_http_protocol(is_allowed: Callable[[Any], bool]) -> type[BoundedHttp]:
    """Return the protocol of one server. is_allowed: whether a request shows the server's key."""
    protocol = type(
        "PageHttp", (BoundedHttp,), {"is_allowed": staticmethod(is_allowed), "unauthenticated": {}}
    )
    assert issubclass(protocol, BoundedHttp)
    return protocol
