"""Images of walls for other programs: the same picture the same way up as in Mitsuba."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from blender import in_blender
from exported_files import export
from nightly import nightly
from renderer import write_room

import lightpaint as lp
from lightpaint.images.formats.exr import write_rgb
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.relit.exported_answer import Source
from lightpaint.scene.mitsuba_scene import Scene

COLUMNS, ROWS = 6, 4
#: Half the width and height of the wall, and where it hangs.
HALF, PLACE = np.array([1.5, 1.0]), np.array([0.0, 1.0, -4.0])
#: A pixel of the image, in texels, over what neighbouring texels differ by.
PIXEL = 0.01
OBJ = """v -1.5 -1 0\nv 1.5 -1 0\nv 1.5 1 0\nv -1.5 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1
f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n"""
PLY = """ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y
property float z\nproperty float s\nproperty float t\nelement face 2
property list uchar int vertex_index\nend_header\n-1.5 -1 0 0 0\n1.5 -1 0 1 0\n1.5 1 0 1 1
-1.5 1 0 0 1\n3 0 1 2\n3 0 2 3\n"""
SHAPES = {"plane": "rectangle", "wall.obj": "obj", "wall.ply": "ply"}


def write_wall(folder: Path, mesh: str) -> tuple[Scene, Lighting]:
    """Write and load a room with a wall in texels, each of which has another colour."""
    (folder / "wall.obj").write_text(OBJ)
    (folder / "wall.ply").write_text(PLY)
    image = np.random.default_rng(4).uniform(0.2, 1.0, (ROWS, COLUMNS, 3)).astype(np.float32)
    write_rgb(folder / "now.exr", image)
    size = '<scale x="1.5" y="1"/>' if mesh == "plane" else ""
    file = "" if mesh == "plane" else f'<string name="filename" value="{mesh}"/>'
    wall = f"""<shape type="{SHAPES[mesh]}" id="screen">{file}<transform name="to_world">{size}
        <translate x="{PLACE[0]}" y="{PLACE[1]}" z="{PLACE[2]}"/></transform><emitter type="area">
        <texture type="bitmap" name="radiance"><string name="filename" value="now.exr"/>
        <boolean name="raw" value="true"/></texture></emitter></shape>"""
    scene = lp.load_scene(write_room(folder, lights=wall), split={"screen": (COLUMNS, ROWS)})
    return scene, Lighting.current(lp.render_basis(scene, spp=2))


def seen_in_mitsuba(scene: Scene, folder: Path, lighting: Lighting) -> Any:
    """Return the radiance of the relit wall at the middles of its texels, (rows, columns, 3), seen
    from its front.
    """
    loaded = lp.relight(scene, lighting, folder / "relit" / "relit.xml").load()
    import mitsuba as mi

    x = (2 * (np.arange(COLUMNS) + 0.5) / COLUMNS - 1) * HALF[0]
    y = (1 - 2 * (np.arange(ROWS) + 0.5) / ROWS) * HALF[1]
    points = np.stack([*np.meshgrid(x, y), np.full((ROWS, COLUMNS), 0.05)], axis=-1) + PLACE
    ray = mi.Ray3f(mi.Point3f(points.reshape(-1, 3).T), mi.Vector3f(0, 0, -1))
    hit = loaded.ray_intersect(ray)
    return np.array(hit.emitter(loaded).eval(hit)).T.reshape(ROWS, COLUMNS, 3)


@pytest.mark.nightly
@pytest.mark.parametrize("mesh", ["plane", nightly("wall.obj"), nightly("wall.ply")])
def test_a_wall_in_blender_shows_the_same_picture(
    tmp_path: Path, blender: list[str], mesh: str
) -> None:
    scene, lighting = write_wall(tmp_path, mesh)
    export(lighting, Source(scene), tmp_path, "blender", "set_scene.py")
    output = in_blender(
        *(blender, Path(__file__).parent / "blender_wall.py"), tmp_path, mesh, COLUMNS, ROWS
    )
    assert "left as it is" not in output
    seen = json.loads(next(line for line in output.splitlines() if line.startswith("SEEN"))[5:])
    # Blender's first row is the lowest.
    picture = np.reshape(seen, (ROWS, COLUMNS, 4))[::-1, :, :3]
    np.testing.assert_allclose(picture, seen_in_mitsuba(scene, tmp_path, lighting), atol=PIXEL)


@pytest.mark.parametrize("kind", ["", "RectLight", "SphereLight"])
def test_a_panel_in_usd_has_the_image_seen_from_its_front(tmp_path: Path, kind: str) -> None:
    pytest.importorskip("pxr.UsdLux", reason="usd-core")
    from pxr import Usd, UsdLux

    scene, lighting = write_wall(tmp_path, "plane")
    stage_path = None
    if kind:
        stage_path = tmp_path / "hall.usda"
        stage = Usd.Stage.CreateNew(str(stage_path))
        getattr(UsdLux, kind).Define(stage, "/rig/screen").CreateIntensityAttr(9.0)
        stage.Save()
    source = Source(scene, stage=stage_path)
    remarks = export(lighting, source, tmp_path, "usd", "lights.usda")
    opened = Usd.Stage.Open(str(tmp_path / "lights.usda"))
    prim = opened.GetPrimAtPath("/rig/screen" if kind else "/lights/screen")
    asset = prim.GetAttribute("inputs:texture:file")
    if kind == "SphereLight":
        assert remarks == [f"{stage_path} has no single light for screen: set it by hand"]
        assert not asset
        return
    light = UsdLux.LightAPI(prim)
    assert (light.GetIntensityAttr().Get(), light.GetNormalizeAttr().Get()) == (1.0, False)
    image = lp.read_target(Path(asset.Get().resolvedPath), find=False).image
    height, width = image.shape[:2]
    assert (width, height) == (512, 341)
    # UsdLux: the first pixel is at +x and +y, and light goes along -z: top left from the front.
    rows = ((np.arange(ROWS) + 0.5) / ROWS * height).astype(int)
    columns = ((np.arange(COLUMNS) + 0.5) / COLUMNS * width).astype(int)
    expected = seen_in_mitsuba(scene, tmp_path, lighting)
    np.testing.assert_allclose(image[np.ix_(rows, columns)], expected, atol=PIXEL)


def test_a_mesh_has_no_image_in_usd_and_says_so(tmp_path: Path) -> None:
    pytest.importorskip("pxr.UsdLux", reason="usd-core")
    scene, lighting = write_wall(tmp_path, "wall.obj")
    [remark] = export(lighting, Source(scene), tmp_path, "usd", "lights.usda")
    assert "USD has no image for screen, a mesh: set it by hand" in remark
    assert "texture" not in (tmp_path / "lights.usda").read_text()
