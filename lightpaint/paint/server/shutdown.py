"""How the painter's server ends: pages are told, and who does not hear is not waited for.

Imported only where uvicorn is installed.
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

from lightpaint.paint.server.session_clients import Line

#: Seconds after which a connection is cut that has not taken what was still to be sent; uvicorn
#: would wait longer, and then say so as an error at the terminal.
PATIENCE_S = 2.0


class PageSocket(WebSocketsSansIOProtocol):
    """A page's socket, which may be at its own goodbye when the server says its."""

    def send_receive_event_to_app(self) -> None:
        """Pass a message on; text, which no page sends, as one that says nothing.

        uvicorn would show at the terminal where it could not read the text.
        """
        if self.curr_msg_data_type == "text":
            self.curr_msg_data_type, self.frames = "bytes", [b""]
        super().send_receive_event_to_app()

    def shutdown(self) -> None:
        """Say goodbye, unless the page has: uvicorn then ends in an error of `websockets`."""
        if self.transport.is_closing():
            self.transport.abort()  # nobody is there for what was still to be sent
        else:
            super().shutdown()


class EndingServer(uvicorn.Server):
    """A server whose pages hear of the end, and that ends."""

    def __init__(self, config: uvicorn.Config, line: Line) -> None:
        super().__init__(config)
        self._line = line

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        """End; whoever asks for it again, while pages are told, does not make it any sooner.

        uvicorn would leave out the rest, and show in which line it was.
        """
        if not self.should_exit:
            super().handle_exit(sig, frame)

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Tell the pages, then end."""
        await self._line.end()  # while they can still be told
        asyncio.get_running_loop().call_later(PATIENCE_S, self._cut)
        await super().shutdown(sockets)

    def _cut(self) -> None:
        for connection in list(self.server_state.connections):
            connection.transport.abort()


@contextmanager
def hanging_up(server: uvicorn.Server) -> Iterator[None]:
    """A terminal that closes ends `server` as SIGTERM does, unless that is ignored (nohup)."""
    before = signal.getsignal(signal.SIGHUP)
    is_heard = threading.current_thread() is threading.main_thread() and callable(before)
    if is_heard:
        signal.signal(signal.SIGHUP, lambda *_: server.handle_exit(signal.SIGTERM, None))
    try:
        yield
    finally:
        if is_heard:
            signal.signal(signal.SIGHUP, before)
