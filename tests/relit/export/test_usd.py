"""A layer of USD over a stage: read by OpenUSD itself, by what UsdLux says of its lights."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lightpaint.colour.primaries import ACESCG, from_rec709
from lightpaint.relit.export.usd import usd_overrides
from lightpaint.relit.export.usd_groups import usd_multipliers

pytest.importorskip("pxr.UsdLux", reason="usd-core")
from pxr import Gf, Usd, UsdGeom, UsdLux, UsdRender

#: Attributes of USD's colours and intensities are float32.
FLOAT32 = 1e-6

RGB = (2.0, 1.0, 0.25)


def made_stage(path: Path) -> Any:
    """A stage with a light of each kind, as a program may have exported it."""
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdGeom.SetStageMetersPerUnit(stage, 0.01)
    stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, "/hall").GetPrim())
    for name, kind in (
        ("panel", UsdLux.RectLight),
        ("sun", UsdLux.DistantLight),
        ("bulb", UsdLux.SphereLight),
        ("spot", UsdLux.DiskLight),
        ("tube", UsdLux.CylinderLight),
        ("sky", UsdLux.DomeLight),
    ):
        light = kind.Define(stage, f"/hall/lamps/{name}")
        api = UsdLux.LightAPI(light)
        api.CreateExposureAttr(3.0)
        api.CreateIntensityAttr(17.0)
        api.CreateEnableColorTemperatureAttr(True)
        UsdGeom.Xformable(light).AddTranslateOp().Set(Gf.Vec3d(1, 2, 3))
    UsdLux.SphereLight.Get(stage, "/hall/lamps/bulb").CreateRadiusAttr(0.3)
    UsdLux.CylinderLight.Get(stage, "/hall/lamps/tube").CreateLengthAttr(7.0)
    UsdLux.DistantLight.Get(stage, "/hall/lamps/sun").CreateAngleAttr(2.0)
    mesh = UsdGeom.Mesh.Define(stage, "/hall/_3_ring")
    mesh.GetPrim().SetDisplayName("3 ring")
    UsdLux.MeshLightAPI.Apply(mesh.GetPrim())
    UsdGeom.Mesh.Define(stage, "/hall/wall")
    stage.Save()
    return stage


def shine(light: Any) -> Any:
    """Intensity, exposure and colour together: radiance, where it is not normalized."""
    api = UsdLux.LightAPI(light)
    assert not api.GetEnableColorTemperatureAttr().Get()
    level = api.GetIntensityAttr().Get() * 2.0 ** api.GetExposureAttr().Get()
    return level * np.array(api.GetColorAttr().Get(), np.float64)


EMITTERS = [
    ("panel", "radiance", RGB),
    ("sun", "irradiance", RGB),
    ("bulb", "intensity", RGB),
    ("spot", "intensity", RGB),
    ("tube", "intensity", (0.0, 0.0, 0.0)),
    ("3 ring", "radiance", RGB),
]


def test_lights_shine_as_they_were_solved(tmp_path: Path) -> None:
    made_stage(tmp_path / "hall.usda")
    (tmp_path / "out").mkdir()
    overrides = usd_overrides(EMITTERS, tmp_path / "hall.usda", tmp_path / "out")
    assert overrides.left == ()
    (tmp_path / "out" / "lights.usda").write_text(overrides.text, encoding="utf-8")
    relit = Usd.Stage.Open(str(tmp_path / "out" / "lights.usda"))

    def prim_at(path: str) -> Any:
        return relit.GetPrimAtPath(f"/hall/{path}")

    for path in ("lamps/panel", "_3_ring"):
        np.testing.assert_allclose(shine(prim_at(path)), RGB, rtol=FLOAT32)
        assert not UsdLux.LightAPI(prim_at(path)).GetNormalizeAttr().Get()
    # Normalized, radiance is over the surface, and intensity is radiance times what is seen of it.
    r = UsdLux.SphereLight(prim_at("lamps/bulb")).GetRadiusAttr().Get()
    radiance = shine(prim_at("lamps/bulb")) / (4 * math.pi * r**2)
    np.testing.assert_allclose(radiance * math.pi * r**2, RGB, rtol=FLOAT32)
    area = math.pi * UsdLux.DiskLight(prim_at("lamps/spot")).GetRadiusAttr().Get() ** 2
    np.testing.assert_allclose(shine(prim_at("lamps/spot")) / area * area, RGB, rtol=FLOAT32)
    # A normalized sun is irradiance, whatever its angle.
    np.testing.assert_allclose(shine(prim_at("lamps/sun")), RGB, rtol=FLOAT32)
    for name in ("bulb", "spot", "sun"):
        assert UsdLux.LightAPI(prim_at(f"lamps/{name}")).GetNormalizeAttr().Get()
    assert not shine(prim_at("lamps/tube")).any()


def test_what_multiplies_a_light_in_the_stage_is_reset_over_it(tmp_path: Path) -> None:
    stage = made_stage(tmp_path / "hall.usda")
    for name in ("panel", "bulb"):
        prim = stage.GetPrimAtPath(f"/hall/lamps/{name}")
        UsdLux.LightAPI(prim).CreateDiffuseAttr(0.5)
        UsdLux.LightAPI(prim).CreateSpecularAttr(0.0)
        shaping = UsdLux.ShapingAPI.Apply(prim)
        shaping.CreateShapingIesFileAttr("lamp.ies")
        shaping.CreateShapingFocusAttr(8.0)
        UsdLux.LightAPI(prim).CreateFiltersRel().AddTarget("/hall/gel")
        shaping.CreateShapingConeAngleAttr(30.0)
    UsdLux.RectLight.Get(stage, "/hall/lamps/panel").CreateTextureFileAttr("window.exr")
    stage.Save()
    overrides = usd_overrides(EMITTERS, tmp_path / "hall.usda", tmp_path)
    (tmp_path / "lights.usda").write_text(overrides.text, encoding="utf-8")
    relit = Usd.Stage.Open(str(tmp_path / "lights.usda"))
    for name in ("panel", "bulb"):
        prim = relit.GetPrimAtPath(f"/hall/lamps/{name}")
        light, shaping = UsdLux.LightAPI(prim), UsdLux.ShapingAPI(prim)
        assert (light.GetDiffuseAttr().Get(), light.GetSpecularAttr().Get()) == (1.0, 1.0)
        assert not shaping.GetShapingIesFileAttr().Get()
        assert not shaping.GetShapingFocusAttr().Get()
        assert light.GetFiltersRel().GetTargets() == []
        assert shaping.GetShapingConeAngleAttr().Get() == 30.0  # its form is the stage's
    assert not UsdLux.RectLight.Get(relit, "/hall/lamps/panel").GetTextureFileAttr().Get()


def test_a_mesh_shines_as_solved_whatever_its_material_emits(tmp_path: Path) -> None:
    stage = made_stage(tmp_path / "hall.usda")
    UsdLux.MeshLightAPI.Apply(UsdGeom.Mesh.Define(stage, "/hall/lamps/tube_mesh").GetPrim())
    stage.Save()
    overrides = usd_overrides([("tube_mesh", "radiance", RGB)], tmp_path / "hall.usda", tmp_path)
    (tmp_path / "lights.usda").write_text(overrides.text, encoding="utf-8")
    relit = Usd.Stage.Open(str(tmp_path / "lights.usda"))
    light = UsdLux.LightAPI(relit.GetPrimAtPath("/hall/lamps/tube_mesh"))
    assert not overrides.left
    # Of the schema's three values the one by which the colour of the light is all that counts.
    assert light.GetMaterialSyncModeAttr().Get() == "noMaterialResponse"


def test_lights_that_a_stage_hides_or_links_are_named(tmp_path: Path) -> None:
    stage = made_stage(tmp_path / "hall.usda")
    assert not usd_overrides(EMITTERS, tmp_path / "hall.usda", tmp_path).in_part
    UsdGeom.Imageable(stage.GetPrimAtPath("/hall/lamps/panel")).MakeInvisible()
    bulb = UsdLux.LightAPI(stage.GetPrimAtPath("/hall/lamps/bulb"))
    bulb.GetLightLinkCollectionAPI().CreateExcludesRel().AddTarget("/hall/wall")
    stage.Save()
    assert usd_overrides(EMITTERS, tmp_path / "hall.usda", tmp_path).in_part == ("panel", "bulb")


@pytest.mark.skipif(not hasattr(Usd, "ColorSpaceAPI"), reason="USD 24.11")
def test_colors_are_in_the_space_of_the_stage(tmp_path: Path) -> None:
    """A stage in ACEScg; the layer's colours are read back there, by the matrix of the ACES."""
    stage = made_stage(tmp_path / "hall.usda")
    space = Usd.ColorSpaceAPI.Apply(stage.GetPrimAtPath("/hall"))
    space.CreateColorSpaceNameAttr().Set("lin_ap1_scene")
    stage.Save()
    to_acescg = from_rec709(ACESCG)
    texts = (
        usd_overrides(EMITTERS[:1], tmp_path / "hall.usda", tmp_path).text,
        usd_multipliers({"panel": RGB}, tmp_path / "hall.usda", tmp_path).text,
    )
    # The stage's own light is white, 17 times: what its multiples are of.
    for k, (text, white) in enumerate(zip(texts, (1.0, 17.0 * 2**3), strict=True)):
        path = tmp_path / f"lights{k}.usda"
        path.write_text(text, encoding="utf-8")
        relit = Usd.Stage.Open(str(path))
        api = UsdLux.LightAPI(relit.GetPrimAtPath("/hall/lamps/panel"))
        level = api.GetIntensityAttr().Get() * 2.0 ** api.GetExposureAttr().Get()
        # USD's matrices have the white of the ACES in five digits.
        np.testing.assert_allclose(
            level * np.array(api.GetColorAttr().Get()), white * to_acescg @ RGB, rtol=1e-4
        )


@pytest.mark.skipif(not hasattr(Usd, "ColorSpaceAPI"), reason="USD 24.11")
@pytest.mark.parametrize("name", ["lin_ap1_scene", "ACEScg", "ACES - ACEScg"])
def test_colors_without_a_space_are_in_the_rendering_space(tmp_path: Path, name: str) -> None:
    """UsdLux: the colour of the emitted light, in the rendering colour space."""
    stage = made_stage(tmp_path / "hall.usda")
    settings = UsdRender.Settings.Define(stage, "/Render/final")
    settings.CreateRenderingColorSpaceAttr(name)
    stage.SetMetadata("renderSettingsPrimPath", "/Render/final")
    stage.Save()
    overrides = usd_overrides(EMITTERS[:1], tmp_path / "hall.usda", tmp_path)
    assert not overrides.unknown_spaces
    (tmp_path / "lights.usda").write_text(overrides.text, encoding="utf-8")
    relit = Usd.Stage.Open(str(tmp_path / "lights.usda"))
    # USD's matrices have the white of the ACES in five digits.
    np.testing.assert_allclose(
        shine(relit.GetPrimAtPath("/hall/lamps/panel")), from_rec709(ACESCG) @ RGB, rtol=1e-4
    )


def test_a_space_that_usd_does_not_know_is_named(tmp_path: Path) -> None:
    stage = made_stage(tmp_path / "hall.usda")
    settings = UsdRender.Settings.Define(stage, "/Render/final")
    settings.CreateRenderingColorSpaceAttr("studio_linear")
    stage.SetMetadata("renderSettingsPrimPath", "/Render/final")
    stage.Save()
    overrides = usd_overrides(EMITTERS[:1], tmp_path / "hall.usda", tmp_path)
    assert overrides.unknown_spaces == ("studio_linear",)


def test_what_nodes_make_of_a_light_is_written_over(tmp_path: Path) -> None:
    stage = made_stage(tmp_path / "hall.usda")
    light = UsdLux.LightAPI(stage.GetPrimAtPath("/hall/lamps/panel"))
    for attribute in (light.GetColorAttr(), light.GetIntensityAttr()):
        attribute.AddConnection("/hall/gel.outputs:value")
    stage.Save()
    overrides = usd_overrides(EMITTERS[:1], tmp_path / "hall.usda", tmp_path)
    (tmp_path / "lights.usda").write_text(overrides.text, encoding="utf-8")
    relit = Usd.Stage.Open(str(tmp_path / "lights.usda"))
    panel = UsdLux.LightAPI(relit.GetPrimAtPath("/hall/lamps/panel"))
    for attribute in (panel.GetColorAttr(), panel.GetIntensityAttr()):
        assert attribute.GetConnections() == []
    np.testing.assert_allclose(shine(panel.GetPrim()), RGB, rtol=FLOAT32)


def test_an_image_says_in_which_space_it_is(tmp_path: Path) -> None:
    made_stage(tmp_path / "hall.usda")
    overrides = usd_overrides([], tmp_path / "hall.usda", tmp_path, panels={"panel": "panel.exr"})
    (tmp_path / "lights.usda").write_text(overrides.text, encoding="utf-8")
    relit = Usd.Stage.Open(str(tmp_path / "lights.usda"))
    panel = relit.GetPrimAtPath("/hall/lamps/panel")
    texture = UsdLux.RectLight(panel).GetTextureFileAttr()
    assert (texture.Get().path, texture.GetColorSpace()) == ("./panel.exr", "lin_rec709_scene")


def test_nothing_else_of_the_stage_changes(tmp_path: Path) -> None:
    before = made_stage(tmp_path / "hall.usda")
    overrides = usd_overrides(EMITTERS[:1], tmp_path / "hall.usda", tmp_path, about="for once")
    (tmp_path / "lights.usda").write_text(overrides.text, encoding="utf-8")
    after = Usd.Stage.Open(str(tmp_path / "lights.usda"))
    assert UsdGeom.GetStageUpAxis(after) == "Z"
    assert UsdGeom.GetStageMetersPerUnit(after) == 0.01
    assert after.GetDefaultPrim().GetPath() == "/hall"
    assert [x.GetPath() for x in after.Traverse()] == [x.GetPath() for x in before.Traverse()]
    changed = {
        str(prim.GetPath())
        for prim in before.Traverse()
        for attribute in prim.GetAttributes()
        if attribute.Get() != after.GetAttributeAtPath(attribute.GetPath()).Get()
    }
    assert changed == {"/hall/lamps/panel"}
    layer = after.GetRootLayer()
    assert layer.comment == "for once"
    assert all(x.specifier.name == "SpecifierOver" for x in layer.rootPrims)


def test_what_is_no_one_light_is_told(tmp_path: Path) -> None:
    stage = made_stage(tmp_path / "hall.usda")
    UsdLux.RectLight.Define(stage, "/hall/other/panel")
    stage.Save()
    ambiguous = [
        ("panel", "radiance", RGB),  # there are two
        ("sky", "", RGB),  # a multiple of what somebody chose
        ("gone", "radiance", RGB),
        ("wall", "radiance", RGB),  # no light
    ]
    overrides = usd_overrides([*ambiguous, EMITTERS[1]], tmp_path / "hall.usda", tmp_path)
    assert overrides.left == ("panel", "sky", "gone", "wall")
    assert "sun" in overrides.text


def test_without_a_stage_lights_are_in_one_place(tmp_path: Path) -> None:
    overrides = usd_overrides([("key light", "intensity", RGB), EMITTERS[0]], None, tmp_path)
    (tmp_path / "lights.usda").write_text(overrides.text, encoding="utf-8")
    layer = Usd.Stage.Open(str(tmp_path / "lights.usda"))
    prim = layer.GetPrimAtPath("/lights/key_light")
    np.testing.assert_allclose(shine(prim) / 4, RGB, rtol=FLOAT32)
    assert layer.GetPrimAtPath("/lights/panel")


def test_a_layer_over_a_stage_elsewhere_warns_of_nothing(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    made_stage(tmp_path / "hall.usda")
    overrides = usd_overrides(EMITTERS, tmp_path / "hall.usda", tmp_path / "looks" / "evening")
    assert capfd.readouterr() == ("", "")
    (tmp_path / "looks" / "evening").mkdir(parents=True)
    (tmp_path / "looks" / "evening" / "lights.usda").write_text(overrides.text, encoding="utf-8")
    stage = Usd.Stage.Open(str(tmp_path / "looks" / "evening" / "lights.usda"))
    assert stage.GetPrimAtPath("/hall/wall").IsA(UsdGeom.Mesh)
    assert capfd.readouterr() == ("", "")
