"""`lightpaint send`, `listen` and `export --to cues`: everything stays on loopback."""

import csv
import json
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import as_from_a_terminal, run, run_refused, succeed
from console_rigs import lamp, open_port, sacn_fields, sacn_packet
from patience import PATIENCE_S

from lightpaint.cli.commands import console_commands
from lightpaint.colour.lamp import Lamp, LampEmitter
from lightpaint.dmx.console_rig import ConsoleRig
from lightpaint.dmx.levels import encode_levels
from lightpaint.lighting.answer.lighting import Lighting, LightSetting
from lightpaint.lighting.answer.lighting_file import write_lighting
from lightpaint.paint.store.history_steps import Identity, StoredLook, ViewIdentity
from lightpaint.paint.store.session_file import Store
from lightpaint.scene.properties.site import EmitterPlace, unit

COLORS = ("red", "green", "blue")
RIG = ConsoleRig(
    "show.mvr", (lamp("left", 1, colors=COLORS), lamp("right", 513, bits=16, colors=COLORS))
)
DRIVES = {"left": (1.0, 0.0, 0.25), "right": (0.125, 0.5, 0.0)}

#: A drive in 8 bits, of which the dimmer has as many.
TABLE_ROUNDING = 0.5 / 255


#: The channels of Rec.709 as emitters: an emission is their drives.
AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
CHANNELS = tuple(LampEmitter(x, axis) for x, axis in zip(COLORS, AXES, strict=True))


def setting(
    name: str, emission: tuple[float, float, float], emitters: tuple[LampEmitter, ...] = CHANNELS
) -> LightSetting:
    """A spot of emitters."""
    return LightSetting(name, "spot", "intensity", "W/sr", emission, emission, lamp=Lamp(emitters))


def write_look(path: Path, drives: dict[str, tuple[float, float, float]] = DRIVES) -> Path:
    lights = tuple(setting(name, emission) for name, emission in drives.items())
    path.parent.mkdir(exist_ok=True)
    write_lighting(path, Lighting(lights, target="evening.png", scene_identity="0" * 16))
    return path


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with an answer, and a rig that is at hand whatever its file."""
    monkeypatch.setattr(console_commands, "read_rig_file", lambda _: RIG)
    write_look(tmp_path / "lighting.json")
    return tmp_path


@pytest.fixture
def port() -> Iterator[socket.socket]:
    with open_port() as opened:
        yield opened


def packets_of(port: socket.socket) -> list[Any]:
    port.settimeout(0)
    packets = []
    while True:
        try:
            packets.append(sacn_fields(port.recv(2048)))
        except BlockingIOError:
            return packets


def target_of(port: socket.socket, scheme: str = "sacn") -> str:
    return f"{scheme}://127.0.0.1:{port.getsockname()[1]}"


SEND = ("send", "lighting.json", "--rig", "show.mvr")


def test_an_answer_is_sent_and_its_stream_ended(folder: Path, port: socket.socket) -> None:
    target = target_of(port)
    output = succeed(folder, *SEND, "--to", target, "--until", "done")
    assert output == f"sending to {target}, universes 1, 2, source 'lightpaint', priority 90\n"
    packets = packets_of(port)
    expected = encode_levels(
        RIG, {name: dict(zip(COLORS, x, strict=True)) for name, x in DRIVES.items()}
    )
    assert all(x.slots == expected[x.universe] for x in packets)
    assert [x.is_last for x in packets] == [False] * 6 + [True] * 6


def test_universes_priority_and_blackout(folder: Path, port: socket.socket) -> None:
    options = ("--universe", "1:7,2:9", "--priority", 120, "--blackout", "--until", "0.1s")
    output = succeed(folder, *SEND, "--to", target_of(port), *options)
    assert "universes 7, 9, source 'lightpaint', priority 120" in output
    packets = packets_of(port)
    assert {(x.universe, x.priority) for x in packets} == {(7, 120), (9, 120)}
    rest = encode_levels(RIG, {})
    assert packets[-1].slots == rest[2]
    assert packets[0].slots != rest[1]


def test_a_fade_comes_in_from_darkness(folder: Path, port: socket.socket) -> None:
    succeed(folder, *SEND, "--to", target_of(port), "--fade", "300ms", "--until", "done")
    reds = [x.slots[0] for x in packets_of(port) if x.universe == 1]
    assert reds == sorted(reds)
    assert reds[0] < 30
    assert reds[-1] == 255
    assert len(set(reds)) > 4


def test_nothing_is_sent_without_a_target(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: Any, **__: Any) -> None:
        raise AssertionError("no socket is needed")

    monkeypatch.setattr(socket, "socket", refuse)
    completed = run(folder, *SEND)
    assert completed.returncode == 0, completed.stderr
    assert "nothing is sent without --to" in completed.stderr
    rows = [line.split() for line in completed.stdout.splitlines()]
    assert rows[0] == ["id", "fixture", "light", "emitter", "drive", "channel", "value"]
    assert ["101", "left", "left", "blue", "0.250", "1.7", "64"] in rows
    assert ["613", "right", "right", "dimmer", "2.1", "128"] in rows
    assert len(rows) == 1 + 2 * 4


def test_the_table_has_what_is_sent(folder: Path) -> None:
    succeed(folder, *SEND, "--dump", "dmx.csv", "--universe", "2:40")
    with (folder / "dmx.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [*rows[0]] == [
        *("fixture_id", "fixture", "light", "emitter"),
        *("drive", "universe", "channels", "value"),
    ]
    [green] = [x for x in rows if (x["light"], x["emitter"]) == ("right", "green")]
    assert (float(green["drive"]), green["universe"], green["channels"]) == (0.5, "40", "7 8")
    [dimmer] = [x for x in rows if (x["light"], x["emitter"]) == ("right", "dimmer")]
    share = int(green["value"]) / 65535 * int(dimmer["value"]) / 255
    assert share == pytest.approx(0.5, abs=TABLE_ROUNDING)


def test_the_document_has_all_levels(folder: Path) -> None:
    succeed(folder, *SEND, "--dump", "dmx.json")
    document = json.loads((folder / "dmx.json").read_text())
    assert document["format"] == "lightpaint-dmx 1"
    drives = {name: dict(zip(COLORS, x, strict=True)) for name, x in DRIVES.items()}
    levels = {int(k): bytes(values) for k, values in document["universes"].items()}
    assert levels == encode_levels(RIG, drives)
    printed = json.loads(succeed(folder, *SEND, "--json"))
    assert printed == {"target": None, **document}


def test_a_rig_has_lights_that_an_answer_does_not(folder: Path) -> None:
    write_look(folder / "lighting.json", {"left": (1.0, 0.0, 0.0)})
    assert "lighting.json has no drives for right, which stay dark" in run(folder, *SEND).stderr


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (("send", "lighting.json"), "the following arguments are required: --rig"),
        ((*SEND, "--to", "dmx"), "'dmx' is not a target: expected sacn://127.0.0.1"),
        ((*SEND, "--to", "sacn://239.255.0.1"), "write sacn://multicast to reach all of them"),
        ((*SEND, "--to", "artnet://10.0.0.1", "--priority", 90), "Art-Net has no priority"),
        ((*SEND, "--to", "sacn://127.0.0.1", "--priority", 201), "at most 200"),
        ((*SEND, "--universe", "1"), "'1' is not RIG:NETWORK, such as 1:5"),
        ((*SEND, "--universe", "9:1"), "show.mvr has no universe 9: it has 1, 2"),
        ((*SEND, "--universe", "1:2"), "would both be universe 2"),
        ((*SEND, "--fade", "soon"), "'soon' is not a time like 3s, 500ms or 2min"),
        ((*SEND, "--until", "never"), "'never' is neither ctrl-c nor done, nor a time like 10s"),
        ((*SEND, "--dump", "dmx.txt"), "expected a file .csv or .json"),
        ((*SEND, "--dump", "lighting.json"), "is an input of this command"),
        ((*SEND, "--to", "sacn://127.255.255.255", "--until", "done"), "Permission denied"),
        (("listen", "--universe", "1:5", "--seconds", "0"), "give --rig, too"),
        (("listen", "--interface", "stage", "--seconds", "0"), "is not an IPv4 address"),
        (("export", "lighting.json", "--to", "cues"), "give --rig show.mvr"),
        (
            ("export", "lighting.json", "lighting.json", "--to", "cues,csv", "--rig", "show.mvr"),
            "csv takes one lighting, not 2; cues take all",
        ),
    ],
)
def test_mistakes_are_one_line(folder: Path, arguments: tuple[Any, ...], line: str) -> None:
    completed = run(folder, *arguments)
    assert completed.returncode == 2, completed.stdout + completed.stderr
    [text] = completed.stderr.strip().splitlines()
    assert line in text


def test_what_does_not_fit_is_refused_and_nothing_sent(folder: Path, port: socket.socket) -> None:
    command = (*SEND, "--to", target_of(port), "--until", "done")
    write_look(folder / "lighting.json", {"sun": (1.0, 0.0, 0.0)})
    assert "show.mvr has no light sun: it has left, right" in run_refused(folder, *command)
    plain = LightSetting("left", "spot", "intensity", "W/sr", (1, 1, 1), (1, 1, 1))
    lighting = Lighting((plain,), target="evening.png", scene_identity="0" * 16)
    write_lighting(folder / "lighting.json", lighting)
    assert "lighting.json has no drives" in run_refused(folder, *command)
    (folder / "dmx.csv").write_text("mine")
    write_look(folder / "lighting.json")
    assert "dmx.csv exists" in run_refused(folder, *command, "--dump", "dmx.csv")
    assert packets_of(port) == []


def test_a_taken_port_is_refused(folder: Path, port: socket.socket) -> None:
    number = port.getsockname()[1]
    line = run_refused(folder, "listen", "--port", number, "--seconds", "1")
    assert f"port {number} of 127.0.0.1 is taken: end the program that listens there" in line


class Sender(threading.Thread):
    """A console that sends packets to a port again and again."""

    def __init__(self, number: int, *packets: bytes) -> None:
        super().__init__(daemon=True)
        self._address, self._packets, self.is_over = ("127.0.0.1", number), packets, False

    def run(self) -> None:
        with open_port() as own:
            while not self.is_over:
                for packet in self._packets:
                    own.sendto(packet, self._address)
                time.sleep(0.02)


def free_port() -> int:
    with open_port() as port:
        return int(port.getsockname()[1])


def listened(folder: Path, packets: list[bytes], *options: object) -> str:
    number = free_port()
    sender = Sender(number, *packets)
    sender.start()
    try:
        return succeed(folder, "listen", "--port", number, "--seconds", "0.5s", *options)
    finally:
        sender.is_over = True
        sender.join()


def sent_packets() -> list[bytes]:
    drives = {name: dict(zip(COLORS, x, strict=True)) for name, x in DRIVES.items()}
    levels = encode_levels(RIG, drives)
    # All of one sequence number: the first of each counts.
    return [sacn_packet(levels[x], universe=x + 10, priority=110) for x in (1, 2)]


def test_listen_prints_drives_by_fixture(folder: Path) -> None:
    options = ("--rig", "show.mvr", "--universe", "1:11,2:12")
    output = listened(folder, sent_packets(), *options)
    first, *lines = output.splitlines()
    assert re.fullmatch(r"listening for sACN at 127\.0\.0\.1, port \d+", first)
    assert "universe 11: from 'console', priority 110" in lines
    assert "left at 1.1: red=1.000 green=0.000 blue=0.251" in lines
    assert lines.count("left at 1.1: red=1.000 green=0.000 blue=0.251") == 1
    document = json.loads(listened(folder, sent_packets(), *options, "--json", "-q"))
    assert document["protocol"] == "sacn"
    for name, drives in DRIVES.items():
        for color, drive in zip(COLORS, drives, strict=True):
            found = document["lights"][name][color]
            assert found == pytest.approx(drive, abs=TABLE_ROUNDING)
    assert document["universes"]["11"]["source"] == "console"


def test_listen_prints_channels_without_a_rig(folder: Path) -> None:
    output = listened(folder, [sacn_packet(b"\x01\x00\x05", universe=3)])
    assert "channels of universe 3: 1=1 3=5" in output.splitlines()


def test_listen_says_that_nothing_arrived(folder: Path) -> None:
    number = free_port()
    completed = run(folder, "listen", "--port", number, "--seconds", "0.05", "--from", "artnet")
    assert completed.returncode == 0
    assert f"nothing arrived at 127.0.0.1, port {number}" in completed.stderr


#: The example rig, four PARs and two washes.
SHOW = Path(__file__).resolve().parents[2] / "scenes" / "rig" / "show.mvr"


def test_an_answer_goes_by_the_file_of_a_show_and_comes_back(
    tmp_path: Path, port: socket.socket
) -> None:
    """From an MVR and an answer to packets, and from these to drives."""
    axes = {"red": (3.0, -0.2, 0.0), "green": (-0.5, 2.0, 0.0), "blue": (0.2, -0.3, 5.0)}
    emitters = tuple(
        LampEmitter(name, rgb) for name, rgb in (axes | {"white": (1.0, 1.0, 1.0)}).items()
    )
    light = setting("102 PAR 2", (1.5, 0.5, 2.0), emitters)
    lighting = Lighting((light,), target="evening.png", scene_identity="0" * 16)
    write_lighting(tmp_path / "lighting.json", lighting)
    command = ("lighting.json", "--rig", SHOW, "--to", target_of(port), "--until", "done")
    succeed(tmp_path, "send", *command)
    packets = [port.recv(2048), port.recv(2048)]  # the first of both universes
    document = json.loads(listened(tmp_path, packets, "--rig", SHOW, "--json", "-q"))
    assert 0 < max(light.drives.values()) <= 1
    for name, drive in light.drives.items():
        # The rounding of a dimmer and of an emitter, in 8 bits each.
        found = document["lights"]["102 PAR 2"][name]
        assert found == pytest.approx(drive, abs=2 * TABLE_ROUNDING)
    assert len(document["lights"]) == 6
    assert not any(document["lights"]["101 PAR 1"].values())


def test_pan_and_tilt_are_sent_when_asked_for(tmp_path: Path) -> None:
    """Of a wash that hangs turned by 90°: +y of the stage is to its right, −90° of pan."""
    light = setting("201 Wash 1", (1.0, 0.5, 0.0))
    place = EmitterPlace("201 Wash 1", (-2.6, 3.4, 5.1), unit((0.0, 1.0, -1.0)))
    turned = EmitterPlace("101 PAR 1", (-3.2, -2.5, 5.1), (0.0, 0.0, 1.0))
    lighting = Lighting(
        (light,),
        target="evening.png",
        scene_identity="0" * 16,
        places=(place, turned),
        up=(0.0, 0.0, 1.0),
    )
    write_lighting(tmp_path / "lighting.json", lighting)
    command = ("send", "lighting.json", "--rig", SHOW, "--dump", "dmx.csv", "--force")
    succeed(tmp_path, *command)
    assert "pan" not in (tmp_path / "dmx.csv").read_text()
    completed = run(tmp_path, *command, "--positions")
    assert completed.returncode == 0, completed.stderr
    assert "'101 PAR 1' has no pan and tilt: turn it by" in completed.stderr
    with (tmp_path / "dmx.csv").open(newline="") as file:
        rows = {(x["light"], x["emitter"]): x for x in csv.DictReader(file)}
    pan, tilt = (int(rows["201 Wash 1", x]["value"]) / 65535 for x in ("pan", "tilt"))
    assert (rows["201 Wash 1", "pan"]["channels"], rows["201 Wash 1", "pan"]["drive"]) == (
        "1 2",
        "",
    )
    # Pan goes from 270° down to −270°, tilt from −130° to 130°; a level is 0.01°.
    assert 270 - 540 * pan == pytest.approx(-90, abs=0.01)
    assert -130 + 260 * tilt == pytest.approx(45, abs=0.01)


#: A program with a rig of its own: `send` in a process that signals reach.
PROGRAM = """
import sys
sys.path[:0] = [{tests!r}, {here!r}]
import test_console_commands
from lightpaint.cli import main
from lightpaint.cli.commands import console_commands
console_commands.read_rig_file = lambda _: test_console_commands.RIG
sys.exit(main({arguments!r}))
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("until", ["ctrl-c", "60s"])
def test_signals_end_the_stream(
    folder: Path, port: socket.socket, number: signal.Signals, until: str
) -> None:
    """Ctrl-C is how it ends, or too early; either way its stream is terminated."""
    here = Path(__file__).parent
    arguments = [*SEND, "--to", target_of(port), "--until", until]
    program = PROGRAM.format(tests=str(here.parent), here=str(here), arguments=arguments)
    with subprocess.Popen(
        [sys.executable, "-c", program],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=as_from_a_terminal,
    ) as process:
        assert not sacn_fields(port.recv(2048)).is_last
        process.send_signal(number)
        output, errors = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == (0 if until == "ctrl-c" else 128 + number), errors
    assert output.startswith("sending to sacn://127.0.0.1")
    assert errors == ("" if until == "ctrl-c" else "lightpaint send: interrupted\n")
    packets = packets_of(port)
    assert [x.is_last for x in packets][-6:] == [True] * 6
    # Nothing went dark.
    assert packets[-1].slots[:4] != encode_levels(RIG, {})[2][:4]


def test_cues_of_several_looks(folder: Path) -> None:
    write_look(folder / "dusk" / "lighting.json")
    write_look(folder / "=night.json", {"left": (0.0, 0.0, 0.5)})
    command = ("export", "dusk/lighting.json", "=night.json", "--to", "cues", "--rig", "show.mvr")
    output = succeed(folder, *command, "--fade", "2.5s", "-o", "out")
    assert output == "out/cues.csv\n"
    with (folder / "out" / "cues.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [*rows[0]] == ["cue", "label", "fade", "fixture", "channel", "value"]
    names = ["Dimmer", "ColorAdd_R", "ColorAdd_G", "ColorAdd_B"]
    assert [x["channel"] for x in rows] == names * 4
    assert [(x["cue"], x["label"]) for x in rows[::8]] == [("1", "dusk"), ("2", "'=night")]
    assert {x["fade"] for x in rows} == {"2.5"}
    assert [x["fixture"] for x in rows[::4]] == ["101", "613"] * 2
    assert [int(x["value"]) for x in rows[:4]] == [65535, 65535, 0, round(64 / 255 * 65535)]
    # The dimmer of the second has the largest drive in 8 bits, and green makes up for its rounding.
    dimmer, _, green = (int(x["value"]) / 65535 for x in rows[4:7])
    assert dimmer == pytest.approx(128 / 255, abs=0.5 / 65535)
    assert dimmer * green == pytest.approx(0.5, abs=1 / 65535)
    assert all(int(x["value"]) == 0 for x in rows[12:])


def kept_session(folder: Path, looks: list[dict[str, Any]]) -> Path:
    """A session of a painter with looks, in its folder."""
    identity = Identity("hall.xml", "0", ("left", "right"), (ViewIdentity("", (2, 2)),))
    with Store.open(folder / "hall.paint" / "session.db", identity) as store:
        for k, fields in enumerate(looks, start=1):
            store.put_look(StoredLook(k, fields, {"weights": np.zeros((2, 3))}))
    return folder / "hall.paint"


def test_each_look_of_a_session_is_a_cue(folder: Path) -> None:
    drives = {name: dict(zip(COLORS, x, strict=True)) for name, x in DRIVES.items()}
    dark = {"left": dict.fromkeys(COLORS, 0.0)}
    looks = [
        {"name": "dusk", "drives": drives},
        {"name": "a console's", "drives": drives, "is_proposal": True},
        {"name": "night", "drives": dark},
    ]
    session = kept_session(folder, looks)
    command = ("--to", "cues", "--rig", "show.mvr", "--fade", "2s", "--force")
    succeed(folder, "export", "hall.paint", *command)
    with (session / "cues.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(x["cue"], x["label"]) for x in rows[::8]] == [("1", "dusk"), ("2", "night")]
    assert not any(int(x["value"]) for x in rows[8:])
    # The same cue as of an answer with these drives.
    succeed(folder, "export", "lighting.json", *command, "-o", "out")
    with (folder / "out" / "cues.csv").open(newline="") as file:
        answer = [{**x, "label": "dusk"} for x in csv.DictReader(file)]
    assert rows[:8] == answer
    # Sessions and answers in one list, in their order.
    sources = ("lighting.json", "hall.paint/session.db")
    succeed(folder, "export", *sources, *command, "-o", "out")
    with (folder / "out" / "cues.csv").open(newline="") as file:
        labels = [x["label"] for x in csv.DictReader(file)][::8]
    assert labels[1:] == ["dusk", "night"]


def test_sessions_that_make_no_cues_are_refused_in_one_line(folder: Path) -> None:
    command = ("export", "hall.paint/session.db", "--to")
    cues = ("cues", "--rig", "show.mvr")
    assert "no such session: hall.paint/session.db" in run_refused(folder, *command, *cues)
    kept_session(folder, [])
    assert "session.db has no looks: keep some" in run_refused(folder, *command, *cues)
    kept_session(folder, [{"name": "dusk"}])
    refusal = run_refused(folder, *command, *cues)
    assert "has no drives of the look 'dusk': open it in the painter once" in refusal
    assert "csv takes a lighting.json" in run_refused(folder, *command, "csv")
    (folder / "other.db").write_bytes(b"SQLite")
    refusal = run_refused(folder, "export", "other.db", "--to", *cues)
    assert "other.db is not a session of the painter" in refusal
    with Store.open(folder / "hall.paint" / "session.db", None):
        assert "is in use: end the painter" in run_refused(folder, *command, *cues)
    assert not list(folder.rglob("cues.csv"))


def test_pan_and_tilt_are_in_cues_that_have_places(tmp_path: Path) -> None:
    pose = {"target": [-2.6, 4.4, 4.1], "position": [-2.6, 3.4, 5.1]}
    drives = {"201 Wash 1": {"red": 0.5}}
    look = {"name": "out", "drives": drives, "wishes": {"poses": {"201 Wash 1": pose}}}
    kept_session(tmp_path, [look])
    command = ("export", "hall.paint", "--to", "cues", "--rig", SHOW, "--force")
    values = {}
    for options in ((), ("--positions",)):
        succeed(tmp_path, *command, *options)
        with (tmp_path / "hall.paint" / "cues.csv").open(newline="") as file:
            values = {(x["fixture"], x["channel"]): int(x["value"]) for x in csv.DictReader(file)}
        assert (("201", "Pan") in values) == bool(options)
    # Towards +y, as `send` has it.
    assert 270 - 540 * values["201", "Pan"] / 65535 == pytest.approx(-90, abs=0.01)
    assert -130 + 260 * values["201", "Tilt"] / 65535 == pytest.approx(45, abs=0.01)
    line = run_refused(tmp_path, "export", "a.json", "--to", "csv", "--positions")
    assert "--positions belongs to cues" in line


def test_cues_go_beside_other_forms(folder: Path) -> None:
    command = ("export", "lighting.json", "--to", "csv,cues", "--rig", "show.mvr", "-o", "out")
    succeed(folder, *command)
    assert sorted(x.name for x in (folder / "out").iterdir()) == ["cues.csv", "fixtures.csv"]
    assert "exists" in run(folder, *command).stderr
