"""The painter's server: who may ask, what strangers and junk are told, who has the session."""

import asyncio
import json
import re
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from posixpath import dirname, join, normpath
from typing import Any

import numpy as np
import pytest
from fake_messages import fake_answer, fake_progress
from fake_session import FakeSession
from live_server import run_in_loop
from raw_message import RawMessage
from server_key import bearer, offered
from starlette.testclient import TestClient, WebSocketDenialResponse, WebSocketTestSession
from starlette.websockets import WebSocketDisconnect

from lightpaint.errors import PaintError
from lightpaint.paint.message_frames import from_frame, to_frame
from lightpaint.paint.protocol import (
    VERSION,
    AnswerChoices,
    Message,
    Paint,
    PictureData,
    PictureUpdate,
)
from lightpaint.paint.server import client, page_server
from lightpaint.paint.server.address import Address, Reach
from lightpaint.paint.server.guard import Guard
from lightpaint.paint.server.page_server import page_app, page_files
from lightpaint.paint.server.session_clients import Connections

DEFAULT_PORT = 8421
HOST = f"127.0.0.1:{DEFAULT_PORT}"
REFUSED = (WebSocketDisconnect, WebSocketDenialResponse)
HERE = Address("127.0.0.1", DEFAULT_PORT, Reach.MACHINE, frozenset({"127.0.0.1"}))


class ServedSession:
    """A session behind its guard, and a browser whose page has not shown its token yet."""

    def __init__(self, folder: Path, address: Address = HERE) -> None:
        (folder / "engine").mkdir(parents=True)
        (folder / "index.html").write_text("<!doctype html><title>page</title>", "utf-8")
        (folder / "engine" / "gl.js").write_text("export {}", "utf-8")
        (folder / "secret.py").write_text("secret", "utf-8")
        (folder / ".hidden.js").write_text("secret", "utf-8")
        self.session, self.messages = FakeSession(), list[str]()
        self.line = Connections(self.session, None, self.messages.append)
        files = page_files(folder)
        app = page_app(self.line, files=files)
        self.guard = Guard(app, address=address, public=files)
        self.browser = TestClient(self.guard, base_url=f"http://{HOST}")
        self.key = ""

    def exchange(self, token: str, **headers: str) -> Any:
        return self.browser.get("/key", headers={**bearer(token), **headers})

    def enter(self) -> None:
        self.key = self.exchange(self.guard.token).text
        self.browser.headers.update(bearer(self.key))

    def socket(self, page: str = "", **headers: str) -> WebSocketTestSession:
        return self.browser.websocket_connect(
            f"ws://{HOST}/live?page={page}",
            headers={"origin": f"http://{HOST}", **headers},
            subprotocols=offered(self.key),
        )


@pytest.fixture
def unknown_browser(tmp_path: Path) -> Iterator[ServedSession]:
    new_session = ServedSession(tmp_path / "page")
    with new_session.browser:
        yield new_session


@pytest.fixture
def known_browser(unknown_browser: ServedSession) -> ServedSession:
    unknown_browser.enter()
    return unknown_browser


def frame(kind: str, seq: int, arrays: dict[str, Any] | None = None, **fields: Any) -> bytes:
    message = RawMessage(kind, {"seq": seq, **fields}, arrays or {})
    return to_frame(message.content(), message.buffers())


def paint(
    seq: int, stroke: int = 1, region: tuple[int, ...] = (0, 1, 0, 1), **options: Any
) -> bytes:
    size = region[1] - region[0], region[3] - region[2]
    arrays = {"image": np.ones((*size, 3), np.float32), "importance": np.ones(size, np.float32)}
    return frame("paint", seq, arrays, stroke=stroke, region=list(region), **options)


def receive(socket: WebSocketTestSession) -> dict[str, Any]:
    return from_frame(socket.receive_bytes())[0]


def greet(socket: WebSocketTestSession, seq: int = 0) -> dict[str, Any]:
    socket.send_bytes(frame("hello", seq, version=VERSION))
    return receive(socket)


# Who may ask


def test_a_stranger_gets_the_page_and_nothing_of_the_session(
    unknown_browser: ServedSession,
) -> None:
    assert unknown_browser.browser.get("/").text == "<!doctype html><title>page</title>"
    assert unknown_browser.browser.get("/engine/gl.js").text == "export {}"
    for path in ("/data/present", "/data/", "/key", "/live", "/nowhere", "/engine"):
        answer = unknown_browser.browser.get(path, follow_redirects=False)
        assert answer.status_code == 403
        assert "open the painter by the address that its terminal shows" in answer.text
    with pytest.raises(REFUSED), unknown_browser.socket():
        pass


def test_the_token_is_exchanged_for_a_key_and_for_nothing_that_a_browser_keeps(
    unknown_browser: ServedSession,
) -> None:
    token = unknown_browser.guard.token
    for _ in range(2):  # the link of the terminal opens a second tab, too
        answer = unknown_browser.exchange(token)
        assert answer.status_code == 200
        assert "set-cookie" not in answer.headers
        assert answer.headers["cache-control"] == "no-store"
        assert answer.text not in ("", token)
    key = answer.text
    assert unknown_browser.browser.get("/data/present", headers=bearer(key)).status_code == 200
    # What opens the door is not a key to the rooms; and an address grants nothing.
    assert unknown_browser.browser.get("/data/present", headers=bearer(token)).status_code == 410
    for secret in (token, key):
        for path in (f"/key?token={secret}", f"/data/present?token={secret}&key={secret}"):
            assert unknown_browser.browser.get(path).status_code == 403
        cookie = {"cookie": f"lightpaint_{DEFAULT_PORT}={secret}; key={secret}"}
        assert unknown_browser.browser.get("/data/present", headers=cookie).status_code == 403


def test_the_token_of_a_command_line_is_good_once(unknown_browser: ServedSession) -> None:
    token = unknown_browser.guard.one_time_token()
    assert unknown_browser.browser.head("/key", headers=bearer(token)).status_code == 410
    assert unknown_browser.exchange(token).status_code == 200
    assert unknown_browser.exchange(token).status_code == 410


def test_the_token_of_a_command_line_is_good_soon_whatever_the_clock_says(
    unknown_browser: ServedSession, monkeypatch: pytest.MonkeyPatch
) -> None:
    early_token, late_token = (
        unknown_browser.guard.one_time_token(),
        unknown_browser.guard.one_time_token(),
    )
    now_s = time.monotonic()
    monkeypatch.setattr(time, "time", lambda: 0.0)
    assert unknown_browser.exchange(early_token).status_code == 200
    monkeypatch.setattr(time, "monotonic", lambda: now_s + 121)
    assert unknown_browser.exchange(late_token).status_code == 410


@pytest.mark.parametrize(
    "credential", ["", "wrong", "é", '"', "Bearer", "Bearer ", "Basic {}", "{}", "Bearer {} {}"]
)
def test_what_is_no_key_opens_nothing(known_browser: ServedSession, credential: str) -> None:
    headers = {"authorization": credential.format(known_browser.key, known_browser.key).encode()}
    assert known_browser.browser.get("/data/present", headers=headers).status_code in (403, 410)


def test_a_socket_without_the_key_is_refused(known_browser: ServedSession) -> None:
    right = known_browser.key
    for key in ("", "wrong", right[:-1], f"{right}=", f"{right}, lightpaint-key.{right}"):
        known_browser.key = key
        with pytest.raises(REFUSED), known_browser.socket():
            pass


def test_two_keys_are_none(known_browser: ServedSession) -> None:
    header = ("authorization", f"Bearer {known_browser.key}")
    asking = known_browser.browser.build_request("GET", "/data/present", headers=[header, header])
    assert known_browser.browser.send(asking).status_code == 403


def test_a_page_of_an_earlier_launch_is_told_what_to_do(
    known_browser: ServedSession, tmp_path: Path
) -> None:
    other = ServedSession(tmp_path / "later")
    other.browser.headers.update(bearer(known_browser.key))
    with other.browser:
        for path in ("/data/", "/data/present", "/key"):
            answer = other.browser.get(path)
            assert answer.status_code == 410
            assert "of an earlier start of the painter: open" in answer.text
            assert other.guard.token not in answer.text
        with pytest.raises(REFUSED), other.socket():
            pass
        # Elsewhere it is told no more than anybody.
        for headers in ({"host": "evil.example"}, {"origin": "http://evil.example"}):
            assert other.browser.get("/key", headers=headers).status_code == 403
        assert other.browser.head("/key").status_code == 410
        other.enter()
        assert other.browser.get("/data/present").status_code == 200


@pytest.mark.parametrize(
    "host",
    ["evil.example", f"evil.example:{DEFAULT_PORT}", "", "127.0.0.1.evil.example", "192.168.1.2"],
)
def test_another_name_is_refused_even_with_the_key(known_browser: ServedSession, host: str) -> None:
    for path in ("/", "/data/present"):
        assert known_browser.browser.get(path, headers={"host": host}).status_code == 403
    assert known_browser.exchange(known_browser.guard.token, host=host).status_code == 403
    with pytest.raises(REFUSED), known_browser.socket(host=host):
        pass


@pytest.mark.parametrize("host", ["localhost:8421", "127.0.0.1:9000", "[::1]:8421", "LOCALHOST"])
def test_names_of_the_machine_itself_and_ports_of_tunnels_are_right(
    known_browser: ServedSession, host: str
) -> None:
    assert known_browser.browser.get("/data/present", headers={"host": host}).status_code == 200


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "null", f"https://{HOST}", "http://127.0.0.1:9999", ""]
)
def test_a_page_of_another_server_is_refused_even_with_the_key(
    known_browser: ServedSession, origin: str
) -> None:
    assert known_browser.exchange(known_browser.guard.token, origin=origin).status_code == 403
    assert known_browser.browser.get("/data/present", headers={"origin": origin}).status_code == 403
    with pytest.raises(REFUSED), known_browser.socket(origin=origin):
        pass


def test_a_socket_that_says_nothing_of_its_page_is_refused(known_browser: ServedSession) -> None:
    offer = {"subprotocols": offered(known_browser.key)}
    with (
        pytest.raises(REFUSED),
        known_browser.browser.websocket_connect(f"ws://{HOST}/live", **offer),
    ):
        pass


def test_a_socket_speaks_the_protocol_that_is_no_secret(known_browser: ServedSession) -> None:
    with known_browser.socket() as socket:
        assert socket.accepted_subprotocol == "lightpaint"


def test_where_others_are_let_in_addresses_are_right_and_foreign_names_are_not(
    tmp_path: Path,
) -> None:
    wide_address = Address("192.168.1.2", DEFAULT_PORT, Reach.ALL, frozenset({"studio"}))
    session = ServedSession(tmp_path / "page", wide_address)
    with session.browser:
        for host in ("192.168.1.2:8421", "[fe80::1]:8421", "Studio:8421", "127.0.0.1:8421"):
            assert session.exchange(session.guard.token, host=host).status_code == 200
        assert session.exchange(session.guard.token, host="evil.net").status_code == 403


def test_only_reading_is_answered(known_browser: ServedSession) -> None:
    for method in ("POST", "PUT", "DELETE", "OPTIONS"):
        assert known_browser.browser.request(method, "/").status_code == 405


def test_every_answer_has_the_policy(known_browser: ServedSession) -> None:
    for path in ("/", "/engine/gl.js", "/data/present", "/data/none", "/none", "/key"):
        headers = known_browser.browser.get(path).headers
        policy = dict(x.split(" ", 1) for x in headers["content-security-policy"].split("; "))
        assert policy["default-src"] == "'none'"
        assert policy["script-src"] == "'self' 'wasm-unsafe-eval'"
        assert policy["style-src"] == "'self'"
        assert policy["connect-src"] == f"'self' ws://{HOST}"
        assert policy["frame-ancestors"] == "'none'"
        assert "unsafe-inline" not in headers["content-security-policy"]
        assert headers["x-content-type-options"] == "nosniff"
        assert headers["referrer-policy"] == "no-referrer"
        assert headers["cache-control"] == "no-store"


# Files and pictures


@pytest.mark.parametrize(
    "path",
    [
        "/secret.py",
        "/.hidden.js",
        "/../secret.py",
        "/engine/../secret.py",
        "/%2e%2e/secret.py",
        "/engine/",
        "/engine",
        "//etc/passwd",
        "/engine/gl.js/",
        "/engine\\gl.js",
        "/engine/gl.js%00",
    ],
)
def test_what_is_not_in_the_table_is_not_there(known_browser: ServedSession, path: str) -> None:
    answer = known_browser.browser.get(path, follow_redirects=False)
    assert answer.status_code == 404
    assert "secret" not in answer.text


def test_the_page_as_it_ships_is_whole_and_keeps_its_policy() -> None:
    """What it refers to is there, and nothing stands in it that the policy forbids."""
    table = page_files()
    page = table["/"].content.decode()
    assert not re.search(r"<script(?![^>]* src=)|<style|\s(?:style|on\w+)=", page)
    links = re.findall(r'(?:src|href)="(?!data:)([^"]+)"', page)
    assert links
    for name in links:
        assert f"/{name}" in table, name
    imports = re.compile(
        r"""(?:^|\n)(?:import|export)\b[^'"\n;]*?(?:\n[^'";]*?)?from ['"]([^'"]+)"""
    )
    for path, file in table.items():
        if path.endswith(".js"):
            text = re.sub(r"/\*.*?\*/", "", file.content.decode(), flags=re.DOTALL)
            for name in imports.findall(text):
                assert normpath(join(dirname(path), name)) in table, f"{name} in {path}"
    assert any(path.startswith("/vendor/LICENSE") for path in table)
    assert table["/favicon.ico"].kind == "image/svg+xml"  # browsers ask for it unasked


def test_a_link_out_of_the_page_is_no_file_of_it(tmp_path: Path) -> None:
    (tmp_path / "page").mkdir()
    (tmp_path / "other.js").write_text("secret", "utf-8")
    (tmp_path / "page" / "other.js").symlink_to(tmp_path / "other.js")
    assert page_files(tmp_path / "page") == {}


def test_pictures_are_raw_bytes_by_name(known_browser: ServedSession) -> None:
    for name, picture in known_browser.session.pictures.items():
        answer = known_browser.browser.get(f"/data/{name}")
        assert answer.headers["x-dtype"] == picture.dtype.name
        shape = tuple(map(int, answer.headers["x-shape"].split(",")))
        received = np.frombuffer(answer.content, picture.dtype.newbyteorder("<")).reshape(shape)
        np.testing.assert_array_equal(received, picture)
    for name in ("none", "../present", "%2e%2e/present", "present/", "x" * 999, "plane/%00"):
        assert known_browser.browser.get(f"/data/{name}").status_code == 404


def test_a_picture_is_kept_by_its_generation_only(known_browser: ServedSession) -> None:
    with known_browser.socket() as socket:
        greet(socket)
        headers = known_browser.browser.get("/data/present?g=1").headers
        assert "immutable" in headers["cache-control"]
        assert headers["vary"] == "Authorization"
        for query in ("", "?g=0", "?g=2", "?g=x"):
            answer = known_browser.browser.get(f"/data/present{query}")
            assert answer.headers["cache-control"] == "no-store"
        assert known_browser.session.on_message is not None
        known_browser.session.on_message(PictureUpdate(resources={"present": 2}))
        assert receive(socket)["kind"] == "renewed"
        assert (
            "immutable" in known_browser.browser.get("/data/present?g=2").headers["cache-control"]
        )
        assert known_browser.browser.get("/data/present?g=1").headers["cache-control"] == "no-store"
        # Whatever else a message says, its pictures are new.
        choices = AnswerChoices(version=1, choices=(), resources={"present": 3})
        known_browser.session.on_message(choices)
        assert receive(socket)["kind"] == "choices"
        assert known_browser.browser.get("/data/present?g=2").headers["cache-control"] == "no-store"


# What is said


def test_each_message_is_answered_by_its_number(known_browser: ServedSession) -> None:
    with known_browser.socket() as socket:
        message = greet(socket, 7)
        assert (message["reply"], message["kind"], message["is_back"]) == (7, "state", False)
        assert greet(socket, 7) == message | {"is_back": True}
        socket.send_bytes(paint(8))
        content, [weights] = from_frame(socket.receive_bytes())
        assert (content["kind"], content["reply"]) == ("answer", 8)
        np.testing.assert_array_equal(np.frombuffer(weights, "<f8"), np.full(6, 3.0))
        socket.send_bytes(frame("undo", 9))
        assert receive(socket) == {"kind": "done", "reply": 9, "buffers": []}
        assert receive(socket) == {"kind": "notice", "text": "said", "tone": "info", "buffers": []}
        socket.send_bytes(paint(10, label="nothing"))
        assert receive(socket)["reply"] == 10
    assert len(known_browser.session.threads) == 1
    assert threading.get_ident() not in known_browser.session.threads


def test_mistakes_are_answered_and_end_nothing(known_browser: ServedSession) -> None:
    with known_browser.socket() as socket:
        greet(socket)
        socket.send_bytes(paint(1, label="refuse"))
        assert receive(socket)["text"] == "this cannot be painted"
        socket.send_bytes(paint(2, label="break"))
        failed = receive(socket)
        assert (failed["kind"], failed["reply"]) == ("failed", 2)
        assert "ZeroDivisionError" in failed["text"]
        assert "Traceback" not in failed["text"]
        assert "Traceback" in known_browser.messages[-1]
        socket.send_bytes(paint(3))
        assert receive(socket)["kind"] == "answer"


NAN = {"image": np.full((1, 1, 3), np.nan, np.float32), "importance": np.ones((1, 1), np.float32)}
SHORT = to_frame(
    {"kind": "paint", "seq": 5, "buffers": [{"name": "image", "dtype": "float32", "shape": [9]}]},
    [b""],
)


@pytest.mark.parametrize(
    ("junk", "seq"),
    [
        (b"", None),
        (b"\xff\xff\xff\xff", None),
        (b"\x02\0\0\0[]", None),
        (b"\x02\0\0\0{}", None),
        (bytes(1000), None),
        (frame("hello", 5, version="1"), 5),
        (frame("hello", 5), 5),
        (frame("launch", 5), 5),
        (frame("undo", -1), None),
        (frame("paint", 5, NAN, stroke=1, region=[0, 1, 0, 1]), 5),
        (frame("paint", 5, stroke=1, region=[0, 1]), 5),
        (frame("constrain_light", 5, light="0", constraints={}), 5),
        (paint(5, stroke=2**53), 5),  # from which on a page cannot count
        (SHORT, None),
    ],
)
def test_junk_is_answered_and_the_session_alive(
    known_browser: ServedSession, junk: bytes, seq: int | None
) -> None:
    with known_browser.socket() as socket:
        greet(socket)
        socket.send_bytes(junk)
        answer = receive(socket)
        assert answer["kind"] == "failed"
        assert answer.get("reply") == seq
        socket.send_text("text")
        assert receive(socket)["kind"] == "failed"
        socket.send_bytes(paint(6))
        assert receive(socket)["kind"] == "answer"
    assert len(known_browser.session.requests) == 1


def test_a_page_of_another_version_is_told(known_browser: ServedSession) -> None:
    with known_browser.socket() as socket:
        socket.send_bytes(frame("hello", 1, version=VERSION + 1, novelty=True))
        answer = receive(socket)
        assert (answer["kind"], answer["reason"], answer["reply"]) == ("closed", "version", 1)
        assert greet(socket)["kind"] == "state"


def test_nothing_is_done_before_hello(known_browser: ServedSession) -> None:
    with known_browser.socket() as socket:
        socket.send_bytes(paint(1))
        assert receive(socket)["kind"] == "closed"
    assert known_browser.session.requests == []


def test_live_paint_that_newer_covers_is_answered_and_not_done(
    known_browser: ServedSession,
) -> None:
    busy, free = threading.Event(), threading.Event()
    known_browser.session.before_paint = lambda: (busy.set(), free.wait(30))
    with known_browser.socket() as socket:
        greet(socket)
        socket.send_bytes(paint(1))
        assert busy.wait(30)
        for message in (
            paint(2, region=(0, 2, 0, 2)),
            paint(3, region=(0, 1, 0, 1)),  # does not cover the one before
            paint(4, region=(0, 2, 0, 2)),
            paint(5, region=(0, 2, 0, 2), is_final=True),
            paint(6, region=(0, 2, 0, 2)),  # the one before is done
            paint(7, stroke=2, region=(0, 2, 0, 2)),
        ):
            socket.send_bytes(message)
        # All that waits has been heard when this, which nobody has to do, is answered.
        known_browser.browser.get("/")
        free.set()
        answers = [receive(socket) for _ in range(7)]
    assert sorted(answer["reply"] for answer in answers) == [1, 2, 3, 4, 5, 6, 7]
    strokes = [request.stroke for request in known_browser.session.requests]
    assert strokes[0] == 1
    assert strokes[-1] == 2
    assert sum(request.is_final for request in known_browser.session.requests) == 1
    assert len(strokes) <= 7


# Who has the session


def test_the_second_tab_is_told_and_may_take_over(known_browser: ServedSession) -> None:
    with known_browser.socket("a") as first, known_browser.socket("b") as second:
        assert greet(first)["kind"] == "state"
        message = greet(second, 3)
        assert (message["kind"], message["reason"], message["reply"]) == ("closed", "taken", 3)
        second.send_bytes(paint(4))
        assert receive(second)["reason"] == "taken"
        second.send_bytes(frame("take_over", 5))
        assert receive(second)["kind"] == "state"
        message = receive(first)
        assert (message["kind"], message["reason"]) == ("closed", "taken")
        assert "reply" not in message
        first.send_bytes(paint(6))
        assert receive(first)["reason"] == "taken"
        assert known_browser.session.requests == []
        second.send_bytes(paint(7))
        assert receive(second)["kind"] == "answer"
        first.send_bytes(frame("take_over", 8))
        message = receive(first)
        # What it has not said yet is of before the other one.
        assert (message["kind"], message["is_back"]) == ("state", False)
        assert greet(first, 9)["is_back"]


def test_the_session_is_free_when_its_tab_has_gone(known_browser: ServedSession) -> None:
    with known_browser.socket() as first:
        greet(first)
    with known_browser.socket() as second:
        assert greet(second)["kind"] == "state"


def test_a_page_that_is_back_after_a_dropped_connection_has_its_session(
    known_browser: ServedSession,
) -> None:
    with known_browser.socket("same") as first, known_browser.socket("same") as second:
        greet(first)
        assert greet(second)["kind"] == "state"
        with pytest.raises(WebSocketDisconnect):  # and is not told that another has it
            first.receive_bytes()


def test_too_many_tabs_are_sent_away(known_browser: ServedSession) -> None:
    with ExitStack() as stack:
        for _ in range(16):
            greet(stack.enter_context(known_browser.socket()))
        with known_browser.socket() as one_more, pytest.raises(WebSocketDisconnect) as refusal:
            one_more.receive_bytes()
        assert refusal.value.code == 1013


def test_all_are_told_of_the_end(unknown_browser: ServedSession) -> None:
    unknown_browser.enter()
    with unknown_browser.socket() as socket:
        greet(socket)
        assert unknown_browser.browser.portal is not None
        unknown_browser.browser.portal.call(unknown_browser.line.close)
        assert receive(socket)["reason"] == "ended"
    assert unknown_browser.session.on_message is None


# Last words


class ScriptedSocket:
    """A socket whose other end has said all it will say at once."""

    def __init__(self, *frames: bytes, with_goodbye: bool = True) -> None:
        goodbye = [{"type": "websocket.disconnect", "code": 1001}] if with_goodbye else []
        events = [{"type": "websocket.receive", "bytes": frame} for frame in frames]
        self.to_hear, self.sent = [*events, *goodbye], list[dict[str, Any]]()

    async def receive(self) -> Any:
        if not self.to_hear:
            await asyncio.Event().wait()
        return self.to_hear.pop(0)

    async def send_bytes(self, data: bytes) -> None:
        self.sent.append(from_frame(data)[0])

    async def close(self, code: int = 1000) -> None:
        """There is nothing to close."""


HELLO = frame("hello", 0, version=VERSION)


def strokes_of(session: FakeSession) -> list[int]:
    return [request.stroke for request in session.requests if isinstance(request, Paint)]


def test_what_a_page_says_last_is_done_though_it_has_gone() -> None:
    session = FakeSession()
    session.before_paint = lambda: time.sleep(0.02)

    async def trial() -> None:
        connections = Connections(session, None)
        connections.attach()
        strokes = [paint(k, stroke=k, is_final=True) for k in (1, 2, 3)]
        page = asyncio.ensure_future(
            connections.serve(client.Client(ScriptedSocket(HELLO, *strokes), "a"))
        )
        await asyncio.sleep(0.03)  # it has left, and is not done with
        after = ScriptedSocket(HELLO, paint(4, stroke=4, is_final=True), with_goodbye=False)
        other = asyncio.ensure_future(connections.serve(client.Client(after, "b")))
        await page
        while len(after.sent) < 2:  # what is done may not have been sent yet
            await asyncio.sleep(0.01)
        other.cancel()
        assert after.sent[0]["kind"] == "state"  # and not that it is open in another tab
        await connections.close()

    run_in_loop(trial)
    assert strokes_of(session) == [1, 2, 3, 4]


def test_a_page_that_greets_and_goes_is_not_waited_for() -> None:
    session = FakeSession()

    async def trial() -> None:
        connections = Connections(session, None)
        connections.attach()
        await connections.serve(client.Client(ScriptedSocket(HELLO, HELLO, paint(1), HELLO), "a"))
        await connections.close()

    run_in_loop(trial)
    assert strokes_of(session) == [1]


def test_what_was_said_before_the_end_is_done() -> None:
    session = FakeSession()
    session.before_paint = lambda: time.sleep(0.02)

    async def trial() -> None:
        connections = Connections(session, None)
        connections.attach()
        socket = ScriptedSocket(
            HELLO, *(paint(k, stroke=k, is_final=True) for k in (1, 2, 3)), with_goodbye=False
        )
        serving = asyncio.ensure_future(connections.serve(client.Client(socket, "a")))
        while not strokes_of(session):
            await asyncio.sleep(0.001)
        await connections.close()
        serving.cancel()
        assert socket.sent[-1]["reason"] == "ended"

    run_in_loop(trial)
    assert strokes_of(session) == [1, 2, 3]


def test_a_page_can_be_given_up_at_any_step() -> None:
    """Whoever gives it up, as a test client does when it leaves, hears of its own word alone."""

    async def given_up_after(steps: int, *, with_goodbye: bool) -> None:
        connections = Connections(FakeSession(), None)
        connections.attach()
        page = client.Client(ScriptedSocket(HELLO, with_goodbye=with_goodbye), "a")
        serving = asyncio.ensure_future(connections.serve(page))
        for _ in range(steps):
            await asyncio.sleep(0)
        serving.cancel("given up")
        try:
            await serving
            words: tuple[str, ...] = ("given up",)  # it has ended before
        except asyncio.CancelledError as cancellation:
            words = cancellation.args
        assert words == ("given up",), steps
        await connections.close()

    for steps in range(40):
        for with_goodbye in (False, True):
            run_in_loop(partial(given_up_after, steps, with_goodbye=with_goodbye))


# Pages that are slow


class DeafSocket:
    """A socket whose other end does not listen."""

    def __init__(self) -> None:
        self.sent: list[dict[str, Any]] = []

    async def receive(self) -> Any:
        raise AssertionError

    async def send_bytes(self, data: bytes) -> None:
        self.sent.append(from_frame(data)[0])

    async def close(self, code: int = 1000) -> None:
        self.sent.append({"kind": "close", "code": code})


def test_of_what_nobody_asked_for_a_slow_page_gets_the_newest() -> None:
    page = client.Client(DeafSocket())
    for k in range(1000):
        page.send(fake_answer(version=k))
        page.send(fake_progress("render", k))
        page.send(fake_progress("denoise", k))
        page.send(PictureUpdate(resources={f"plane/{k % 3}": k}))
    unsent = [message for message, _ in page._unsent]
    assert [m.fields.get("version") for m in unsent if m.kind == "answer"] == [999]
    assert [m.fields["done"] for m in unsent if m.kind == "progress"] == [999, 999]
    [renewed] = [m for m in unsent if m.kind == "renewed"]
    assert renewed.fields["resources"] == {"plane/0": 999, "plane/1": 997, "plane/2": 998}


class SlowSocket(ScriptedSocket):
    """A socket whose other end asks for much, and takes one answer when it is let."""

    def __init__(self, *frames: bytes) -> None:
        super().__init__(*frames, with_goodbye=False)
        self.is_let = asyncio.Event()

    async def send_bytes(self, data: bytes) -> None:
        await self.is_let.wait()
        await super().send_bytes(data)


def test_a_page_that_asks_and_does_not_listen_is_answered_no_further(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Else pictures without number would wait for it in memory."""
    monkeypatch.setattr(client, "MAX_UNSENT_BYTES", 1000)
    count = 50
    session, requests = FakeSession(), list[Any]()

    def handle(request: Any, arrays: Any) -> list[Message]:
        requests.append(request)
        return [PictureData(name=request.name, data=np.zeros(100, np.float64))]

    session.handle = handle  # type: ignore[method-assign]

    async def trial() -> None:
        connections = Connections(session, None)
        connections.attach()
        socket = SlowSocket(HELLO, *(frame("fetch", k, name="x") for k in range(1, count + 1)))
        page = asyncio.ensure_future(connections.serve(client.Client(socket, "a")))
        while len(requests) < 2:
            await asyncio.sleep(0.001)
        for _ in range(20):
            await asyncio.sleep(0.005)
        assert len(requests) <= 3
        socket.is_let.set()
        while len(socket.sent) <= count:
            await asyncio.sleep(0.001)
        page.cancel()
        assert [message["reply"] for message in socket.sent] == list(range(count + 1))
        await connections.close()

    run_in_loop(trial)


def test_what_a_page_has_said_at_length_is_answered_before_it_says_more(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    frames = [paint(k, stroke=k, is_final=True) for k in range(1, 20)]
    monkeypatch.setattr(client, "MAX_QUEUED_BYTES", 3 * len(frames[0]))

    async def trial() -> None:
        socket = ScriptedSocket(*frames, with_goodbye=False)
        page = client.Client(socket)
        signals_as_interrupts = asyncio.ensure_future(page.receive_all())
        for _ in range(50):
            await asyncio.sleep(0)
        assert len(frames) - len(socket.to_hear) == 4
        for stroke in range(1, 20):  # none is lost
            message = await page.next_message()
            assert isinstance(message.request, Paint)
            assert message.request.stroke == stroke
        signals_as_interrupts.cancel()

    run_in_loop(trial)


def test_two_pages_that_fight_over_the_session_harm_nobody(known_browser: ServedSession) -> None:
    with known_browser.socket("a") as first, known_browser.socket("b") as other:
        greet(first)
        pages = [first, other]
        for turn in range(40):
            page, loser = pages[turn % 2], pages[1 - turn % 2]
            page.send_bytes(frame("take_over", 2 * turn))
            page.send_bytes(paint(2 * turn + 1, stroke=turn, is_final=True))
            kinds = list[str]()
            while kinds[-1:] != ["answer"]:
                message = receive(page)
                kinds.append(message["kind"])
                assert message["kind"] in ("state", "answer", "closed")
                assert message["kind"] != "closed" or "reply" not in message
            loser.send_bytes(paint(10_000 + turn, stroke=turn, is_final=True))
            while (message := receive(loser)).get("reply") != 10_000 + turn:
                assert message["kind"] == "closed"
            assert message["reason"] == "taken"
    assert [
        request.stroke for request in known_browser.session.requests if isinstance(request, Paint)
    ] == [*range(40)]


def test_answers_to_what_was_asked_are_not_dropped_and_who_is_too_slow_is_sent_away() -> None:
    page = client.Client(DeafSocket())
    for k in range(client.MAX_UNSENT):
        page.send(fake_answer(), k)
    assert len(page._unsent) == client.MAX_UNSENT
    page.send(fake_answer(), 0)
    assert page._unsent == []
    page.send(fake_answer(), 1)
    assert page._unsent == []


def test_without_its_libraries_the_line_to_run_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(page_server, "find_spec", lambda name: None if name == "uvicorn" else name)
    with pytest.raises(PaintError, match=r"needs uvicorn: pip install 'lightpaint\[paint\]'"):
        page_server.check_installed()


def test_names_from_files_are_text() -> None:
    name = "</script><b>\u202e\ud800"
    text = to_frame({"kind": "notice", "text": name}, [])
    assert json.loads(text[4:].rstrip(b"\0"))["text"].startswith("</script><b>")
