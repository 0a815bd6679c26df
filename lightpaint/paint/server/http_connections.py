"""Connections of browsers to the painter's server: few of strangers, and none for long.

Whoever reaches the server can open connections and say nothing on them, or half of a request. Until
a connection has shown the key it is a stranger's: one that asks for nothing is closed soon, and
when there are too many the oldest makes room, so that a page always gets through.

Imported only where uvicorn is installed.
"""

import asyncio
import socket
from collections.abc import Callable
from typing import Any, ClassVar

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

#: Seconds in which a connection has to come with a whole request, at first and after each answer.
REQUEST_S = 10.0

#: Connections that have not shown the key; a browser opens six at a time.
MOST_STRANGERS = 128


class BoundedHttp(H11Protocol):
    """One connection, until it becomes a socket of messages."""

    #: Whether a request shows the key.
    knows: Callable[[Any], bool]
    #: Those that have not shown it, the oldest first.
    strangers: ClassVar[dict["BoundedHttp", None]]

    _deadline: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Let it in, and send what it is told at once."""
        super().connection_made(transport)
        if (connection := transport.get_extra_info("socket")) is not None:
            # Otherwise the end of an answer waits until its beginning is acknowledged: 40 ms.
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.strangers[self] = None
        self._expect_request()
        if len(self.strangers) > MOST_STRANGERS:
            next(iter(self.strangers))._cut()

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget it."""
        self._let_go()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Take a part of a request."""
        before = self.scope
        super().data_received(data)
        if self.scope is before or self not in self.strangers:
            return
        if self.knows(self.scope):
            self._let_go()
        else:
            self._expect_request()

    def handle_websocket_upgrade(self, event: h11.Request) -> None:
        """Hand the connection on: who has no key is refused there."""
        self._let_go()
        super().handle_websocket_upgrade(event)

    def on_response_complete(self) -> None:
        """Wait for the next request."""
        super().on_response_complete()
        if self in self.strangers:
            self._expect_request()

    def _expect_request(self) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
        self._deadline = self.loop.call_later(REQUEST_S, self._miss_request)

    def _miss_request(self) -> None:
        is_answered = self.cycle is None or self.cycle.response_complete
        if not is_answered or self.transport.get_write_buffer_size():
            self._expect_request()  # it is the answer that takes long
        else:
            self._cut()

    def _let_go(self) -> None:
        self.strangers.pop(self, None)
        if self._deadline is not None:
            self._deadline.cancel()
            self._deadline = None

    def _cut(self) -> None:
        self._let_go()
        self.transport.abort()


def bounded_http(knows: Callable[[Any], bool]) -> type[BoundedHttp]:
    """Return the protocol of one server. knows: whether a request shows the server's key."""
    made = type("PageHttp", (BoundedHttp,), {"knows": staticmethod(knows), "strangers": {}})
    assert issubclass(made, BoundedHttp)
    return made
