"""Separate renders that go on where they stopped, and budgets of time."""

import os
import signal
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from nightly import nightly
from renderer import LIGHTS, SAME_SAMPLES, mitsuba_render, same_basis, write_room

import lightpaint.scene.scene_render
from lightpaint.basis.cache.cached_render import obtain_basis
from lightpaint.basis.file.basis_file import read_basis, write_basis
from lightpaint.basis.light_basis import Basis
from lightpaint.basis.render.basis_render import render_basis
from lightpaint.basis.render.rendered_basis import ONE_PASS, SEPARATE
from lightpaint.basis.render.separate_renders import BLACK, WHITE
from lightpaint.errors import BasisError, SceneError
from lightpaint.progress import Interrupted
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.scene_reader import load_scene
from lightpaint.scene.scene_render import Stream, pass_seed

SEPARATELY = '<integrator type="volpathmis"><integer name="max_depth" value="4"/></integrator>'
THREE = LIGHTS["panel"] + LIGHTS["bulb"] + LIGHTS["sun"]


@pytest.fixture(autouse=True)
def small_passes(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Passes of four samples per pixel of the test room, and a cache of its own."""
    monkeypatch.setattr(lightpaint.scene.scene_render, "SAMPLES_PER_PASS", 4 * 4 * 24 * 20)
    monkeypatch.setenv("LIGHTPAINT_CACHE", str(tmp_path / "cache"))


@pytest.fixture
def scene(tmp_path: Path) -> Scene:
    return load_scene(write_room(tmp_path, lights=THREE, integrator=SEPARATELY))


def interrupt_after(passes: int, scene: Scene, saved_bases: list[Basis], **budget: object) -> str:
    """Render, press Ctrl-C after so many passes, and return what is said then."""
    count = 0

    def press_ctrl_c(_label: str, done: int, _total: int, _unit: str = "") -> None:
        nonlocal count
        count += done > 0
        if count == passes:
            os.kill(os.getpid(), signal.SIGINT)

    def keep(basis: Basis) -> bool:
        saved_bases.append(basis)
        return True

    with pytest.raises(Interrupted) as interrupt:
        render_basis(scene, keep=keep, progress=press_ctrl_c, **budget)  # type: ignore[arg-type]
    return str(interrupt.value)


def test_an_image_is_the_mean_of_renders_of_that_light_alone(scene: Scene) -> None:
    basis = render_basis(scene, spp=16, seed=7)
    assert basis.origin.each_light == ()
    for k, name in enumerate(basis.names):
        single_light = {x: WHITE if x == name else BLACK for x in basis.names}
        of_light = pass_seed(7, Stream.BASIS, k)
        halves = [
            mitsuba_render(
                scene, single_light, seed=pass_seed(of_light, Stream.BASIS, number), spp=4
            )
            for number in range(4)
        ]
        mean = np.mean(halves, axis=0)
        assert np.abs(basis.images[k] - mean).max() <= 4 * SAME_SAMPLES * mean.max()


@pytest.mark.parametrize("through_a_file", [True, nightly(False)])
@pytest.mark.parametrize("after", [nightly(1), 2, nightly(5), nightly(8), 11])
def test_interrupted_and_gone_on_is_as_if_never_interrupted(
    scene: Scene, tmp_path: Path, after: int, through_a_file: bool
) -> None:
    """Four passes for each of three lights."""
    saved_bases: list[Basis] = []
    message = interrupt_after(after, scene, saved_bases, spp=16)
    assert "of 16 samples per pixel, on average over the lights, are kept" in message
    part = saved_bases[-1]
    assert part.origin.method == SEPARATE
    pass_counts = [a + b for a, b, _, _ in part.origin.each_light]
    assert sum(pass_counts) == 4 * after
    # What the last light has in both halves; mostly it has none.
    assert part.origin.spp == (8 if after == 11 else 0)
    if through_a_file:
        write_basis(tmp_path / "part.exr", part)
        part = read_basis(tmp_path / "part.exr")
        assert part.origin == saved_bases[-1].origin
    continuation, single_render = (
        render_basis(scene, spp=16, start=part),
        render_basis(scene, spp=16),
    )
    same_basis(continuation, single_render, of_file=through_a_file)


@pytest.mark.nightly
def test_more_samples_add_only_what_is_missing(scene: Scene) -> None:
    rendered: list[int] = []

    def count(_label: str, done: int, _total: int) -> None:
        rendered.append(done)

    first = render_basis(scene, spp=8)
    continuation = render_basis(scene, spp=24, start=first, progress=count)
    assert sum(done > 0 for done in rendered) == 3 * 4
    same_basis(continuation, render_basis(scene, spp=24))


def test_nothing_is_mixed(scene: Scene, tmp_path: Path) -> None:
    saved_bases: list[Basis] = []
    interrupt_after(4, scene, saved_bases, spp=16)
    with pytest.raises(BasisError, match="another scene"):
        render_basis(scene, spp=16, seed=1, start=saved_bases[-1])
    with pytest.raises(BasisError, match="another scene"):
        render_basis(scene.reduced("1/2"), spp=16, start=saved_bases[-1])
    changed = scene.path.read_text(encoding="utf-8").replace("0.7 0.5 0.4", "0.7 0.5 0.5")
    scene.path.write_text(changed, encoding="utf-8")
    with pytest.raises(BasisError, match="another scene"):
        render_basis(load_scene(scene.path), spp=16, start=saved_bases[-1])


def test_a_part_of_separate_renders_does_not_replace_a_whole_basis(
    scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As when a basis of one pass is kept and a variant is asked for that has no such thing."""
    monkeypatch.setattr(
        "lightpaint.basis.render.rendered_basis.why_not_one_pass", lambda _scene: None
    )
    start = obtain_basis(scene, spp=8)
    assert start.origin.method == ONE_PASS
    monkeypatch.setattr(
        "lightpaint.basis.render.rendered_basis.why_not_one_pass", lambda _scene: "because"
    )
    with pytest.raises(KeyboardInterrupt) as interrupt:
        obtain_basis(scene, spp=16, progress=lambda *_: os.kill(os.getpid(), signal.SIGINT) or None)
    assert not isinstance(interrupt.value, Interrupted)
    assert obtain_basis(scene, spp=8).origin == start.origin


@pytest.mark.nightly
@pytest.mark.parametrize("integrator", [SEPARATELY, '<integrator type="path"/>'])
def test_a_time_is_kept_and_adds_samples(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, integrator: str
) -> None:
    # Quarters of a second of this process, which get as much done on a busy machine.
    clock = SimpleNamespace(
        monotonic=lambda: 4 * time.process_time(), process_time=time.process_time
    )
    monkeypatch.setattr("lightpaint.basis.render.render_budget.time", clock)
    scene = load_scene(write_room(tmp_path, lights=THREE, integrator=integrator))
    reports: list[tuple[int, int, str]] = []

    def listen(_label: str, done: int, total: int, unit: str = "passes") -> None:
        reports.append((done, total, unit))

    render_basis(scene, spp=4)  # compiles
    first = obtain_basis(scene, time_s=4, progress=listen)
    assert {(total, unit) for _, total, unit in reports} == {(4, "seconds")}
    assert reports[0][0] == 0
    assert first.origin.halves[0] == first.origin.halves[1] > 4
    assert first.origin.each_light == ()
    continuation = obtain_basis(scene, time_s=0.1)
    assert continuation.origin.spp > first.origin.spp
    if integrator is SEPARATELY:  # whose passes are as short for a number of samples
        same_basis(continuation, render_basis(scene, spp=continuation.origin.spp), of_file=True)


@pytest.mark.nightly
def test_a_time_goes_on_from_unequal_lights(scene: Scene) -> None:
    saved_bases: list[Basis] = []
    interrupt_after(4, scene, saved_bases, spp=16)
    part = saved_bases[-1]
    assert len(set(part.origin.each_light)) > 1
    continuation = render_basis(scene, time_s=0.01, start=part)
    assert continuation.origin.each_light == ()
    assert continuation.origin.spp > 16
    same_basis(continuation, render_basis(scene, spp=continuation.origin.spp))


def test_a_budget_is_a_number_or_a_time(scene: Scene) -> None:
    with pytest.raises(SceneError, match="not both"):
        render_basis(scene, spp=4, time_s=1)
    for time_s in (0, -1, float("nan"), float("inf")):
        with pytest.raises(SceneError, match="cannot render for"):
            render_basis(scene, time_s=time_s)


def test_a_file_that_counts_other_lights_is_refused(scene: Scene, tmp_path: Path) -> None:
    basis = render_basis(scene, spp=4)
    with pytest.raises(BasisError, match="samples of 1 lights for 3 lights"):
        replace(basis, origin=replace(basis.origin, each_light=((2, 2, 1, 1),)))
