"""Connections to the painter's server: strangers take no room and no time of a page's."""

import http.client
import socket
import time
from contextlib import closing, suppress
from typing import Any

import pytest
from live_server import Page, RunningServer, wait_until
from patience import PATIENCE_S
from server_key import bearer

from lightpaint.paint.protocol import VERSION
from lightpaint.paint.server import http_server

HALF = b"GET / HTTP/1.1\r\nHost: 127.0"


def status(serving: RunningServer, path: str, key: str = "") -> int:
    """How a page's request is answered, on a connection of its own."""
    with closing(http.client.HTTPConnection("127.0.0.1", serving.server.port, 20)) as asking:
        asking.request("GET", path, headers=bearer(key) if key else {})
        return asking.getresponse().status


def is_cut(connection: socket.socket) -> bool:
    """Whether the server has closed it; waits until there is something to say of it."""
    try:
        return connection.recv(1 << 16) == b""
    except ConnectionResetError:
        return True


def connected_sockets(serving: RunningServer) -> list[Any]:
    assert serving.server._uvicorn is not None
    return list(serving.server._uvicorn.server_state.connections)


def send_in_drops(connection: socket.socket) -> None:
    """Send a request byte by byte, which goes on after its head and takes as long as anything."""
    for drop in range(round(PATIENCE_S / 0.05)):
        connection.sendall(b"GET / HTTP/1.1\r\n"[drop : drop + 1] or b"x")
        time.sleep(0.05)


def test_hundreds_of_half_sent_requests_shut_nobody_out(serving: RunningServer) -> None:
    page = Page(serving)
    for _ in range(300):
        serving.connection().sendall(HALF)
    wait_until(
        lambda: len(connected_sockets(serving)) >= http_server.MAX_UNAUTHENTICATED,
        "they do not come",
    )
    assert status(serving, "/data/present", serving.key) == 200
    assert status(serving, "/") == 200  # a page that is being opened
    another = Page(serving)
    for client in (page, another):
        client.send("hello", version=VERSION)
        assert client.receive()[0]["kind"] in ("state", "closed")
    assert len(connected_sockets(serving)) <= http_server.MAX_UNAUTHENTICATED + 4
    # The latest have the best chance of being people.
    assert is_cut(serving.connections[1])


def test_a_request_comes_in_time_or_its_connection_is_closed(
    serving: RunningServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Long enough to connect and to ask on a busy machine.
    monkeypatch.setattr(http_server, "REQUEST_TIMEOUT_S", 2.0)
    page, silent, half = Page(serving), serving.connection(), serving.connection()
    half.sendall(HALF)
    second = serving.connection()
    second.sendall(f"GET / HTTP/1.1\r\nHost: {serving.address}\r\n\r\n".encode())
    assert second.recv(12) == b"HTTP/1.1 200"
    second.sendall(HALF)
    headers = f"Host: {serving.address}\r\n{serving.key_header}\r\n\r\n"
    trusted = serving.connection()
    trusted.sendall(f"GET /data/present HTTP/1.1\r\n{headers}".encode())
    assert trusted.recv(12) == b"HTTP/1.1 200"
    trusted.sendall(HALF)
    # Who sends it in drops has no longer.
    slow = serving.connection()
    with pytest.raises((ConnectionResetError, BrokenPipeError)):
        send_in_drops(slow)
    for connection in (silent, half, slow):
        assert is_cut(connection)
    while second.recv(1 << 16):
        pass  # what it had asked for comes whole
    # Who has shown the key, and a page, have all the time they want.
    page.send("hello", version=VERSION)
    assert page.receive()[0]["kind"] == "state"
    trusted.sendall(f".0.1:{serving.server.port}\r\n{serving.key_header}\r\n\r\n".encode())
    wait_until(lambda: b"HTTP/1.1 200" in trusted.recv(1 << 16), "it is not answered again")


def test_an_answer_that_is_taken_slowly_is_not_cut(
    serving: RunningServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As the page's own files through a slow tunnel are, by a browser that has no key yet."""
    monkeypatch.setattr(http_server, "REQUEST_TIMEOUT_S", 0.1)
    asking = serving.connection()
    wait_until(lambda: connected_sockets(serving), "it is not there")
    for connection in connected_sockets(serving):  # else the system takes it all
        accepted = connection.transport.get_extra_info("socket")
        accepted.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4096)
    asking.sendall(f"GET /main.js HTTP/1.1\r\nHost: {serving.address}\r\n\r\n".encode())
    head = asking.recv(1 << 12)
    [length] = [
        int(line.partition(b":")[2])
        for line in head.split(b"\r\n")
        if line.startswith(b"content-length")
    ]
    time.sleep(0.5)
    received = len(head.partition(b"\r\n\r\n")[2])
    while received < length:
        data = asking.recv(1 << 16)
        assert data, f"{received} of {length} bytes"
        received += len(data)


def test_what_is_sent_goes_at_once(serving: RunningServer) -> None:
    """Nothing waits until what was sent before it is acknowledged (RFC 896): 40 ms an answer."""
    keeper, page = serving.connection(), Page(serving)
    keeper.sendall(HALF)
    page.send("hello", version=VERSION)
    wait_until(lambda: len(connected_sockets(serving)) >= 2, "they are not there")
    for connection in connected_sockets(serving):
        accepted = connection.transport.get_extra_info("socket")
        assert accepted.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)


def test_junk_of_strangers_is_no_news(
    serving: RunningServer, capfd: pytest.CaptureFixture[str]
) -> None:
    for junk in (
        b"\x16\x03\x01\x02\0\x01\0\x01\xfc\x03\x03",  # a browser that tries TLS
        b"GET / HTTP/9.9\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: x\r\nHost: y\r\n\r\n",
        b"GET /" + b"x" * 70_000 + b" HTTP/1.1\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: x\r\nConnection: upgrade\r\nUpgrade: h2c\r\n\r\n",
        b"GET /live HTTP/1.1\r\nHost: x\r\nConnection: upgrade\r\nUpgrade: websocket\r\n\r\n",
        b"POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 99999999999\r\n\r\nx",
        b"POST / HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\nffffffff\r\nx",
        b"\0" * 100,
    ):
        connection = serving.connection()
        connection.sendall(junk)
        with suppress(ConnectionResetError):
            connection.recv(1 << 16)
    assert status(serving, "/data/present", serving.key) == 200
    assert capfd.readouterr() == ("", "")


def websocket_frame(head: int, payload: bytes, *, length: int | None = None) -> bytes:
    """One of a page (RFC 6455, 5.2), masked by zeros. head: its first byte."""
    size = len(payload) if length is None else length
    if size < 126:
        return bytes([head, 0x80 | size]) + bytes(4) + payload
    return bytes([head, 0xFF]) + size.to_bytes(8, "big") + bytes(4) + payload


FINAL, TEXT, BINARY, CONTINUED, CLOSE, PING = 0x80, 1, 2, 0, 8, 9
LAST = websocket_frame(FINAL | CONTINUED, b"x")


def test_malformed_frames_cost_their_page_its_connection_at_most(
    serving: RunningServer, capfd: pytest.CaptureFixture[str]
) -> None:
    for junk in (
        websocket_frame(FINAL | TEXT, b"\xff\xfe"),
        websocket_frame(TEXT, b"\xff") + websocket_frame(FINAL | CONTINUED, b"\xfe"),
        websocket_frame(FINAL | 0x40 | BINARY, b"x"),
        websocket_frame(FINAL | 3, b"x"),
        websocket_frame(FINAL | PING, bytes(126)),
        websocket_frame(FINAL | CONTINUED, b"x"),
        websocket_frame(FINAL | CLOSE, b"\x03"),
        websocket_frame(FINAL | CLOSE, b"\x03\xe8\xff"),
        websocket_frame(FINAL | BINARY, b"x", length=2**63 - 1),
        websocket_frame(FINAL | BINARY, b"x", length=2**64 - 1),
        websocket_frame(BINARY, bytes(9)) + 500 * websocket_frame(CONTINUED, bytes(9)) + LAST,
        200 * websocket_frame(FINAL | PING, b"x"),
        bytes(100),
    ):
        page = Page(serving)
        page.send("hello", version=VERSION)
        assert page.receive()[0]["kind"] in ("state", "closed")
        with suppress(OSError):
            page.send_bytes(junk)
            page.connection.recv(1 << 16)
        page.connection.close()
    last = Page(serving)
    last.send("hello", version=VERSION)
    assert last.receive()[0]["kind"] in ("state", "closed")
    assert capfd.readouterr() == ("", "")
