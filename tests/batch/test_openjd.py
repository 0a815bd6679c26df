"""A batch as a farm job: what `openjd run` makes of it, or at least what its commands do."""

import json
import os
import shutil
import subprocess
import sys
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import pytest
from batches import NAMES, contents, run_whole_batch, write_batch
from command import run, run_refused, succeed

OPENJD = os.environ.get("LIGHTPAINT_OPENJD") or shutil.which("openjd")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write_batch(tmp_path)
    output = succeed(tmp_path, "batch", "looks.toml", "-o", "out", "--export", "openjd", "job")
    assert "openjd run job/template.json" in output
    assert not (tmp_path / "out").exists()
    return tmp_path


def _template(folder: Path) -> Any:
    return json.loads((folder / "job" / "template.json").read_text())


def test_each_look_is_in_one_task_after_all_that_it_is_made_of(folder: Path) -> None:
    steps = _template(folder)["steps"]
    assert [step["name"] for step in steps] == ["Bases", "Looks", "Made 1", "Gallery"]
    finished: list[str] = []
    for k, step in enumerate(steps[:-1]):
        [look] = step["parameterSpace"]["taskParameterDefinitions"]
        for pattern in look["range"]:
            finished += [name for name in NAMES if fnmatchcase(name, pattern)]
        waits = [dependency["dependsOn"] for dependency in step.get("dependencies", [])]
        assert waits == [dependency["name"] for dependency in steps[:k]]
    assert sorted(finished) == sorted(NAMES)
    assert finished[0] == "p0"


def test_its_commands_done_one_by_one_leave_what_one_batch_leaves(folder: Path) -> None:
    succeed(folder, "batch", "looks.toml", "-o", "out")
    (folder / "out").rename(folder / "once")
    template = _template(folder)
    values = {"{{Param.Manifest}}": "looks.toml", "{{Param.Output}}": "out"}
    for step in template["steps"]:
        action = step["script"]["actions"]["onRun"]
        space = step.get("parameterSpace", {"taskParameterDefinitions": [{"range": [""]}]})
        for look in space["taskParameterDefinitions"][0]["range"]:
            filled = {**values, "{{Task.Param.Look}}": look}
            completed = run(folder, *(filled.get(word, word) for word in action["args"]), "-q")
            assert completed.returncode == 0, completed.stderr
    assert contents(folder / "out") == contents(folder / "once")


def test_those_that_share_a_folder_keep_others_out(folder: Path) -> None:
    from lightpaint.batch.plan.planner import plan_batch
    from lightpaint.batch.run import run_batch
    from lightpaint.batch.run_options import RunOptions
    from lightpaint.errors import OutputError

    planned, remarks = plan_batch(folder / "looks.toml", folder / "out"), []

    def occupy(*_: Any) -> None:
        with pytest.raises(OutputError, match="another batch is at work"):
            run_batch(planned)
        remarks.append(run_batch(planned.select("p1"), RunOptions(shares_folder=True)).done)

    run_batch(planned.select("p0"), RunOptions(shares_folder=True), on_step=occupy)
    assert remarks == [["p1"]]
    assert not (folder / "out" / "index.html").exists()
    assert set(run_batch(plan_batch(folder / "looks.toml", folder / "out")).skipped) == {"p0", "p1"}


def test_files_in_the_folder_of_the_job_go_with_it(folder: Path) -> None:
    def kinds(template: Any) -> dict[str, tuple[str, str]]:
        own_parameters = template["parameterDefinitions"][:3]
        return {
            parameter["name"]: (parameter["type"], parameter["default"])
            for parameter in own_parameters
        }

    outside = {"Manifest": "looks.toml", "Output": "out", "Cache": "out/.cache"}
    folder_parameters = {
        name: ("STRING", str((folder / file).resolve())) for name, file in outside.items()
    }
    assert kinds(_template(folder)) == folder_parameters
    succeed(folder, "batch", "looks.toml", "-o", "out", "--export", "openjd", ".")
    template_inside = json.loads((folder / "template.json").read_text())
    assert kinds(template_inside) == {name: ("PATH", file) for name, file in outside.items()}


def test_a_template_that_is_there_is_kept(folder: Path) -> None:
    refusal = run_refused(folder, "batch", "looks.toml", "--export", "openjd", "job")
    assert "template.json is there" in refusal
    assert "folder of the job is missing" in run_refused(
        folder, "batch", "looks.toml", "--export", "openjd"
    )


@pytest.mark.nightly
def test_openjd_runs_it(folder: Path) -> None:
    if OPENJD is None:
        pytest.skip("openjd (or LIGHTPAINT_OPENJD: its path)")
    program = folder / "lightpaint.sh"
    program.write_text(f'#!/bin/sh\nexec {sys.executable} -m lightpaint "$@"\n', encoding="utf-8")
    program.chmod(0o755)
    completed = subprocess.run(
        [OPENJD, "run", "job/template.json", "-p", f"Lightpaint={program}"],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert completed.returncode == 0, completed.stdout + completed.stderr
    final_contents = contents(folder / "out")
    assert b"p1-warmer" in final_contents["summary.csv"]
    run_whole_batch(str(folder / "looks.toml"), str(folder / "once"))
    reference_contents = contents(folder / "once")
    # The command, and so the sums of files with it, is that of the farm.
    comparable = [
        name for name in reference_contents if Path(name).name in ("lighting.json", "predicted.exr")
    ]
    assert {name: final_contents[name] for name in comparable} == {
        name: reference_contents[name] for name in comparable
    }
