"""Planes of groups, and of what is kept, against the planes of their emitters."""

from pathlib import Path

import numpy as np
import pytest
from renderer import (
    LIGHTS,
    SAME_SAMPLES,
    SCREEN,
    TWIN,
    mitsuba_render,
    one_pass,
    write_room,
)

from lightpaint.basis.cache.cached_render import obtain_basis
from lightpaint.basis.file.basis_file import read_basis, write_basis
from lightpaint.basis.light_basis import Basis
from lightpaint.basis.render.basis_render import render_basis
from lightpaint.basis.render.rendered_basis import SEPARATE, is_of
from lightpaint.basis.render.separate_renders import BLACK, WHITE
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.properties.emission import MULTIPLE
from lightpaint.scene.scene_reader import load_scene

SLOW = '<integrator type="volpathmis"><integer name="max_depth" value="5"/></integrator>'

ROOM = "".join(LIGHTS.values()) + TWIN
TIED = {"pair": ["bulb", "twin"], "mix": ["panel", "sun"]}


def planes_by_name(scene: Scene, *, seed: int) -> dict[str, np.ndarray]:
    planes = one_pass(scene, seed=seed, spp=16)
    return {light.name: plane for light, plane in zip(scene.lights, planes, strict=True)}


def test_a_tied_plane_is_the_sum_of_its_members_and_the_rest_that_of_the_others(
    tmp_path: Path,
) -> None:
    path = write_room(tmp_path, lights=ROOM)
    plain_scene = load_scene(path)
    tied = load_scene(path, groups=TIED, lights=["pair", "mix"])
    assert [light.name for light in tied.lights] == ["mix", "pair", "rest"]
    single = planes_by_name(plain_scene, seed=3)
    current = {e.name: single[e.name] * np.float32(e.emission) for e in plain_scene.emitters}
    expected = {
        "pair": single["bulb"] + single["twin"],  # of one colour, so per unit of it
        "mix": current["panel"] + current["sun"],  # as authored
        "rest": current["beam"] + current["sky"],
    }
    tied_planes = planes_by_name(tied, seed=3)
    for name, plane in expected.items():
        assert plane.max() > 0
        assert np.abs(tied_planes[name] - plane).max() <= SAME_SAMPLES * plane.max(), name


@pytest.mark.parametrize("integrator", [None, SLOW])
def test_what_cannot_be_scaled_is_rendered_as_it_is(tmp_path: Path, integrator: str | None) -> None:
    options = {} if integrator is None else {"integrator": integrator}
    path = write_room(tmp_path, lights=SCREEN + LIGHTS["bulb"] + LIGHTS["sky"], **options)
    scene = load_scene(path, lights=["bulb"])
    assert [e.name for e in scene.emitters if e.obstacle] == ["screen"]
    basis = render_basis(scene, spp=64)
    assert (basis.origin.method == SEPARATE) == (integrator is not None)
    # The parts of the picture, each alone, add up to the picture of all.
    reference = mitsuba_render(scene, {"bulb": WHITE}, seed=5, spp=256)
    bulb = mitsuba_render(scene, {"bulb": WHITE, "rest": BLACK}, seed=5, spp=256)
    rest = mitsuba_render(scene, {"bulb": BLACK}, seed=5, spp=256)
    for name, image in (("bulb", bulb), ("rest", rest), ("both", reference)):
        plane = basis.images.sum(axis=0) if name == "both" else basis.image(name)
        # Means over the picture; 64 samples of 480 pixels leave a few per cent of noise.
        np.testing.assert_allclose(plane.mean(), image.mean(), rtol=0.08, err_msg=name)


@pytest.mark.nightly
def test_rest_of_separate_renders_is_the_present_render_of_the_others(tmp_path: Path) -> None:
    path = write_room(tmp_path, lights=ROOM, integrator=SLOW)
    basis = render_basis(load_scene(path, groups=TIED, lights=["mix"]), spp=64)
    reference = mitsuba_render(load_scene(path), seed=1, spp=256)
    np.testing.assert_allclose(
        basis.images.sum(axis=0).mean(), reference.mean(), rtol=0.05
    )  # noise


@pytest.mark.nightly
def test_another_choice_is_another_basis(tmp_path: Path) -> None:
    path = write_room(tmp_path, lights=ROOM)
    choices: list[dict[str, object]] = [
        {},
        {"groups": {"pair": ["bulb", "twin"]}},
        {"groups": {"couple": ["bulb", "twin"]}},
        {"groups": {"pair": ["bulb", "sky"]}},
        {"lights": ["bulb"]},
        {"lights": ["bulb", "sky"]},
    ]
    scenes = [load_scene(path, **choice) for choice in choices]  # type: ignore[arg-type]
    assert len({scene.identity for scene in scenes}) == len(scenes)
    assert scenes[0].identity == scenes[0].content == scenes[1].content
    # To choose all is to choose nothing, and order is not a choice.
    assert load_scene(path, lights=["*"]).identity == scenes[0].identity
    reordered = load_scene(path, groups={"pair": ["twin", "bulb"]})
    assert reordered.identity == scenes[1].identity

    bases: list[Basis] = [obtain_basis(scene, spp=2) for scene in scenes]
    for scene, basis in zip(scenes, bases, strict=True):
        assert (
            obtain_basis(scene, spp=2).names == basis.names == tuple(x.name for x in scene.lights)
        )
        assert [is_of(other, basis, 0) for other in scenes].count(True) == 1


def test_the_file_knows_members_and_what_is_fixed(tmp_path: Path) -> None:
    scene = load_scene(write_room(tmp_path, lights=ROOM), groups=TIED, lights=["mix", "pair"])
    basis = render_basis(scene, spp=2)
    write_basis(tmp_path / "a.basis.exr", basis)
    read = read_basis(tmp_path / "a.basis.exr")
    assert read.lights == basis.lights
    assert [light.is_fixed for light in read.lights] == [False, False, True]
    assert read.lights[2].members == ("beam", "sky")
    assert read.lights[2].unit == MULTIPLE
    assert b"is_fixed" in (tmp_path / "a.basis.exr").read_bytes()
    # Where every emitter is a light, the file says no more than it used to.
    write_basis(tmp_path / "b.basis.exr", render_basis(load_scene(scene.path), spp=2))
    raw = (tmp_path / "b.basis.exr").read_bytes()
    assert b"is_fixed" not in raw
    assert b"members" not in raw


def test_an_emitter_of_an_unknown_kind_is_kept(tmp_path: Path) -> None:
    beam = LIGHTS["panel"].replace('type="area"', 'type="directionalarea"')
    scene = load_scene(write_room(tmp_path, lights=beam + LIGHTS["bulb"], integrator=SLOW))
    assert scene.light("rest").member_names == ("panel",)
    assert "is a directionalarea emitter" in scene.emitters[0].obstacle
    # Nothing samples it and no ray meets it, in this integrator: it is there, and dark.
    assert not render_basis(scene, spp=2).image("rest").any()
