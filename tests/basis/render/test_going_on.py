"""A basis that goes on where it stopped: same samples, same result, nothing mixed."""

import os
import signal
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from renderer import LIGHTS, assert_equal_bits, same_basis, write_room

import lightpaint.scene.scene_render
from lightpaint.basis.file.basis_file import read_basis, write_basis
from lightpaint.basis.light_basis import Basis
from lightpaint.basis.render import basis_render, render_budget
from lightpaint.basis.render.basis_render import render_basis
from lightpaint.errors import BasisError
from lightpaint.progress import Interrupted
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.runtime.variant import use_variant
from lightpaint.scene.scene_reader import load_scene
from lightpaint.scene.scene_render import plan_passes


@pytest.fixture(autouse=True)
def small_passes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Steps of four samples per pixel of the test room in each half."""
    monkeypatch.setattr(lightpaint.scene.scene_render, "SAMPLES_PER_PASS", 4 * 4 * 24 * 20)
    monkeypatch.setattr(basis_render, "TRAINING_SAMPLES", (2**12,))


def test_what_is_left_to_do_goes_on_with_whole_passes() -> None:
    all_passes = plan_passes(24 * 20, 160)
    for spp_before in range(0, 80, 16):
        rest = plan_passes(24 * 20, 160, done=(spp_before, spp_before))
        assert rest == all_passes[2 * spp_before // 16 :]
    assert plan_passes(24 * 20, 160, done=(32, 16))[0] == (1, 16)
    assert sum(size for half, size in plan_passes(24 * 20, 160, done=(32, 16)) if half) == 64
    assert plan_passes(24 * 20, 160, done=(80, 80)) == []


@pytest.mark.parametrize("through_a_file", [True, False])
def test_in_two_goes_as_in_one(tmp_path: Path, small_room: Scene, through_a_file: bool) -> None:
    first = render_basis(small_room, spp=16, seed=3)
    if through_a_file:
        write_basis(tmp_path / "b.exr", first)
        first = read_basis(tmp_path / "b.exr")
    continuation = render_basis(small_room, spp=40, seed=3, start=first)
    single_render = render_basis(small_room, spp=40, seed=3)
    same_basis(continuation, single_render, of_file=through_a_file)


@pytest.mark.nightly
@pytest.mark.parametrize("after", [1, 2, 4])
def test_an_interrupt_keeps_what_is_done(small_room: Scene, after: int) -> None:
    saved_bases: list[Basis] = []

    def keep(basis: Basis) -> bool:
        saved_bases.append(basis)
        return True

    def press_ctrl_c(_label: str, done: int, _total: int) -> None:
        if done == after:
            os.kill(os.getpid(), signal.SIGINT)

    done = 8 * after
    with pytest.raises(Interrupted, match=f"{done} of 40"):
        render_basis(small_room, spp=40, keep=keep, progress=press_ctrl_c)
    assert saved_bases[-1].origin.spp == done
    continuation = render_basis(small_room, spp=40, start=saved_bases[-1])
    assert_equal_bits(continuation, render_basis(small_room, spp=40))


@pytest.mark.nightly
def test_an_interrupt_between_the_halves_of_a_step_waits_for_the_second(
    small_room: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    use_variant()
    from lightpaint.basis.render.tracer.one_pass import Tracer

    saved_bases: list[Basis] = []
    add, calls = Tracer.add, 0

    def press_ctrl_c(*step: Any) -> None:
        nonlocal calls
        calls += 1
        add(*step)
        if calls == 3:  # the first half of the second step
            os.kill(os.getpid(), signal.SIGINT)

    with monkeypatch.context() as patch:
        patch.setattr(Tracer, "add", press_ctrl_c)
        with pytest.raises(Interrupted, match="16 of 40"):
            render_basis(small_room, spp=40, keep=lambda basis: not saved_bases.append(basis))
    as_asked = render_basis(small_room, spp=16)
    assert_equal_bits(replace(saved_bases[-1], origin=as_asked.origin), as_asked)
    continuation = render_basis(small_room, spp=40, start=saved_bases[-1])
    assert_equal_bits(continuation, render_basis(small_room, spp=40))


@pytest.mark.nightly
@pytest.mark.parametrize("integrator", ["path", "volpathmis"])
def test_what_goes_on_has_the_bits_of_one_render(tmp_path: Path, integrator: str) -> None:
    options = {"integrator": f'<integrator type="{integrator}"/>'}
    scene = load_scene(write_room(tmp_path, lights=LIGHTS["panel"] + LIGHTS["beam"], **options))
    single_render = render_basis(scene, spp=40)
    # Separate renders draw other numbers where their passes end elsewhere.
    rungs = (2, 8, 24) if integrator == "path" else (16, 32)
    basis = None
    for spp in rungs:
        basis = render_basis(scene, spp=spp, start=basis, is_final=False)
        assert basis.origin.spp == spp
    continuation = render_basis(scene, spp=40, start=basis)
    assert_equal_bits(continuation, single_render)
    assert continuation.sums is None


def test_enough_is_enough(small_room: Scene) -> None:
    basis = render_basis(small_room, spp=16)
    assert render_basis(small_room, spp=8, start=basis) is basis


def test_nothing_is_mixed(tmp_path: Path, small_room: Scene) -> None:
    basis = render_basis(small_room, spp=4)
    with pytest.raises(BasisError, match="another scene, sensor, film or seed"):
        render_basis(small_room, spp=8, seed=1, start=basis)
    changed = load_scene(write_room(tmp_path), parameters={"width": 20})
    with pytest.raises(BasisError, match="another scene, sensor, film or seed"):
        render_basis(changed, spp=8, start=basis)


def test_what_is_finished_is_left_to_the_caller_to_keep(
    small_room: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A thousand lights take as long to write as to render."""
    monkeypatch.setattr(render_budget, "KEEP_EVERY_S", -1.0)
    for samples_per_pass, has_several_steps in ((2**21, False), (4 * 4 * 24 * 20, True)):
        monkeypatch.setattr(lightpaint.scene.scene_render, "SAMPLES_PER_PASS", samples_per_pass)
        kept_spp: list[int] = []
        basis = render_basis(
            small_room, spp=20, keep=lambda basis, kept=kept_spp: not kept.append(basis.origin.spp)
        )
        assert bool(kept_spp) is has_several_steps
        assert basis.origin.spp not in kept_spp
