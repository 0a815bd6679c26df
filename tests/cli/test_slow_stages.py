"""Stages that take long: they show it, and Ctrl-C and `kill` wait for none of their steps."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from batches import contents
from command import as_from_a_terminal, run, succeed
from conftest import BasisFactory
from patience import PATIENCE_S

from lightpaint.basis.file import basis_file
from lightpaint.basis.file.basis_file import read_basis, write_basis
from lightpaint.images.formats.exr import write_rgb

#: `lightpaint …` whose walks have a hundred blocks, or a light each, of a second in one stage.
MAIN = """
import sys, time
import lightpaint.basis.planes as planes, lightpaint.progress as progress
planes.BLOCK_PIXELS = 6
from lightpaint.cli import main
report = progress._Stage.report
def slowly(stage, *step):
    if stage.label == "STAGE":
        print("step", file=sys.stderr, flush=True)
        time.sleep(1)
    report(stage, *step)
progress._Stage.report = slowly
sys.exit(main(sys.argv[1:]))
"""

#: Steps that threads may still take after the signal: those that have begun, and one more each.
MAX_LAST_STEPS = 2 * ((os.cpu_count() or 1) + 2)


#: Options of another answer, which would replace the earlier one.
OTHER = ("--force", "--colors", "white")


@pytest.fixture
def folder(tmp_path: Path, make_basis: BasisFactory) -> Path:
    """A basis of fifty lights, and a painting."""
    rng = np.random.default_rng(5)
    images = rng.random((50, 20, 30, 3))
    noise = rng.normal(0, 0.02, images.shape)
    basis = make_basis(images=images, half_differences=noise)
    write_basis(tmp_path / "hall.basis.exr", basis)
    write_rgb(tmp_path / "look.exr", images.mean(axis=0).astype(np.float32))
    return tmp_path


@pytest.mark.parametrize(
    ("stage", "number"),
    [
        ("solving", signal.SIGTERM),
        ("error bars", signal.SIGINT),
        ("report", signal.SIGINT),
    ],
)
def test_a_signal_waits_for_no_stage(folder: Path, stage: str, number: signal.Signals) -> None:
    command = ["solve", "hall.basis.exr", "look.exr", "--literal", "-o", "out"]
    succeed(folder, *command)
    before = contents(folder / "out")
    process = subprocess.Popen(
        [sys.executable, "-c", MAIN.replace("STAGE", stage), *command, *OTHER],
        cwd=folder,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=as_from_a_terminal,
    )
    assert process.stderr is not None
    for line in process.stderr:
        if line == "step\n":
            break
    process.send_signal(number)
    _, rest = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 128 + number, rest
    assert rest.splitlines()[-1] == "lightpaint solve: interrupted"
    assert rest.count("step\n") <= MAX_LAST_STEPS
    assert contents(folder / "out") == before


def test_no_report_skips_it(folder: Path) -> None:
    command = ["solve", "hall.basis.exr", "look.exr", "-o", "out"]
    succeed(folder, *command)
    assert (folder / "out" / "report.html").is_file()
    completed = run(folder, *command, "--no-report")
    assert completed.returncode == 0, completed.stderr
    left = {file.name for file in (folder / "out").iterdir()}
    assert {"lighting.json", "predicted.exr", "report.json"} <= left
    assert not {"report.html", "comparison.png"} & left


def test_a_file_that_takes_seconds_is_read_light_by_light(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    expected = read_basis(folder / "hall.basis.exr")
    monkeypatch.setattr(basis_file, "QUICK_MAX_BYTES", 0)
    monkeypatch.setattr(basis_file, "read_parts", None)
    basis = read_basis(folder / "hall.basis.exr")
    assert basis.lights == expected.lights
    assert basis.origin == expected.origin
    for name in ("images", "half_differences", "emitters_seen"):
        assert getattr(basis, name).tobytes() == getattr(expected, name).tobytes()


def test_no_error_bars_skips_them(folder: Path) -> None:
    """The answer is the same, and says nothing of how sure it is."""
    command = ["solve", "hall.basis.exr", "look.exr", "--literal", "-o"]
    succeed(folder, *command, "sure")
    succeed(folder, *command, "quick", "--no-error-bars")
    sure, quick = (
        json.loads((folder / name / "lighting.json").read_text())["lights"]
        for name in ("sure", "quick")
    )
    for name, light in sure.items():
        assert quick[name]["emission"] == light["emission"]
        assert "standard_error" not in quick[name]
    assert any("standard_error" in light for light in sure.values())
    assert (folder / "quick" / "report.html").is_file()
