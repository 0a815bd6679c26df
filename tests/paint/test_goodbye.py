"""How the server ends, over real connections: with pages that hear, are deaf, or have just left."""

import http.client
import logging
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing

import numpy as np
import pytest
from fake_session import FakeSession
from websockets.client import ClientProtocol
from websockets.datastructures import Headers
from websockets.uri import parse_uri

from lightpaint.paint.frames import Message, of_frame, to_frame
from lightpaint.paint.protocol import VERSION
from lightpaint.paint.server import Server

#: More than the system takes for somebody who does not read.
LARGE = np.zeros((2048, 2048, 4), np.float32)


class Serving:
    """A session served on a port of its own, and what that has ended in."""

    def __init__(self) -> None:
        self.session = FakeSession()
        self.session.pictures["large"] = LARGE
        self.server = Server(self.session, port=0)
        self.ended_in: BaseException | None = None
        self.connections: list[socket.socket] = []
        self.thread = threading.Thread(target=self._run, daemon=True)
        self.thread.start()
        self.cookie = self._cookie()

    def _run(self) -> None:
        try:
            self.server.run()
        except BaseException as error:
            self.ended_in = error

    def _cookie(self) -> str:
        with closing(http.client.HTTPConnection("127.0.0.1", self.server.port)) as asking:
            asking.request("GET", self.server.url.partition(str(self.server.port))[2])
            answer = asking.getresponse()
            answer.read()
        return answer.headers["set-cookie"].partition(";")[0]

    def connection(self) -> socket.socket:
        """One whose end here takes next to nothing unless it is read."""
        made = socket.socket()
        made.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        made.connect(("127.0.0.1", self.server.port))
        made.settimeout(20)
        self.connections.append(made)
        return made

    def end(self) -> None:
        """Stop, and fail if that is an error or never comes."""
        self.server.stop()
        self.thread.join(20)
        self.server.close()
        assert not self.thread.is_alive()
        assert self.ended_in is None


@pytest.fixture
def serving(caplog: pytest.LogCaptureFixture) -> Iterator[Serving]:
    """What the terminal would show beside, is an error as well."""
    made = Serving()
    with caplog.at_level(logging.WARNING):
        yield made
        made.end()
    for connection in made.connections:
        connection.close()
    records = [*caplog.get_records("call"), *caplog.records]
    assert [record.getMessage() for record in records] == []


class Page:
    """A page's end of the socket, byte by byte."""

    def __init__(self, serving: Serving) -> None:
        self.connection = serving.connection()
        here = f"127.0.0.1:{serving.server.port}"
        self.protocol = ClientProtocol(parse_uri(f"ws://{here}/live"))
        request = self.protocol.connect()
        request.headers = Headers(
            {**dict(request.headers), "Cookie": serving.cookie, "Origin": f"http://{here}"}
        )
        self.protocol.send_request(request)
        self._sent()
        self.hears()
        assert self.protocol.handshake_exc is None

    def says(self, kind: str, **fields: object) -> None:
        self.protocol.send_binary(to_frame(Message(kind, {"seq": 1, **fields}).content(), []))
        self._sent()

    def says_goodbye(self) -> None:
        self.protocol.send_close(1001)
        self._sent()

    def hears(self) -> list[dict[str, object]]:
        """The next that comes; nothing at the end."""
        while True:
            data = self.connection.recv(1 << 16)
            if not data:
                return []
            self.protocol.receive_data(data)
            if events := self.protocol.events_received():
                frames = [bytes(e.data) for e in events if getattr(e, "opcode", None) == 2]
                return [of_frame(frame)[0] for frame in frames]

    def _sent(self) -> None:
        self.connection.sendall(b"".join(self.protocol.data_to_send()))


def until(is_so: Callable[[], object], what: str) -> None:
    end = time.monotonic() + 20
    while not is_so():
        assert time.monotonic() < end, what
        time.sleep(0.01)


def deaf(serving: Serving) -> Page:
    """A page that does not read what it is sent."""
    page = Page(serving)
    page.says("hello", version=VERSION)
    assert page.hears()[0]["kind"] == "state"
    assert serving.session.on_message is not None
    serving.session.on_message(Message("fetched", {"name": "large"}, {"picture": LARGE}))
    return page


def unsent(serving: Serving) -> list[int]:
    """Bytes that wait in the server for each of its connections."""
    assert serving.server._serving is not None
    connections = list(serving.server._serving.server_state.connections)
    return [c.transport.get_write_buffer_size() for c in connections]


def test_a_page_that_is_there_hears_of_the_end(serving: Serving) -> None:
    page = Page(serving)
    page.says("hello", version=VERSION)
    assert page.hears()[0]["kind"] == "state"
    serving.end()
    assert page.hears()[0]["reason"] == "ended"


def test_a_page_that_does_not_hear_is_not_waited_for(serving: Serving) -> None:
    deaf(serving)
    until(lambda: any(unsent(serving)), "the system takes it all")
    serving.end()


def test_a_page_that_is_at_its_own_goodbye_is_no_error(serving: Serving) -> None:
    page = deaf(serving)
    until(lambda: any(unsent(serving)), "the system takes it all")
    page.says_goodbye()
    assert serving.server._serving is not None
    [connection] = serving.server._serving.server_state.connections
    until(connection.transport.is_closing, "the goodbye is not heard")
    serving.end()


def test_a_picture_that_nobody_takes_and_half_a_question_are_not_waited_for(
    serving: Serving,
) -> None:
    asking, _, half = (serving.connection() for _ in range(3))
    here = f"Host: 127.0.0.1:{serving.server.port}\r\n"
    asking.sendall(f"GET /data/large HTTP/1.1\r\n{here}Cookie: {serving.cookie}\r\n\r\n".encode())
    half.sendall(f"GET /data/large HTTP/1.1\r\n{here}".encode())
    assert asking.recv(12) == b"HTTP/1.1 200"
    until(lambda: any(unsent(serving)), "the system takes it all")
    serving.end()
