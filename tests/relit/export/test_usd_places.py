"""Places in a layer of USD: read by OpenUSD itself, whose lights shine along their -z."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from exported_places import OLD, PLACES, RGB, WAY, z_up
from renderer import write_room

from lightpaint.relit.export.usd import Overrides, usd_overrides
from lightpaint.scene.lights.new_emitter import new_emitter_at
from lightpaint.scene.scene_reader import load_scene

pytest.importorskip("pxr.UsdLux", reason="usd-core")
from pxr import Gf, Usd, UsdGeom, UsdLux

#: Cones are float32.
FLOAT32 = 1e-6
#: Matrices are float64, and one is inverted.
FLOAT64 = 1e-9

EMITTERS = [
    ("spot", "intensity", RGB),
    ("sun", "irradiance", RGB),
    *((name, "intensity", RGB) for name in ("bulb", "key", "fill")),
    ("window light", "radiance", RGB),
]


def stage_at(path: Path, *, scale: float = 1.0, up: str = "Z") -> Any:
    """A stage with the scene's lights below a parent that is moved, turned and scaled."""
    rotation = z_up if up == "Z" else np.array
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, up)
    hall = UsdGeom.Xform.Define(stage, "/hall")
    stage.SetDefaultPrim(hall.GetPrim())
    rig = UsdGeom.Xform.Define(stage, "/hall/rig")
    UsdGeom.Xformable(rig).AddTranslateOp().Set(Gf.Vec3d(5, 6, 7))
    UsdGeom.Xformable(rig).AddRotateZOp().Set(30.0)
    UsdGeom.Xformable(rig).AddScaleOp().Set(Gf.Vec3f(2, 2, 2))
    to_rig = UsdGeom.XformCache().GetLocalToWorldTransform(rig.GetPrim()).GetInverse()
    for name, kind, point in (
        ("spot", UsdLux.DiskLight, OLD.position),
        ("bulb", UsdLux.SphereLight, PLACES[1].position),
        ("sun", UsdLux.DistantLight, (8.0, 9.0, 9.0)),
    ):
        light = kind.Define(stage, f"/hall/rig/{name}")
        world = np.eye(4)
        # In its parent it has the size of one unit of the world.
        world[3, :3] = scale * rotation(point)
        local = Gf.Matrix4d(world.tolist()) * to_rig
        UsdGeom.Xformable(light).AddTranslateOp().Set(local.ExtractTranslation())
        UsdGeom.Xformable(light).AddRotateXOp().Set(-30.0)
    stage.Save()
    return stage


def relit(overrides: Overrides, folder: Path) -> Any:
    (folder / "lights.usda").write_text(overrides.text, encoding="utf-8")
    return Usd.Stage.Open(str(folder / "lights.usda"))


def world_of(stage: Any, path: str) -> np.ndarray:
    prim = stage.GetPrimAtPath(path)
    assert prim, path
    return np.array(UsdGeom.XformCache().GetLocalToWorldTransform(prim))


def assert_hangs(world: np.ndarray, position: Any, direction: Any) -> None:
    if position is not None:
        np.testing.assert_allclose(world[3, :3], position, atol=FLOAT64)
    if direction is not None:
        way = -world[2, :3] / np.linalg.norm(world[2, :3])
        np.testing.assert_allclose(way, direction, atol=FLOAT64)
    assert np.linalg.det(world[:3, :3]) > 0


@pytest.mark.parametrize("up", ["Y", "Z"])
def test_lights_hang_in_the_axes_of_the_stage(tmp_path: Path, up: str) -> None:
    rotation = z_up if up == "Z" else np.array
    before = stage_at(tmp_path / "hall.usda", up=up)
    overrides = usd_overrides(EMITTERS, tmp_path / "hall.usda", tmp_path, places=PLACES)
    assert (overrides.left, overrides.unplaced) == ((), ())
    after = relit(overrides, tmp_path)
    assert UsdGeom.GetStageUpAxis(after) == up
    spot = world_of(after, "/hall/rig/spot")
    assert_hangs(spot, rotation(PLACES[0].position), rotation(WAY))
    # Its size, which is that of its parent, stays.
    np.testing.assert_allclose(np.linalg.norm(spot[:3, :3], axis=1), 2, atol=FLOAT64)
    # A sun turns, and what stays in the scene stays in the stage.
    old_sun = world_of(before, "/hall/rig/sun")
    assert_hangs(world_of(after, "/hall/rig/sun"), old_sun[3, :3], rotation(WAY))
    bulb = "/hall/rig/bulb"
    np.testing.assert_array_equal(world_of(after, bulb), world_of(before, bulb))
    for place in PLACES[3:]:
        path = f"/hall/lights/{place.name.replace(' ', '_')}"
        way = None if place.direction is None else rotation(place.direction)
        assert_hangs(world_of(after, path), rotation(place.position), way)
    assert after.GetPrimAtPath("/hall/lights").GetTypeName() == "Scope"
    assert after.GetPrimAtPath("/hall").GetTypeName() == "Xform"


def test_cones_and_sizes_are_those_of_the_answer(tmp_path: Path) -> None:
    stage_at(tmp_path / "hall.usda")
    overrides = usd_overrides(EMITTERS, tmp_path / "hall.usda", tmp_path, places=PLACES)
    after = relit(overrides, tmp_path)
    for path, cutoff, beam in (("rig/spot", 40, 10), ("lights/key", 25, 5)):
        shaping = UsdLux.ShapingAPI(after.GetPrimAtPath(f"/hall/{path}"))
        angle = shaping.GetShapingConeAngleAttr().Get()
        assert angle == pytest.approx(cutoff, rel=FLOAT32)
        # OpenUSD: the light is full up to angle · (1 − softness).
        softness = shaping.GetShapingConeSoftnessAttr().Get()
        assert angle * (1 - softness) == pytest.approx(beam, rel=FLOAT32)
    assert not after.GetPrimAtPath("/hall/lights/fill").HasAPI(UsdLux.ShapingAPI)
    fill = UsdLux.SphereLight(after.GetPrimAtPath("/hall/lights/fill"))
    assert fill.GetTreatAsPointAttr().Get()
    level = UsdLux.LightAPI(fill).GetIntensityAttr().Get()
    np.testing.assert_allclose(
        level * np.array(UsdLux.LightAPI(fill).GetColorAttr().Get()) / 4, RGB, rtol=FLOAT32
    )
    panel = UsdLux.RectLight(after.GetPrimAtPath("/hall/lights/window_light"))
    assert (panel.GetWidthAttr().Get(), panel.GetHeightAttr().Get()) == (2.0, 0.5)
    assert panel.GetPrim().GetDisplayName() == "window light"


def test_a_panel_lies_as_in_the_xml(tmp_path: Path) -> None:
    """Mitsuba's rectangle reaches from -1 to 1 along its x and y."""
    place = PLACES[-1]
    scene = load_scene(write_room(tmp_path)).with_new_emitters([new_emitter_at(place)])
    import mitsuba as mi

    loaded = scene.load()
    [shape] = [x for x in loaded.shapes() if x.id() == place.name]
    matrix = np.array(mi.traverse(shape)["to_world"].matrix, float).reshape(4, 4)
    after = relit(usd_overrides([], None, tmp_path, places=[place]), tmp_path)
    world = world_of(after, "/lights/window_light")
    for k in range(2):
        half = world[k, :3] * place.size[k] / 2  # type: ignore[index]
        sign = np.sign(half @ matrix[:3, k])
        np.testing.assert_allclose(sign * half, matrix[:3, k], atol=FLOAT32)


def test_a_stage_of_other_units_keeps_its_places(tmp_path: Path) -> None:
    before = stage_at(tmp_path / "hall.usda", scale=100.0)
    overrides = usd_overrides(EMITTERS, tmp_path / "hall.usda", tmp_path, places=PLACES)
    assert overrides.unplaced == ("spot", "sun")
    assert overrides.left == ("key", "fill", "window light")
    after = relit(overrides, tmp_path)
    spot = "/hall/rig/spot"
    np.testing.assert_array_equal(world_of(after, spot), world_of(before, spot))


def test_lights_of_the_stage_tell_the_axes_where_no_camera_does(tmp_path: Path) -> None:
    """A camera that looks straight down has -z upwards in a scene whose y is up."""
    stage_at(tmp_path / "hall.usda")
    overrides = usd_overrides(
        EMITTERS, tmp_path / "hall.usda", tmp_path, places=PLACES, up=(0.0, 0.0, -1.0)
    )
    after = relit(overrides, tmp_path)
    assert_hangs(world_of(after, "/hall/lights/key"), z_up(PLACES[3].position), z_up(WAY))


@pytest.mark.parametrize(("up", "axis"), [((0.0, 1.0, 0.0), "Y"), ((0.0, 0.0, 1.0), "Z")])
def test_without_a_stage_places_are_those_of_the_scene(
    tmp_path: Path, up: tuple[float, float, float], axis: str
) -> None:
    overrides = usd_overrides(EMITTERS, None, tmp_path, places=PLACES, up=up)
    assert (overrides.left, overrides.unplaced) == ((), ())
    after = relit(overrides, tmp_path)
    assert UsdGeom.GetStageUpAxis(after) == axis
    assert not after.GetPrimAtPath("/lights/bulb").GetAttribute("xformOpOrder").HasAuthoredValue()
    assert "over" in overrides.text
    for name, index in (("key", 3), ("fill", 4)):
        place = PLACES[index]
        assert_hangs(world_of(after, f"/lights/{name}"), place.position, place.direction)
    # An override has no type, so its transform is read as an attribute.
    matrix = np.array(after.GetPrimAtPath("/lights/spot").GetAttribute("xformOp:transform").Get())
    assert_hangs(matrix, PLACES[0].position, WAY)


def test_a_new_light_takes_no_name_of_the_stage(tmp_path: Path) -> None:
    stage = stage_at(tmp_path / "hall.usda")
    UsdGeom.Mesh.Define(stage, "/hall/lights/key")
    stage.Save()
    overrides = usd_overrides(EMITTERS, tmp_path / "hall.usda", tmp_path, places=PLACES)
    after = relit(overrides, tmp_path)
    assert after.GetPrimAtPath("/hall/lights/key").IsA(UsdGeom.Mesh)
    assert after.GetPrimAtPath("/hall/lights/key_").GetDisplayName() == "key"
    assert after.GetPrimAtPath("/hall/lights/key_").IsA(UsdLux.SphereLight)
