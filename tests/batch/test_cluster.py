"""A real scheduler and two real worker processes: accidents cost nothing, to the last bit."""

import contextlib
import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from batches import contents
from command import run
from renderer import write_room

from lightpaint.basis.render import guide_training
from lightpaint.basis.render import render_parts as parts_module
from lightpaint.batch.cluster.cluster import Cluster
from lightpaint.batch.plan.planner import plan
from lightpaint.batch.run import run_batch
from lightpaint.batch.run_options import BatchOutcome, RunOptions
from lightpaint.images.formats.exr import write_rgb
from lightpaint.scene import scene_render
from lightpaint.scene.runtime.kernel_threads import limit_threads

distributed = pytest.importorskip("distributed", reason="Dask's distributed")

pytestmark = pytest.mark.long

LOOKS = """
[defaults]
scene = "room.xml"
settings = { spp = 16 }

[[look]]
painting = "bright.exr"
want = ["solve", "verify", "render", "export"]
render = { spp = 4, resolution = "1/2" }

[[look]]
name = "third"
painting = "dark.exr"
want = ["predict"]
settings = { spp = 16, hold = 0.5 }
variations = ["warmer"]

[[look]]
name = "alone"
painting = "bright.exr"
want = ["lights"]
settings = { spp = 16, literal = true }
"""

#: Seconds after which something has gone wrong, however busy the machine is.
LONG_S = 120.0


@dataclass
class Workers:
    """A scheduler with two workers. slow: folder by which they are held (slow_worker.py)."""

    address: str
    slow: Path

    def pid(self, worker: str) -> int:
        """The process behind an address."""
        with distributed.Client(self.address, set_as_default=False) as client:
            return int(client.run(os.getpid, workers=[worker])[worker])

    def await_two(self) -> None:
        """Until both are there: a nanny begins another in the place of one that died."""
        with distributed.Client(self.address, set_as_default=False) as client:
            wait_until(lambda: len(client.nthreads()) == 2)


def wait_until(holds: Callable[[], Any]) -> None:
    """Wait for it."""
    deadline_s = time.monotonic() + LONG_S
    while not holds():
        assert time.monotonic() < deadline_s
        time.sleep(0.02)


@pytest.fixture(scope="module")
def workers(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Workers]:
    here = tmp_path_factory.mktemp("cluster")
    (slow := here / "slow").mkdir()
    file, tests = here / "scheduler.json", Path(__file__).parent.parent
    environment = {
        **os.environ,
        "LIGHTPAINT_TEST_SLOW": str(slow),
        "PYTHONPATH": os.pathsep.join([str(tests), *filter(None, sys.path)]),
        # Its own, so that nothing is found that the tests have kept.
        "LIGHTPAINT_CACHE": str(here / "none"),
    }
    dask = [sys.executable, "-m", "dask"]
    known = ["--scheduler-file", str(file)]
    quiet: dict[str, Any] = {"stdout": subprocess.DEVNULL, "env": environment, "cwd": here}
    with contextlib.ExitStack() as stack, (here / "log").open("w") as log:
        for command in (
            [*dask, "scheduler", "--port", "0", "--host", "127.0.0.1", "--no-dashboard", *known],
            [
                *dask, "worker", "--nworkers", "2", "--nthreads", "1", "--no-dashboard",
                "--local-directory", str(here), "--preload", "slow_worker", *known,
            ],
        ):  # fmt: skip
            process = stack.enter_context(subprocess.Popen(command, stderr=log, **quiet))
            stack.callback(_end, process)
            wait_until(file.exists)
        wait_until(lambda: _address(file))
        found = Workers(_address(file), slow)
        found.await_two()
        yield found


def _address(file: Path) -> str:
    with contextlib.suppress(ValueError):  # half written
        return str(json.loads(file.read_text())["address"])
    return ""


def _end(process: "subprocess.Popen[Any]") -> None:
    process.terminate()
    try:
        process.wait(20)
    except subprocess.TimeoutExpired:
        process.kill()


@pytest.fixture(scope="module")
def reference_batch(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, bytes]]:
    """A folder with a manifest, and what its batch leaves that this process does alone."""
    here = tmp_path_factory.mktemp("looks")
    write_room(here)
    for name, light in (("bright", 0.8), ("dark", 0.2)):
        write_rgb(here / f"{name}.exr", np.full((20, 24, 3), light, np.float32))
    (here / "looks.toml").write_text(LOOKS, encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        render_small_parts(patch, here / "cache-alone")
        limit_threads(1)
        try:
            outcome = run_batch(plan(here / "looks.toml", here / "alone"))
        finally:
            limit_threads(None)
    assert not outcome.failed
    return here, contents(here / "alone")


def render_small_parts(patch: pytest.MonkeyPatch, cache: Path) -> None:
    patch.setattr(parts_module, "PART_SAMPLES", 2**10)
    patch.setattr(guide_training, "TRAINING_SAMPLES", (2**12,))
    patch.setattr(scene_render, "SAMPLES_PER_RANGE", 1)
    patch.setenv("LIGHTPAINT_CACHE", str(cache))


@dataclass
class ItemListener:
    """Listens, and tells `when` of all that is said."""

    when: Callable[[str], None] = lambda text: None
    said: list[str] = field(default_factory=list)
    workers: dict[str, str | None] = field(default_factory=dict)

    def __call__(self, *_: Any) -> None: ...

    def say(self, text: str) -> None:
        self.said.append(text)
        self.when(text)

    note = say

    def at_work(self, worker: str, what: str | None) -> None:
        self.workers[worker] = what

    @property
    def starts(self) -> Counter[str]:
        """How often each item was begun."""
        return Counter(text.split(" begun by ")[0] for text in self.said if " begun by " in text)


def run_item(
    here: Path, name: str, workers: Workers, hears: ItemListener, **how: Any
) -> BatchOutcome:
    with pytest.MonkeyPatch.context() as patch:
        render_small_parts(patch, here / f"cache-{name}")
        planned = plan(here / "looks.toml", here / name)
        outcome = run_batch(planned, RunOptions(cluster=workers.address, **how), hears)  # type: ignore[arg-type]
    assert not outcome.failed
    return outcome


@dataclass
class Killer:
    """Kills the worker that has begun `victim`, which waits for it, once `is_time` holds."""

    workers: Workers
    victim: str
    is_time: Callable[[], bool]
    how: int = signal.SIGKILL
    thread: threading.Thread | None = None

    def __post_init__(self) -> None:
        (self.workers.slow / f"wait-{self.victim}").touch()

    def hear(self, text: str) -> None:
        if re.fullmatch(f"{self.victim}(: answer)? begun by .*", text) and self.thread is None:
            worker = text.split()[-1]
            self.thread = threading.Thread(target=self._kill, args=(worker,))
            self.thread.start()

    def _kill(self, worker: str) -> None:
        try:
            wait_until(self.is_time)
            os.kill(self.workers.pid(worker), self.how)
        finally:
            (self.workers.slow / f"wait-{self.victim}").unlink()


def test_a_cluster_does_what_one_process_does(
    workers: Workers, reference_batch: tuple[Path, dict[str, bytes]]
) -> None:
    here, expected = reference_batch
    hears = ItemListener()
    run_item(here, "all", workers, hears)
    assert contents(here / "all") == expected
    parts = [name for name in hears.starts if name.startswith("part ")]
    assert len(parts) == len(plan_of_parts(here)) >= 4
    assert all(hears.starts[name] == 1 for name in parts)
    # One for the basis, and one for the lighting that is had by sums.
    assert hears.starts["training"] == 2
    assert all(hears.starts[f"{name}: answer"] == 1 for name in ("bright", "third", "third-warmer"))
    # The only final render is one of both workers.
    assert hears.starts["bright 0"] == hears.starts["bright 1"] == 1
    assert hears.starts["bright: render"] == 0
    assert list(hears.workers.values()) == [None, None]
    assert len({text.split()[-1] for text in hears.said if " begun by " in text}) == 2
    # Again nothing is done; and on a shared disk it is the same.
    assert run_item(here, "all", workers, hears).done == []
    run_item(here, "shared", workers, ItemListener(), shared_fs=True)
    assert contents(here / "shared") == expected


def test_a_worker_killed_in_the_middle_of_a_basis_costs_one_part(
    workers: Workers, reference_batch: tuple[Path, dict[str, bytes]]
) -> None:
    workers.await_two()
    here, expected = reference_batch
    spool = here / "cache-killed" / "parts"
    killer = Killer(workers, "part 3", lambda: len(list(spool.glob("*/[0-9]*-*.npz"))) >= 2)
    hears = ItemListener(killer.hear)
    run_item(here, "killed", workers, hears)
    assert killer.thread is not None
    assert contents(here / "killed") == expected
    again = {name: count for name, count in hears.starts.items() if count > 1}
    assert again == {"training": 2, "part 3": 2}
    assert any("is lost; trying elsewhere" in text for text in hears.said)
    # What was kept of the parts has gone.
    assert list(spool.iterdir()) == []


def test_a_worker_killed_in_the_middle_of_a_look_costs_one_try(
    workers: Workers, reference_batch: tuple[Path, dict[str, bytes]]
) -> None:
    workers.await_two()
    here, expected = reference_batch
    journal = here / "look" / "journal.jsonl"

    def others_are_done() -> bool:
        """Bright waits, and third is done meanwhile."""
        return journal.is_file() and len(journal.read_text().splitlines()) >= 2

    killer = Killer(workers, "bright", others_are_done)
    hears = ItemListener(killer.hear)
    run_item(here, "look", workers, hears)
    assert killer.thread is not None
    assert contents(here / "look") == expected
    again = {name: count for name, count in hears.starts.items() if count > 1}
    assert again == {"training": 2, "bright: answer": 2}


def test_a_worker_that_hangs_and_one_without_memory_are_replaced(
    workers: Workers, reference_batch: tuple[Path, dict[str, bytes]]
) -> None:
    workers.await_two()
    here, expected = reference_batch
    (workers.slow / "wait-part 2").touch()
    (workers.slow / "memory-third").touch()

    def free(text: str) -> None:
        if text.startswith("part 2: ") and " takes more than " in text:
            (workers.slow / "wait-part 2").unlink()

    hears = ItemListener(free)
    run_item(here, "hung", workers, hears, task_limit_s=5.0)
    assert contents(here / "hung") == expected
    # On a busy machine others may take too long as well.
    assert hears.starts["part 2"] >= 2
    assert hears.starts["third: answer"] >= 2


def test_a_batch_that_was_killed_goes_on_with_the_parts_that_it_has(
    workers: Workers, reference_batch: tuple[Path, dict[str, bytes]]
) -> None:
    workers.await_two()
    here, expected = reference_batch
    spool = here / "cache-stopped" / "parts"

    def stop(text: str) -> None:
        if text.startswith("part ") and len(list(spool.glob("*/[0-9]*-*.npz"))) >= 2:
            raise KeyboardInterrupt

    first, second = ItemListener(stop), ItemListener()
    with pytest.raises(KeyboardInterrupt):
        run_item(here, "stopped", workers, first)
    kept = len(list(spool.glob("*/[0-9]*-*.npz")))
    assert kept >= 2
    run_item(here, "stopped", workers, second)
    assert contents(here / "stopped") == expected
    parts = sum(name.startswith("part ") for name in second.starts)
    assert parts == len(plan_of_parts(here)) - kept
    assert "training" not in second.starts


def plan_of_parts(here: Path) -> list[Any]:
    from lightpaint.scene.scene_reader import load_scene

    with pytest.MonkeyPatch.context() as patch:
        render_small_parts(patch, here / "none")
        return parts_module.plan_parts(load_scene(here / "room.xml"), 16)


def test_what_is_wrong_with_a_cluster_is_one_line(folder: Path, workers: Workers) -> None:
    for options, said in (
        (("--cluster", "tcp://127.0.0.1:9"), "no scheduler answers at tcp://127.0.0.1:9"),
        (("--cluster", "nowhere"), "no scheduler answers at nowhere"),
        (("--cluster", workers.address, "--workers", "2"), "give one of them"),
        (("--shared-fs",), "give --cluster ADDRESS, too"),
        (("--task-limit", "3"), "give --cluster ADDRESS, too"),
    ):
        found = run(folder, "batch", "looks.toml", "-o", "wrong", "-q", *options)
        assert found.returncode == 2
        [line] = found.stderr.splitlines()
        assert line.startswith("lightpaint batch: ")
        assert said in line


def test_without_dask_the_line_is_said_that_installs_it(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    found = run(folder, "batch", "looks.toml", "-o", "wrong", "--cluster", "tcp://127.0.0.1:9")
    assert found.returncode == 2
    assert "pip install 'lightpaint[cluster]'" in found.stderr


def test_workers_of_another_version_are_left_out(
    workers: Workers, monkeypatch: pytest.MonkeyPatch
) -> None:
    from lightpaint.batch.cluster import worker as cluster_worker

    workers.await_two()
    mine = {**cluster_worker.versions(), "lightpaint": "other"}
    # Workers find the function by its name, and theirs is not changed.
    monkeypatch.setattr("lightpaint.batch.cluster.workers.own_versions", lambda: mine)
    hears = ItemListener()
    with Cluster(workers.address, hears):  # type: ignore[arg-type]
        assert sum("is left out: it has lightpaint" in text for text in hears.said) == 2


@pytest.fixture
def folder(reference_batch: tuple[Path, dict[str, bytes]]) -> Path:
    return reference_batch[0]
