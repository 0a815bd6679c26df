"""Maps of skies for other programs: the same light from the same side as in Mitsuba."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from blender import in_blender
from renderer import LIGHTS, write_room

import lightpaint as lp
from lightpaint.images.formats.exr import write_rgb
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.progress import listener, silent
from lightpaint.relit.export.program_axes import blender_axes, lat_long, map_axes
from lightpaint.relit.exported_answer import Source
from lightpaint.relit.formats import write_content, writers_of
from lightpaint.scene.mitsuba_scene import Scene

#: Directions in the scene's axes, y up.
DIRECTIONS = [(1, 0.3, 0.2), (-1, 0.2, 0.4), (0.1, 0.4, 1), (0.2, 0.1, -1), (0.1, 1, 0.2),
              (-0.6, 0.5, -0.7), (0.3, -0.5, 0.6)]  # fmt: skip
TURN = '<transform name="to_world"><rotate y="1" angle="70"/><rotate x="1" angle="20"/></transform>'
#: A pixel of the map, in texels, over what neighbouring texels differ by; Blender interpolates it.
PIXEL = 0.02


@pytest.fixture(scope="module")
def sky(tmp_path_factory: pytest.TempPathFactory) -> tuple[Scene, Lighting]:
    """A room below a turned sky in texels, each of which is bright in another colour."""
    folder = tmp_path_factory.mktemp("sky")
    turned = (
        LIGHTS["sky"]
        .replace("constant", "envmap")
        .replace(
            '<rgb name="radiance" value="0.1 0.2 0.3"/>',
            f'<string name="filename" value="sky.exr"/>{TURN}',
        )
    )
    image = np.random.default_rng(4).uniform(0.2, 1.0, (4, 6, 3)).astype(np.float32)
    write_rgb(folder / "sky.exr", image)
    scene = lp.load_scene(write_room(folder, lights=turned), split={"sky": (6, 4)})
    return scene, Lighting.current(lp.render_basis(scene, spp=2))


def _unit(directions: Any) -> Any:
    directions = np.asarray(directions, float)
    return directions / np.linalg.norm(directions, axis=-1, keepdims=True)


def _radiance(scene: Scene, folder: Path, lighting: Lighting) -> Any:
    """Return the radiance of the relit sky from DIRECTIONS, (n, 3), as Mitsuba evaluates it."""
    relit = lp.relight(scene, lighting, folder / "relit.xml")
    import drjit as dr
    import mitsuba as mi

    directions = _unit(DIRECTIONS).T
    emitter = relit.load().environment()
    si = dr.zeros(mi.SurfaceInteraction3f, len(DIRECTIONS))
    si.wi = -mi.Vector3f(directions)
    return np.array(emitter.eval(si)).T


def _export(lighting: Lighting, source: Source, folder: Path, form: str, name: str) -> None:
    writers, _ = writers_of({form: name}, lighting, source, folder, listener(silent))
    for file, make in writers.items():
        write_content(folder / file, make())


@pytest.mark.nightly
def test_a_map_in_blender_shines_from_the_same_side(
    sky: tuple[Scene, Lighting], tmp_path: Path, blender: list[str]
) -> None:
    scene, lighting = sky
    _export(lighting, Source(scene), tmp_path, "blender", "set_scene.py")
    assert (tmp_path / "sky.latlong.exr").exists()
    x, y, z = _unit(DIRECTIONS).T
    (tmp_path / "directions.json").write_text(json.dumps(np.stack([x, -z, y], axis=1).tolist()))
    output = in_blender(blender, Path(__file__).parent / "blender_sky.py", tmp_path)
    assert "left as it is" not in output
    seen = json.loads(next(line for line in output.splitlines() if line.startswith("SEEN"))[5:])
    np.testing.assert_allclose(seen, _radiance(scene, tmp_path, lighting), atol=PIXEL)


@pytest.mark.parametrize("stage_up", ["", "Y", "Z"])
def test_a_dome_in_usd_shines_from_the_same_side(
    sky: tuple[Scene, Lighting], tmp_path: Path, stage_up: str
) -> None:
    pytest.importorskip("pxr.UsdLux", reason="usd-core")
    from pxr import Usd, UsdGeom, UsdLux

    scene, lighting = sky
    stage_path = None
    if stage_up:
        stage_path = tmp_path / "hall.usda"
        stage = Usd.Stage.CreateNew(str(stage_path))
        UsdGeom.SetStageUpAxis(stage, stage_up)
        UsdGeom.Xform.Define(stage, "/rig").AddRotateZOp().Set(40.0)
        UsdLux.DomeLight.Define(stage, "/rig/sky").AddRotateYOp().Set(10.0)
        stage.Save()
    _export(lighting, Source(scene, stage=stage_path), tmp_path, "usd", "lights.usda")
    opened = Usd.Stage.Open(str(tmp_path / "lights.usda"))
    [prim] = [prim for prim in opened.Traverse() if prim.IsA(UsdLux.DomeLight)]
    dome = UsdLux.DomeLight(prim)
    path = Path(dome.GetTextureFileAttr().Get().resolvedPath)
    assert dome.GetTextureFormatAttr().Get() == "latlong"
    assert (dome.GetIntensityAttr().Get(), dome.GetNormalizeAttr().Get()) == (1.0, False)
    world = np.array(UsdGeom.XformCache().GetLocalToWorldTransform(prim))[:3, :3]
    x, y, z = _unit(DIRECTIONS).T
    way = np.stack([x, -z, y] if stage_up == "Z" else [x, y, z], axis=1)
    # As OpenEXR has it, and UsdLux: latitude 0 and longitude 0 are +z, longitude 90° is +x.
    local = way @ np.linalg.inv(world)
    image = lp.read_target(path, find=False).image
    height, width = image.shape[:2]
    longitude = np.arctan2(local[:, 0], local[:, 2])
    column = ((0.5 - longitude / (2 * np.pi)) * width).astype(int) % width
    row = (np.arccos(np.clip(local[:, 1], -1, 1)) / np.pi * height).astype(int)
    np.testing.assert_allclose(image[row, column], _radiance(scene, tmp_path, lighting), atol=PIXEL)


def test_rotations_of_maps_turn_nothing_inside_out() -> None:
    for up in ((0, 1, 0), (0, 0, 1), (0, 0, -1)):
        for axes in (map_axes(up), blender_axes(up)):
            assert np.linalg.det(axes) == pytest.approx(1)
    # The top of a map is the direction up.
    top = lat_long(np.full((3, 2, 3), [[[1.0]], [[0.0]], [[0.0]]]), np.eye(3), (8, 8))
    assert top[0].min() > top[-1].max()
