"""A real scheduler and real worker processes: accidents cost nothing, to the last bit."""

import os
import re
import signal
import sys
import threading
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from batches import contents
from command import run
from dask_cluster import Workers, cluster_of, wait_until
from renderer import write_room

from lightpaint.basis.file import basis_file
from lightpaint.basis.render import banded_film, basis_render
from lightpaint.basis.render import render_parts as parts_module
from lightpaint.batch.dask_engine import Cluster
from lightpaint.batch.plan.planner import plan_batch
from lightpaint.batch.run import BatchOutcome, run_batch
from lightpaint.batch.run_options import RunOptions
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


@pytest.fixture(scope="module")
def workers(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Workers]:
    with cluster_of(2, tmp_path_factory.mktemp("cluster")) as worker_pool:
        yield worker_pool


@pytest.fixture(scope="module")
def reference_batch(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, bytes]]:
    """A folder with a manifest, and what its batch leaves that this process does alone."""
    folder = tmp_path_factory.mktemp("looks")
    write_room(folder)
    for name, light in (("bright", 0.8), ("dark", 0.2)):
        write_rgb(folder / f"{name}.exr", np.full((20, 24, 3), light, np.float32))
    (folder / "looks.toml").write_text(LOOKS, encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        render_small_parts(patch, folder / "cache-alone")
        limit_threads(1)
        try:
            outcome = run_batch(plan_batch(folder / "looks.toml", folder / "alone"))
        finally:
            limit_threads(None)
    assert not outcome.failed
    return folder, contents(folder / "alone")


def render_small_parts(patch: pytest.MonkeyPatch, cache: Path) -> None:
    patch.setattr(parts_module, "PART_SAMPLES", 2**10)
    patch.setattr(basis_render, "TRAINING_SAMPLES", (2**12,))
    patch.setattr(scene_render, "SAMPLES_PER_RANGE", 1)
    patch.setenv("LIGHTPAINT_CACHE", str(cache))


@dataclass
class ItemListener:
    """A listener that passes every remark to `when`."""

    when: Callable[[str], None] = lambda text: None
    remarks: list[str] = field(default_factory=list)
    workers: dict[str, str | None] = field(default_factory=dict)

    def __call__(self, *_: Any) -> None: ...

    def say(self, text: str) -> None:
        self.remarks.append(text)
        self.when(text)

    note = say

    def at_work(self, worker: str, task: str | None) -> None:
        self.workers[worker] = task

    @property
    def starts(self) -> Counter[str]:
        """How often each item was begun."""
        return Counter(text.split(" begun by ")[0] for text in self.remarks if " begun by " in text)


def run_item(
    folder: Path, name: str, workers: Workers, listener: ItemListener, **options: Any
) -> BatchOutcome:
    with pytest.MonkeyPatch.context() as patch:
        render_small_parts(patch, folder / f"cache-{name}")
        planned = plan_batch(folder / "looks.toml", folder / name)
        outcome = run_batch(planned, RunOptions(cluster=workers.address, **options), listener)  # type: ignore[arg-type]
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
    folder, expected = reference_batch
    listener = ItemListener()
    run_item(folder, "all", workers, listener)
    assert contents(folder / "all") == expected
    parts = [name for name in listener.starts if name.startswith("part ")]
    assert len(parts) == len(plan_of_parts(folder)) >= 4
    assert all(listener.starts[name] == 1 for name in parts)
    # One for the basis, and one for the lighting that is had by sums.
    assert listener.starts["training"] == 2
    assert all(
        listener.starts[f"{name}: answer"] == 1 for name in ("bright", "third", "third-warmer")
    )
    # The only final render is one of both workers.
    assert listener.starts["bright 0"] == listener.starts["bright 1"] == 1
    assert listener.starts["bright: render"] == 0
    assert list(listener.workers.values()) == [None, None]
    assert len({text.split()[-1] for text in listener.remarks if " begun by " in text}) == 2
    # Again nothing is done.
    assert run_item(folder, "all", workers, listener).done == []


@pytest.mark.nightly
def test_on_a_shared_disk_it_is_the_same(
    workers: Workers, reference_batch: tuple[Path, dict[str, bytes]]
) -> None:
    workers.await_all()
    folder, expected = reference_batch
    run_item(folder, "shared", workers, ItemListener(), shared_fs=True)
    assert contents(folder / "shared") == expected


@pytest.mark.nightly
def test_a_worker_killed_in_the_middle_of_a_basis_costs_one_part(
    workers: Workers, reference_batch: tuple[Path, dict[str, bytes]]
) -> None:
    workers.await_all()
    folder, expected = reference_batch
    spool = folder / "cache-killed" / "parts"
    killer = Killer(workers, "part 3", lambda: len(list(spool.glob("*/[0-9]*-*.npz"))) >= 2)
    listener = ItemListener(killer.hear)
    run_item(folder, "killed", workers, listener)
    assert killer.thread is not None
    assert contents(folder / "killed") == expected
    repeated = {name: count for name, count in listener.starts.items() if count > 1}
    assert repeated == {"training": 2, "part 3": 2}
    assert any("is lost; trying elsewhere" in text for text in listener.remarks)
    # What was kept of the parts has gone.
    assert list(spool.iterdir()) == []


@pytest.mark.nightly
def test_of_four_workers_two_are_killed_in_the_middle_of_a_basis(
    tmp_path: Path, reference_batch: tuple[Path, dict[str, bytes]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The others take their parts, whose sums this process adds in a file, to the same bits."""
    folder, expected = reference_batch
    spool = folder / "cache-halved" / "parts"
    monkeypatch.setattr(banded_film, "WHOLE_MAX_BYTES", 0)
    monkeypatch.setattr(basis_file, "SINGLES_MAX_BYTES", 0)
    with cluster_of(4, tmp_path) as four:
        killers = [
            Killer(four, victim, lambda: len(list(spool.glob("*/[0-9]*-*.npz"))) >= 2)
            for victim in ("part 2", "part 3")
        ]

        def hear(text: str) -> None:
            for killer in killers:
                killer.hear(text)

        listener = ItemListener(hear)
        run_item(folder, "halved", four, listener)
    assert all(killer.thread is not None for killer in killers)
    assert contents(folder / "halved") == expected
    repeated = {name: count for name, count in listener.starts.items() if count > 1}
    assert repeated == {"training": 2, "part 2": 2, "part 3": 2}
    lost = {text for text in listener.remarks if "is lost; trying elsewhere" in text}
    assert len({text.split(" worker ")[1] for text in lost}) == 2
    assert list(spool.iterdir()) == []


@pytest.mark.nightly
def test_a_worker_killed_in_the_middle_of_a_look_costs_one_try(
    workers: Workers, reference_batch: tuple[Path, dict[str, bytes]]
) -> None:
    workers.await_all()
    folder, expected = reference_batch
    journal = folder / "look" / "journal.jsonl"

    def others_are_done() -> bool:
        """Bright waits, and third is done meanwhile."""
        return journal.is_file() and len(journal.read_text().splitlines()) >= 2

    killer = Killer(workers, "bright", others_are_done)
    listener = ItemListener(killer.hear)
    run_item(folder, "look", workers, listener)
    assert killer.thread is not None
    assert contents(folder / "look") == expected
    repeated = {name: count for name, count in listener.starts.items() if count > 1}
    assert repeated == {"training": 2, "bright: answer": 2}


@pytest.mark.nightly
def test_a_worker_that_hangs_and_one_without_memory_are_replaced(
    workers: Workers, reference_batch: tuple[Path, dict[str, bytes]]
) -> None:
    workers.await_all()
    folder, expected = reference_batch
    (workers.slow / "wait-part 2").touch()
    (workers.slow / "memory-third").touch()

    def free(text: str) -> None:
        if text.startswith("part 2: ") and " takes more than " in text:
            (workers.slow / "wait-part 2").unlink()

    listener = ItemListener(free)
    run_item(folder, "hung", workers, listener, task_limit_s=5.0)
    assert contents(folder / "hung") == expected
    # On a busy machine others may take too long as well.
    assert listener.starts["part 2"] >= 2
    assert listener.starts["third: answer"] >= 2


@pytest.mark.nightly
def test_a_batch_that_was_killed_goes_on_with_the_parts_that_it_has(
    workers: Workers, reference_batch: tuple[Path, dict[str, bytes]]
) -> None:
    workers.await_all()
    folder, expected = reference_batch
    spool = folder / "cache-stopped" / "parts"

    def stop(text: str) -> None:
        if text.startswith("part ") and len(list(spool.glob("*/[0-9]*-*.npz"))) >= 2:
            raise KeyboardInterrupt

    first, second = ItemListener(stop), ItemListener()
    with pytest.raises(KeyboardInterrupt):
        run_item(folder, "stopped", workers, first)
    part_count = len(list(spool.glob("*/[0-9]*-*.npz")))
    assert part_count >= 2
    run_item(folder, "stopped", workers, second)
    assert contents(folder / "stopped") == expected
    parts = sum(name.startswith("part ") for name in second.starts)
    assert parts == len(plan_of_parts(folder)) - part_count
    assert "training" not in second.starts


def plan_of_parts(folder: Path) -> list[Any]:
    from lightpaint.scene.scene_reader import load_scene

    with pytest.MonkeyPatch.context() as patch:
        render_small_parts(patch, folder / "none")
        return parts_module.plan_parts(load_scene(folder / "room.xml"), 16)


def test_what_is_wrong_with_a_cluster_is_one_line(folder: Path, workers: Workers) -> None:
    for options, message in (
        (("--cluster", "tcp://127.0.0.1:9"), "no scheduler answers at tcp://127.0.0.1:9"),
        (("--cluster", "nowhere"), "no scheduler answers at nowhere"),
        (("--cluster", workers.address, "--workers", "2"), "give one of them"),
        (("--shared-fs",), "give --cluster ADDRESS, too"),
    ):
        completed = run(folder, "batch", "looks.toml", "-o", "wrong", "-q", *options)
        assert completed.returncode == 2
        [line] = completed.stderr.splitlines()
        assert line.startswith("lightpaint batch: ")
        assert message in line


def test_without_dask_the_line_is_said_that_installs_it(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    completed = run(folder, "batch", "looks.toml", "-o", "wrong", "--cluster", "tcp://127.0.0.1:9")
    assert completed.returncode == 2
    assert "pip install 'lightpaint[cluster]'" in completed.stderr


def test_workers_of_another_version_are_left_out(
    workers: Workers, monkeypatch: pytest.MonkeyPatch
) -> None:
    from lightpaint.batch import parcels

    workers.await_all()
    own_versions = {**parcels.versions(), "lightpaint": "other"}
    # Workers find the function by its name, and theirs is not changed.
    monkeypatch.setattr("lightpaint.batch.dask_workers.own_versions", lambda: own_versions)
    listener = ItemListener()
    with Cluster(workers.address, listener):  # type: ignore[arg-type]
        assert sum("is left out: it has lightpaint" in text for text in listener.remarks) == 2


@pytest.fixture
def folder(reference_batch: tuple[Path, dict[str, bytes]]) -> Path:
    return reference_batch[0]
