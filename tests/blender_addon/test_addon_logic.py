"""The add-on's parts that need no Blender: arithmetic, names, frames, messages."""

import socket
import struct
import threading
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from live_server import RunningServer

from lightpaint.blender_addon.lamps.grouping import group_bytes, group_name, stem
from lightpaint.blender_addon.lamps.lamp_levels import (
    DRIVES_KEY,
    discard_drives,
    forget_drives,
    keep_drives,
    show_drives,
)
from lightpaint.blender_addon.lamps.lamp_units import (
    are_equal,
    in_space,
    scaled,
    scaled_colour,
    working_space,
)
from lightpaint.blender_addon.painter import painter_link, program
from lightpaint.blender_addon.painter.painter_messages import (
    PROTOCOL_VERSION,
    MessageError,
    PainterState,
    from_bytes,
    to_bytes,
)
from lightpaint.blender_addon.painter.program import find_program
from lightpaint.blender_addon.shot.shot_files import ShotFolder
from lightpaint.cli.options.parser import command_parser
from lightpaint.colour.primaries import ACESCG, REC2020, from_rec709
from lightpaint.paint.message_frames import from_frame, to_frame
from lightpaint.paint.protocol import VERSION

FACTORS = st.tuples(*[st.floats(0.001, 1000)] * 3)


@given(FACTORS)
def test_level_times_colour_takes_the_whole_factor(factor: tuple[float, ...]) -> None:
    level, *colour = scaled([80.0, 1.0, 0.5, 0.25], factor)
    wanted = [80.0 * c * f for c, f in zip((1.0, 0.5, 0.25), factor, strict=True)]
    assert [level * c for c in colour] == pytest.approx(wanted)
    assert level == pytest.approx(80.0 * sum(factor) / 3)


def test_a_light_that_goes_out_keeps_its_colour() -> None:
    assert scaled([80.0, 1.0, 0.5, 0.25], (0.0, 0.0, 0.0)) == [0.0, 1.0, 0.5, 0.25]
    assert scaled([80.0, 1.0, 0.5, 0.25], (float("nan"), 1.0, 1.0))[0] == 0.0
    assert scaled_colour([1.0, 1.0, 0.5, 0.25], (2.0, -1.0, 1.0)) == [1.0, 2.0, 0.0, 0.25]


def test_a_change_of_brightness_alone_leaves_the_colour() -> None:
    assert scaled([80.0, 1.0, 0.5, 0.25], (2.0, 2.0, 2.0)) == [160.0, 1.0, 0.5, 0.25]


@pytest.mark.parametrize(
    ("name", "primaries"), [("lin_ap1_scene", ACESCG), ("lin_rec2020_scene", REC2020)]
)
@given(factor=FACTORS)
def test_a_white_light_becomes_the_colour_of_rec709_whatever_space_a_file_works_in(
    name: str, primaries: tuple[float, ...], factor: tuple[float, ...]
) -> None:
    settings = SimpleNamespace(working_space_interop_id=name)
    space = working_space(SimpleNamespace(colorspace=settings))
    assert space is not None
    np.testing.assert_allclose(space, from_rec709(primaries), atol=1e-9)  # nine digits
    level, *colour = scaled([80.0, 1.0, 1.0, 1.0], in_space(factor, space))
    made = level * np.linalg.solve(space, colour)
    np.testing.assert_allclose(made, 80.0 * np.array(factor), atol=1e-9 * 80 * max(factor))
    # Another light is multiplied channel by channel there, as a renderer multiplies it.
    level, *other = scaled([80.0, 0.5, 0.0, 1.0], in_space(factor, space))
    np.testing.assert_allclose(other, np.array(colour) * (0.5, 0.0, 1.0), rtol=1e-9)
    assert in_space(factor, working_space(SimpleNamespace())) == factor  # before Blender 5


def test_levels_are_compared_as_float32() -> None:
    rounded = struct.unpack("<f", struct.pack("<f", 0.1))[0]
    assert are_equal([0.1, 1.0], [rounded, 1.0])
    assert not are_equal([0.1, 1.0], [0.1001, 1.0])


@given(st.lists(st.text(max_size=80), max_size=12), st.integers(8, 40))
def test_names_of_groups_are_short_plain_and_apart(names: list[str], limit: int) -> None:
    taken: list[str] = []
    for name in names:
        taken.append(group_name(name, taken, limit))
    assert len({name.casefold() for name in taken}) == len(taken)
    assert all(0 < len(name.encode()) <= limit for name in taken)
    assert not [name for name in taken if set(name) & set('.\n"\\\0')]


def test_channels_of_long_view_layers_leave_less_for_names() -> None:
    assert group_bytes("ViewLayer") == 40
    assert group_bytes("v" * 40) == 11
    assert group_bytes("v" * 60) == 0
    assert [stem(x) for x in ("Spot.001", "Spot", "a.b", ".001")] == ["Spot", "Spot", "a.b", ".001"]


def test_frames_are_those_of_the_painter() -> None:
    assert PROTOCOL_VERSION == VERSION
    weights = struct.pack("<6d", *range(6))
    described = [{"name": "weights", "dtype": "float64", "shape": [2, 3]}]
    content = {"kind": "answer", "text": "Δ", "buffers": described}
    frame = to_frame(content, [weights])
    assert to_bytes(content, [weights]) == frame
    found, buffers = from_bytes(frame)
    assert found == from_frame(frame)[0]
    assert buffers["weights"] == tuple(range(6))


def test_fixed_lights_are_not_dimmed_by_the_master() -> None:
    lights = [{"name": "a", "is_fixed": False}, {"name": "rest", "is_fixed": True}]
    state = PainterState()
    content: dict[str, Any] = {"kind": "state", "lights": lights, "looks": [], "master": 0.5}
    assert state.receive(content, {"weights": (2.0, 2.0, 2.0, 1.0, 1.0, 1.0)})
    assert state.factors == {"a": (1.0, 1.0, 1.0), "rest": (1.0, 1.0, 1.0)}
    assert state.receive({"kind": "answer", "exact": False}, {"weights": (4.0,) * 6})
    assert state.factors["a"] == (2.0, 2.0, 2.0)
    assert not state.receive({"kind": "notice", "text": "soon"}, {})


def test_drives_of_emitters_are_known_by_name_and_dimmed_by_the_master() -> None:
    emitters = [{"name": "red", "swatch": "#f00"}, {"name": "white", "swatch": "#fff"}]
    lights = [
        {"name": "a", "is_fixed": False, "emitters": emitters},
        {"name": "b", "is_fixed": False, "emitters": []},
    ]
    weights = {"weights": (2.0, -0.5, 0.0, 1.0, 1.0, 1.0)}
    looks = [{"id": 1, "name": "x", "lights": ["a"], "weights": [[1.0, -0.1, 0.0]]}]
    content: dict[str, Any] = {"kind": "state", "lights": lights, "looks": looks, "master": 0.5}
    state = PainterState()
    assert state.receive({**content, "answer": {"lights": [{"drives": [0.5, 1]}, {}]}}, weights)
    assert state.drives == {"a": {"red": 0.25, "white": 0.5}}
    # LEDs lie outside of Rec.709, which lamps in Blender do not.
    assert state.factors["a"] == (1.0, 0.0, 0.0)
    assert state.looks[0].factors == {"a": (1.0, 0.0, 0.0)}
    # Under the brush some answers have them, and others leave them as they are.
    assert state.receive({"kind": "answer", "drives": [[0.0, 0.25], None]}, weights)
    assert state.receive({"kind": "answer", "master": 1.0}, weights)
    assert state.drives == {"a": {"red": 0.0, "white": 0.25}}
    for wrong in ([2.0, 0.0], [0.5], ["a", "b"], [float("nan"), 0.0]):
        with pytest.raises(MessageError):
            state.receive({"kind": "answer", "drives": [wrong, None]}, weights)
    negative = {"weights": (1.0, 1.0, 1.0, -1.0, 1.0, 1.0)}
    with pytest.raises(MessageError):
        state.receive({"kind": "answer"}, negative)


def test_drives_are_properties_of_lamps_until_they_are_discarded() -> None:
    class Owner(dict[str, Any]):
        """A lamp with custom properties."""

    lamp, other = Owner(), Owner(own=1)
    groups = {"a": [SimpleNamespace(owner=lamp)], "b": [SimpleNamespace(owner=other)]}
    show_drives(groups, {"a": {"red": 0.5}})
    assert lamp == {DRIVES_KEY: {"red": 0.5}}
    discard_drives(groups)
    assert lamp == {}
    show_drives(groups, {"a": {"red": 0.25}})
    keep_drives(groups)
    show_drives(groups, {"a": {"red": 1.0}})
    discard_drives(groups)
    assert lamp[DRIVES_KEY] == {"red": 0.25}
    # Another look, of which no drives are known, is applied.
    show_drives(groups, {})
    keep_drives(groups)
    discard_drives(groups)
    assert DRIVES_KEY not in lamp
    forget_drives(lamp)
    assert other == {"own": 1}


def test_the_painter_of_a_shot_gets_its_lights_file() -> None:
    plain = program.paint_arguments("shot.exr", "painting", ["--view", "agx"])
    assert plain == ["paint", "--lights", "shot.exr", "-o", "painting", "--json", "--view", "agx"]
    words = program.paint_arguments("shot.exr", "painting", [], "a.lights.toml")
    options = command_parser().parse_args([str(x) for x in words])
    assert options.lights_file == "a.lights.toml"


@pytest.mark.parametrize("size", [0, 125, 126, 65535, 65536])
def test_a_socket_sends_and_receives_messages_of_any_size(size: int) -> None:
    here, there = socket.socketpair()
    client, data = painter_link.SocketClient(here, b""), bytes(range(256)) * (size // 256 + 1)
    sender = threading.Thread(target=client.send, args=[data[:size]])
    sender.start()
    head = there.recv(2, socket.MSG_WAITALL)
    length = head[1] & 0x7F
    if length > 125:
        width = 2 if length == 126 else 8
        length = int.from_bytes(there.recv(width, socket.MSG_WAITALL), "big")
    mask = there.recv(4, socket.MSG_WAITALL)
    masked = there.recv(length, socket.MSG_WAITALL) if length else b""
    assert bytes(b ^ mask[i % 4] for i, b in enumerate(masked)) == data[:size]
    sender.join()
    # A message in two frames, and a ping between them.
    for frame in (b"\x02\x02ab", b"\x89\x00", b"\x80\x01c"):
        there.sendall(frame)
    assert client.receive() == b"abc"
    there.close()
    assert client.receive() is None
    client.close()


def test_a_painter_takes_the_connection_and_refuses_others() -> None:
    serving = RunningServer()
    try:
        found = serving.server.connection
        client = painter_link.SocketClient.open(found["address"], found["token"])
        client.send(to_bytes({"kind": "observe", "seq": 1, "version": PROTOCOL_VERSION}))
        assert from_bytes(client.receive())[0]["reply"] == 1
        client.close()
        with pytest.raises(ConnectionError, match="refused"):
            painter_link.SocketClient.open(found["address"], "another")
    finally:
        serving.end()


def test_a_shot_is_known_by_a_whole_render_only(tmp_path: Path) -> None:
    folder = ShotFolder(tmp_path / "shot")
    folder.check_writable()
    assert folder.rendered_digest() == ""
    folder.part.write_bytes(b"exr")
    folder.finish_render("digest", ["Key"])
    assert folder.rendered_digest() == "digest"
    folder.render.write_bytes(b"ex")
    assert folder.rendered_digest() == ""
    folder.write_looks([("Evening", {"Key": (1.0, 2.0, 3.0)})])
    assert folder.read_looks() == [("Evening", {"Key": (1.0, 2.0, 3.0)})]
    folder.looks.write_text("[1]")
    assert folder.read_looks() == []


def test_a_program_that_is_missing_is_told_with_what_to_do(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(FileNotFoundError, match="pip install"):
        find_program()
    with pytest.raises(FileNotFoundError, match="correct it in the preferences"):
        find_program("/nowhere/lightpaint")


def test_the_program_that_wrote_the_addon_comes_before_that_on_the_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    programs = {}
    for name in ("writer", "path"):
        programs[name] = tmp_path / name / "lightpaint"
        programs[name].parent.mkdir()
        programs[name].write_text("#!/bin/sh\n")
        programs[name].chmod(0o755)
    monkeypatch.setenv("PATH", str(programs["path"].parent))
    monkeypatch.setattr(program, "WRITER_FILE", tmp_path / "PROGRAM")
    assert find_program() == str(programs["path"])
    program.WRITER_FILE.write_text(f"{programs['writer']}\n")
    assert find_program() == str(programs["writer"])
    # Of another machine, or uninstalled since.
    programs["writer"].unlink()
    assert find_program() == str(programs["path"])
    assert find_program(str(programs["path"])) == str(programs["path"])
