"""One thread has Mitsuba at a time, and those that nobody waits for let others go first."""

import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from spectral_room import write_spectral_room

import lightpaint as lp
from lightpaint.arrays import Floats
from lightpaint.lighting.constraints.constraints_file import constraints_of
from lightpaint.pipeline.job.sources import spectral_scene
from lightpaint.scene.runtime.render_lock import MAX_WAIT_S, MITSUBA, Turns
from lightpaint.scene.runtime.variant import spectral_variant, use_variant
from lightpaint.scene.scene_reader import load_scene
from lightpaint.scene.scene_render import Stream, render

#: Seconds of a piece of work, and in which a thread surely comes to its turn.
PIECE_S, SOON_S = 0.02, 60


class Work:
    """Pieces that several threads do, and whether two are ever done at once."""

    def __init__(self, turns: Turns) -> None:
        self.turns, self.done, self._at_work = turns, list[str](), 0
        self.has_begun = threading.Event()

    def piece(self, name: str) -> None:
        assert not self._at_work, "two at once"
        self._at_work += 1
        self.done.append(name)
        self.has_begun.set()
        time.sleep(PIECE_S)
        self._at_work -= 1

    def urgent(self) -> None:
        with self.turns.acquired():
            self.piece("urgent")
            with self.turns.acquired():  # as what is done within it does
                self.piece("urgent")

    def leisure(self) -> None:
        with self.turns.low_priority(), self.turns.acquired(), self.turns.acquired():
            for _ in range(6):
                self.piece("leisure")
                self.turns.let_others()


@pytest.fixture
def work() -> Work:
    return Work(Turns())


def _together(first: Callable[[], None], *others: Callable[[], None], work: Work) -> None:
    with ThreadPoolExecutor(1 + len(others)) as threads:
        running = [threads.submit(first)]
        assert work.has_begun.wait(SOON_S)
        running += [threads.submit(other) for other in others]
        for one in running:
            one.result(SOON_S)


def test_who_is_waited_for_goes_first(work: Work):
    _together(work.leisure, work.urgent, work.urgent, work=work)
    assert sorted(work.done) == ["leisure"] * 6 + ["urgent"] * 4
    first = work.done.index("urgent")
    assert work.done[first : first + 4] == ["urgent"] * 4


def test_nobody_is_passed_over(work: Work):
    """Not even by somebody who takes turn after turn without a pause."""
    is_done = threading.Event()

    def work_on() -> None:
        while not is_done.is_set():
            work.urgent()

    def work_urgently() -> None:
        work.urgent()
        is_done.set()

    _together(work_on, work_urgently, work=work)


def test_who_is_at_leisure_comes_now_and_then(work: Work, monkeypatch: pytest.MonkeyPatch):
    """Somebody may render in a notebook one picture after the other."""
    monkeypatch.setattr("lightpaint.scene.runtime.render_lock.MAX_WAIT_S", 5 * PIECE_S)
    is_done = threading.Event()

    def work_on() -> None:
        while not is_done.is_set():
            work.urgent()

    def leisure() -> None:
        work.leisure()
        is_done.set()

    _together(work_on, leisure, work=work)
    assert work.done.count("leisure") == 6


def test_two_who_wait_agree_whose_turn_it_is(work: Work, monkeypatch: pytest.MonkeyPatch):
    """One looks just before the patience of who is at leisure ends, the other just after."""
    turns, idle = work.turns, threading.local()
    monkeypatch.setattr(
        "lightpaint.scene.runtime.render_lock.monotonic",
        lambda: (
            0.0
            if not turns._low_priority_since
            else MAX_WAIT_S * (0.99 if hasattr(idle, "is_one") else 1.01)
        ),
    )

    def leisure() -> None:
        idle.is_one = True
        work.leisure()

    def holds() -> None:
        with turns.acquired():
            work.piece("first")
            while not (turns._waiting and turns._low_priority_since):
                time.sleep(PIECE_S)

    _together(holds, leisure, work.urgent, work=work)
    assert sorted(work.done) == ["first", *["leisure"] * 6, "urgent", "urgent"]


def test_who_waits_for_another_lets_it(work: Work):
    """Somebody who hears of progress may wait for a thread that wants its own turn."""
    turns, is_done = work.turns, threading.Event()

    def call_listener() -> None:
        with turns.acquired(), turns.acquired():
            work.piece("first")
            with turns.aside():
                assert is_done.wait(SOON_S)
            work.piece("last")

    def listen() -> None:
        with turns.acquired():
            work.piece("heard")
        is_done.set()

    _together(call_listener, work.leisure, listen, work=work)
    # Who is at leisure does not come in between.
    assert work.done == ["first", "heard", "last", *["leisure"] * 6]


def test_who_is_interrupted_while_waiting_keeps_nobody(work: Work, monkeypatch: pytest.MonkeyPatch):
    turns = work.turns

    def interrupted(_: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(turns._changed, "wait_for", interrupted)
        with pytest.raises(KeyboardInterrupt), turns.acquired():
            pass
    _together(work.leisure, work=work)
    assert work.done == ["leisure"] * 6


@pytest.mark.nightly
def test_threads_render_what_one_alone_does(small_room: lp.Scene, monkeypatch: pytest.MonkeyPatch):
    """Two scenes in two threads, one of them loaded anew between the passes of the other."""
    monkeypatch.setattr("lightpaint.scene.scene_render.SAMPLES_PER_PASS", 2**11)
    single_render = lp.render_basis(small_room, spp=64)
    order: list[str] = []
    has_begun = threading.Event()

    def note_pass(label: str, done: int, total: int, unit: str = "passes") -> None:
        order.append("pass")
        has_begun.set()

    def frame() -> Floats:
        estimate = render(load_scene(small_room.path), spp=4, stream=Stream.VERIFICATION)
        order.append("frame")
        return estimate.image

    def frames() -> list[Floats]:
        assert has_begun.wait(SOON_S)
        return [frame() for _ in range(4)]

    with ThreadPoolExecutor(1) as threads:
        future = threads.submit(frames)
        with MITSUBA.low_priority():
            basis = lp.render_basis(small_room, spp=64, progress=note_pass)
        pictures = future.result(60)
    first, *other_frames = (k for k, kind in enumerate(order) if kind == "frame")
    assert order[:first]
    assert order[other_frames[-1] + 1 :]  # it was in the middle
    # Sums are added in any order by several threads: float32.
    np.testing.assert_allclose(basis.images, single_render.images, rtol=1e-4, atol=1e-5)
    for picture in [*pictures, frame()]:
        np.testing.assert_allclose(picture, pictures[0], rtol=1e-4, atol=1e-5)


def test_who_borrows_a_turn_finds_things_as_expected():
    """Each thread has its own context for the time at which its turn is lent."""
    turns, state, seen = Turns(), ["rgb"], list[str]()

    @contextmanager
    def in_rgb() -> Iterator[None]:
        state[0] = "rgb"
        yield
        assert turns.is_held
        state[0] = "spectral"

    def leisure() -> None:
        with turns.low_priority(), turns.acquired(), turns.around_lending(in_rgb):
            state[0] = "spectral"
            is_waiting.set()
            while len(seen) < 3:
                assert state[0] == "spectral"
                turns.let_others()
            state[0] = "rgb"

    def urgent() -> None:
        assert is_waiting.wait(SOON_S)
        for _ in range(3):
            with turns.acquired():
                seen.append(state[0])
                with turns.aside():  # without a context of its own
                    pass

    is_waiting = threading.Event()
    with ThreadPoolExecutor(2) as threads:
        for one in [threads.submit(leisure), threads.submit(urgent)]:
            one.result(SOON_S)
    assert seen == ["rgb"] * 3
    assert state == ["rgb"]


@pytest.mark.nightly
def test_others_render_in_rgb_between_the_passes_of_spectra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """Two threads, of which one has Mitsuba in its spectral variant."""
    monkeypatch.setattr("lightpaint.scene.scene_render.SAMPLES_PER_PASS", 2**11)
    plain = load_scene(write_spectral_room(tmp_path))
    spectral = spectral_scene(plain, constraints_of(plain.requests))
    order: list[str] = []
    has_begun = threading.Event()

    def note_pass(label: str, done: int, total: int, unit: str = "passes") -> None:
        order.append("pass")
        has_begun.set()

    def frame() -> Floats:
        estimate = render(load_scene(plain.path), spp=4, stream=Stream.VERIFICATION)
        order.append(use_variant().variant)
        return estimate.image

    def frames() -> list[Floats]:
        assert has_begun.wait(SOON_S)
        return [frame() for _ in range(3)]

    alone = lp.render_basis(spectral, spp=64)
    with ThreadPoolExecutor(1) as threads:
        future = threads.submit(frames)
        with MITSUBA.low_priority():
            basis = lp.render_basis(spectral, spp=64, progress=note_pass)
        pictures = future.result(SOON_S)
    variant = use_variant().variant
    assert variant.endswith("_rgb")
    assert order[-1] == "pass"  # the frames were in the middle
    assert order.count("pass") + order.count(variant) == len(order)
    # Sums are added in any order by several threads: float32.
    np.testing.assert_allclose(basis.images, alone.images, rtol=1e-4, atol=1e-5)
    for picture in [*pictures, frame()]:
        np.testing.assert_allclose(picture, pictures[0], rtol=1e-4, atol=1e-5)


def test_changes_of_the_variant_warn_of_nothing(monkeypatch: pytest.MonkeyPatch):
    """Mitsuba loads its own Python integrators anew each time, which Dr.Jit counts."""
    import drjit.ast

    use_variant()
    monkeypatch.setattr(drjit.ast, "_syntax_counter", 2000)
    with spectral_variant():
        pass
