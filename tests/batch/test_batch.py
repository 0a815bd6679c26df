"""A batch from a saved basis: what it leaves, what a second run does, and what a failure costs."""

import csv
import json
import os
import random
import shlex
import shutil
import signal
import subprocess
import time
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from batches import LOOKS, NAMES, contents, kill_batch, run_whole_batch, small_basis, write_batch
from command import run, succeed
from nightly import nightly
from PIL import Image

from lightpaint.batch import engine
from lightpaint.batch.engine import Processes
from lightpaint.batch.gallery.gallery_page import contact_sheet, gallery_page
from lightpaint.batch.gallery.summary import LightRow, SummaryRow, summary_csv
from lightpaint.batch.manifest.file_names import FILES, is_reserved
from lightpaint.batch.manifest.keys import as_key
from lightpaint.batch.manifest.looks_file import read_manifest
from lightpaint.batch.plan.planner import plan_batch
from lightpaint.batch.run import _Run, run_batch
from lightpaint.batch.run_options import RunOptions
from lightpaint.batch.work import item_execution
from lightpaint.batch.work.work_items import ItemResult, Task
from lightpaint.errors import BatchError, OutputError
from lightpaint.images.formats.exr import write_rgb
from lightpaint.lighting.answer.lighting_file import read_lighting
from lightpaint.progress import Interrupted, silent
from lightpaint.sentences import Hint, Sentence, Word


@pytest.fixture(scope="module")
def reference_batch(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, bytes]]:
    """A manifest, and what its batch leaves."""
    folder = tmp_path_factory.mktemp("batch")
    manifest = write_batch(folder)
    run_whole_batch(str(manifest), str(folder / "out"))
    return manifest, contents(folder / "out")


@pytest.fixture
def batch_folder(tmp_path: Path) -> Path:
    write_batch(tmp_path)
    return tmp_path


def run_item(folder: Path, **options: Any) -> Any:
    return run_batch(plan_batch(folder / "looks.toml", folder / "out"), RunOptions(**options))


def test_equal_runs_leave_equal_files(batch_folder: Path) -> None:
    """Also the reports, which hold the command; only the document on stdout has times."""
    looks = LOOKS.replace('"predict"]', '"predict", "report"]', 1)
    (batch_folder / "looks.toml").write_text(looks, encoding="utf-8")
    options, left = ("--only", "p1*", "--json", "-q"), {}
    for name in ("one", "two"):
        document = json.loads(succeed(batch_folder, "batch", "looks.toml", "-o", name, *options))
        left[name] = contents(batch_folder / name)
        chosen = [look for look in document["looks"] if look["look"].startswith("p1")]
        assert all(look["seconds"] > 0 for look in chosen)
        assert not any("seconds" in x for x in document["looks"] if x not in chosen)
    assert "p1-white-only/report.html" in left["one"]
    assert left["one"] == left["two"]


def test_the_command_in_a_report_of_a_batch_runs_it_again(batch_folder: Path) -> None:
    """In the folder of the batch, also where that is a link to somewhere else."""
    (batch_folder / "elsewhere" / "out").mkdir(parents=True)
    (batch_folder / "out").symlink_to(batch_folder / "elsewhere" / "out")
    succeed(batch_folder, "batch", "looks.toml", "-o", "out", "--only", "p0", "-q")
    command = json.loads((batch_folder / "out/p0/report.json").read_text("utf-8"))["command"]
    answer = (batch_folder / "out/p0/lighting.json").read_bytes()
    shutil.rmtree(batch_folder / "out/p0")
    succeed(batch_folder / "out", *shlex.split(command)[1:], "--only", "p0", "-q")
    assert (batch_folder / "out/p0/lighting.json").read_bytes() == answer


def test_every_look_is_what_solve_makes_of_it(
    reference_batch: tuple[Path, dict[str, bytes]], tmp_path: Path
) -> None:
    manifest, reference_contents = reference_batch
    assert {name.split("/")[0] for name in reference_contents if "/" in name} == {
        *NAMES,
        "thumbnails",
    }
    assert {*FILES, "journal.jsonl"} == {name for name in reference_contents if "/" not in name}
    # No look can lie where any of it goes.
    assert all(
        is_reserved(name) for name in {x.split("/")[0] for x in reference_contents} - {*NAMES}
    )
    assert not any(map(is_reserved, NAMES))
    write_batch(tmp_path)
    succeed(tmp_path, "solve", "b.basis.exr", "p0.exr")
    batch_weights, solve_weights = (
        np.array(list(read_lighting(path).emission.values()))
        for path in (
            manifest.parent / "out" / "p0" / "lighting.json",
            tmp_path / "p0/lighting.json",
        )
    )
    np.testing.assert_array_equal(batch_weights, solve_weights)
    assert set(json.loads(reference_contents["p0/result.json"])["files"]) == {
        "lighting.json",
        "predicted.exr",
        "report.json",
    }


def test_a_sequence_begins_and_ends_with_its_looks(
    reference_batch: tuple[Path, dict[str, bytes]],
) -> None:
    output_folder = reference_batch[0].parent / "out"
    lights = {
        name: read_lighting(output_folder / name / "lighting.json").emission for name in NAMES
    }
    assert lights["dusk-0"] == lights["p0"]
    assert lights["dusk-2"] == lights["third"]
    assert lights["p0"] != lights["p0-warmer"] != lights["dusk-1"]


def test_a_second_run_does_nothing_and_a_change_only_what_hangs_on_it(batch_folder: Path) -> None:
    assert run_item(batch_folder).done == [x for x in NAMES if not is_derived(x)] + [
        x for x in NAMES if is_derived(x)
    ]
    before = contents(batch_folder / "out")
    outcome = run_item(batch_folder)
    assert (outcome.done, sorted(outcome.skipped)) == ([], sorted(NAMES))
    assert contents(batch_folder / "out") == before
    # Another painting under the same name.
    write_rgb(batch_folder / "p1.exr", 0.5 * small_basis().images.sum(axis=0))
    outcome = run_item(batch_folder)
    assert sorted(outcome.done) == ["p1", "p1-warmer", "p1-white-only"]
    # A result that is lost, and what is made of it stays: it would come out the same.
    (batch_folder / "out" / "third" / "predicted.exr").unlink()
    assert run_item(batch_folder).done == ["third"]
    # And one that is asked for otherwise.
    text = LOOKS.replace('painting = "p2.exr"', 'painting = "p2.exr"\nsettings = { hold = 0.1 }')
    (batch_folder / "looks.toml").write_text(text, encoding="utf-8")
    assert sorted(run_item(batch_folder).done) == ["dusk-0", "dusk-1", "dusk-2", "third"]


def is_derived(name: str) -> bool:
    """Whether a look is made of others."""
    return "warmer" in name or "dusk" in name


@pytest.mark.nightly
def test_a_project_that_was_moved_is_done_still(batch_folder: Path) -> None:
    run_item(batch_folder)
    moved_folder = batch_folder.parent / f"{batch_folder.name}-moved"
    batch_folder.rename(moved_folder)
    assert run_item(moved_folder).done == []


def test_a_damaged_journal_is_said_and_its_look_done_again(batch_folder: Path) -> None:
    command = ("batch", "looks.toml", "-o", "out")
    run(batch_folder, *command)
    before = contents(batch_folder / "out")
    rows = before["journal.jsonl"].split(b"\n")
    [line_index] = (k for k, row in enumerate(rows) if b'"third"' in row)
    rows[line_index] = rows[line_index].replace(b"done", b"d\xffne")
    (batch_folder / "out" / "journal.jsonl").write_bytes(b"\n".join(rows))
    completed = run(batch_folder, *command)
    assert completed.returncode == 0, completed.stderr
    assert (
        "journal.jsonl has a line that cannot be read: its step will be done again"
        in completed.stderr
    )
    assert "third: answer done" in completed.stderr
    assert "p0: answer done" not in completed.stderr
    assert contents(batch_folder / "out") == before
    assert "journal" not in run(batch_folder, *command).stderr


@pytest.mark.nightly
def test_only_some(batch_folder: Path) -> None:
    partial_plan = plan_batch(batch_folder / "looks.toml", batch_folder / "out").select("dusk-1")
    outcome = run_batch(partial_plan)
    assert outcome.done == ["p0", "third", "dusk-1"]
    assert [row.state for row in outcome.rows].count("waiting") == 7
    assert len(run_item(batch_folder).done) == 7
    with pytest.raises(BatchError, match="no look matches"):
        partial_plan.select("x*")


def test_one_bad_painting_fails_alone(batch_folder: Path) -> None:
    (batch_folder / "p1.exr").write_bytes(b"no picture")
    completed = run(batch_folder, "batch", "looks.toml", "-o", "out", "--log", "log.txt")
    assert completed.returncode == 1
    complaints = [x for x in completed.stderr.splitlines() if x.startswith("lightpaint batch: ")]
    assert [x.split()[2] for x in complaints] == ["p1:", "p1-warmer:", "p1-white-only:"]
    assert "10 looks: 3 failed" in completed.stdout
    summary = json.loads((batch_folder / "out" / "summary.json").read_text())
    assert [look["look"] for look in summary["looks"]][:3] == ["p1", "p1-warmer", "p1-white-only"]
    assert "p1.exr" in summary["looks"][0]["why"]
    assert (summary["done"], summary["failed"]) == (7, 3)
    log = (batch_folder / "log.txt").read_text().splitlines()
    assert sum("failed: " in line for line in log) == 3
    assert all(line[:4].isdigit() for line in log)
    # Mended, it is done, and nothing else is.
    write_rgb(batch_folder / "p1.exr", small_basis().images.sum(axis=0))
    summary = json.loads(succeed(batch_folder, "batch", "looks.toml", "-o", "out", "-q", "--json"))
    assert (summary["done"], summary["failed"]) == (10, 0)
    # Or nothing is begun.
    (batch_folder / "p1.exr").write_bytes(b"no picture")
    completed = run(batch_folder, "batch", "looks.toml", "-o", "other", "--stop-early", "-q")
    assert completed.returncode == 1
    assert not (batch_folder / "other" / "p0").exists()


def test_what_was_changed_by_hand_is_kept(batch_folder: Path) -> None:
    run_item(batch_folder)
    (batch_folder / "out" / "p0" / "lighting.json").write_text("mine", encoding="utf-8")
    outcome = run_item(batch_folder)
    assert "was changed since lightpaint wrote it" in outcome.failed["p0"]
    assert (batch_folder / "out" / "p0" / "lighting.json").read_text() == "mine"
    assert run(batch_folder, "batch", "looks.toml", "-o", "out", "--force", "-q").returncode == 0


def test_a_plan_is_only_told(batch_folder: Path) -> None:
    output = succeed(batch_folder, "batch", "looks.toml", "-o", "out", "--dry-run")
    assert [line.split()[0] for line in output.splitlines()[1:-1]] == NAMES
    assert "GB of memory" in output
    assert not (batch_folder / "out").exists()
    summary = json.loads(succeed(batch_folder, "batch", "looks.toml", "--dry-run", "--json"))
    assert [look["look"] for look in summary["looks"]] == NAMES


def test_a_plan_says_why_a_look_cannot_be_done(batch_folder: Path) -> None:
    (batch_folder / "p2.exr").write_bytes(b"no picture")
    ended = run(batch_folder, "batch", "looks.toml", "--dry-run", "--json")
    looks = {look["look"]: look for look in json.loads(ended.stdout)["looks"]}
    assert ended.returncode == 1
    assert "p2.exr" in looks["third"]["why"]
    assert "why" not in looks["p0"]


def test_a_look_can_have_no_variations_though_the_defaults_do(batch_folder: Path) -> None:
    defaults = '[defaults]\nbasis = "b.basis.exr"\nvariations = ["warmer", "white only"]\n\n'
    looks = '[[look]]\npainting = "p0.exr"\n\n[[look]]\npainting = "p1.exr"\nvariations = []\n'
    looks += '\n[[look]]\npainting = "p2.exr"\nvariations = []\nwant = ["lights"]\n'
    looks += "settings = { literal = true }\n"
    (batch_folder / "looks.toml").write_text(defaults + looks, encoding="utf-8")
    planned = plan_batch(batch_folder / "looks.toml", batch_folder / "out")
    names = [look.entry.name for look in planned.looks]
    assert names == ["p0", "p0-warmer", "p0-white-only", "p1", "p2"]


def test_a_failure_names_keys_of_the_manifest(batch_folder: Path) -> None:
    write_rgb(batch_folder / "p1.exr", np.ones((5, 7, 3), dtype=np.float32))
    failures = {
        x.entry.name: x.failure for x in plan_batch(batch_folder / "looks.toml", "out").looks
    }
    assert failures["p1"].endswith("or pass settings.resize = true"), failures


@pytest.mark.parametrize(
    ("hint", "expected"),
    [
        (Hint("find", False), "find_template = false"),
        (Hint("sensor", "guest"), 'sensor = "guest"'),
        (Hint("template"), "template = ..."),
        (Hint("resolution"), "settings.resolution = ..."),
        (Hint("emitters", Word("count")), 'settings.emitters = "count"'),
        (Hint("refine", 1), "settings.refine = 1"),
        (Hint("force", True), "force=True"),
        (Hint("parameters", {"x": ...}), "parameters={'x': ...}"),
    ],
)
def test_arguments_are_spelled_as_keys(hint: Hint, expected: str) -> None:
    sentence = Sentence("use ", hint, " or fewer").spelled(as_key)
    assert sentence == f"use {expected} or fewer"
    # Another face spells what has no key.
    assert (hint in sentence.parts) == (expected == str(hint))


def test_a_look_can_do_without_the_template_of_the_defaults(batch_folder: Path) -> None:
    (batch_folder / "t").mkdir()
    looks = '[[look]]\npainting = "p0.exr"\n\n[[look]]\npainting = "p1.exr"\n'
    defaults = '[defaults]\nbasis = "b.basis.exr"\ntemplate = "t"\n\n'
    (batch_folder / "looks.toml").write_text(
        defaults + looks + "find_template = false\n", encoding="utf-8"
    )
    templates = [x.values.get("template") for x in read_manifest(batch_folder / "looks.toml").looks]
    assert templates == ["t", None]


def test_a_plan_names_paintings_from_the_current_folder(batch_folder: Path) -> None:
    """However the manifest leads there."""
    (batch_folder / "plans").mkdir()
    manifest = '[defaults]\nbasis = "../b.basis.exr"\n\n[[look]]\npainting = "../p0.exr"\n'
    (batch_folder / "plans" / "looks.toml").write_text(manifest, encoding="utf-8")
    _, look, _ = succeed(batch_folder, "batch", "plans/looks.toml", "--dry-run").splitlines()
    assert look.split()[-1] == "p0.exr"


@pytest.mark.nightly
def test_what_fails_is_tried_again_as_often_as_is_asked(
    batch_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tries: list[str] = []
    answer = item_execution._answer

    def sometimes(task: Task, *rest: Any) -> None:
        tries.append(task.look)
        if task.look == "p1" and tries.count("p1") < 3:
            raise RuntimeError("a library's\nown words")
        answer(task, *rest)

    monkeypatch.setattr(item_execution, "_answer", sometimes)
    outcome = run_item(batch_folder, retry=1)
    assert outcome.failed["p1"] == "RuntimeError: a library's"
    assert outcome.failed["p1-warmer"] == "it is made of p1, which failed"
    assert tries.count("p1") == 2
    assert sorted(run_item(batch_folder, retry=1).done) == ["p1", "p1-warmer"]


def test_a_full_disk_stops_with_one_line_and_goes_on_after(
    batch_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    succeed(batch_folder, "batch", "looks.toml", "-o", "out")
    (batch_folder / "out").rename(batch_folder / "whole")
    answer, count = item_execution._answer, 0

    def full(task: Task, *rest: Any) -> None:
        nonlocal count
        if (count := count + 1) > 3:
            try:
                raise OSError(28, "No space left on device")
            except OSError as error:
                raise OutputError("cannot write it: No space left on device") from error
        answer(task, *rest)

    with monkeypatch.context() as patch:
        patch.setattr(item_execution, "_answer", full)
        completed = run(batch_folder, "batch", "looks.toml", "-o", "out", "-q")
    assert completed.returncode == 2
    [line] = completed.stderr.splitlines()
    assert "No space left" in line
    assert "run the same command to continue" in line
    second_run = run(batch_folder, "batch", "looks.toml", "-o", "out", "--workers", 1)
    assert "3 looks were done earlier" in second_run.stderr
    assert contents(batch_folder / "out") == contents(batch_folder / "whole")


def test_one_look_is_not_several(batch_folder: Path) -> None:
    for _ in range(2):
        completed = run(batch_folder, "batch", "looks.toml", "-o", "one", "--only", "third")
    assert "1 look was done earlier and is unchanged" in completed.stderr


@pytest.mark.nightly
def test_a_basis_that_takes_too_much_memory_fails_its_looks_alone(
    batch_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def too_large(*_: Any, **__: Any) -> None:
        raise MemoryError

    with monkeypatch.context() as patch:
        patch.setattr("lightpaint.batch.task_bases.obtain_bases", too_large)
        completed = run(batch_folder, "batch", "looks.toml", "-o", "out", "-q")
    assert completed.returncode == 1
    assert "it takes more memory than there is" in completed.stderr
    assert "Traceback" not in completed.stderr
    succeed(batch_folder, "batch", "looks.toml", "-o", "out")


@pytest.mark.nightly
def test_a_disk_that_is_really_full(batch_folder: Path) -> None:
    disk = batch_folder / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=96K", "tmpfs", str(disk)]
    if shutil.which("mount") is None or subprocess.run(mount, capture_output=True).returncode:
        pytest.skip("the right to mount")
    try:
        completed = run(batch_folder, "batch", "looks.toml", "-o", disk / "out", "-q")
        assert completed.returncode == 2
        [line] = completed.stderr.splitlines()
        assert "No space left on device: make room, and run the same command to continue" in line
        assert not list((disk / "out").glob(".*"))
        remount = ["mount", "-o", "remount,size=8M", str(disk)]
        subprocess.run(remount, check=True)
        second_run = run(batch_folder, "batch", "looks.toml", "-o", disk / "out")
        assert second_run.returncode == 0
        assert "looks were done earlier" in second_run.stderr
    finally:
        subprocess.run(["umount", str(disk)], check=True)


def test_an_interrupt_says_how_to_go_on(
    batch_folder: Path,
    monkeypatch: pytest.MonkeyPatch,
    reference_batch: tuple[Path, dict[str, bytes]],
) -> None:
    def interrupted(*_: Any) -> ItemResult:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(engine, "run_item", interrupted)
        with pytest.raises(
            Interrupted, match="10 looks are left; run the same command to continue"
        ):
            run_item(batch_folder)
    run_item(batch_folder)
    assert contents(batch_folder / "out") == reference_batch[1]


@pytest.mark.nightly
def test_workers_that_are_all_gone_are_no_look_s_failure(
    batch_folder: Path, reference_batch: tuple[Path, dict[str, bytes]]
) -> None:
    class Gone(engine.InProcess):
        def run(self, items: Any) -> Any:
            yield engine.run_item(items[0], self._cache, self._listen)
            self.is_gone = True
            yield ItemResult(items[1].name, items[1].kind, "the scheduler is gone")

    def lose_worker(run: Any, _: Any) -> Any:
        return Gone(run._cache, run._listen)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(_Run, "_start_engine", lose_worker)
        with pytest.raises(BatchError, match="the scheduler is gone"):
            run_item(batch_folder)
    [line] = (batch_folder / "out" / "journal.jsonl").read_text().splitlines()
    assert json.loads(line)["state"] == "done"
    run_item(batch_folder)
    assert contents(batch_folder / "out") == reference_batch[1]


def test_two_batches_do_not_work_in_one_folder(batch_folder: Path) -> None:
    planned, remarks = plan_batch(batch_folder / "looks.toml", batch_folder / "out"), []

    def other(*_: Any) -> None:
        with pytest.raises(OutputError, match="another batch is at work"):
            run_batch(planned)
        remarks.append(1)

    run_batch(planned.select("p0"), on_step=other)
    assert remarks == [1]


class _AtWork:
    """Listens to what each worker does."""

    def __init__(self) -> None:
        self.workers: dict[str, str | None] = {}
        self.done: set[str] = set()

    def __call__(self, *_: Any) -> None: ...

    def at_work(self, worker: str, task: str | None) -> None:
        assert (self.workers.get(worker) is None) == (task is not None)
        self.workers[worker] = task
        self.done.add(task or "")


def test_workers_make_the_same_and_one_that_dies_costs_nothing(
    batch_folder: Path, reference_batch: tuple[Path, dict[str, bytes]]
) -> None:
    planned, pids = plan_batch(batch_folder / "looks.toml", batch_folder / "out"), []

    def record_remark(*_: Any) -> None:
        if not pids:  # the first answer is here, and another is on its way
            victim = _first_process(started[-1])
            pids.append(victim)
            os.kill(victim, signal.SIGKILL)

    started: list[Any] = []
    begin = Processes.__enter__
    listener = _AtWork()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            Processes, "__enter__", lambda manager: started.append(manager) or begin(manager)
        )
        outcome = run_batch(planned, RunOptions(workers=2), listener, on_step=record_remark)
    assert pids
    assert listener.workers == {"worker 1": None, "worker 2": None}
    assert {f"{name}: answer" for name in outcome.done} <= listener.done
    assert not outcome.failed
    assert contents(batch_folder / "out") == reference_batch[1]


def _first_process(processes: Processes) -> int:
    """Return the number of a worker process."""
    return next(pid for pool in processes._pools.values() for pid in pool._processes)


@pytest.mark.nightly
def test_a_step_that_takes_too_long_fails_in_words_and_costs_nothing_else(
    batch_folder: Path, reference_batch: tuple[Path, dict[str, bytes]]
) -> None:
    hasty = run_item(batch_folder, task_limit_s=0.2)  # no process even starts so quickly
    assert not hasty.done
    assert all("longer than 0.2 s" in x or "which failed" in x for x in hasty.failed.values())
    assert not run_item(batch_folder).failed
    assert contents(batch_folder / "out") == reference_batch[1]


@pytest.mark.nightly
def test_the_others_go_on_while_a_worker_hangs(
    batch_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    started: list[Processes] = []
    begin = Processes.__enter__
    monkeypatch.setattr(Processes, "__enter__", lambda x: started.append(x) or begin(x))
    stopped: list[int] = []

    def stop_one(*_: Any) -> None:
        if not stopped:  # the first answer is here, and another is on its way
            stopped.append(_first_process(started[-1]))
            os.kill(stopped[0], signal.SIGSTOP)

    planned = plan_batch(batch_folder / "looks.toml", batch_folder / "out")
    options = RunOptions(workers=2, task_limit_s=60)
    outcome = run_batch(planned, options, on_step=stop_one)
    [failed] = [name for name, reason in outcome.failed.items() if "longer than 60 s" in reason]
    others = {name: reason for name, reason in outcome.failed.items() if name != failed}
    assert set(others.values()) <= {f"it is made of {failed}, which failed"}
    assert set(outcome.done) == {look.entry.name for look in planned.looks} - set(outcome.failed)
    assert outcome.done


@pytest.mark.parametrize("moments", [5, nightly(20)])
def test_killed_at_many_moments_it_ends_as_if_undisturbed(
    batch_folder: Path, reference_batch: tuple[Path, dict[str, bytes]], moments: int
) -> None:
    chance, kills, batches = random.Random(1), 0, 0
    begun_s = time.monotonic()
    assert kill_batch(batch_folder / "looks.toml", batch_folder / "first", 60) == 0
    run_s = time.monotonic() - begun_s
    while kills < moments:
        folder, batches = batch_folder / f"out{batches}", batches + 1
        while kill_batch(batch_folder / "looks.toml", folder, chance.uniform(0, 0.6 * run_s)):
            kills += 1
            assert kills < 200
        assert contents(folder) == reference_batch[1]


class _Page(HTMLParser):
    """What a page would load from elsewhere, and the data in it."""

    def __init__(self) -> None:
        super().__init__()
        self.loads: list[str] = []
        self.data, self._is_data = "", False

    def handle_starttag(self, tag: str, attributes: Any) -> None:
        attribute_values = dict(attributes)
        self._is_data = attribute_values.get("id") == "looks" and tag == "script"
        if tag in ("script", "img", "link", "iframe"):
            loaded = attribute_values.get("src") or attribute_values.get("href") or "data:"
            self.loads += [] if loaded.startswith("data:") else [loaded]

    def handle_endtag(self, tag: str) -> None:
        self._is_data = False

    def handle_data(self, data: str) -> None:
        self.data += data if self._is_data else ""


def test_the_page_holds_all_and_loads_nothing(
    reference_batch: tuple[Path, dict[str, bytes]],
) -> None:
    contents_by_name = reference_batch[1]
    page = _Page()
    page.feed(contents_by_name["index.html"].decode())
    assert page.loads == []
    looks = json.loads(page.data)
    assert [look["look"] for look in looks] == NAMES
    assert all(look["picture"].startswith("data:image/jpeg;base64,") for look in looks)
    for look in looks:
        assert all(
            (reference_batch[0].parent / "out" / target).is_file() for _, target in look["links"]
        )
    rows = list(csv.DictReader(contents_by_name["summary.csv"].decode().splitlines()))
    assert [row["look"] for row in rows] == NAMES
    assert float(rows[0]["lamp 1"]) > 0
    summary = json.loads(contents_by_name["summary.json"])
    assert [light["name"] for light in summary["looks"][0]["lights"]] == [
        "lamp 0",
        "lamp 1",
        "lamp 2",
    ]


@pytest.mark.nightly
def test_a_page_of_a_thousand_looks_with_names_that_mean_mischief(tmp_path: Path) -> None:
    hostile_name = "</script><img src=x onerror=alert(1)>\u202e$title"
    lights = tuple(LightRow(f"{hostile_name}{k}", 1.0, hex="#ffffff") for k in range(12))
    rows = [
        SummaryRow(f"{hostile_name}{k}", "failed", hostile_name, f"look {k}", lights=lights)
        for k in range(1000)
    ]
    text = gallery_page(tmp_path, hostile_name, rows)
    assert text.count("</script>") == 3
    assert "<img src=x" not in text
    page = _Page()
    page.feed(text)
    assert page.loads == []
    assert json.loads(page.data)[0]["look"] == f"{hostile_name}0"
    sheet = contact_sheet(tmp_path, rows)
    assert sheet.dtype == np.uint8
    assert sheet.shape[1] < 2000


def test_a_first_manifest_is_one_that_can_be_run(batch_folder: Path) -> None:
    (batch_folder / "room.xml").write_text("", encoding="utf-8")
    (batch_folder / "sub").mkdir()
    output = succeed(
        batch_folder, "batch", "--init", "room.xml", "p0.exr", "p1.exr", "-o", "sub/l.toml"
    )
    assert "lightpaint batch sub/l.toml" in output
    text = (batch_folder / "sub" / "l.toml").read_text()
    text = text.replace('scene = "../room.xml"', 'basis = "../b.basis.exr"')
    text = text.replace('"verify", ', "").replace('quality = "preview"', "")
    (batch_folder / "sub" / "l.toml").write_text(text, encoding="utf-8")
    planned = plan_batch(batch_folder / "sub" / "l.toml", batch_folder / "out")
    assert [look.entry.name for look in planned.looks] == ["p0", "p1"]
    assert not any(look.failure for look in planned.looks)


def test_without_anybody_listening(batch_folder: Path) -> None:
    assert run_batch(
        plan_batch(batch_folder / "looks.toml", batch_folder / "out").select("third"), None, silent
    ).done


@pytest.mark.nightly
@pytest.mark.parametrize("damage", [b"", b"junk", None])
def test_small_pictures_that_are_damaged_are_made_again(
    batch_folder: Path, damage: bytes | None
) -> None:
    run_item(batch_folder)
    pictures = sorted((batch_folder / "out" / "thumbnails").glob("*.jpg"))
    before = {path: path.read_bytes() for path in pictures}
    assert pictures
    first = pictures[0]
    first.write_bytes(before[first][: len(before[first]) // 2] if damage is None else damage)
    run_item(batch_folder)
    assert {path: path.read_bytes() for path in pictures} == before


@pytest.mark.nightly
@pytest.mark.parametrize(
    "message", [nightly('{"lights": 3}'), '{"lights": [1]}', nightly('{"lights": []}'), "junk"]
)
def test_planes_that_are_damaged_cost_no_gallery(batch_folder: Path, message: str) -> None:
    run_item(batch_folder)
    for path in (batch_folder / "out" / "thumbnails").glob("*.planes.json"):
        path.write_text(message)
    run_item(batch_folder)
    assert (batch_folder / "out" / "index.html").is_file()


def test_columns_of_lights_are_those_of_no_other_column() -> None:
    """Of lights called as a column is, and of one called as a column of another light."""
    names = ["state", "noise", "key", "key R", "lamp"]
    lights = tuple(LightRow(name, k + 0.5, (2.0, 3.0, 4.0)) for k, name in enumerate(names))
    row = SummaryRow("dusk", "done", "", "dusk", lights=lights)
    [heading, cells] = csv.reader(summary_csv([row]).splitlines())
    assert len(set(heading)) == len(heading) == len(cells)
    table = dict(zip(heading, cells, strict=True))
    assert (table["state"], table["light state"], table["light noise"]) == ("done", "0.5", "1.5")
    assert (table["key"], table["key R"], table["light key R"], table["lamp"]) == (
        *("2.5", "2", "3.5", "4.5"),
    )


def test_several_patterns_choose_looks_of_each(batch_folder: Path) -> None:
    output = succeed(
        batch_folder, "batch", "looks.toml", "--dry-run", "--only", "p0", "--only", "thi*"
    )
    assert "third" in output
    assert "p0" in output
    assert "p1" not in output
    planned = plan_batch(batch_folder / "looks.toml", batch_folder / "out")
    with pytest.raises(BatchError, match=r"no look matches 'x\*'"):
        planned.select("p0", "x*")


def test_remarks_stand_in_the_log(batch_folder: Path) -> None:
    image = small_basis().images.sum(axis=0)
    image[0, 0] = -1
    write_rgb(batch_folder / "p2.exr", image)
    succeed(batch_folder, "batch", "looks.toml", "-o", "out", "--only", "third", "--log", "a.log")
    log = (batch_folder / "a.log").read_text()
    assert "a negative luminance in 1 of 96 pixels" in log
    assert log.count("third: answer done in") == 1


def test_remarks_name_keys_of_the_manifest(batch_folder: Path) -> None:
    """The command has no such options, and whoever reads the log writes no Python."""
    image = np.full((8, 12, 3), 128, np.uint8)
    Image.fromarray(image).save(batch_folder / "p2.png")
    text = (batch_folder / "looks.toml").read_text().replace("p2.exr", "p2.png")
    (batch_folder / "looks.toml").write_text(text)
    line = ("looks.toml", "-o", "out", "--only", "third", "--log", "a.log")
    completed = run(batch_folder, "batch", *line)
    for printed in (completed.stderr, (batch_folder / "a.log").read_text()):
        assert printed.count("(template = ... names one)") == 1
        assert "--template" not in printed
        assert "template=" not in printed
