"""Observers of a session, and programs that are not browsers: what they hear, and may not do."""

import asyncio
from collections.abc import Iterator
from contextlib import ExitStack
from typing import Any

import numpy as np
import pytest
from fake_messages import fake_answer, fake_pending, fake_progress, fake_state
from fake_session import FakeSession
from live_server import wait_until
from raw_message import RawMessage
from server_key import bearer, offered
from starlette.testclient import TestClient, WebSocketDenialResponse, WebSocketTestSession
from starlette.websockets import WebSocketDisconnect

import lightpaint as lp
from lightpaint.errors import PaintError
from lightpaint.paint.message_frames import from_frame, to_frame
from lightpaint.paint.protocol import (
    VERSION,
    CanvasPatch,
    HistoryInfo,
    LoadLook,
    LookList,
    Message,
    PictureUpdate,
    Propose,
    RenameLook,
    SaveLook,
    SessionPending,
)
from lightpaint.paint.server import client, session_clients
from lightpaint.paint.server.address import Address, Reach
from lightpaint.paint.server.guard import Guard
from lightpaint.paint.server.page_server import page_app
from lightpaint.paint.server.session_clients import Connections
from lightpaint.paint.session.look_library import MAX_PROPOSALS, LookLibrary
from lightpaint.paint.session.painting_session import Session
from lightpaint.paint.session.picture_table import PictureTable
from lightpaint.paint.store.history_steps import Identity
from lightpaint.paint.store.session_file import MemoryStore
from lightpaint.pipeline.job.settings import Settings

HOST = "127.0.0.1:8421"
HERE = Address("127.0.0.1", 8421, Reach.MACHINE, frozenset({"127.0.0.1"}))
REFUSED = (WebSocketDisconnect, WebSocketDenialResponse)


class ServedSession:
    """A session behind its guard; what is shown to it is a test's."""

    def __init__(self) -> None:
        self.session = FakeSession()
        self.line = Connections(self.session, None)
        self.guard = Guard(_unserved, address=HERE)
        self.guard.app = page_app(self.line, files={}, is_program=self.guard.is_program)
        self.browser = TestClient(self.guard, base_url=f"http://{HOST}")

    def program(self, token: str | None = None, **headers: str) -> WebSocketTestSession:
        key_headers = bearer(self.guard.program_token if token is None else token)
        return self.browser.websocket_connect(
            f"ws://{HOST}/live", headers={**key_headers, **headers}
        )

    def page(self) -> WebSocketTestSession:
        key = self.browser.get("/key", headers=bearer(self.guard.token)).text
        origin = {"origin": f"http://{HOST}"}
        return self.browser.websocket_connect(
            f"ws://{HOST}/live", headers=origin, subprotocols=offered(key)
        )


async def _unserved(scope: Any, receive: Any, send: Any) -> None:
    """Nobody is served yet."""


@pytest.fixture
def served_session() -> Iterator[ServedSession]:
    session = ServedSession()
    with session.browser:
        yield session


def send_request(socket: WebSocketTestSession, kind: str, seq: int = 1, **fields: Any) -> None:
    arrays = {k: fields.pop(k) for k in ("image", "importance") if k in fields}
    message = RawMessage(kind, {"seq": seq, **fields}, arrays)
    socket.send_bytes(to_frame(message.content(), message.buffers()))


def receive(socket: WebSocketTestSession) -> dict[str, Any]:
    return from_frame(socket.receive_bytes())[0]


def paint(socket: WebSocketTestSession, seq: int, *, is_final: bool) -> None:
    pixel = {"image": np.ones((1, 1, 3), np.float32), "importance": np.ones((1, 1), np.float32)}
    send_request(socket, "paint", seq, stroke=1, region=[0, 1, 0, 1], is_final=is_final, **pixel)


# Who is let in


def test_a_program_shows_its_token_in_a_header_and_names_no_origin(
    served_session: ServedSession,
) -> None:
    with served_session.program() as program:
        send_request(program, "observe", version=VERSION)
        assert receive(program)["kind"] == "state"
    answer = served_session.browser.get(
        "/data/present", headers=bearer(served_session.guard.program_token)
    )
    assert answer.status_code == 200


@pytest.mark.parametrize("token", ["", "x", "x" * 5000, "Bearer"])
def test_a_wrong_token_is_refused(served_session: ServedSession, token: str) -> None:
    with pytest.raises(REFUSED), served_session.program(token):
        pass
    assert served_session.browser.get("/data/present", headers=bearer("x")).status_code == 410


def test_what_opens_pages_opens_no_program_and_the_other_way_round(
    served_session: ServedSession,
) -> None:
    guard = served_session.guard
    key = served_session.browser.get("/key", headers=bearer(guard.token)).text
    for token in (guard.token, guard.one_time_token(), key):
        with pytest.raises(REFUSED), served_session.program(token):
            pass
    assert len({guard.token, guard.program_token, key}) == 3
    assert served_session.browser.get("/key", headers=bearer(guard.program_token)).text != key
    with (
        pytest.raises(REFUSED),
        served_session.browser.websocket_connect(
            f"ws://{HOST}/live",
            headers={"origin": f"http://{HOST}"},
            subprotocols=offered(guard.program_token),
        ),
    ):
        pass


@pytest.mark.parametrize(
    "headers",
    [
        {"origin": f"http://{HOST}"},
        {"origin": "http://evil.example"},
        {"origin": "null"},
        {"host": "evil.example:8421"},
    ],
)
def test_a_page_gets_in_by_no_programs_token(
    served_session: ServedSession, headers: dict[str, str]
) -> None:
    """Neither of this server, nor of another one by whatever name it leads here."""
    with pytest.raises(REFUSED), served_session.program(**headers):
        pass
    key_headers = bearer(served_session.guard.program_token)
    assert (
        served_session.browser.get("/data/present", headers={**key_headers, **headers}).status_code
        != 200
    )


# What they hear


def test_observers_hear_what_comes_of_painting_and_the_painter_keeps_the_session(
    served_session: ServedSession,
) -> None:
    with (
        served_session.page() as page,
        served_session.program() as one,
        served_session.program() as other,
    ):
        send_request(page, "hello", version=VERSION)
        assert receive(page)["kind"] == "state"
        for program in (one, other):
            send_request(program, "observe", version=VERSION)
            assert receive(program)["kind"] == "state"
        paint(page, 2, is_final=True)
        assert receive(page)["reply"] == 2
        for program in (one, other):
            message = receive(program)
            assert message["kind"] == "answer"
            assert "reply" not in message
        served_session.session.on_message(fake_progress("basis", 3))  # type: ignore[misc]
        assert [receive(x)["kind"] for x in (page, one, other)] == ["progress"] * 3
        paint(page, 3, is_final=True)
        assert receive(page)["reply"] == 3


@pytest.mark.parametrize(
    ("kind", "fields"),
    [
        ("hello", {"version": VERSION}),
        ("take_over", {}),
        ("undo", {}),
        ("constrain_light", {"light": 0, "constraints": {"off": True}}),
        ("change_settings", {"settings": {"hold": 0}}),
        ("save_look", {"name": "mine"}),
        ("load_look", {"look": 1}),
        ("drop_look", {"look": 1}),
        ("verify", {}),
        ("export", {"outputs": [], "run": False}),
    ],
)
def test_an_observer_neither_paints_nor_takes_the_session(
    served_session: ServedSession, kind: str, fields: Any
) -> None:
    with served_session.page() as page, served_session.program() as program:
        send_request(page, "hello", version=VERSION)
        receive(page)
        send_request(program, "observe", version=VERSION)
        receive(program)
        send_request(program, kind, 5, **fields)
        message = receive(program)
        assert (message["kind"], message["reply"]) == ("failed", 5)
        assert message["text"].startswith("an observer may fetch, export and propose")
        paint(program, 6, is_final=True)
        assert receive(program)["kind"] == "failed"
        assert served_session.session.requests == []
        paint(page, 2, is_final=True)
        assert receive(page)["kind"] == "answer"


def messages_to_painter(served: ServedSession, observers: int) -> list[tuple[str, Any]]:
    """Paint while so many observe, ask, and try what they may not; return what the page is sent."""
    with ExitStack() as stack:
        page = stack.enter_context(served.page())
        programs = [stack.enter_context(served.program()) for _ in range(observers)]
        send_request(page, "hello", version=VERSION)
        received = [receive(page)]
        for program in programs:
            send_request(program, "observe", version=VERSION)
            assert receive(program)["kind"] == "state"

        def ask() -> None:
            for k, kind in enumerate(("fetch", "take_over", "hello"), start=1):
                fields = {"fetch": {"name": "present"}, "hello": {"version": VERSION}}
                for program in programs:
                    send_request(program, kind, 10 + k, **fields.get(kind, {}))

        for seq in range(2, 10):
            paint(page, seq, is_final=seq % 4 == 1)
            received.append(receive(page))
            ask()
            served.session.on_message(fake_progress("basis", seq))  # type: ignore[misc]
            received.append(receive(page))
        # All that observers have asked for is answered before nothing more can come.
        for program in programs:
            send_request(program, "fetch", 99, name="present")
            while receive(program).get("reply") != 99:
                pass
        send_request(page, "undo", 50)
        received += [receive(page), receive(page)]
        assert received[-2]["reply"] == 50
    return [(one["kind"], one.get("reply")) for one in received]


def test_who_paints_is_sent_the_same_however_many_observe(served_session: ServedSession) -> None:
    """An observer costs a stroke no message, and takes no session."""
    single_messages = messages_to_painter(served_session, 0)
    strokes = [request for request in served_session.session.requests if request.kind == "paint"]
    assert len(strokes) == 8
    assert messages_to_painter(served_session, 3) == single_messages
    paint_requests = [
        request for request in served_session.session.requests if request.kind == "paint"
    ]
    assert len(paint_requests) == 2 * len(strokes)


@pytest.mark.parametrize(("kind", "ask"), [("page", "hello"), ("program", "observe")])
def test_no_older_state_follows_a_newer_one(
    served_session: ServedSession, monkeypatch: pytest.MonkeyPatch, kind: str, ask: str
) -> None:
    """The first basis arrives while a client is told that there is none yet."""

    known_versions = dict.fromkeys(served_session.session.pictures, 1)

    def pending_then_known(**_: Any) -> SessionPending:
        served_session.session.on_message(fake_state(known_versions))  # type: ignore[misc]
        served_session.session.on_message(PictureUpdate(resources={"present": 2}))  # type: ignore[misc]
        wait_until(
            lambda: served_session.line.generations.get("present") == 2, "they are not handled"
        )
        return fake_pending()

    for name in ("greet", "state"):
        monkeypatch.setattr(served_session.session, name, pending_then_known)
    with getattr(served_session, kind)() as client:
        send_request(client, ask, version=VERSION)
        received = [receive(client)]
        send_request(client, "fetch", 2, name="present")
        while received[-1].get("reply") != 2:
            received.append(receive(client))
        *news, _ = received
        assert [(one["kind"], one.get("reply")) for one in news] == [
            ("waiting", 1),
            ("state", None),
            ("renewed", None),
        ]
    assert served_session.line.generations["present"] == 2


def test_who_has_the_session_does_not_become_an_observer(served_session: ServedSession) -> None:
    with served_session.page() as page:
        send_request(page, "hello", version=VERSION)
        receive(page)
        send_request(page, "observe", 2, version=VERSION)
        assert receive(page)["kind"] == "failed"
        paint(page, 3, is_final=True)
        assert receive(page)["kind"] == "answer"


def test_observers_are_few_and_speak_this_version(
    served_session: ServedSession, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(session_clients, "MAX_OBSERVERS", 1)
    with served_session.program() as one, served_session.program() as other:
        send_request(one, "observe", version=VERSION + 1)
        assert receive(one)["reason"] == "version"
        send_request(one, "observe", version=VERSION)
        assert receive(one)["kind"] == "state"
        send_request(other, "observe", version=VERSION)
        assert receive(other)["text"] == "1 observers are there already: close one of them"


@pytest.mark.parametrize(
    ("kind", "fields"),
    [
        ("paint", {}),
        ("constrain_light", {"light": 0, "constraints": {"lock": 1.0}}),
        ("constrain_lights", {"constraints": {"lamp 0": {"lock": 1.0}}}),
    ],
)
def test_what_observers_ask_for_waits_while_a_brush_or_slider_is_in_hand(
    served_session: ServedSession, kind: str, fields: Any
) -> None:
    def drag(seq: int, *, is_final: bool) -> None:
        if kind == "paint":
            paint(page, seq, is_final=is_final)
        else:
            send_request(page, kind, seq, is_final=is_final, **fields)

    with served_session.page() as page, served_session.program() as program:
        send_request(page, "hello", version=VERSION)
        receive(page)
        send_request(program, "observe", version=VERSION)
        receive(program)
        drag(2, is_final=False)
        receive(page)
        assert receive(program)["kind"] == "answer"
        send_request(program, "export", 7, outputs=["lighting"])
        drag(3, is_final=True)
        assert receive(page)["reply"] == 3
        assert [receive(program).get("reply") for _ in range(2)] == [None, 7]
    kinds = [request.kind for request in served_session.session.requests]
    assert kinds == [kind, kind, "export"]


def test_the_brush_of_who_leaves_is_down_no_more(served_session: ServedSession) -> None:
    with served_session.program() as program:
        with served_session.page() as page:
            send_request(page, "hello", version=VERSION)
            receive(page)
            paint(page, 2, is_final=False)
            receive(page)
        send_request(program, "observe", version=VERSION)
        assert receive(program)["kind"] == "state"


def test_a_proposal_is_heard_of_where_somebody_paints(served_session: ServedSession) -> None:
    def said(said: Any, arrays: Any) -> list[Message]:
        return [LookList(looks=(), resources={})]

    served_session.session.handle = said  # type: ignore[method-assign]
    with served_session.page() as page, served_session.program() as program:
        send_request(page, "hello", version=VERSION)
        receive(page)
        send_request(program, "observe", version=VERSION)
        receive(program)
        send_request(program, "propose", 9, name="evening", lights={"lamp 0": [1, 1, 1]})
        assert (receive(program)["kind"], receive(page)["kind"]) == ("looks", "looks")
        assert receive(page)["text"] == "evening was proposed: see the looks"


class DeafSocket:
    """A socket that takes nothing."""

    async def receive(self) -> Any:
        await asyncio.Event().wait()

    async def send_bytes(self, data: bytes) -> None:
        await asyncio.Event().wait()

    async def close(self, code: int = 1000) -> None:
        """Nobody hears it."""


def test_what_waits_for_a_slow_observer_is_replaced_and_nothing_asked_is_lost() -> None:
    slow = client.Client(DeafSocket())
    slow.is_observer = True
    line = session_clients.Observers([slow])
    history = HistoryInfo(("stroke",), (), 1)
    line.send(fake_answer(version=0, history=history, constraints={"lamp": {"off": True}}))
    for k in range(1, 2000):
        line.send(fake_answer(version=k))
        line.send(fake_progress("basis", k))
        line.send(fake_state({"present": k}))
        line.send(PictureUpdate(resources={"present": k}))
    unsent = [message.fields for message, _ in slow._unsent]
    assert [one.get("version") for one in unsent] == [1999, None, VERSION, None]
    assert unsent[0]["history"]["count"] == 1
    assert unsent[0]["constraints"] == {"lamp": {"off": True}}


def test_of_what_a_canvas_holds_observers_get_the_lighting() -> None:
    slow = client.Client(DeafSocket())
    slow.is_observer = True
    pixels = np.zeros((1, 1, 3), np.float32)
    patch = CanvasPatch(
        region=(0, 1, 0, 1),
        view=0,
        views=(0,),
        version=4,
        stroke=2,
        exact=False,
        mode="linear",
        image=pixels,
        importance=pixels[..., 0],
        weights=np.ones((2, 3)),
    )
    session_clients.Observers([slow]).send(patch)
    draft = np.zeros((1, 1, 3), np.float16)
    session_clients.Observers([slow]).send(fake_answer(version=5, draft=draft))
    for message, _ in slow._unsent:
        assert message.kind == "answer"
        assert list(message.arrays) == ["weights"]


# Proposals


@pytest.fixture
def looks(make_basis: Any) -> tuple[Session, LookLibrary]:
    basis = make_basis(3)
    session = Session(
        [basis],
        [basis.current_look],
        MemoryStore(Identity.of([basis])),
        settings=Settings(),
        transform=lp.ViewTransform(),
    )
    return session, LookLibrary(session, PictureTable())


def test_a_proposal_is_a_look_that_holds_its_lighting(looks: tuple[Session, LookLibrary]) -> None:
    session, library = looks
    first, second, third = session.basis.names
    before = session.weights.copy()
    reply = library.handle(Propose("evening", {first: (1.0, 2.0, 3.0), second: (0.0, 0.0, 0.0)}))
    assert isinstance(reply, LookList)
    [look] = reply.looks
    assert look.is_proposal
    np.testing.assert_array_equal(session.weights, before)
    expected = np.array([[1, 2, 3], [0, 0, 0], before[2]])
    np.testing.assert_allclose(look.weights, expected)
    library.load(LoadLook(look.id))
    np.testing.assert_allclose(session.weights, expected)
    assert third in session.requests.lights


def test_a_later_proposal_of_the_name_takes_its_place_but_never_that_of_a_look(
    looks: tuple[Session, LookLibrary],
) -> None:
    session, library = looks
    name = session.basis.names[0]
    library.handle(SaveLook("evening"))
    for level in (1.0, 2.0):
        library.handle(Propose("evening", {name: (level, level, level)}))
    kept_info, proposed = library.infos()
    assert (kept_info.is_proposal, proposed.is_proposal) == (False, True)
    assert proposed.weights[0] == (2.0, 2.0, 2.0)
    library.handle(RenameLook(proposed.id, "evening"))
    library.handle(Propose("evening", {}))
    assert [look.is_proposal for look in library.infos()] == [False, False, True]


def test_a_proposal_that_cannot_be_is_refused(looks: tuple[Session, LookLibrary]) -> None:
    session, library = looks
    name = session.basis.names[0]
    for lights, words in (
        ({"nothing": (1.0, 1.0, 1.0)}, "no light is called 'nothing'"),
        ({name: (-1.0, 1.0, 1.0)}, "expected numbers >= 0"),
        ({name: (float("nan"), 1.0, 1.0)}, "expected numbers >= 0"),
    ):
        with pytest.raises(PaintError, match=words):
            library.handle(Propose("x", lights))
    assert library.infos() == ()
    for k in range(MAX_PROPOSALS):
        library.handle(Propose(f"look {k}", {}))
    with pytest.raises(PaintError, match="proposals exist"):
        library.handle(Propose("one more", {}))
    library.handle(Propose("look 0", {}))
