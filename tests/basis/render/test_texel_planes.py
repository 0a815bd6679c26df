"""The one pass divides the light of a sky among its texels, as Mitsuba interpolates them."""

from pathlib import Path

import numpy as np
import pytest
from renderer import (
    LIGHTS,
    SAME_SAMPLES,
    map_file,
    mitsuba_render,
    one_pass,
    painted,
    predicted_and_shown,
    write_room,
)

from lightpaint.basis.render.basis_render import render_basis
from lightpaint.errors import SceneError
from lightpaint.lighting.answer.combination import combine
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.lighting.problem import Problem
from lightpaint.relit.relit_scene import relight
from lightpaint.relit.verification_render import verify
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.scene_reader import load_scene
from lightpaint.target.painted_target import Target

ROTATED = """<emitter type="envmap" id="sky"><string name="filename" value="map.exr"/>
    <float name="scale" value="2"/><transform name="to_world"><rotate x="1" angle="40"/>
    <rotate y="1" angle="70"/></transform></emitter>"""
#: A pane of glass before the camera.
PANE = """<shape type="rectangle"><transform name="to_world"><scale value="0.6"/>
    <translate x="-0.3" y="0.9" z="1.6"/></transform><bsdf type="thindielectric"/></shape>"""
SHORT = '<integrator type="path"><integer name="max_depth" value="1"/></integrator>'


def split_room(folder: Path, sky: str, *, size: str = "6x4", **options: str) -> Scene:
    """Return a room under a sky in texels."""
    map_file(folder)
    return load_scene(write_room(folder, lights=sky, **options), split={"sky": size})


def test_the_pictures_of_all_texels_sum_to_that_of_an_even_sky(tmp_path: Path) -> None:
    scene = split_room(tmp_path, LIGHTS["sky"])
    plain = load_scene(scene.path)
    whole = mitsuba_render(plain, {"sky": (1.0, 1.0, 1.0)}, seed=5, spp=16)
    planes = one_pass(scene, seed=5, spp=16)
    assert len(planes) == 24
    np.testing.assert_allclose(planes.sum(axis=0), whole, atol=SAME_SAMPLES * whole.max())


@pytest.mark.parametrize("sky", [LIGHTS["sky"], ROTATED], ids=["constant", "envmap"])
def test_a_sky_in_view_looks_as_mitsuba_shows_the_written_image(tmp_path: Path, sky: str) -> None:
    scene = split_room(tmp_path, sky, integrator=SHORT)
    predicted, shown = predicted_and_shown(scene, tmp_path)
    assert shown.max() > 0.5
    # Mitsuba's float32 interpolation.
    np.testing.assert_allclose(predicted, shown, atol=1e-4)


@pytest.mark.parametrize("sky", [LIGHTS["sky"], ROTATED], ids=["constant", "envmap"])
def test_a_render_of_the_written_image_confirms_the_prediction(tmp_path: Path, sky: str) -> None:
    scene = split_room(tmp_path, sky + LIGHTS["bulb"])
    lighting = painted(scene)
    predicted = combine(render_basis(scene, spp=256), lighting)
    relit = relight(scene, lighting, tmp_path / "relit.xml")
    assert (tmp_path / "relit.sky.exr").is_file()
    assert verify(predicted, relit, spp=256).agrees


def test_a_lighting_splits_the_scene_that_it_is_written_into(tmp_path: Path) -> None:
    scene = split_room(tmp_path, ROTATED)
    lighting = painted(scene)
    relight(scene, lighting, tmp_path / "a.xml")
    relight(load_scene(scene.path), lighting, tmp_path / "b.xml")
    assert (tmp_path / "a.sky.exr").read_bytes() == (tmp_path / "b.sky.exr").read_bytes()


def test_texels_that_are_not_adjusted_stay_in_the_written_image(tmp_path: Path) -> None:
    map_file(tmp_path)
    path = write_room(tmp_path, lights=ROTATED)
    scene = load_scene(path, split={"sky": "6x4"}, lights=["sky.*.y1"])
    assert [light.name for light in scene.lights] == [*(f"sky.x{x}.y1" for x in range(6)), "rest"]
    basis = render_basis(scene, spp=128)
    lighting = Lighting.current(basis).with_emission("sky.x2.y1", (3.0, 2.0, 1.0))
    relit = relight(scene, lighting, tmp_path / "relit.xml")
    assert verify(combine(basis, lighting), relit, spp=128).agrees


def test_a_sky_that_is_not_adjusted_is_not_split(tmp_path: Path) -> None:
    map_file(tmp_path)
    path = write_room(tmp_path, lights=ROTATED + LIGHTS["bulb"])
    scene = load_scene(path, split={"sky": "6x4"}, lights=["bulb"])
    assert not scene.split
    assert [light.member_names for light in scene.lights] == [("bulb",), ("sky",)]


def test_a_sky_can_be_dimmed_as_one_light_beside_its_texels(tmp_path: Path) -> None:
    map_file(tmp_path)
    path = write_room(tmp_path, lights=ROTATED)
    scene = load_scene(path, split={"sky": "6x4"}, groups={"dome": ["sky"]})
    [dome] = scene.lights
    assert len(dome.members) == 24
    basis = render_basis(scene, spp=128)
    lighting = Lighting.current(basis).with_emission("dome", (2.0, 1.0, 0.5))
    relit = relight(scene, lighting, tmp_path / "relit.xml")
    assert verify(combine(basis, lighting), relit, spp=128).agrees


def test_planes_of_some_texels_are_those_of_a_basis_of_all(tmp_path: Path) -> None:
    scene = split_room(tmp_path, ROTATED)
    names = ["sky.x2.y1", "sky.x5.y0"]
    alone, all_of_them = render_basis(scene.only(names), spp=64), render_basis(scene, spp=64)
    for name in names:
        np.testing.assert_allclose(
            alone.image(name), all_of_them.image(name), atol=1e-5 * all_of_them.image(name).max()
        )


def test_separate_renders_refuse_texels_in_one_line(tmp_path: Path) -> None:
    integrator = '<integrator type="ptracer"/>'
    scene = split_room(tmp_path, LIGHTS["sky"], integrator=integrator)
    with pytest.raises(SceneError, match="cannot be split into texels: leave split out") as caught:
        render_basis(scene, spp=4)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("split", "part"),
    [
        ({"sun": "8x4"}, "has no light 'sun' to split into texels; it has sky"),
        (
            {"bulb": "8x4"},
            "light 'bulb' is of the kind point: only envmap, constant, area",
        ),
    ],
)
def test_other_lights_are_refused_in_one_line(
    tmp_path: Path, split: dict[str, str], part: str
) -> None:
    path = write_room(tmp_path, lights=LIGHTS["sky"] + LIGHTS["bulb"])
    with pytest.raises(SceneError) as caught:
        load_scene(path, split=split)
    assert part in str(caught.value)


def test_the_lights_file_splits_a_sky_and_constrains_all_its_texels(tmp_path: Path) -> None:
    path = write_room(tmp_path, lights=LIGHTS["sky"])
    path.with_name("room.lights.toml").write_text("[light.sky]\nsplit = [4, 3]\nlock = true\n")
    scene = load_scene(path)
    assert len(scene.lights) == 12
    assert len(load_scene(path, split={}).lights) == 1
    basis = render_basis(scene, spp=2)
    problem = Problem.of(basis, Target.of(np.ones((*basis.size, 3))))
    assert not problem.reduction.is_free.any()


def test_a_sky_behind_a_window_is_confirmed_by_a_render(tmp_path: Path) -> None:
    scene = split_room(tmp_path, ROTATED + PANE)
    lighting = painted(scene)
    predicted = combine(render_basis(scene, spp=256), lighting)
    assert verify(predicted, relight(scene, lighting, tmp_path / "relit.xml"), spp=256).agrees
