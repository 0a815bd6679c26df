"""Slides of projectors for other programs: the same light on a floor as in Mitsuba."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from blender import in_blender
from exported_files import export
from nightly import nightly
from renderer import write_room

import lightpaint as lp
from lightpaint.colour.color import luminance
from lightpaint.images.formats.exr import write_rgb
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.relit.export.fixtures import fixtures_of
from lightpaint.relit.exported_answer import Source, emitters_of, half_slide, slide_images_of
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.runtime.variant import use_variant

COLUMNS, ROWS = 6, 4
#: Side of the floor that is seen, in metres, and pixels of its picture.
SIDE, PIXELS = 3.0, 24
#: Fields of view as Mitsuba's projectors have them.
VIEWS: list[dict[str, Any]] = [
    {"fov": 50.0},
    *({"fov": 35.0, "fov_axis": axis} for axis in ("y", "diagonal", "smaller", "larger")),
    {"focal_length": "40mm"},
    {},
]


def write_slide(folder: Path) -> tuple[Scene, Lighting]:
    """Write and load a room with a slide in texels, each of which has another colour."""
    image = np.random.default_rng(4).uniform(0.2, 1.0, (ROWS, COLUMNS, 3)).astype(np.float32)
    write_rgb(folder / "now.exr", image)
    projector = """<emitter type="projector" id="slide"><transform name="to_world">
        <lookat origin="0.6 2 0.8" target="0.1 0 0" up="0.3 0 -1"/></transform>
        <float name="fov" value="50"/><float name="scale" value="5"/>
        <texture type="bitmap" name="irradiance">
        <string name="filename" value="now.exr"/><boolean name="raw" value="true"/></texture>
        </emitter>"""
    scene = lp.load_scene(write_room(folder, lights=projector), split={"slide": (COLUMNS, ROWS)})
    return scene, Lighting.current(lp.render_basis(scene, spp=2))


def floor_in_mitsuba(scene: Scene, folder: Path, lighting: Lighting) -> Any:
    """Return the radiance of a white floor under the relit slide, (PIXELS, PIXELS, 3), seen from
    above with -z at the top.
    """
    loaded = lp.relight(scene, lighting, folder / "relit" / "relit.xml").load()
    import mitsuba as mi

    middles = ((np.arange(PIXELS) + 0.5) / PIXELS - 0.5) * SIDE
    x, z = (one.ravel() for one in np.meshgrid(middles, middles))
    place = mi.SurfaceInteraction3f()
    place.p, place.t = mi.Point3f(x, 0 * x, z), mi.Float(1.0)
    [projector] = [one for one in loaded.emitters() if one.id() == "slide"]
    sample, light = projector.sample_direction(place, mi.Point2f(0.5))
    cosine = np.maximum(np.array(sample.d)[1], 0)
    return (np.array(light) * cosine / np.pi).T.reshape(PIXELS, PIXELS, 3)


@pytest.mark.nightly
@pytest.mark.parametrize("before", ["new", nightly("AREA"), nightly("SPOT")])
def test_a_slide_in_blender_lights_a_floor_the_same(
    tmp_path: Path, new_blender: list[str], before: str
) -> None:
    scene, lighting = write_slide(tmp_path)
    export(lighting, Source(scene), tmp_path, "blender", "set_scene.py")
    [slide] = slide_images_of(scene, lighting)
    matrix = np.eye(4)
    to_z_up = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])
    matrix[:3, :3], matrix[:3, 3] = to_z_up @ np.transpose(slide.axes), to_z_up @ slide.position
    (tmp_path / "matrix.json").write_text(json.dumps(matrix.tolist()))
    script = Path(__file__).parent / "blender_slide.py"
    output = in_blender(new_blender, script, tmp_path, before)
    assert "left as it is" not in output
    assert "change its light" not in output  # of the second run, the nodes of the first
    seen = json.loads(next(line for line in output.splitlines() if line.startswith("SEEN"))[5:])
    # Blender's first row is the lowest.
    picture = np.reshape(seen, (PIXELS, PIXELS, 4))[::-1, :, :3]
    expected = floor_in_mitsuba(scene, tmp_path, lighting)
    is_lit = expected.max(axis=2) > 0
    assert 0.2 < is_lit.mean() < 0.8
    # Pixels on the border of the slide are lit in part.
    inside, outside = is_lit & ~near(~is_lit), ~near(is_lit)
    np.testing.assert_allclose(picture[inside], expected[inside], rtol=0.01)
    assert not picture[outside].any()


def near(mask: Any) -> Any:
    """Return the pixels that are next to some of a mask, or of it."""
    wide = np.pad(mask, 1)
    shifts = [(y, x) for y in range(3) for x in range(3)]
    return np.any([wide[y : y + PIXELS, x : x + PIXELS] for y, x in shifts], axis=0)


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("size", [(6, 4), (4, 8)])
def test_the_size_of_a_slide_is_that_of_mitsuba(view: dict[str, Any], size: Any) -> None:
    use_variant(None)
    import mitsuba as mi

    columns, rows = size
    bitmap = mi.Bitmap(np.ones((rows, columns, 3), np.float32))
    texture = {"type": "bitmap", "bitmap": bitmap, "raw": True, "wrap_mode": "clamp"}
    projector = mi.load_dict({"type": "projector", "irradiance": texture, **view})
    width, height = half_slide(view, columns / rows)
    for inside, places in (
        (True, [(0.99, 0.99), (-0.99, 0.99), (0.99, -0.99)]),
        (False, [(1.01, 0), (-1.01, 0), (0, 1.01), (0, -1.01)]),
    ):
        for x, y in places:
            place = mi.SurfaceInteraction3f()
            place.p, place.t = mi.Point3f(x * width, y * height, 1.0), mi.Float(1.0)
            _, light = projector.sample_direction(place, mi.Point2f(0.5))
            assert (np.max(np.array(light)) > 0) == inside


def test_a_projector_of_one_colour_is_as_bright_in_other_programs(tmp_path: Path) -> None:
    """They have its intensity, which a floor at distance 1 shows, where Mitsuba has that over π."""
    projector = """<emitter type="projector" id="slide"><transform name="to_world">
        <lookat origin="0 1 0" target="0 0 0" up="0 0 -1"/></transform>
        <float name="fov" value="50"/><rgb name="irradiance" value="2 1 0.5"/></emitter>"""
    scene = lp.load_scene(write_room(tmp_path, lights=projector))
    lighting = Lighting.current(lp.render_basis(scene, spp=2))
    radiance = floor_in_mitsuba(scene, tmp_path, lighting)
    middle = radiance[PIXELS // 2 - 1 : PIXELS // 2 + 1, PIXELS // 2 - 1 : PIXELS // 2 + 1]
    # Of the four pixels around the middle, seen at an angle: cos⁻³ of its own, cos³ of the floor.
    intensity = np.pi * middle.mean(axis=(0, 1))
    [(name, quantity, exported)] = emitters_of(scene, lighting)
    assert (name, quantity) == ("slide", "intensity")
    np.testing.assert_allclose(exported, intensity, rtol=1e-5)  # float32
    [fixture] = fixtures_of(replace(lighting, cd_per_unit=10.0))
    np.testing.assert_allclose((fixture.red, fixture.green, fixture.blue), intensity, rtol=1e-5)
    assert fixture.luminous == pytest.approx(10 * float(luminance(intensity)), rel=1e-5)
    assert fixture.luminous_unit == "lx"


def test_a_slide_in_usd_is_named_as_to_be_set_by_hand(tmp_path: Path) -> None:
    pytest.importorskip("pxr.UsdLux", reason="usd-core")
    scene, lighting = write_slide(tmp_path)
    [remark] = export(lighting, Source(scene), tmp_path, "usd", "lights.usda")
    assert remark == (
        "USD has no projector for slide: give a light the slide by hand, slide.slide.exr"
    )
    assert (tmp_path / "slide.slide.exr").is_file()
    assert "slide" not in (tmp_path / "lights.usda").read_text()
