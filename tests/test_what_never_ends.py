"""A path that leads to no file, or to one without an end: one line, at once."""

import errno
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import nullcontext
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
import pytest
from command import run_refused, succeed
from patience import PATIENCE_S
from renderer import write_room

from lightpaint import files
from lightpaint.basis.file.basis_file import write_basis
from lightpaint.errors import PaintError, SceneError
from lightpaint.images.formats.exr import write_rgb
from lightpaint.paint.store.session_file import Store
from lightpaint.paint.store.stored_arrays import read_kept_looks

#: Seconds that a refusal may take; Mitsuba starts in them.
AT_ONCE = 60

#: What a path may be: a pipe, devices, what a kernel makes up, a folder, a terabyte of nothing.

REQUESTS = {
    "pipe": "is a device or a pipe",
    "/dev/zero": "is a device or a pipe",
    "/proc/kmsg": "is made up by the system as it is read",
    "/proc/kpagecount": "is made up by the system as it is read",
    "folder": "folder",
    "sparse": "",
}

#: Commands with a path X, its ending, and what else it may be taken for than a file.
COMMANDS = {
    "lights": ("lights --no-sheet X", ".xml"),
    "basis": ("basis X", ".xml"),
    "template": ("template X", ".xml"),
    "scene": ("solve X painting.exr", ".xml"),
    "saved basis": ("solve X painting.exr", ".basis.exr"),
    "painting": ("solve b.basis.exr X -o out", ".png"),
    "painted EXR": ("solve b.basis.exr X -o out", ".exr"),
    "layered": ("solve b.basis.exr X -o out", ".kra"),
    "mask": ("solve b.basis.exr painting.exr --mask X", ".png"),
    "lights file": ("lights --no-sheet room.xml --lights-file X", ".toml"),
    "its constraints": ("solve b.basis.exr painting.exr --lights-file X", ".toml"),
    "lighting": ("relight room.xml X", ".json"),
    "groups": ("solve painting.exr --lights X", ".exr"),
}


@pytest.fixture(autouse=True)
def _at_once() -> Iterator[None]:
    """A test that waits for ever fails."""

    def waited(_signal: int, _frame: FrameType | None) -> None:
        raise AssertionError("it waits")

    before = signal.signal(signal.SIGALRM, waited)
    signal.alarm(AT_ONCE)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


@pytest.fixture
def folder(tmp_path: Path, make_basis: Any) -> Path:
    basis = make_basis(2)
    write_basis(tmp_path / "b.basis.exr", basis)
    write_rgb(tmp_path / "painting.exr", basis.images.sum(axis=0))
    write_room(tmp_path)
    return tmp_path


def made(path: Path, kind: str) -> None:
    """`kind` at `path`."""
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "folder":
        path.mkdir()
    elif kind == "sparse":
        with path.open("wb") as file:
            file.truncate(2**40)
    elif not Path(kind).exists():
        pytest.skip(kind)
    else:
        path.symlink_to(kind)


def each_with_some(paths: Sequence[str]) -> list[Any]:
    """Return every path with every kind, of which most are for the night.

    By day each meets what never answers, what never ends, and one of the other kinds in turn.
    """
    others = [kind for kind in REQUESTS if kind not in ("pipe", "sparse")]
    by_day = [("pipe", "sparse", others[n % len(others)]) for n in range(len(paths))]
    return [
        pytest.param(path, kind, marks=() if kind in kinds else pytest.mark.nightly)
        for path, kinds in zip(paths, by_day, strict=True)
        for kind in REQUESTS
    ]


@pytest.mark.parametrize(("command", "kind"), each_with_some(list(COMMANDS)))
def test_every_path_of_a_command(folder: Path, command: str, kind: str) -> None:
    line, ending = COMMANDS[command]
    made(folder / f"x{ending}", kind)
    message = run_refused(folder, *line.replace("X", f"x{ending}").split())
    assert f"x{ending}" in message
    # A folder may hold light groups, too.
    others = ("EXR", ".exr file") if kind == "folder" else ("holds no light groups",)
    assert any(words in message for words in (REQUESTS[kind], *others))


#: Elements of a scene that name a file, and how its name ends.
ELEMENTS = {
    '<include filename="X"/>': ".xml",
    '<bsdf type="diffuse"><spectrum name="reflectance" filename="X"/></bsdf>': ".spd",
    '<texture type="bitmap"><string name="filename" value="X"/></texture>': ".png",
    '<emitter type="envmap"><string name="filename" value="X"/></emitter>': ".exr",
    '<shape type="ply"><string name="filename" value="X"/></shape>': ".ply",
    '<shape type="obj"><string name="filename" value="X"/></shape>': ".obj",
    '<shape type="serialized"><string name="filename" value="X"/></shape>': ".serialized",
}


@pytest.mark.parametrize(("element", "kind"), each_with_some(list(ELEMENTS)))
def test_every_file_of_a_scene(folder: Path, element: str, kind: str) -> None:
    ending = ELEMENTS[element]
    made(folder / f"x{ending}", kind)
    room = folder / "room.xml"
    text = room.read_text(encoding="utf-8")
    element = element.replace("X", f"x{ending}")
    room.write_text(text.replace("</scene>", f"{element}</scene>"), encoding="utf-8")
    message = run_refused(folder, "lights", room)
    assert f"x{ending}" in message
    assert REQUESTS[kind] in message


def test_beside_the_scene_and_in_a_template(folder: Path) -> None:
    (folder / "room.lights.toml").symlink_to("/proc/kmsg")
    (folder / "template").mkdir()
    (folder / "template" / "template.json").symlink_to("/proc/kmsg")
    message = run_refused(folder, "solve", "b.basis.exr", "painting.exr", "-o", "out")
    assert "template.json" in message
    for kind in ("pipe", "folder"):
        (folder / "template" / "template.json").unlink()
        made(folder / "template" / "template.json", kind)
        message = run_refused(folder, "solve", "b.basis.exr", "painting.exr", "-o", "out")
        assert "template.json is a " in message


@pytest.mark.parametrize(
    ("kind", "message"),
    [
        ("pipe", "is a device or a pipe, not a lights file"),
        ("folder", "is a folder, not a lights file"),
        ("nowhere", "no such lights file: "),
    ],
)
def test_what_has_the_name_of_a_lights_file_is_none_that_is_absent(
    folder: Path, kind: str, message: str
) -> None:
    """A link that leads nowhere, as after a move, would silently free all lights."""
    place = folder / "room.lights.toml"
    if kind == "nowhere":
        place.symlink_to("moved.lights.toml")
    else:
        made(place, kind)
    refusal = run_refused(folder, "lights", "--no-sheet", "room.xml")
    assert message in refusal
    assert "room.lights.toml" in refusal


class HalfWay:
    """A file of which the beginning has been read."""

    def __init__(self, read: Callable[..., Any]) -> None:
        self.read = read

    def __enter__(self) -> None: ...

    def __exit__(self, *_: object) -> None: ...


def test_a_drive_that_does_not_answer(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither where it is asked what there is, nor where it is read, at once or half-way."""
    room = folder / "room.xml"
    open_again, awake, asleep = threading.Event(), threading.Semaphore(0), 0
    monkeypatch.setattr(files, "FILE_TIMEOUT_S", 0.05)

    def sleeps(*_: object) -> Any:
        nonlocal asleep
        asleep += 1
        open_again.wait(AT_ONCE)
        awake.release()
        return nullcontext()

    half_way = HalfWay(sleeps)

    for stubs in (
        {"_stat": sleeps},
        {"_is_sparse": sleeps},
        {"_open": sleeps},
        {"_is_sparse": lambda *_: False, "_open": sleeps},
        {
            "_is_sparse": lambda *_: False,
            "_read_first_chunk": lambda _: (half_way, bytes(files.CHUNK)),
        },
    ):
        with monkeypatch.context() as patch:
            for name, stub in stubs.items():
                patch.setattr(files, name, stub)
            start_s = time.monotonic()
            with pytest.raises(SceneError, match=r"cannot read .*room\.xml: no answer within"):
                files.read_text(room, "scene file", SceneError)
            assert time.monotonic() - start_s < PATIENCE_S
    assert asleep == 5
    open_again.set()
    for _ in range(asleep):
        assert awake.acquire(timeout=PATIENCE_S)


def test_a_process_does_not_wait_for_such_a_drive_at_its_end() -> None:
    code = (
        "from threading import Event\nfrom lightpaint.files import call_with_timeout\n"
        "call_with_timeout(Event().wait, 0.05)"
    )
    command = [sys.executable, "-c", code]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, check=False)
    assert "TimeoutError: [Errno 110] no answer within 0.05 s" in ended.stderr


def test_a_thread_without_memory_for_its_first_step(monkeypatch: pytest.MonkeyPatch) -> None:
    """Python's own `Thread.start` would wait for ever."""
    monkeypatch.setattr(files, "THREAD_START_S", 0.05)
    monkeypatch.setattr(files._thread, "start_new_thread", lambda *_: 1)
    with pytest.raises(RuntimeError, match="can't start new thread"):
        files.call_with_timeout(lambda: 0, PATIENCE_S)


@pytest.mark.parametrize("ending", [".ply", ".obj", ".serialized", ".png", ".exr"])
def test_a_long_file_of_nearly_nothing(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"x{ending}"
    with path.open("wb") as file:
        file.write(b"ply\nformat ascii 1.0\nelement vertex 3\n")
        file.truncate(2**32 - 10)
    with pytest.raises(SceneError, match="nearly all of it was never written"):
        files.file_length(path, "file to read", SceneError, limit=2**32)
    # One that has holes, and is mostly there, is a file like any other.
    with path.open("wb") as file:
        file.seek(2**26)
        file.write(bytes(2**20))
    assert files.file_length(path, "file to read", SceneError, limit=2**32) == 2**26 + 2**20


def test_what_goes_wrong_in_time_is_told_as_ever(tmp_path: Path) -> None:
    def fails() -> None:
        raise OSError(errno.EIO, "broken")

    with pytest.raises(OSError, match="broken"):
        files._call_in_time(fails)
    assert files._call_in_time(lambda: np.pi) == np.pi


def test_files_that_are_read_as_they_were(tmp_path: Path) -> None:
    path = tmp_path / "a"
    for size in (1, 2, files.CHUNK, files.CHUNK + 1):
        path.write_bytes(b"x" * size)
        assert files.read_bytes(path, "file", SceneError) == b"x" * size
    with pytest.raises(SceneError, match="bytes long"):
        files.read_bytes(path, "file", SceneError, limit=files.CHUNK)
    path.write_bytes(b"")
    assert files.read_bytes(path, "file", SceneError, may_be_empty=True) == b""
    with pytest.raises(SceneError, match=r"a is empty: expected a file$"):
        files.file_length(path, "file", SceneError)


@pytest.mark.parametrize("kind", ["pipe", "sparse", "/dev/zero"])
def test_a_session_that_is_none(tmp_path: Path, kind: str) -> None:
    """A copy of one, to recover it, would fill the disk."""
    made(tmp_path / "session.db", kind)
    with pytest.raises(PaintError, match=r"session\.db is .*, (?:not a|and nearly all|so it)"):
        Store.open(tmp_path / "session.db", None)
    with pytest.raises(PaintError, match=r"session\.db"):
        read_kept_looks(tmp_path / "session.db")


def test_a_tag_of_the_cache_that_is_none(folder: Path) -> None:
    """Its folder is foreign then, as one without a tag is."""
    (folder / "kept").mkdir()
    made(folder / "kept" / "CACHEDIR.TAG", "pipe")
    succeed(folder, "cache", "list", LIGHTPAINT_CACHE=str(folder / "kept"))
