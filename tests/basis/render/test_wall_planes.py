"""The one pass divides the light of walls and slides among texels, as Mitsuba interpolates them."""

from pathlib import Path

import numpy as np
import pytest
from nightly import nightly
from renderer import (
    LIGHTS,
    SAME_SAMPLES,
    map_file,
    mitsuba_render,
    one_pass,
    painted,
    write_room,
)

from lightpaint.basis.render.basis_render import render_basis
from lightpaint.errors import SceneError
from lightpaint.lighting.answer.combination import combine
from lightpaint.relit.relit_scene import relight
from lightpaint.relit.verification_render import verify
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.properties.emission import read_emitted_image
from lightpaint.scene.scene_reader import load_scene

PLACE = """<transform name="to_world"><scale x="0.8" y="0.5"/><rotate z="1" angle="25"/>
    <rotate y="1" angle="20"/><translate x="-0.2" y="1" z="-0.7"/></transform>"""
BITMAP = """<texture type="bitmap" name="{}"><string name="filename" value="map.exr"/>
    <string name="wrap_mode" value="clamp"/>{}</texture>"""
FLIPPED = '<transform name="to_uv"><scale y="-1"/><translate y="1"/></transform>'
COLOR = '<rgb name="radiance" value="1 2 3"/>'

SHAPE = '<shape type="{}" id="it">{}{}<emitter type="area">{}</emitter></shape>'
MESH = '<string name="filename" value="{}"/>'
BEAM = """<transform name="to_world"><lookat origin="0.5 1.8 1.5" target="0 0.3 0" up="0 1 0"/>
    </transform>"""
QUAD = """v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\n
vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n"""

WALLS = {
    "colour": SHAPE.format("rectangle", "", PLACE, COLOR),
    "bitmap": SHAPE.format("rectangle", "", PLACE, BITMAP.format("radiance", "")),
    "flipped": SHAPE.format("rectangle", "", PLACE, BITMAP.format("radiance", FLIPPED)),
    "mesh": SHAPE.format("obj", MESH.format("quad.obj"), PLACE, BITMAP.format("radiance", "")),
}
PROJECTOR = f"""<emitter type="projector" id="it">{BITMAP.format("irradiance", "")}
    <float name="scale" value="3"/><float name="fov" value="35"/>{BEAM}</emitter>"""
LIT = {**WALLS, "projector": PROJECTOR}
#: A short path shows the walls alone.
SHORT = '<integrator type="path"><integer name="max_depth" value="1"/></integrator>'


def write_files(folder: Path) -> None:
    """Write the bitmap and the mesh that the lights refer to."""
    map_file(folder)
    (folder / "quad.obj").write_text(QUAD)


def split_room(folder: Path, light: str, *, size: str = "6x3", **options: str) -> Scene:
    """Return a room with `light`, called `it`, in texels."""
    write_files(folder)
    return load_scene(write_room(folder, lights=light, **options), split={"it": size})


def predicted_by(planes: np.ndarray, scene: Scene, emission: dict[str, tuple[float, ...]]):
    """Return the sum of planes under these emissions."""
    weights = np.array([emission[light.name] for light in scene.lights])
    return np.einsum("nc,nhwc->hwc", weights, planes)


@pytest.mark.parametrize("kind", [kind if kind == "colour" else nightly(kind) for kind in WALLS])
def test_a_wall_in_view_looks_as_mitsuba_shows_the_written_image(tmp_path: Path, kind: str) -> None:
    scene = split_room(tmp_path, WALLS[kind], integrator=SHORT)
    lighting = painted(scene)
    predicted = predicted_by(one_pass(scene, seed=5, spp=16), scene, lighting.emission)
    shown = mitsuba_render(relight(scene, lighting, tmp_path / "relit.xml"), seed=5, spp=16)
    assert shown.max() > 0.5
    # Mitsuba's float32 interpolation.
    np.testing.assert_allclose(predicted, shown, atol=1e-5)


@pytest.mark.parametrize("kind", ["bitmap", *map(nightly, ["flipped", "mesh"])])
def test_a_wall_with_a_texel_for_each_pixel_is_as_it_was(tmp_path: Path, kind: str) -> None:
    scene = split_room(tmp_path, WALLS[kind], size="32x16", integrator=SHORT)
    now = {light.name: light.emission for light in scene.lights}
    predicted = predicted_by(one_pass(scene, seed=5, spp=16), scene, now)
    whole = mitsuba_render(load_scene(scene.path), seed=5, spp=16)
    assert whole.max() > 0.5
    np.testing.assert_allclose(predicted, whole, atol=1e-5)


def test_the_first_row_of_a_rectangle_is_its_top(tmp_path: Path) -> None:
    upright = '<transform name="to_world"><translate y="1" z="-0.9"/></transform>'
    light = SHAPE.format("rectangle", "", upright, COLOR)
    scene = split_room(tmp_path, light, size="2x2", integrator=SHORT)
    planes = one_pass(scene, seed=5, spp=16).sum(axis=-1)
    y, x = np.indices(planes.shape[1:])
    places = {
        light.name: ((plane * x).sum() / plane.sum(), (plane * y).sum() / plane.sum())
        for light, plane in zip(scene.lights, planes, strict=True)
    }
    assert places["it.x0.y0"][0] < places["it.x1.y0"][0]
    assert places["it.x0.y0"][1] < places["it.x0.y1"][1]


@pytest.mark.nightly
def test_a_projector_shines_as_mitsuba_projects_the_written_slide(tmp_path: Path) -> None:
    scene = split_room(tmp_path, PROJECTOR)
    lighting = painted(scene)
    predicted = predicted_by(one_pass(scene, seed=5, spp=16), scene, lighting.emission)
    shown = mitsuba_render(relight(scene, lighting, tmp_path / "relit.xml"), seed=5, spp=16)
    assert shown.max() > 0.1
    np.testing.assert_allclose(predicted, shown, atol=2 * SAME_SAMPLES * shown.max())


def test_a_slide_with_a_texel_for_each_pixel_is_as_it_was(tmp_path: Path) -> None:
    scene = split_room(tmp_path, PROJECTOR, size="32x16")
    now = {light.name: light.emission for light in scene.lights}
    predicted = predicted_by(one_pass(scene, seed=5, spp=16), scene, now)
    whole = mitsuba_render(load_scene(scene.path), seed=5, spp=16)
    np.testing.assert_allclose(predicted, whole, atol=2 * SAME_SAMPLES * whole.max())


@pytest.mark.parametrize("kind", [x if x in ("bitmap", "projector") else nightly(x) for x in LIT])
def test_a_render_of_the_written_image_confirms_the_prediction(tmp_path: Path, kind: str) -> None:
    scene = split_room(tmp_path, LIT[kind] + LIGHTS["bulb"])
    lighting = painted(scene)
    predicted = combine(render_basis(scene, spp=256), lighting)
    relit = relight(scene, lighting, tmp_path / "relit.xml")
    assert read_emitted_image(tmp_path / "relit.it.exr", is_linear=True).shape == (3, 6, 3)
    assert verify(predicted, relit, spp=256).agrees


@pytest.mark.nightly
def test_a_sky_a_wall_and_a_slide_in_texels_share_a_scene(tmp_path: Path) -> None:
    write_files(tmp_path)
    lights = LIGHTS["sky"] + WALLS["bitmap"] + PROJECTOR.replace('id="it"', 'id="slide"')
    path = write_room(tmp_path, lights=lights)
    scene = load_scene(path, split={"sky": "6x4", "it": "6x3", "slide": "4x2"})
    lighting = painted(scene)
    predicted = combine(render_basis(scene, spp=256), lighting)
    assert verify(predicted, relight(scene, lighting, tmp_path / "relit.xml"), spp=256).agrees


@pytest.mark.nightly
def test_texels_that_are_not_adjusted_stay_in_the_written_image(tmp_path: Path) -> None:
    write_files(tmp_path)
    path = write_room(tmp_path, lights=WALLS["bitmap"])
    scene = load_scene(path, split={"it": "6x3"}, lights=["it.*.y0"])
    assert [light.name for light in scene.lights] == [*(f"it.x{x}.y0" for x in range(6)), "rest"]
    lighting = painted(scene)
    relit = relight(scene, lighting, tmp_path / "relit.xml")
    assert verify(combine(render_basis(scene, spp=128), lighting), relit, spp=128).agrees


def test_a_texel_of_a_wall_does_not_move(tmp_path: Path) -> None:
    scene = split_room(tmp_path, WALLS["colour"])
    assert scene.emitter_places == ()


CUBE = SHAPE.format("cube", "", PLACE, COLOR)
BALL = SHAPE.format("sphere", "", "", COLOR)
NO_UV = SHAPE.format("obj", MESH.format("bare.obj"), PLACE, COLOR)
CHECKERED = SHAPE.format("rectangle", "", PLACE, '<texture type="checkerboard" name="radiance"/>')


@pytest.mark.parametrize(
    ("light", "size", "part"),
    [
        (CUBE, "4x4", "is a mesh of which several places have the same texture coordinates"),
        (BALL, "4x4", "is a sphere, whose texture coordinates no flat image follows"),
        (NO_UV, "4x4", "is a mesh without texture coordinates (uv), so it cannot be split"),
        (CHECKERED, "4x4", "neither a bitmap nor a single colour, so it cannot be split"),
        (WALLS["colour"], "1x1", "has at least 2 columns and 2 rows"),
        (WALLS["colour"], "400x250", "100,000 texels: expected at most 4,096"),
        (PROJECTOR, "16x9", "32x16: expected 16x8, or another size of that shape"),
    ],
)
def test_what_cannot_be_split_is_refused_in_one_line(
    tmp_path: Path, light: str, size: str, part: str
) -> None:
    (tmp_path / "bare.obj").write_text("v -1 -1 0\nv 1 -1 0\nv 1 1 0\nf 1 2 3\n")
    with pytest.raises(SceneError) as caught:
        split_room(tmp_path, light, size=size)
    assert part in str(caught.value)
    assert "\n" not in str(caught.value)
