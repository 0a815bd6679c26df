"""A painter's server over real connections, and pages that speak to it byte by byte."""

import asyncio
import socket
import threading
import time
from collections.abc import Callable, Coroutine
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from fake_session import FakeSession
from patience import PATIENCE_S
from raw_message import RawMessage
from server_key import bearer, key_of, offered
from websockets.client import ClientProtocol
from websockets.datastructures import Headers
from websockets.typing import Subprotocol
from websockets.uri import parse_uri

from lightpaint.paint.message_frames import from_frame, to_frame
from lightpaint.paint.server.guard import PROTOCOL
from lightpaint.paint.server.page_server import Server

#: More than the system takes for somebody who does not read.
LARGE = np.zeros((2048, 2048, 4), np.float32)


class RunningServer:
    """A session served on a port of its own, and what that has ended in."""

    def __init__(self) -> None:
        self.session = FakeSession()
        self.session.pictures["large"] = LARGE
        self.server = Server(self.session, port=0)
        self.ended_in: BaseException | None = None
        self.connections: list[socket.socket] = []
        self.thread = threading.Thread(target=self._run, daemon=True)
        self.thread.start()
        self.key = key_of(self.server.url)

    @property
    def key_header(self) -> str:
        """The line of a request that shows the key."""
        [(name, value)] = bearer(self.key).items()
        return f"{name}: {value}"

    @property
    def address(self) -> str:
        """The address of the server, as requests have it."""
        return f"127.0.0.1:{self.server.port}"

    def _run(self) -> None:
        try:
            self.server.run()
        except BaseException as error:
            self.ended_in = error

    def connection(self) -> socket.socket:
        """One whose end here takes next to nothing unless it is read."""
        client = socket.socket()
        client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        client.connect(("127.0.0.1", self.server.port))
        client.settimeout(PATIENCE_S)
        self.connections.append(client)
        return client

    def end(self) -> None:
        """Stop, and fail if that is an error or never comes."""
        self.server.stop()
        self.thread.join(PATIENCE_S)
        self.server.close()
        assert not self.thread.is_alive()
        assert self.ended_in is None


class Page:
    """A page's end of the socket, byte by byte."""

    def __init__(self, serving: RunningServer) -> None:
        self.connection = serving.connection()
        address = serving.address
        self.protocol = ClientProtocol(
            parse_uri(f"ws://{address}/live"), subprotocols=[Subprotocol(PROTOCOL)]
        )
        request = self.protocol.connect()
        offer = {"Sec-WebSocket-Protocol": ", ".join(offered(serving.key))}
        request.headers = Headers({**dict(request.headers), **offer, "Origin": f"http://{address}"})
        self.protocol.send_request(request)
        self._flush()
        self.receive()
        assert self.protocol.handshake_exc is None

    def send(self, kind: str, **fields: object) -> None:
        self.protocol.send_binary(to_frame(RawMessage(kind, {"seq": 1, **fields}).content(), []))
        self._flush()

    def send_bytes(self, data: bytes) -> None:
        """Send any bytes."""
        self.connection.sendall(data)

    def send_goodbye(self) -> None:
        self.protocol.send_close(1001)
        self._flush()

    def receive(self) -> list[dict[str, object]]:
        """Return the next messages that come; none at the end."""
        while True:
            data = self.connection.recv(1 << 16)
            if not data:
                return []
            self.protocol.receive_data(data)
            if events := self.protocol.events_received():
                frames = [bytes(e.data) for e in events if getattr(e, "opcode", None) == 2]
                return [from_frame(frame)[0] for frame in frames]

    def _flush(self) -> None:
        self.connection.sendall(b"".join(self.protocol.data_to_send()))


def wait_until(is_so: Callable[[], object], description: str) -> None:
    """Wait for it, as long as anything takes on a busy machine."""
    end = time.monotonic() + PATIENCE_S
    while not is_so():
        assert time.monotonic() < end, description
        time.sleep(0.01)


def run_in_loop(trial: Callable[[], Coroutine[Any, Any, None]]) -> None:
    """Run a trial in another thread: where other tests have a browser open, this one has a loop."""
    with ThreadPoolExecutor(1) as threads:
        threads.submit(lambda: asyncio.run(asyncio.wait_for(trial(), PATIENCE_S))).result()
