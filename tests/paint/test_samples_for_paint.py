"""Samples that are added in the background, where the newest paint needs them."""

import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from patience import PATIENCE_S
from renderer import LIGHTS, write_room

from lightpaint.basis.cache.denoised_planes import read_denoised_planes
from lightpaint.basis.render import basis_render
from lightpaint.paint import protocol
from lightpaint.paint.background_threads import LatestWork
from lightpaint.paint.store.session_file import MemoryStore
from lightpaint.paint.studio import session_bases
from lightpaint.paint.studio.session_bases import SAMPLING, add_round
from lightpaint.paint.studio.session_studio import Studio
from lightpaint.paint.subject import Subject
from lightpaint.pipeline.job.settings import Settings
from lightpaint.pipeline.job_bases import Certainty
from lightpaint.scene.scene_reader import load_scene


@pytest.fixture
def subject(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Subject:
    """A room of two lights, whose paint is to be answered to 3 %."""
    monkeypatch.setattr(basis_render, "TRAINING_SAMPLES", (2**12,))
    monkeypatch.setenv("LIGHTPAINT_CACHE", str(tmp_path / "cache"))
    room = write_room(tmp_path, lights=LIGHTS["panel"] + LIGHTS["sun"])
    settings = Settings(error=0.03)
    return Subject(str(room), tmp_path, scene=load_scene(room), settings=settings)


def wait_until(is_so: Callable[[], Any], seconds: float = PATIENCE_S) -> None:
    end = time.monotonic() + seconds
    while not is_so():
        assert time.monotonic() < end
        time.sleep(0.02)


def paint(studio: Studio, stroke: int, light: tuple[float, float, float]) -> None:
    arrays = {
        "image": np.broadcast_to(np.float32(light), (6, 8, 3)).copy(),
        "importance": np.ones((6, 8), np.float32),
    }
    studio.handle(protocol.Paint(stroke, (9, 15, 4, 12), True), arrays)


@pytest.mark.nightly
def test_paint_is_answered_as_surely_as_was_asked_for(subject: Subject):
    studio = Studio([subject], MemoryStore)
    messages: list[Any] = []
    studio.on_message = messages.append
    studio.start()
    try:
        wait_until(lambda: studio.is_ready)
        paint(studio, 1, (0.5, 0.3, 0.2))

        def is_sure() -> bool:
            snapshot = studio.snapshot()
            solution = snapshot.solution()
            extra = snapshot.bases[0].origin.extra_spp
            return extra > 0 and Certainty.of(solution).error <= 0.03

        wait_until(is_sure)
        basis = studio.snapshot().bases[0]
        # Most of them are where the paint is.
        painted_mask = np.zeros(basis.size, bool)
        painted_mask[9:15, 4:12] = True
        assert basis.extra[painted_mask].mean() > 2 * basis.extra[~painted_mask].mean()
        # Nothing more is taken then.
        time.sleep(1)
        assert studio.snapshot().bases[0].origin == basis.origin

        # Pages hear of it, and of its end.
        def shares() -> list[float]:
            reports = [x for x in messages if isinstance(x, protocol.ProgressReport)]
            return [x.done / x.total for x in reports if x.task == SAMPLING]

        assert 0 < shares()[0] < 1
        wait_until(lambda: shares()[-1] == 1)
    finally:
        studio.close()
        studio.wait()


@pytest.mark.nightly
def test_planes_with_added_samples_are_denoised_anew(
    subject: Subject, monkeypatch: pytest.MonkeyPatch
):
    """Once there are enough, and not after each round."""
    denoised: list[tuple[float, int]] = []
    inner = session_bases.denoise_to_halves

    def denoise(basis: Any, k: int, factor: int) -> Any:
        denoised.append((basis.origin.extra_spp, k))
        return inner(basis, k, factor)

    monkeypatch.setattr(session_bases, "denoise_to_halves", denoise)
    studio = Studio([subject], MemoryStore)
    studio.start()
    try:
        wait_until(lambda: studio.is_ready)
        paint(studio, 1, (0.5, 0.3, 0.2))

        def is_done() -> bool:
            [basis] = studio.snapshot().bases
            extra = basis.origin.extra_spp
            return extra > 0 and (extra, len(basis.lights) - 1) in denoised

        wait_until(is_done)
        [basis] = studio.snapshot().bases
        assert Certainty.of(studio.snapshot().solution()).error <= 0.03
        lights = list(range(len(basis.lights)))
        assert [k for extra, k in denoised if extra > 0] == lights
        wait_until(lambda: read_denoised_planes(basis) is not None)
    finally:
        studio.close()
        studio.wait()


def test_a_round_gives_way_to_the_brush(subject: Subject):
    studio = Studio([subject], MemoryStore)
    studio.start()
    try:
        wait_until(lambda: studio.is_ready)
        paint(studio, 1, (0.5, 0.3, 0.2))
        snapshot = studio.snapshot()
        solution = snapshot.solution()
        assert add_round([subject], snapshot, solution, is_enough=lambda: True) is None
    finally:
        studio.close()
        studio.wait()


def test_only_the_latest_is_worked_on():
    jobs_done: list[int] = []
    first_begun, may_go_on = threading.Event(), threading.Event()

    def work(job_number: int) -> None:
        jobs_done.append(job_number)
        first_begun.set()
        may_go_on.wait(60)

    loop = LatestWork(work, lambda _: None)
    thread = threading.Thread(target=loop.run)
    thread.start()
    loop.give(1)
    first_begun.wait(60)
    loop.give(2)
    loop.give(3)
    may_go_on.set()
    wait_until(lambda: len(jobs_done) == 2)
    loop.stop()
    thread.join(60)
    assert jobs_done == [1, 3]
