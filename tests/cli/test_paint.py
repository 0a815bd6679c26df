"""`lightpaint paint`: what it paints, where it says the page is, and how it ends."""

import json
import os
import re
import shlex
import signal
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import as_from_a_terminal, run, run_refused
from light_groups import interleaved, pictures
from nightly import nightly
from patience import PATIENCE_S
from picture_files import layered
from raw_message import RawMessage
from renderer import write_room
from rig_files import EXAMPLE
from server_key import key_of, offered
from websockets.exceptions import ConnectionClosedError
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin, Subprotocol

from lightpaint.basis.file.basis_file import write_basis
from lightpaint.cli.commands.paint_command import command_for_paintings
from lightpaint.cli.options.command_arguments import values_of
from lightpaint.cli.options.job_options import settings_of
from lightpaint.cli.options.parser import command_parser
from lightpaint.cli.options.source_options import painted_of
from lightpaint.paint import launch
from lightpaint.paint.background_threads import BackgroundThreads
from lightpaint.paint.message_frames import from_frame, to_frame
from lightpaint.paint.protocol import VERSION
from lightpaint.paint.store.history_steps import Identity, Step
from lightpaint.paint.store.session_file import Store
from lightpaint.paint.store.session_requests import SessionRequests
from lightpaint.paint.subject_factory import make_subject, make_subjects
from lightpaint.pipeline.job.sources import BasisFile, GroupsFile, SceneFile
from lightpaint.version import __version__
from lightpaint.viewer import BundleError


@pytest.fixture
def work_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, make_basis: Any) -> Path:
    """A folder with light groups, a scene and a basis."""
    monkeypatch.chdir(tmp_path)
    layers = {f"RGBA_{name}": x for name, x in zip("abc", pictures(), strict=True)}
    interleaved(tmp_path / "groups.exr", layers)
    (tmp_path / "scene.xml").write_text("<scene/>")
    write_basis(tmp_path / "room.basis.exr", make_basis(2))
    return tmp_path


def painter_arguments(line: str) -> dict[str, Any]:
    """What the command is called with."""
    arguments = ["paint", *line.split()]
    return values_of(command_parser().parse_args(arguments), arguments)


@pytest.mark.parametrize(
    ("line", "kind", "path", "folder"),
    [
        ("scene.xml", SceneFile, "scene.xml", None),
        ("scene.xml --lights a,b", SceneFile, "scene.xml", None),
        ("room.basis.exr", BasisFile, "room.basis.exr", "room.paint"),
        ("groups.exr", GroupsFile, "groups.exr", "groups.paint"),
        ("--lights groups.exr", GroupsFile, "groups.exr", "groups.paint"),
        ("--lights groups.exr -o other", GroupsFile, "groups.exr", "other"),
    ],
)
@pytest.mark.usefixtures("work_folder")
def test_what_is_painted_and_where_it_is_kept(
    line: str, kind: type, path: str, folder: str | None
) -> None:
    values = painter_arguments(line)
    [source] = values["sources"]
    assert type(source) is kind
    assert source.path == path
    # Scenes that are called alike go by their folders.
    assert values["folder"] == Path(folder or f"{Path.cwd().name}.paint")


@pytest.mark.usefixtures("work_folder")
def test_the_command_for_what_is_exported_has_the_options_that_solve_has() -> None:
    line = "--new scene.xml -q --spp 8 --lock a=40% --port 0 -s 1 --no-browser --hold 0.5 -o x"
    line += " --layers my.ora"
    values = painter_arguments(f"{line} --group g=a,b* --view agx --host 127.0.0.1")
    words = ("--spp=8", "--lock=a=40%", "-s", "1", "--hold=0.5", "'--group=g=a,b*'")
    assert values["options"] == words
    arguments = ["solve", "scene.xml", "painting.exr", *shlex.split(" ".join(words))]
    options = command_parser().parse_args(arguments)
    assert settings_of(options, arguments).hold == values["settings"].hold == 0.5
    assert painter_arguments("--lights groups.exr --lock a")["options"] == ("--lock=a",)
    assert values["layers"] == Path("my.ora")
    assert (values["new"], values["port"], values["host"]) == (True, 0, "127.0.0.1")


@pytest.mark.usefixtures("work_folder")
def test_several_views_are_named_by_sensors_or_are_bases(make_basis: Any) -> None:
    values = painter_arguments("scene.xml --spp 8 -s a --sensor b")
    assert [(source.path, source.sensor) for source in values["sources"]] == [
        ("scene.xml", "a"),
        ("scene.xml", "b"),
    ]
    assert values["options"] == ("--spp=8",)
    paintings = {"a": "x/painting-a.exr", "b c": "x/painting-b c.exr"}
    command = command_for_paintings("scene.xml", paintings, values["options"], SessionRequests())
    words = shlex.split(command)[1:]
    options = command_parser().parse_args(words)
    assert options.views == list(paintings.items())
    basis = make_basis(2)
    write_basis("side.basis.exr", replace(basis, origin=replace(basis.origin, sensor="side")))
    values = painter_arguments("room.basis.exr side.basis.exr")
    assert values["folder"] == Path("room.paint")
    subjects = make_subjects(values["sources"], Path("x"))
    views = [
        (subject.basis.origin.sensor, subject.view_count) for subject in subjects if subject.basis
    ]
    assert views == [(basis.origin.sensor, 2), ("side", 2)]


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("room.basis.exr room.basis.exr", "a view is given twice"),
        ("room.basis.exr groups.exr", "several must be bases of the views of one scene"),
        ("scene.xml room.basis.exr", "for views of a scene repeat --sensor"),
        ("room.basis.exr -s a", "-s cannot change a saved basis|--sensor"),
        ("", "nothing to paint: give a scene, a basis, or light groups"),
        ("--lights key,fill", "no such file or folder of light groups: --lights key,fill"),
        ("scene.xml --lights groups.exr", "at once: give one to paint"),
        ("room.basis.exr --lights a", "chooses lights of a scene|--lights cannot"),
        ("room.basis.exr --spp 8", "--spp cannot change a saved basis"),
        ("groups.exr --seed 3", "--seed cannot be used with groups.exr"),
        ("room.basis.exr --lock lamp", "lamp"),
        ("none.basis.exr", "none.basis.exr"),
        ("room.basis.exr --layers none.ora", r"none\.ora"),
        ("room.basis.exr --layers room.basis.exr", "does not say what its layers mean"),
        ("room.basis.exr --port 70000", "70000"),
        ("room.basis.exr --rig a.mvr --positions", "--positions belongs to what is sent"),
        (f"room.basis.exr --rig {EXAMPLE}", "none of the lights has emitters, so that nothing"),
        ("room.basis.exr -o room.basis.exr", "cannot write"),
    ],
)
def test_what_cannot_be_painted_is_said_in_one_line(
    work_folder: Path, line: str, message: str
) -> None:
    assert re.search(message, run_refused(work_folder, "paint", *line.split(), "--no-browser"))


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("room.basis.exr --layers empty.ora", "empty.ora is damaged: the archive has no file"),
        ("room.xml --off lamp", "no light 'lamp'; there are panel, bulb, beam, sun, sky"),
        nightly("room.xml --layers empty.ora", "empty.ora is damaged: the archive has no file"),
        nightly("room.xml --sensor side", "has no sensor 'side'"),
        nightly("room.xml --resolution 7x3", "cannot be reduced to 7x3"),
        nightly("room.xml --split lamp=2x2", "no light 'lamp' to split"),
        nightly("empty.ora", "is not a scene"),
    ],
)
def test_a_mistake_that_files_show_is_said_before_there_is_an_address(
    work_folder: Path, line: str, message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(launch, "SLOW_S", PATIENCE_S)
    write_room(work_folder)
    (work_folder / "empty.ora").write_bytes(layered(None))
    arguments = *line.split(), "--no-browser", "--port", "0"
    assert message in run_refused(work_folder, "paint", *arguments)


def test_a_scene_that_takes_long_to_load_is_announced(
    work_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(launch, "SLOW_S", 0)
    write_room(work_folder)
    command = "paint room.xml --off lamp --no-browser --port 0"
    lines = run(work_folder, *command.split()).stderr.splitlines()
    assert lines[0] == "lightpaint: loading room; the address follows"
    assert "no light 'lamp'" in lines[-1]


@pytest.mark.usefixtures("work_folder")
def test_a_subject_of_light_groups_knows_them() -> None:
    subject = make_subject(painter_arguments("groups.exr")["sources"][0], Path("x"))
    assert subject.groups is not None
    assert subject.basis is subject.groups.basis
    assert subject.scene is None
    options = command_parser().parse_args(["paint", "groups.exr"])
    assert isinstance(painted_of(options)[0], GroupsFile)


#: `lightpaint …` where no renderer is installed.
WITHOUT = """
import sys
sys.modules["mitsuba"] = sys.modules["drjit"] = None
from lightpaint.cli import main
sys.exit(main(sys.argv[1:]))
"""


@contextmanager
def start_painting(folder: Path, *arguments: str) -> Iterator[tuple["subprocess.Popen[str]", str]]:
    """The process, and the address that it said."""
    command = [sys.executable, "-c", WITHOUT, "paint", *arguments, "--no-browser", "--port", "0"]
    process = subprocess.Popen(
        command,
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        preexec_fn=as_from_a_terminal,
    )
    with process:
        try:
            assert process.stdout is not None
            assert process.stderr is not None
            match = re.search(r"http://\S+", process.stdout.readline())
            assert match is not None, process.stderr.read()
            yield process, match[0]
        finally:
            process.kill()


def test_it_serves_until_it_is_told_to_end_and_keeps_the_session(
    work_folder: Path, make_basis: Any
) -> None:
    path = work_folder / "room.paint" / "session.db"
    with start_painting(work_folder, "room.basis.exr") as (process, url):
        assert url.startswith("http://127.0.0.1:")
        assert key_of(url)
        # Another process is told, and leaves it alone.
        refusal = run_refused(work_folder, "paint", "room.basis.exr", "--no-browser", "--port", "0")
        assert re.search(r"session.db is in use: .* folder \(-o\)$", refusal)
        process.send_signal(signal.SIGTERM)
        assert process.wait(timeout=PATIENCE_S) == 0
        assert process.stderr is not None
        errors = process.stderr.read()
        assert "Traceback" not in errors
        assert errors.endswith("the session is kept in room.paint\n")
    identity = Identity.of([make_basis(2)])
    with Store.open(path, identity) as store:
        store.append(Step("stroke", "mine"))
    with start_painting(work_folder, "room.basis.exr", "--new") as (process, _):
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=PATIENCE_S) == 0
        assert process.stderr is not None
        assert "the earlier session is kept as room.paint/session-1.db" in process.stderr.read()
    with Store.open(path.with_name("session-1.db"), identity) as store:
        assert [step.label for step in store.steps] == ["mine"]


def test_a_program_connects_by_one_line_or_by_a_file_of_its_owner(work_folder: Path) -> None:
    file = work_folder / "room.paint" / "painter.json"
    options = ("room.basis.exr", "--no-browser", "--port", "0", "--json")
    killed = ""
    for ends in (signal.SIGKILL, signal.SIGTERM):
        with subprocess.Popen(
            [sys.executable, "-m", "lightpaint", "paint", *options],
            cwd=work_folder,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        ) as process:
            try:
                assert process.stdout is not None
                announcement = json.loads(process.stdout.readline())
                assert announcement.keys() >= {"address", "token", "version", "protocol"}
                assert announcement["version"] == __version__
                with connect(
                    f"{announcement['address'].replace('http', 'ws')}live",
                    additional_headers={"Authorization": f"Bearer {announcement['token']}"},
                    max_size=None,
                ) as socket:
                    state = ask(socket, 0, "observe", version=VERSION)
                    if state["kind"] == "waiting":
                        state = from_frame(bytes(socket.recv(timeout=PATIENCE_S)))[0]
                    assert state["kind"] == "state"
                    names = [light["name"] for light in state["lights"]]
                    lights = {names[0]: [1.0, 1.0, 1.0]}
                    reply = ask(socket, 1, "propose", name="evening", lights=lights)
                    assert reply["looks"][-1]["is_proposal"]
                    assert ask(socket, 2, "undo")["kind"] == "failed"
                # That of the killed painter was replaced.
                connection = json.loads(file.read_text())
                assert connection == {key: announcement[key] for key in connection}
                assert connection["token"] != killed
                assert file.stat().st_mode & 0o777 == 0o600
                killed = connection["token"]
                process.send_signal(ends)
                process.wait(timeout=PATIENCE_S)
                assert process.stdout.read() == ""
            finally:
                process.kill()
        assert file.exists() == (ends == signal.SIGKILL)


@pytest.mark.nightly
def test_the_observer_of_the_document_hears_the_state(work_folder: Path) -> None:
    text = (Path(__file__).parents[2] / "docs" / "protocol.md").read_text(encoding="utf-8")
    [code] = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    with start_painting(work_folder, "room.basis.exr"):
        listening = [sys.executable, "-u", "-c", code]
        with subprocess.Popen(
            listening, cwd=work_folder, stdout=subprocess.PIPE, text=True
        ) as observer:
            try:
                assert observer.stdout is not None
                lines = iter(observer.stdout.readline, "")
                assert next(line for line in lines if not line.startswith("waiting")) == "state \n"
            finally:
                observer.kill()


@pytest.mark.nightly
@pytest.mark.parametrize("second", [signal.SIGINT, nightly(signal.SIGTERM)])
def test_who_asks_twice_for_the_end_gets_one(work_folder: Path, second: signal.Signals) -> None:
    with start_painting(work_folder, "room.basis.exr") as (process, url), connect_page(url):
        process.send_signal(signal.SIGINT)
        time.sleep(0.05)  # while the page is told
        process.send_signal(second)
        assert process.wait(timeout=PATIENCE_S) == 0
        assert process.stderr is not None
        errors = process.stderr.read()
    assert "Traceback" not in errors
    assert errors.endswith("the session is kept in room.paint\n")


def connect_page(url: str) -> ClientConnection:
    """The socket of a page that was opened at `url`."""
    base = url.partition("/#")[0]
    protocols = [Subprotocol(word) for word in offered(key_of(url))]
    address = f"{base.replace('http', 'ws')}/live"
    return connect(address, origin=Origin(base), subprotocols=protocols, max_size=None)


def ask(socket: ClientConnection, seq: int, kind: str, **fields: Any) -> dict[str, Any]:
    """Say something, and hear the answer to it; to `hello` the state when there is a picture."""
    arrays = {name: fields.pop(name) for name in ("image", "importance") if name in fields}
    message = RawMessage(kind, {"seq": seq, **fields}, arrays)
    socket.send(to_frame(message.content(), message.buffers()))
    while True:
        frame = socket.recv(timeout=PATIENCE_S)
        assert isinstance(frame, bytes)
        content, _ = from_frame(frame)
        if "size" in content if kind == "hello" else content.get("reply") == seq:
            return content


def greet(socket: ClientConnection) -> dict[str, Any]:
    return ask(socket, 0, "hello", version=VERSION)


def test_who_is_being_started_is_not_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C may come just then; Python refuses to wait for a thread that has not begun."""

    def interrupted(_: threading.Thread) -> None:
        raise KeyboardInterrupt

    threads = BackgroundThreads(lambda _: None)
    monkeypatch.setattr(threading.Thread, "start", interrupted)
    with pytest.raises(KeyboardInterrupt):
        threads.start(lambda: None, "x")
    threads.join_all()


def test_what_was_answered_is_there_after_a_kill(work_folder: Path) -> None:
    pixels = {"image": np.ones((2, 3, 3), np.float32), "importance": np.ones((2, 3), np.float32)}
    stroke = {"stroke": 1, "region": [0, 2, 0, 3], "is_final": True, "label": "mine"}
    with (
        start_painting(work_folder, "room.basis.exr") as (process, url),
        connect_page(url) as socket,
    ):
        assert greet(socket)["history"]["undo"] == []
        assert ask(socket, 1, "paint", **stroke, **pixels)["kind"] == "answer"
        process.kill()
        process.wait()
    with start_painting(work_folder, "room.basis.exr") as (_, url), connect_page(url) as socket:
        assert greet(socket)["history"]["undo"] == ["mine"]


@pytest.mark.nightly
def test_a_message_that_no_page_would_send_costs_its_sender_the_connection(
    work_folder: Path,
) -> None:
    with start_painting(work_folder, "room.basis.exr") as (_, url):
        with connect_page(url) as socket:
            greet(socket)
            socket.send(bytes(2**20 + 16 * 12 * 10 + 1))
            with pytest.raises(ConnectionClosedError) as closed:
                deque(socket, 0)
            assert closed.value.rcvd is not None
            assert closed.value.rcvd.code == 1009
        with connect_page(url) as socket:
            assert greet(socket)["kind"] == "state"
            assert socket.protocol.extensions == []  # nothing is compressed


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("host", "open_to"),
    [
        ("127.0.0.2", "programs of this machine, and nobody else, can reach"),
        nightly("0.0.0.0", "other machines can reach the painter at every address of this one"),
    ],
)
def test_a_host_is_told_what_it_means_and_a_closed_terminal_ends_it(
    work_folder: Path, host: str, open_to: str
) -> None:
    with start_painting(work_folder, "groups.exr", "--host", host) as (process, url):
        assert key_of(url)
        process.send_signal(signal.SIGHUP)
        assert process.wait(timeout=PATIENCE_S) == 0
        assert process.stderr is not None
        errors = process.stderr.read()
    assert open_to in errors
    is_risk = "anyone who has its address with the token can paint here" in errors
    assert is_risk == (host == "0.0.0.0")
    assert "Traceback" not in errors
    assert errors.endswith("the session is kept in groups.paint\n")


@pytest.mark.parametrize("host", ["", "no.such.name.invalid", "203.0.113.7"])
def test_a_host_that_this_machine_has_not_is_one_line(work_folder: Path, host: str) -> None:
    refusal = run_refused(work_folder, "paint", "room.basis.exr", "--no-browser", "--host", host)
    assert "give an address of this machine, 0.0.0.0 for all of them" in refusal


def test_a_page_that_cannot_be_bundled_is_one_line(
    work_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse() -> None:
        raise BundleError("paint/page/x.js: cannot bundle `export *`: write it as another export")

    monkeypatch.setattr("lightpaint.paint.server.page_server.page_files", refuse)
    completed = run(work_folder, "paint", "room.basis.exr", "--no-browser", "-q")
    assert completed.returncode == 2
    assert completed.stderr == (
        "lightpaint paint: the page cannot be served: paint/page/x.js: cannot bundle `export *`: "
        "write it as another export\n"
    )
    assert not (work_folder / "room.paint" / "painter.json").exists()


def test_a_session_of_another_basis_is_refused(work_folder: Path, make_basis: Any) -> None:
    folder = work_folder / "room.paint"
    Store.open(folder / "session.db", Identity.of([make_basis(2, (6, 5))])).close()
    refusal = run_refused(work_folder, "paint", "room.basis.exr", "--no-browser")
    assert "is a session of 5x6 pixels, and scene.xml has 10x12" in refusal
    assert "(-o)" in refusal
    assert "(--new)" in refusal
