"""What goes to the terminal: nothing in a file steers it, or passes for a line of its own."""

import json
import re
import sys
from pathlib import Path
from typing import Any

import pytest
from command import run, run_refused, spawn, succeed
from renderer import write_room
from rich.markup import escape

from lightpaint.basis.cache import basis_cache
from lightpaint.basis.file.basis_file import write_basis
from lightpaint.cli.output import lines, terminal
from lightpaint.display_text import some_names, visible
from lightpaint.images.formats.exr import write_rgb
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.lighting.answer.lighting_file import write_lighting

#: A name that colours, erases, breaks the line, turns the reading order, and speaks rich's markup.
BAD = "b\x1b[2J\x1b[31m\r\n\t\x7f\x9b\u202e\u2066\u2028\u200b[red]c[/red][/]\\"
SHOWN = r"b\x1b[2J\x1b[31m\r\n\t\x7f\x9b\u202e\u2066\u2028\u200b[red]c[/red][/]" + "\\"

#: What may not reach a terminal.
STEERS = re.compile(
    r"[\x00-\x09\x0b-\x1f\x7f-\x9f\u061c\u200b\u200e\u200f\u2028-\u202e\u2066-\u2069]"
)


def write_room_with_bulb(folder: Path, name: str) -> Path:
    """The small room, its bulb called `name`."""
    path = write_room(folder)
    escaped_name = "".join(f"&#{ord(c)};" for c in name)
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace('id="bulb"', f'id="{escaped_name}"'), encoding="utf-8")
    return path


def test_what_is_seen_is_left_alone() -> None:
    plain = "Größe 灯 👩\u200d🚀 می\u200cخواهم a\\b [x] \u00a0 é e\u0301"
    assert visible(plain) == plain
    assert visible(BAD) == SHOWN
    for code in range(0x110000):
        visible_text = visible(chr(code))
        assert visible_text == chr(code) or visible_text.isascii()
        assert not STEERS.search(visible_text)
        visible_text.encode()  # halves of surrogate pairs, too


def test_lists_are_cut_with_a_count() -> None:
    assert some_names(["a", "b"]) == "a, b"
    assert some_names([]) == ""
    names = [f"light_{k}" for k in range(30_000)]
    cut_list = some_names(names)
    assert len(cut_list) < 400
    listed_names = cut_list.split(", ")
    assert listed_names[:-1] == names[: len(listed_names) - 1]
    assert listed_names[-1] == f"… and {30_000 - len(listed_names) + 1} more"
    assert some_names(["x" * 10**6, "y"]).startswith("x" * 100)
    assert len(some_names(["x" * 10**6, "y"])) < 400


def test_lights_and_errors(tmp_path: Path) -> None:
    room = write_room_with_bulb(tmp_path, BAD.replace("\0", ""))
    output = succeed(tmp_path, "lights", room, "--no-sheet")
    assert SHOWN in output
    assert not STEERS.search(output)
    assert len(output.splitlines()) == 6
    listed = json.loads(succeed(tmp_path, "lights", room, "--json"))["lights"]
    assert listed[1]["name"] == BAD
    assert not STEERS.search(succeed(tmp_path, "lights", room, "--json"))
    refusal = run_refused(tmp_path, "lights", room, "--lights", "nope\x1b[1m")
    assert r"no light 'nope\x1b[1m'" in refusal
    assert SHOWN in refusal
    assert not STEERS.search(refusal)


@pytest.mark.parametrize("command", ["lights", "basis", "template", "solve", "relight", "verify"])
def test_paths_and_options(tmp_path: Path, command: str) -> None:
    for line in ([f"no\n{BAD}.xml", f"{BAD}.png"], [f"--{BAD}", "a", "b"], ["a.xml", "--spp", BAD]):
        refusal = run_refused(tmp_path, command, *line)
        assert not STEERS.search(refusal)
        assert r"\x1b[31m" in refusal or "not a whole number" in refusal


def test_a_path_that_is_no_unicode(tmp_path: Path) -> None:
    refusal = run_refused(tmp_path, "lights", "a\udcff\x1b.xml")
    assert r"a\udcff\x1b.xml" in refusal


def test_the_cache_and_solve(tmp_path: Path, make_basis: Any) -> None:
    basis = make_basis(2, names=["a", BAD.replace("\0", "")])
    folder = tmp_path / "cache"
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("LIGHTPAINT_CACHE", str(folder))
        assert basis_cache.keep(basis)
    completed = run(tmp_path, "cache", "list", LIGHTPAINT_CACHE=str(folder))
    assert completed.returncode == 0
    assert not STEERS.search(completed.stdout)
    write_basis(tmp_path / "b.basis.exr", basis)
    write_rgb(tmp_path / "p.exr", basis.images.sum(axis=0))
    completed = run(tmp_path, "solve", "b.basis.exr", "p.exr", "-o", "out")
    assert completed.returncode == 0, completed.stderr
    assert SHOWN[:20] in completed.stdout
    assert not STEERS.search(completed.stdout + completed.stderr)
    full = ("--table", "full")
    completed = run(tmp_path, "solve", "b.basis.exr", "p.exr", "-o", "again", *full)
    assert SHOWN in completed.stdout
    assert not STEERS.search(completed.stdout + completed.stderr)


def test_relight_of_names_that_steer(tmp_path: Path, make_basis: Any) -> None:
    lighting = Lighting.current(make_basis(2, names=["a", BAD])).for_target("evening")
    write_lighting(tmp_path / "l.json", lighting)
    refusal = run_refused(tmp_path, "relight", write_room(tmp_path), "l.json")
    assert SHOWN in refusal
    assert not STEERS.search(refusal)


@pytest.mark.nightly
def test_thousands_of_names_are_not_repeated(tmp_path: Path, make_basis: Any) -> None:
    names = [f"light_{k}" for k in range(3000)]
    basis = make_basis(images=[[[[1.0] * 3]]] * 3000, names=names)
    write_lighting(tmp_path / "l.json", Lighting.current(basis).for_target("evening"))
    refusal = run_refused(tmp_path, "relight", write_room(tmp_path), "l.json")
    assert "more that the scene does not have" in refusal
    assert len(refusal) < 1000


def test_progress_and_remarks_on_a_terminal(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    monkeypatch.setenv("TERM", "dumb")
    with terminal.TerminalListener() as listen:
        listen(f"basis of {BAD}", 0, 2)
        listen(f"basis of {BAD}", 1, 2)
        assert listen._bars is not None
        [task] = listen._bars.tasks
        assert task.description == f"basis of {SHOWN}"
        listen.say(f"remark on {BAD}")
    assert f"remark on {SHOWN}" in capfd.readouterr().err.replace("\n", "")
    listen(f"basis of {BAD}", 0, 2)
    assert capfd.readouterr().err == f"basis of {SHOWN}: 2 passes\n"


@pytest.mark.parametrize(
    ("count", "unit", "line"),
    [(1, "passes", "1 pass"), (1, "ranges of rows", "1 range of rows"), (2, "parts", "2 parts")],
)
def test_one_thing_is_no_plural(
    count: int, unit: str, line: str, capfd: pytest.CaptureFixture[str]
) -> None:
    terminal.TerminalListener()("basis", 0, count, unit)
    assert capfd.readouterr().err == f"basis: {line}\n"


def test_an_interrupted_listener_shows_no_more_progress(capfd: pytest.CaptureFixture[str]) -> None:
    """A thread that was in the middle of a step reports it after the command has said its last."""
    listen = terminal.TerminalListener()
    with pytest.raises(KeyboardInterrupt), listen:
        raise KeyboardInterrupt
    listen("basis", 0, 2)
    assert capfd.readouterr().err == ""
    with listen:
        listen("basis", 0, 2)
    listen("solving", 0, 2)
    assert capfd.readouterr().err == "basis: 2 passes\nsolving: 2 passes\n"


def test_each_worker_has_a_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    monkeypatch.setenv("TERM", "dumb")

    def lines_of(listen: terminal.TerminalListener) -> list[str]:
        assert listen._bars is not None
        return [task.description for task in listen._bars.tasks if task.visible]

    with terminal.TerminalListener() as listen:
        listen.at_work("worker 1", f"{BAD}: answer")
        listen.at_work("worker 2", "night: answer")
        assert lines_of(listen) == [f"worker 1: {SHOWN}: answer", "worker 2: night: answer"]
        listen.at_work("worker 1", None)
        listen.at_work("worker 2", "dawn: answer")
        assert lines_of(listen) == ["worker 2: dawn: answer"]
        for k in range(3, 20):
            listen.at_work(f"worker {k}", "dusk: answer")
        assert len(lines_of(listen)) == terminal.MAX_WORKER_LINES + 1
        assert lines_of(listen)[-1] == "and 10 more at work"
        for k in range(2, 20):
            listen.at_work(f"worker {k}", None)
        assert lines_of(listen) == []
    listen.at_work("worker 1", "night: answer")  # in a log nothing is said of it


def test_markup_of_rich_is_text(capfd: pytest.CaptureFixture[str]) -> None:
    table = terminal.table("name")
    table.row(escape("[red]x[/red]") + "[/blue]")
    terminal.print_table(table)
    assert capfd.readouterr().out.splitlines()[1] == r"\[red]x\[/red][/blue]"


def test_a_line_of_stderr_has_an_end(capfd: pytest.CaptureFixture[str]) -> None:
    lines.err("x" * 10**7)
    assert len(capfd.readouterr().err) < 5000


def test_a_fault_of_its_own_is_one_line_and_steers_nothing(tmp_path: Path) -> None:
    (tmp_path / "sitecustomize.py").write_text(
        "import lightpaint.cli.commands.program_commands as c\n"
        "def fails(**_): raise RuntimeError('\\x1b[2J told')\n"
        "c.doctor = fails\n"
    )
    path = ":".join([str(tmp_path), *filter(None, sys.path)])
    completed = spawn(tmp_path, "doctor", PYTHONPATH=path, XDG_STATE_HOME=str(tmp_path))
    assert completed.returncode == 70
    assert len(completed.stderr.splitlines()) == 1
    assert r"RuntimeError: \x1b[2J told" in completed.stderr
    assert not STEERS.search(completed.stderr)
