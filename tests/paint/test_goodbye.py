"""How the server ends, over real connections: with pages that hear, are deaf, or have just left."""

import pytest
from live_server import LARGE, Page, RunningServer, wait_until

from lightpaint.paint.protocol import VERSION, PictureData


def deaf_page(serving: RunningServer) -> Page:
    """A page that does not read what it is sent."""
    page = Page(serving)
    page.send("hello", version=VERSION)
    assert page.receive()[0]["kind"] == "state"
    assert serving.session.on_message is not None
    serving.session.on_message(PictureData(name="large", data=LARGE))
    return page


def unsent_bytes(serving: RunningServer) -> list[int]:
    """Bytes that wait in the server for each of its connections."""
    assert serving.server._uvicorn is not None
    connections = list(serving.server._uvicorn.server_state.connections)
    return [c.transport.get_write_buffer_size() for c in connections]


def test_a_page_that_is_there_hears_of_the_end(serving: RunningServer) -> None:
    page = Page(serving)
    page.send("hello", version=VERSION)
    assert page.receive()[0]["kind"] == "state"
    serving.end()
    assert page.receive()[0]["reason"] == "ended"


@pytest.mark.nightly
def test_a_page_that_does_not_hear_is_not_waited_for(serving: RunningServer) -> None:
    deaf_page(serving)
    wait_until(lambda: any(unsent_bytes(serving)), "the system takes it all")
    serving.end()


def test_a_page_that_is_at_its_own_goodbye_is_no_error(serving: RunningServer) -> None:
    page = deaf_page(serving)
    wait_until(lambda: any(unsent_bytes(serving)), "the system takes it all")
    page.send_goodbye()
    assert serving.server._uvicorn is not None
    [connection] = serving.server._uvicorn.server_state.connections
    wait_until(connection.transport.is_closing, "the goodbye is not heard")
    serving.end()


def test_a_picture_that_nobody_takes_and_half_a_question_are_not_waited_for(
    serving: RunningServer,
) -> None:
    asking, _, half = (serving.connection() for _ in range(3))
    host_line = f"Host: {serving.address}\r\n"
    asking.sendall(f"GET /data/large HTTP/1.1\r\n{host_line}{serving.key_header}\r\n\r\n".encode())
    half.sendall(f"GET /data/large HTTP/1.1\r\n{host_line}".encode())
    assert asking.recv(12) == b"HTTP/1.1 200"
    wait_until(lambda: any(unsent_bytes(serving)), "the system takes it all")
    serving.end()
