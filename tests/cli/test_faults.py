"""What nobody foresaw is one line and a code of its own; what Mitsuba cannot render is an error."""

import errno
import os
import re
import stat
import subprocess
import sys
from pathlib import Path

import pytest
from command import run, run_refused
from renderer import REPOSITORY, write_room

import lightpaint as lp
from lightpaint.cli import dispatcher
from lightpaint.cli.crash_report import FAULT
from lightpaint.errors import AccessError, BasisError
from lightpaint.scene.runtime.mitsuba_errors import render_errors

#: A camera that no particle hits: it loads, and Mitsuba throws in the middle of the render.
SCENE = """<scene version="3.0.0">
    <integrator type="ptracer"/>
    <sensor type="orthographic"><film type="hdrfilm">
        <integer name="width" value="8"/><integer name="height" value="8"/>
    </film></sensor>
    <shape type="rectangle"><transform name="to_world"><translate z="3"/></transform></shape>
    <emitter type="point" id="lamp"/>
</scene>"""


@pytest.mark.parametrize("name", ["template", "basis"])
def test_a_scene_that_mitsuba_cannot_render_is_one_line(tmp_path: Path, name: str) -> None:
    (tmp_path / "flat.xml").write_text(SCENE, encoding="utf-8")
    line = run_refused(tmp_path, name, "flat.xml", "--spp", "2", "-o", "out.basis.exr", "-q")
    assert line.startswith(f"lightpaint {name}: Mitsuba cannot render flat.xml: ")
    assert "not implemented" in line
    assert "--integrator path" in line


def make_fail(monkeypatch: pytest.MonkeyPatch, error: Exception) -> None:
    def doctor(**_: object) -> None:
        raise error

    monkeypatch.setattr(dispatcher, "_command", lambda name: doctor)


def test_a_recursion_without_end_is_no_error_of_mitsuba() -> None:
    """RecursionError is a RuntimeError, as all that Mitsuba throws."""
    module_globals = {"__name__": "lightpaint.somewhere"}
    exec("def endless(): endless()", module_globals)
    with pytest.raises(RecursionError), render_errors(Path("room.xml")):
        module_globals["endless"]()  # type: ignore[operator]


def test_what_nobody_foresaw_has_a_code_a_line_and_a_private_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    make_fail(monkeypatch, KeyError("a\x1b[31m name\nof two lines"))
    completed = run(
        tmp_path, "doctor", "--json", XDG_STATE_HOME=str(tmp_path / "state"), HOME=str(tmp_path)
    )
    assert completed.returncode == FAULT == 70
    assert completed.stdout == ""
    [line] = completed.stderr.splitlines()
    assert line.startswith("lightpaint doctor: a bug in lightpaint: KeyError: ")
    assert "\x1b" not in line
    match = re.search(r"the details are in (.*\.txt)$", line)
    assert match is not None
    file = Path(match[1])
    assert tmp_path in file.parents
    assert stat.S_IMODE(file.stat().st_mode) == 0o600
    assert stat.S_IMODE(file.parent.stat().st_mode) == 0o700
    details_text = file.read_text(encoding="utf-8")
    assert "Traceback" in details_text
    assert "'doctor', '--json'" in details_text
    assert "raise error" in details_text
    assert "\x1b" not in details_text


def test_too_little_memory_is_no_fault(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    make_fail(monkeypatch, MemoryError("Unable to allocate 12 GiB"))
    line = run_refused(tmp_path, "doctor")
    assert "more memory than there is" in line
    assert "--resolution 1/2" in line


@pytest.mark.parametrize("kind", ["ImportError", "NameError", "RuntimeError"])
def test_half_a_mitsuba_neither_is_called_missing_nor_aborts(tmp_path: Path, kind: str) -> None:
    """With too little memory its extension module starts in part, and Python's end aborts."""
    (tmp_path / "mitsuba.py").write_text(
        f"import atexit, os\natexit.register(os.abort)\nraise {kind}('an error while starting')"
    )
    scene = write_room(tmp_path)
    command = [sys.executable, "-m", "lightpaint", "lights", str(scene)]
    path = os.pathsep.join([str(tmp_path), str(REPOSITORY)])
    environment = {**os.environ, "PYTHONPATH": path}
    completed = subprocess.run(
        command, capture_output=True, text=True, env=environment, check=False
    )
    assert completed.returncode == 2, completed.stderr
    [line] = completed.stderr.splitlines()
    assert "Mitsuba is installed and cannot start (an error while starting)" in line


def test_where_nothing_can_be_written_it_is_one_line_still(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    make_fail(monkeypatch, ZeroDivisionError())
    monkeypatch.setattr("lightpaint.cli.crash_report._folders", lambda: [Path("/dev/null/logs")])
    completed = run(tmp_path, "doctor")
    assert completed.returncode == FAULT
    [line] = completed.stderr.splitlines()
    assert line.endswith("bug in lightpaint: ZeroDivisionError; the details could not be written")


def test_a_fault_before_there_is_a_command_is_told_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken() -> None:
        raise ImportError("half an installation")

    monkeypatch.setattr(dispatcher, "command_parser", broken)
    completed = run(tmp_path, "doctor", XDG_STATE_HOME=str(tmp_path), HOME=str(tmp_path))
    assert completed.returncode == FAULT
    assert "lightpaint: a bug in lightpaint: ImportError: half an inst" in completed.stderr
    assert len(completed.stderr.splitlines()) == 1


#: Commands with a path X of a name that no system takes.
LONG_NAMES = (
    "template --lights X.exr",
    "solve --lights X.exr p.exr",
    "verify X",
    "blender -o X.zip",
    "template room.xml -o X",
    "basis room.xml -o X.basis.exr",
    "paint X.xml --no-browser -o session.paint",
)


@pytest.mark.parametrize("line", LONG_NAMES)
def test_names_that_no_system_takes_are_one_line(tmp_path: Path, line: str) -> None:
    write_room(tmp_path)
    message = run_refused(tmp_path, *line.replace("X", "x" * 300).split())
    assert "name too long" in message.lower()


def test_the_library_refuses_such_names_too() -> None:
    for read in (lp.read_light_groups, lp.find_frames, lp.read_basis, lp.read_target):
        with pytest.raises(lp.LightpaintError):
            read("x" * 300)
    with pytest.raises(AccessError, match=r"cannot use x+…: File name too long") as refusal:
        lp.read_light_groups("x" * 300)
    assert isinstance(refusal.value, OSError)  # for those who expect that


@pytest.mark.parametrize("pattern", ["", "/", ".", "..", "%99999999999d.exr", "shot.exr"])
def test_what_is_no_pattern_of_frames_is_refused(pattern: str) -> None:
    with pytest.raises(BasisError, match="the sign stands for the number"):
        lp.find_frames(pattern)


def test_no_room_for_a_thread_or_a_library_is_no_bug(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for error in (
        RuntimeError("can't start new thread"),
        RuntimeError("can't allocate read lock"),
        ImportError("libscipy_openblas.so: failed to map segment from shared object"),
    ):
        make_fail(monkeypatch, error)
        assert "needs more memory than there is" in run_refused(tmp_path, "doctor")
    make_fail(monkeypatch, OSError(errno.ENOSPC, "No space left on device", "a"))
    assert "cannot use a: No space left" in run_refused(tmp_path, "doctor")
