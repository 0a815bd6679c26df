"""The one pass divides the light of a sky among texels that are split again."""

from pathlib import Path

import numpy as np
import pytest
from renderer import (
    LIGHTS,
    map_file,
    painted,
    predicted_and_shown,
    write_room,
)

from lightpaint.basis.render.basis_render import render_basis
from lightpaint.lighting.answer.combination import combine
from lightpaint.relit.relit_scene import relight
from lightpaint.relit.verification_render import verify
from lightpaint.scene.lights.texels.texel import TexelLayout
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.scene_reader import load_scene, with_layout

ROTATED = """<emitter type="envmap" id="sky"><string name="filename" value="map.exr"/>
    <float name="scale" value="2"/><transform name="to_world"><rotate x="1" angle="40"/>
    <rotate y="1" angle="70"/></transform></emitter>"""
SHORT = '<integrator type="path"><integer name="max_depth" value="1"/></integrator>'
#: In the middle, twice; over the seam of the columns; and at a pole.
SPLITS = ((0, 0, 0), (0, 2, 1), (0, 5, 2), (1, 7, 3), (1, 8, 4))


def finer_room(folder: Path, **options: str) -> Scene:
    """Return a room under a sky of which some texels are split again."""
    map_file(folder)
    path = write_room(folder, lights=ROTATED + LIGHTS["bulb"], **options)
    scene = load_scene(path, split={"sky": "6x4"})
    return with_layout(scene, "sky", TexelLayout((6, 4), SPLITS))


@pytest.mark.nightly
def test_a_sky_in_view_looks_as_mitsuba_shows_the_written_image(tmp_path: Path) -> None:
    scene = finer_room(tmp_path, integrator=SHORT)
    predicted, shown = predicted_and_shown(scene, tmp_path)
    assert shown.max() > 0.5
    # Mitsuba's float32 interpolation.
    np.testing.assert_allclose(predicted, shown, atol=3e-4)


@pytest.mark.nightly
def test_a_render_of_the_written_image_confirms_the_prediction(tmp_path: Path) -> None:
    scene = finer_room(tmp_path)
    lighting = painted(scene)
    predicted = combine(render_basis(scene, spp=256), lighting)
    relit = relight(scene, lighting, tmp_path / "relit.xml")
    assert verify(predicted, relit, spp=256).agrees
    # The lighting alone tells which texels there are.
    relight(load_scene(scene.path), lighting, tmp_path / "again.xml")
    files = [(tmp_path / f"{name}.sky.exr").read_bytes() for name in ("relit", "again")]
    assert files[0] == files[1]


@pytest.mark.nightly
def test_the_light_of_finer_texels_is_that_of_the_coarse_ones(tmp_path: Path) -> None:
    scene = finer_room(tmp_path)
    coarse = load_scene(scene.path, split={"sky": "6x4"})
    looks = [render_basis(x, spp=1024).current_look for x in (coarse, scene)]
    assert looks[1].mean() == pytest.approx(looks[0].mean(), rel=0.01)


def test_only_changed_texels_have_other_planes(tmp_path: Path) -> None:
    scene = finer_room(tmp_path)
    coarse = load_scene(scene.path, split={"sky": "6x4"})
    identities = dict(zip((x.name for x in coarse.lights), coarse.light_identities, strict=True))
    kept = {
        light.name
        for light, identity in zip(scene.lights, scene.light_identities, strict=True)
        if identities.get(light.name) == identity
    }
    assert "bulb" in kept
    assert "sky.x3.y3" in kept  # beside none of them
    assert not kept & {"sky.x1.y1", "sky.x3.y1", "sky.x2.y2", "sky.x0.y2", "sky.x4.y1"}


@pytest.mark.nightly
def test_planes_of_finer_texels_alone_are_those_of_a_basis_of_all(tmp_path: Path) -> None:
    scene = finer_room(tmp_path)
    names = [x.name for x in scene.lights if x.name.startswith("sky.sun2")]
    assert len(names) > 25
    alone = render_basis(scene.only(names), spp=512)
    whole = render_basis(scene, spp=512)
    together = [sum(basis.image(name) for name in names).mean() for basis in (alone, whole)]
    assert together[0] == pytest.approx(together[1], rel=0.03)
