"""Samples until the lights are as sure as was asked for, where the painting needs them."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from renderer import LIGHTS, write_room
from test_views import CLOSE

from lightpaint.basis.render import basis_render
from lightpaint.basis.render.basis_render import render_basis
from lightpaint.errors import LightpaintError
from lightpaint.lighting.analysis.noise.uncertainty import error_bars
from lightpaint.pipeline.job.settings import PILOT_SPP, Settings
from lightpaint.pipeline.job.solve_job import Job
from lightpaint.pipeline.job_bases import add_needed_samples
from lightpaint.pipeline.one_call import paint_with_light
from lightpaint.progress import listener
from lightpaint.report.measures import picture_errors
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.scene_reader import load_scene
from lightpaint.target.painted_target import Target


class Heard:
    """A listener that remembers remarks, and what was worked on."""

    def __init__(self) -> None:
        self.remarks: list[str] = []
        self.notes: list[str] = []
        self.work: set[str] = set()

    def __call__(self, label: str, *_: object) -> None:
        self.work.add(label)

    def note(self, text: str) -> None:
        self.notes.append(text)

    def say(self, text: str) -> None:
        self.remarks.append(text)


@pytest.fixture(autouse=True)
def short_training(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(basis_render, "TRAINING_SAMPLES", (2**12,))


@pytest.fixture
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LIGHTPAINT_CACHE", str(tmp_path / "cache"))


def painting(scene: Scene) -> Target:
    """Three lights dimmed, and a stroke that no mix reaches."""
    basis = render_basis(scene, spp=64, seed=7)
    weights = basis.current_weights * np.array([1, 0.5, 2, 1, 0.7][: len(basis.names)])[:, None]
    image = basis.mix(weights)
    image[8:12, 4:12] *= np.float32([1.2, 1, 0.8])
    return Target("t", image, np.ones(basis.size, np.float32), everything=True)


def answer(scene: Any, target: Any, folder: Path, **options: Any) -> tuple[Any, Heard]:
    recorder = Heard()
    options = {"verify": False, "report": False, "force": True} | options
    return paint_with_light(scene, target, folder, progress=recorder, **options), recorder


@pytest.mark.nightly
def test_the_scene_stays_loaded_over_the_rounds(
    small_room: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    target = painting(small_room)
    loads: list[Scene] = []
    load = Scene.load
    monkeypatch.setattr(
        Scene, "load", lambda self, *a, **o: loads.append(self) or load(self, *a, **o)
    )
    pilot = render_basis(small_room, spp=PILOT_SPP)
    rendered = len(loads)
    job = Job(
        (small_room,), (target,), tmp_path / "b", settings=Settings(error=0.15, use_cache=False)
    )
    listen = Heard()
    [basis] = add_needed_samples(job, [pilot], listener(listen))
    assert len(listen.notes) > 1  # one for each round
    assert len(loads) == rendered + 1
    assert basis.origin.extra_spp > 0


@pytest.mark.usefixtures("own_cache")
def test_samples_go_where_they_are_needed_until_the_error_is_met(small_room: Scene, tmp_path: Path):
    target = painting(small_room)
    look, recorder = answer(small_room, target, tmp_path / "a", error=0.3)
    # More samples of the basis do not lower what noise of the painting adds.
    error = picture_errors(look.basis, error_bars(look.solution, with_painting=False)).max()
    assert error <= 0.3
    assert look.basis.origin.spp == PILOT_SPP
    assert look.basis.extra.any()
    assert recorder.work >= {"basis", "top-up"}
    [remark] = [x for x in recorder.remarks if "where the painting needs them" in x]
    assert "lights are known to ± " in remark
    assert "was asked for" not in remark
    # All of it is kept: the same again renders nothing.
    second, recorder = answer(small_room, target, tmp_path / "a", error=0.3)
    assert not recorder.work & {"basis", "top-up"}
    np.testing.assert_array_equal(second.solution.weights, look.solution.weights)
    assert any("more where a painting needed them" in x for x in recorder.remarks)
    # A smaller error goes on from there.
    finer, _ = answer(small_room, target, tmp_path / "a", error=error / 1.5)
    assert (finer.basis.extra >= look.basis.extra).all()
    assert finer.basis.origin.extra_spp > look.basis.origin.extra_spp


def test_time_bounds_what_an_error_takes(small_room: Scene, tmp_path: Path):
    target = painting(small_room)
    options = {"error": 1e-4, "time_s": 0.01, "use_cache": False}
    look, recorder = answer(small_room, target, tmp_path / "a", **options)
    assert look.basis.origin.mean_spp == PILOT_SPP
    assert any("was asked for" in x for x in recorder.remarks)


@pytest.mark.nightly
def test_several_views_share_the_samples(tmp_path: Path):
    lights = LIGHTS["panel"] + LIGHTS["bulb"] + LIGHTS["beam"] + LIGHTS["sky"]
    room = write_room(tmp_path, lights=lights, sensors=CLOSE)
    scenes = [load_scene(room, sensor=name) for name in ("camera", "close")]
    targets = [painting(scene) for scene in scenes]
    looks, recorder = answer(scenes, targets, tmp_path / "a", error=0.3, use_cache=False)
    assert {"top-up of camera", "top-up of close"} <= recorder.work
    for look, scene in zip(looks, scenes, strict=True):
        assert look.basis.size == scene.size
        assert look.basis.origin.extra_spp > 0


@pytest.mark.nightly
def test_renders_of_single_lights_get_more_samples_everywhere(tmp_path: Path):
    integrator = '<integrator type="volpathmis"/>'
    room = write_room(tmp_path, lights=LIGHTS["panel"] + LIGHTS["bulb"], integrator=integrator)
    scene = load_scene(room)
    target = painting(scene)
    look, _ = answer(scene, target, tmp_path / "a", error=0.3, use_cache=False)
    assert look.basis.origin.method == "separate renders"
    assert look.basis.extra is None
    uncertainty = error_bars(look.solution, with_painting=False)
    assert picture_errors(look.basis, uncertainty).max() <= 0.3


@pytest.mark.parametrize("other", [{"spp": 4}, {"exact_spp": True}])
def test_an_error_and_a_number_of_samples_are_refused(other: dict[str, Any]):
    with pytest.raises(LightpaintError, match=r"error is 0\.02 and .*: expected either"):
        Settings(error=0.02, **other)


def test_an_error_needs_a_scene(make_basis: Any, tmp_path: Path):
    basis = make_basis()
    target = Target("t", basis.current_look, np.ones(basis.size, np.float32), everything=True)
    with pytest.raises(LightpaintError, match="error"):
        paint_with_light(None, target, tmp_path, basis=basis, error=0.02)
