"""The HTTP server of the painter: bounded connections, and a shutdown that notifies the pages.

Any program that reaches the server can open connections and send nothing, or half a request.
A connection is unauthenticated until it has shown the key. One that requests nothing is closed
soon, and if there are too many, the oldest is closed, so that a page always gets through. An
unresponsive page is cut off when the server ends.

Import it only if uvicorn is installed.
"""

import asyncio
import signal
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any, ClassVar

import h11
import uvicorn
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

from lightpaint.paint.server.session_clients import Connections

#: Seconds for a connection to send a whole request, at first and after each answer.
REQUEST_TIMEOUT_S = 10.0

#: Maximum number of connections without the key; a browser opens six at a time.
MAX_UNAUTHENTICATED = 128

#: Seconds before a connection with unsent data is cut; uvicorn would wait longer, and then print an
#: error to the terminal.
CUT_OFF_S = 2.0


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


class PageSocket(WebSocketsSansIOProtocol):
    """A page's socket, which may be closing when the server closes it."""

    def send_receive_event_to_app(self) -> None:
        """Pass a message on; text, which no page sends, becomes an empty message.

        uvicorn would print invalid text to the terminal.
        """
        if self.curr_msg_data_type == "text":
            self.curr_msg_data_type, self.frames = "bytes", [b""]
        super().send_receive_event_to_app()

    def shutdown(self) -> None:
        """Close the socket, unless the page has: that would cause an error of `websockets`."""
        if self.transport.is_closing():
            self.transport.abort()  # no client is left to receive the rest
        else:
            super().shutdown()


class GracefulServer(uvicorn.Server):
    """A server that notifies its pages before it ends, and then ends in bounded time."""

    def __init__(self, config: uvicorn.Config, connections: Connections) -> None:
        super().__init__(config)
        self._connections = connections

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        """End the server; a second signal, while pages are notified, changes nothing.

        uvicorn would skip the rest, and print the line at which it stopped.
        """
        if not self.should_exit:
            super().handle_exit(sig, frame)

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Notify the pages, then end."""
        await self._connections.close()  # while they can still be notified
        asyncio.get_running_loop().call_later(CUT_OFF_S, self._abort)
        await super().shutdown(sockets)

    def _abort(self) -> None:
        for connection in list(self.server_state.connections):
            connection.transport.abort()


@contextmanager
def stop_on_hangup(server: uvicorn.Server) -> Iterator[None]:
    """Stop `server` when its terminal closes, as SIGTERM does, unless SIGHUP is ignored (nohup)."""
    previous_handler = signal.getsignal(signal.SIGHUP)
    is_handled = threading.current_thread() is threading.main_thread() and callable(
        previous_handler
    )
    if is_handled:
        signal.signal(signal.SIGHUP, lambda *_: server.handle_exit(signal.SIGTERM, None))
    try:
        yield
    finally:
        if is_handled:
            signal.signal(signal.SIGHUP, previous_handler)
