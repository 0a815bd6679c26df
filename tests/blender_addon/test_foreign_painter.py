"""The add-on beside a foreign painter: malformed frames, messages and numbers, and other hosts."""

import contextlib
import json
import os
import socket
import struct
import sys
import threading
import time
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lightpaint.blender_addon.lamps.lamp_units import checked_factor
from lightpaint.blender_addon.painter import painter_link, painter_messages
from lightpaint.blender_addon.painter.painter_link import PainterLink, SocketClient
from lightpaint.blender_addon.painter.painter_messages import (
    MessageError,
    PainterState,
    from_bytes,
    to_bytes,
)
from lightpaint.blender_addon.painter.program import running_painter
from lightpaint.blender_addon.painter.solves import read_factors
from lightpaint.blender_addon.shot import shot_files
from lightpaint.blender_addon.shot.shot_files import ShotFolder

#: Seconds that a thread takes on a busy machine.
PATIENCE_S = 20.0

LIGHTS = [{"name": "key", "is_fixed": False}, {"name": "rest", "is_fixed": True}]
STATE: dict[str, Any] = {"kind": "state", "lights": LIGHTS, "looks": [], "master": 1.0}
WEIGHTS = {"weights": (1.0,) * 6}
LOOK: dict[str, Any] = {"id": 1, "name": "a", "lights": ["key"], "weights": [[1, 1, 1]]}


@given(st.binary(max_size=64))
def test_bytes_of_any_kind_are_a_message_or_an_error_of_one_kind(frame: bytes) -> None:
    for tried in (frame, struct.pack("<I", len(frame)) + frame):
        try:
            content, _ = from_bytes(tried)
        except MessageError:
            continue
        assert isinstance(content["kind"], str)


def described(**fields: Any) -> bytes:
    """A frame with two weights, of which something is described otherwise."""
    array = {"name": "weights", "dtype": "float32", "shape": [2], **fields}
    return to_bytes({"kind": "answer", "buffers": [array]}, [struct.pack("<2f", 1, 2)])


@pytest.mark.parametrize(
    "frame",
    [
        described(shape=[3000]),
        described(shape=[-1]),
        described(shape=[1.5]),
        described(shape=["2"]),
        described(shape=7),
        described(shape=[2**16] * 8),
        described(dtype="complex"),
        described(dtype=[]),
        to_bytes({"kind": "answer", "buffers": [1]}),
        to_bytes({"kind": "answer", "buffers": 1}),
        to_bytes({"kind": 1}),
        to_bytes({}),
        to_bytes([]),
        to_bytes({"kind": "answer", "master": float("nan")}),
        to_bytes({"kind": "answer", "more": "x" * painter_messages.MAX_JSON}),
        struct.pack("<I", 2) + b"\xff\xff",
        struct.pack("<I", 200_000) + b"[" * 200_000,
        struct.pack("<I", 99) + b"{}",
        b"",
    ],
)
def test_a_frame_with_a_fault_is_no_message(frame: bytes) -> None:
    with pytest.raises(MessageError):
        from_bytes(frame)


@pytest.mark.parametrize(
    ("content", "buffers"),
    [
        ({"kind": "state"}, {}),
        ({**STATE, "lights": None}, WEIGHTS),
        ({**STATE, "lights": [{"name": 5, "is_fixed": False}]}, {"weights": (1.0,) * 3}),
        (
            {**STATE, "looks": [{"id": 1, "name": "a", "lights": ["key"], "weights": [[1, 1]]}]},
            WEIGHTS,
        ),
        (
            {
                **STATE,
                "looks": [{"id": 1, "name": "a", "lights": ["key"], "weights": [[1, 1, -1]]}],
            },
            WEIGHTS,
        ),
        (STATE, {"weights": (1.0,) * 5}),
        (STATE, {"weights": (1.0,) * 9}),
        *((STATE, {"weights": (bad, *(1.0,) * 5)}) for bad in (float("nan"), float("inf"), -1.0)),
        *(
            ({**STATE, "master": bad}, WEIGHTS)
            for bad in (-1.0, float("inf"), "1", [], 1e200, 10**400)
        ),
        ({**STATE, "master": 1e20}, {"weights": (1e20,) * 6}),  # too bright together
        (
            {
                **STATE,
                "looks": [{"id": 1, "name": "a", "lights": ["key"], "weights": [[10**400, 1, 1]]}],
            },
            WEIGHTS,
        ),
        ({**STATE, "looks": [LOOK] * (painter_messages.MAX_LOOKS + 1)}, WEIGHTS),
        ({"kind": "notice"}, {}),
        ({"kind": "notice", "text": 5}, {}),
        ({"kind": "progress", "task": "a"}, {}),
        ({"kind": "answer", "headline": ["a"]}, WEIGHTS),
    ],
)
def test_a_message_with_a_fault_changes_no_lamp(content: Any, buffers: Any) -> None:
    state = PainterState()
    assert state.receive(STATE, WEIGHTS)
    before = dict(state.factors)
    with pytest.raises(MessageError) as refusal:
        state.receive(content, buffers)
    assert state.factors == before
    assert len(str(refusal.value)) < 200
    assert "\n" not in str(refusal.value)


def test_a_panel_gets_sentences_of_one_short_line() -> None:
    state, look = PainterState(), {**LOOK, "name": "a\tb"}
    state.receive({**STATE, "headline": "x\ny\x1b[31m " + "z" * 10**6, "looks": [look]}, WEIGHTS)
    assert state.headline.startswith("x y [31m zzz")
    assert len(state.headline) == painter_messages.MAX_SENTENCE
    assert state.looks[0].name == "a b"


@pytest.mark.parametrize(
    "value", [float("nan"), float("inf"), -1.0, None, "1", True, 1e31, 10**400]
)
def test_no_light_has_such_a_factor(tmp_path: Path, value: Any) -> None:
    with pytest.raises(ValueError, match="expected three from 0 on"):
        checked_factor([1.0, value, 1.0])
    (tmp_path / "lighting.json").write_text(
        json.dumps({"lights": {"key": {"weight": [1.0, value, 1.0]}}})
    )
    with pytest.raises(ValueError, match="expected three from 0 on"):
        read_factors(str(tmp_path / "lighting.json"))
    folder = ShotFolder(tmp_path)
    folder.write_looks([("Evening", {"key": [1.0, value, 1.0]})])
    assert folder.read_looks() == []


def receiving(*frames: bytes) -> Any:
    """Return the messages that a client receives from these frames."""
    here, there = socket.socketpair()
    try:
        there.sendall(b"".join(frames))
        there.close()
        return SocketClient(here, b"").receive()
    finally:
        here.close()


@pytest.mark.parametrize(
    "frames",
    [
        [b"\x81\x01a"],  # a text
        [b"\x80\x01a"],  # a continuation of nothing
        [b"\x02\x01a", b"\x82\x01b"],  # a message within a message
        [b"\xc2\x01a"],  # compressed, which nobody agreed on
        [b"\x82\x81mask"],  # masked, as only clients do
        [b"\x83\x01a"],  # a kind that there is not
        [b"\x09\x01a"],  # a ping in parts
        [b"\x89\x7e\x00\x7e" + bytes(126)],  # a ping that is too long
        [b"\x82\x7f" + struct.pack(">Q", 2**40)],  # more than a message may have
    ],
)
def test_frames_that_no_painter_sends_end_the_connection_with_words(frames: list[bytes]) -> None:
    with pytest.raises(ValueError, match=r"^a (frame|message) that|^a frame of the kind"):
        receiving(*frames)


def test_the_parts_of_a_message_are_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(painter_link, "MAX_FRAMES", 3)
    monkeypatch.setattr(painter_link, "MAX_MESSAGE", 4)
    assert receiving(b"\x02\x01a", b"\x00\x01b", b"\x80\x02cd") == b"abcd"
    with pytest.raises(ValueError, match="longer than a painter's"):
        receiving(b"\x02\x01a", b"\x00\x02bc", b"\x80\x02de")
    with pytest.raises(ValueError, match="longer than a painter's"):
        receiving(b"\x02\x01a", b"\x00\x00", b"\x00\x00", b"\x00\x00")


def test_a_painter_that_reads_nothing_does_not_hold_up_who_leaves_it() -> None:
    here, there = socket.socketpair()
    here.setblocking(False)
    with contextlib.suppress(BlockingIOError):
        while True:
            here.send(bytes(2**16))
    here.setblocking(True)
    closing = threading.Thread(target=SocketClient(here, b"").close, daemon=True)
    closing.start()
    closing.join(PATIENCE_S)
    there.close()
    assert not closing.is_alive()


def test_messages_that_wait_are_bounded_by_their_bytes(monkeypatch: pytest.MonkeyPatch) -> None:
    waiting = painter_link._Waiting()
    monkeypatch.setattr(painter_link, "MAX_WAITING_BYTES", 10)
    monkeypatch.setattr(painter_link, "MAX_WAITING", 3)
    for name, size in (("a", 4), ("b", 4), ("c", 4)):
        waiting.add(name, size)
    assert waiting.take() == ["b", "c"]
    assert waiting.take() == []
    for name in "abcde":
        waiting.add(name, 1)
    assert waiting.take() == ["c", "d", "e"]
    waiting.add("one that is larger than all bounds", 11)
    assert len(waiting.take()) == 1


def test_an_empty_answer_to_the_handshake_is_a_refusal() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:

        def answer() -> None:
            connection, _ = server.accept()
            connection.recv(4096)
            connection.sendall(b"\r\n\r\n")
            connection.close()

        threading.Thread(target=answer, daemon=True).start()
        with pytest.raises(OSError, match="the painter refused: ''"):
            SocketClient.open(f"http://127.0.0.1:{server.getsockname()[1]}/", "token")


def ended_link(monkeypatch: pytest.MonkeyPatch, data: bytes) -> PainterLink:
    """A link to what has answered with some bytes, once it is over."""
    here, there = socket.socketpair()
    monkeypatch.setattr(painter_link.SocketClient, "open", lambda *_: SocketClient(here, b""))
    there.sendall(data)
    link = PainterLink("http://127.0.0.1:1/", "token")
    end = time.monotonic() + PATIENCE_S
    while not link.has_ended:
        assert time.monotonic() < end
        link.messages()
        time.sleep(0.01)
    there.close()
    return link


def framed(message: bytes) -> bytes:
    return b"\x82\x7e" + struct.pack(">H", len(message)) + message


@pytest.mark.parametrize("data", [b"\x81\x01a", framed(b"\xff" * 8), framed(to_bytes([]))])
def test_a_link_ends_with_the_words_for_what_came(
    monkeypatch: pytest.MonkeyPatch, data: bytes
) -> None:
    link = ended_link(monkeypatch, data)
    assert link.is_connected
    assert link.error.startswith("a ")


@pytest.mark.parametrize(
    ("link_error", "messages", "words"),
    [
        ("a frame that is not a message (error)", [], "a frame that is not a message"),
        ("", [(STATE, {"weights": (-1.0,) * 6})], "a message 'state' with a fault"),
    ],
)
def test_the_panel_says_why_the_painter_was_left(
    monkeypatch: pytest.MonkeyPatch, link_error: str, messages: Any, words: str
) -> None:
    monkeypatch.setitem(sys.modules, "bpy", ModuleType("bpy"))
    from lightpaint.blender_addon.interface.live_session import LiveSession

    named = SimpleNamespace(name="Scene")
    session = LiveSession(None, named, named)  # type: ignore[no-untyped-call]
    closed: list[bool] = []
    session._link = SimpleNamespace(
        messages=lambda: messages,
        has_ended=bool(link_error),
        is_connected=True,
        error=link_error,
        close=lambda: closed.append(True),
    )  # type: ignore[assignment]
    assert session.tick()  # type: ignore[no-untyped-call]
    assert session.is_over
    assert closed
    assert words in session.message
    assert "is it of the same version?" in session.message


@pytest.mark.parametrize(
    ("address", "token", "is_taken"),
    [
        ("http://127.0.0.1:8000/", "a-B_1~", True),
        ("http://localhost:8000/deep/", "a", True),
        ("http://[::1]:8000/", "a=", True),
        ("http://127.8.9.1:8000/", "a", True),
        ("http://192.0.2.1:8000/", "a", False),
        ("http://example.org/", "a", False),
        ("http://127.0.0.1.example.org/", "a", False),
        ("https://127.0.0.1:8000/", "a", False),
        ("http://127.0.0.1:8000/a b", "a", False),
        ("http://127.0.0.1:8000/", "a\r\nX: b", False),
        ("http://127.0.0.1:8000/", "a b", False),
        ("http://127.0.0.1:8000/", "", False),
        ("http://127.0.0.1:8000/", 5, False),
        (["http://127.0.0.1/"], "a", False),
        ("http://[", "a", False),
    ],
)
def test_only_a_painter_of_this_machine_is_found_beside_a_shot(
    tmp_path: Path, address: Any, token: Any, is_taken: bool
) -> None:
    (tmp_path / "painter.json").write_text(json.dumps({"address": address, "token": token}))
    assert running_painter(tmp_path) == ((address, token) if is_taken else None)


@pytest.mark.parametrize("damage", ["deep", "fifo", "large", "list"])
def test_files_beside_a_shot_are_read_if_they_are_lightpaints(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, damage: str
) -> None:
    folder = ShotFolder(tmp_path)
    folder.render.write_bytes(b"")
    folder.session.mkdir()
    for path in (folder.looks, folder.record, folder.session / "painter.json"):
        if damage == "fifo":
            os.mkfifo(path)
        else:
            path.write_text({"deep": "[" * 10**5, "large": "[]", "list": "[[]]"}[damage])
    if damage == "large":
        monkeypatch.setattr(shot_files, "MAX_JSON_FILE", 1)
    assert folder.read_looks() == []
    assert folder.rendered_digest() == ""
    assert running_painter(folder.session) is None
    with pytest.raises(ValueError, match=r"\.json"):
        read_factors(str(folder.looks))
