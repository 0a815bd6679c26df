"""Ctrl-C and kill -9 in the middle of real processes: nothing lost, nothing mixed."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from command import as_from_a_terminal
from nightly import nightly
from patience import PATIENCE_S
from renderer import CORNELL, LIGHTS, PATH, assert_equal_bits, write_room

from lightpaint.basis.cache.cached_render import obtain_basis
from lightpaint.basis.file.basis_file import read_basis
from lightpaint.basis.light_basis import Basis
from lightpaint.basis.render.rendered_basis import ONE_PASS, SEPARATE
from lightpaint.scene.scene_reader import load_scene

SEPARATELY = '<integrator type="volpathmis"><integer name="max_depth" value="5"/></integrator>'
INTEGRATORS = {ONE_PASS: PATH, SEPARATE: SEPARATELY}

#: Samples per pixel: dozens of passes, and seconds of work where it goes slowly.
SPP = {ONE_PASS: 1200, SEPARATE: 250}

#: `lightpaint …` with passes of a hundredth of a second, each of which is kept.
MAIN = """
import os, sys, time
import lightpaint.basis.render.render_budget as budget, lightpaint.scene.scene_render as render
from lightpaint.cli import main
budget.KEEP_EVERY_S, render.SAMPLES_PER_PASS = 0, 2**15
if "SLOWLY" in os.environ:
    # However fast the machine is, there is a middle to be stopped in.
    keep = budget.Keeper.now_and_then
    budget.Keeper.now_and_then = lambda *a: (time.sleep(0.25), keep(*a))
sys.exit(main(sys.argv[1:]))
"""


def start(
    folder: Path, room: Path, spp: int, cache: str, **environment: str
) -> "subprocess.Popen[str]":
    arguments = ["basis", room, "--spp", spp, "-o", f"{cache}.exr"]
    return subprocess.Popen(
        [sys.executable, "-c", MAIN, *map(str, arguments)],
        cwd=folder,
        env={**os.environ, "LIGHTPAINT_CACHE": str(folder / cache), **environment},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=as_from_a_terminal,
    )


def kept_bases(folder: Path, cache: str) -> list[Path]:
    return list((folder / cache).glob("*.basis.exr"))


def basis_versions(folder: Path, cache: str) -> list[tuple[int, int]]:
    """Which file has the basis that is kept; nothing where there is none.

    Each one that is written is another file, while a time also changes when a basis is found.
    """
    return [(path.stat().st_ino, path.stat().st_size) for path in kept_bases(folder, cache)]


def samples(basis: Basis) -> int:
    """Samples per pixel of all lights together."""
    sample_counts = basis.origin.each_light or ((*basis.origin.halves, 0, 0),) * len(basis.lights)
    return sum(a + b for a, b, _, _ in sample_counts)


def three_lights(folder: Path, method: str) -> Path:
    """A room that is rendered by this method."""
    lights = LIGHTS["panel"] + LIGHTS["bulb"] + LIGHTS["sun"]
    return write_room(folder, lights=lights, integrator=INTEGRATORS[method])


@pytest.fixture(scope="module", params=[ONE_PASS, nightly(SEPARATE)])
def uninterrupted(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[str, Path, Basis]:
    """(method, a room, the basis that nothing interrupted)."""
    method, folder = str(request.param), tmp_path_factory.mktemp("whole")
    room = three_lights(folder, method)
    with start(folder, room, SPP[method], "whole") as process:
        assert process.wait(timeout=PATIENCE_S) == 0
    return method, room, read_basis(folder / "whole.exr")


@pytest.mark.parametrize(
    "signals",
    [
        nightly((signal.SIGINT, signal.SIGKILL)),
        nightly((signal.SIGKILL,)),
        nightly((signal.SIGKILL, signal.SIGINT)),
        nightly((signal.SIGINT,) * 2),
    ],
)
def test_stopped_and_gone_on_is_as_if_never_stopped(
    tmp_path: Path, uninterrupted: tuple[str, Path, Basis], signals: tuple[signal.Signals, ...]
) -> None:
    method, room, reference = uninterrupted
    spp, samples_done = SPP[method], 0
    for number in signals:
        before = basis_versions(tmp_path, "stopped")
        with start(tmp_path, room, spp, "stopped", SLOWLY="yes") as process:
            assert process.stderr is not None
            while not process.stderr.readline().startswith("basis"):
                assert process.poll() is None
            # Something new is kept, and more is on its way.
            while basis_versions(tmp_path, "stopped") in ([], before):
                assert process.poll() is None
                time.sleep(0.01)
            time.sleep(0.3)
            assert process.poll() is None
            stopped_s = time.monotonic()
            process.send_signal(number)
            errors = process.stderr.read()
            code = process.wait(timeout=PATIENCE_S)
        if number == signal.SIGINT:
            assert time.monotonic() - stopped_s < 3
            assert code == 130
            *remarks, line = errors.splitlines()
            assert line.startswith("lightpaint basis: interrupted")
            assert line.endswith("are kept; run the same command to continue")
            # Where that takes more than a minute, it has been said.
            assert all(x.startswith("lightpaint: rendering takes") for x in remarks)
        [path] = kept_bases(tmp_path, "stopped")
        part = read_basis(path)
        assert part.origin.method == method
        # Nothing of what was kept is lost, and there is more to do.
        assert samples_done < samples(part) < spp * len(part.lights)
        samples_done = samples(part)
        if number == signal.SIGINT and method == ONE_PASS:
            assert f"{part.origin.spp} of {spp}" in errors
    assert {p.name for p in tmp_path.iterdir()} == {"stopped"}

    # The same command goes on.
    with start(tmp_path, room, spp, "stopped") as process:
        assert process.wait(timeout=PATIENCE_S) == 0
    stopped = read_basis(tmp_path / "stopped.exr")
    assert stopped.origin.spp == spp
    assert_equal_bits(stopped, reference)
    assert len(kept_bases(tmp_path, "stopped")) == 1


@pytest.mark.parametrize(
    ("method", "number", "delay_s"),
    [
        (ONE_PASS, signal.SIGINT, 0),
        nightly(ONE_PASS, signal.SIGTERM, 0.1),
        nightly(ONE_PASS, signal.SIGHUP, 0.1),
        nightly(SEPARATE, signal.SIGINT, 0.1),
        nightly(ONE_PASS, signal.SIGINT, 0.1),
        nightly(SEPARATE, signal.SIGINT, 0),
        nightly(SEPARATE, signal.SIGTERM, 0.1),
        nightly(SEPARATE, signal.SIGHUP, 0.1),
    ],
)
def test_interrupted_before_much_is_done(
    tmp_path: Path,
    tmp_path_factory: pytest.TempPathFactory,
    method: str,
    number: signal.Signals,
    delay_s: float,
) -> None:
    room = three_lights(tmp_path_factory.mktemp("room"), method)
    with start(tmp_path, room, 1_000_000, "cache") as process:
        assert process.stderr is not None
        while not process.stderr.readline().startswith("basis"):
            assert process.poll() is None
        time.sleep(delay_s)
        process.send_signal(number)
        errors = process.stderr.read()
        assert process.wait(timeout=PATIENCE_S) == 128 + number
    assert errors.startswith("lightpaint basis: interrupted")
    assert errors.count("\n") == 1
    assert len(kept_bases(tmp_path, "cache")) == ("are kept" in errors)
    assert {p.name for p in tmp_path.iterdir()} <= {"cache"}


#: `lightpaint …` that gets a signal just when it imports a module for the first time.
AT_IMPORT = """
import os, sys
module, number = sys.argv.pop(1), int(sys.argv.pop(1))
class Finder:
    def find_spec(self, name, path=None, target=None):
        if name == module:
            sys.meta_path.remove(self)
            os.kill(os.getpid(), number)
sys.meta_path.insert(0, Finder())
from lightpaint.cli import main
sys.exit(main())
"""


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("module", "number"),
    [
        ("lightpaint.cli.options.parser", signal.SIGINT),
        ("lightpaint.cli.commands.render_commands", signal.SIGTERM),
        ("numpy", signal.SIGINT),
        ("mitsuba", signal.SIGINT),
    ],
)
def test_interrupted_while_it_imports(tmp_path: Path, module: str, number: signal.Signals) -> None:
    arguments = [module, str(int(number)), "lights", str(CORNELL)]
    completed = subprocess.run(
        [sys.executable, "-c", AT_IMPORT, *arguments],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert completed.returncode == 128 + number
    assert completed.stderr in ("lightpaint: interrupted\n", "lightpaint lights: interrupted\n")
    assert completed.stdout == ""


def _ignoring(*numbers: signal.Signals) -> None:
    for number in numbers:
        signal.signal(number, signal.SIG_IGN)


@pytest.mark.nightly
def test_what_a_script_starts_in_its_background_hears_ctrl_c(tmp_path: Path) -> None:
    """Its shell has it ignored; what `nohup` has ignored stays ignored."""
    room = write_room(tmp_path, lights=LIGHTS["bulb"])
    command = [sys.executable, "-m", "lightpaint", "basis", str(room), "--spp", "1000000"]
    with subprocess.Popen(
        command,
        cwd=tmp_path,
        env={**os.environ, "LIGHTPAINT_CACHE": str(tmp_path / "cache")},
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: _ignoring(signal.SIGINT, signal.SIGHUP),
    ) as process:
        assert process.stderr is not None
        while not process.stderr.readline().startswith("basis"):
            assert process.poll() is None
        process.send_signal(signal.SIGHUP)
        time.sleep(0.5)
        assert process.poll() is None
        process.send_signal(signal.SIGINT)
        assert "lightpaint basis: interrupted" in process.stderr.read()
        assert process.wait(timeout=PATIENCE_S) == 130


@pytest.mark.nightly
@pytest.mark.parametrize("delay_s", [nightly(0.3), 0.7, nightly(1.3)])
def test_killed_at_any_moment_leaves_a_readable_basis(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, delay_s: float
) -> None:
    """However far the writing of a part has come."""
    code = f"""
import lightpaint.scene.scene_render, lightpaint as lp, sys
from lightpaint.basis.cache.cached_render import obtain_basis
sys.modules["lightpaint.basis.render.render_budget"].KEEP_EVERY_S = 0
lightpaint.scene.scene_render.SAMPLES_PER_PASS = 2**17
scene = lp.load_scene({str(CORNELL)!r})
print("ready", flush=True)
obtain_basis(scene, spp=100_000)
"""
    environment = {**os.environ, "LIGHTPAINT_CACHE": str(tmp_path)}
    with subprocess.Popen(
        [sys.executable, "-c", code], env=environment, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        while not list(tmp_path.glob("*.basis.exr")):
            assert process.poll() is None
            time.sleep(0.01)
        time.sleep(delay_s)
        process.kill()
    [path] = tmp_path.glob("*.basis.exr")
    basis = read_basis(path)
    assert basis.origin.spp >= 2
    # And the next run goes on from there, like one that was never interrupted.
    monkeypatch.setenv("LIGHTPAINT_CACHE", str(tmp_path))
    more_spp = basis.origin.spp + 32
    assert more_spp <= obtain_basis(load_scene(CORNELL), spp=more_spp).origin.spp <= more_spp + 1
    assert more_spp <= read_basis(path).origin.spp <= more_spp + 1
