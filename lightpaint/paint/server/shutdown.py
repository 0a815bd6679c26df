"""The shutdown of the painter's server: it notifies the pages, and cuts off unresponsive ones.

Import it only if uvicorn is installed.
"""

import asyncio
import signal
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

import uvicorn
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

from lightpaint.paint.server.session_clients import Connections

#: Seconds before a connection with unsent data is cut; uvicorn would wait longer, and then print an
#: error to the terminal.
CUT_OFF_S = 2.0


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
