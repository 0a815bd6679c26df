"""Multipliers of light groups as a layer over the stage that was rendered."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import run, succeed
from light_groups import interleaved, pictures

from lightpaint.colour.primaries import ACESCG, REC2020, from_rec709, to_rec709
from lightpaint.errors import OutputError
from lightpaint.relit.export.usd_groups import usd_multipliers

pxr = pytest.importorskip("pxr", reason="lightpaint[usd] is not installed")
from pxr import Gf, Sdf, Usd, UsdLux  # noqa: E402

#: The file holds float32.
FLOAT32 = 1e-6

MULTIPLIER = (0.5, 2.0, 1.0)


def shot(path: Path) -> Any:
    stage = Usd.Stage.CreateNew(str(path))
    for name, kind in (("key", UsdLux.RectLight), ("fill", UsdLux.SphereLight)):
        light = kind.Define(stage, f"/world/lights/{name}")
        light.CreateIntensityAttr(40.0)
        light.CreateExposureAttr(3.0)
        light.CreateColorAttr(Gf.Vec3f(1.0, 0.25, 0.5))
    stage.Save()
    return stage


def light(path: Path, prim: str) -> tuple[np.ndarray, float]:
    """Intensity times colour of a light in a stage, and its exposure."""
    stage = Usd.Stage.Open(str(path))
    found = UsdLux.LightAPI(stage.GetPrimAtPath(prim))
    colour = np.array(found.GetColorAttr().Get())
    return found.GetIntensityAttr().Get() * colour, found.GetExposureAttr().Get()


def layer(folder: Path, multipliers: dict[str, Any], stage: str = "shot.usda") -> Any:
    overrides = usd_multipliers(multipliers, folder / stage, folder)
    (folder / "lights.usda").write_text(overrides.text, encoding="utf-8")
    return overrides


@pytest.mark.parametrize(
    "name", ["/world/lights/key", "world/lights/key", "world_lights_key", "key"]
)
def test_a_group_scales_the_light_of_its_path_or_name(tmp_path: Path, name: str) -> None:
    shot(tmp_path / "shot.usda")
    assert layer(tmp_path, {name: MULTIPLIER}).left == ()
    before, _ = light(tmp_path / "shot.usda", "/world/lights/key")
    after, exposure = light(tmp_path / "lights.usda", "/world/lights/key")
    np.testing.assert_allclose(after, before * MULTIPLIER, rtol=FLOAT32)
    assert exposure == 3.0
    same, _ = light(tmp_path / "lights.usda", "/world/lights/fill")
    np.testing.assert_array_equal(same, before)


@pytest.mark.parametrize("attribute", ["inputs:karma:light:lpetag", "karma:light:lpetag"])
def test_a_tag_scales_all_its_lights(tmp_path: Path, attribute: str) -> None:
    stage = shot(tmp_path / "shot.usda")
    for name in ("key", "fill"):
        prim = stage.GetPrimAtPath(f"/world/lights/{name}")
        prim.CreateAttribute(attribute, Sdf.ValueTypeNames.String).Set("window")
    stage.Save()
    assert layer(tmp_path, {"window": (0.0, 0.0, 0.0)}).left == ()
    for name in ("key", "fill"):
        after, _ = light(tmp_path / "lights.usda", f"/world/lights/{name}")
        assert not after.any()


def test_lights_without_a_value_have_that_of_their_kind(tmp_path: Path) -> None:
    stage = Usd.Stage.CreateNew(str(tmp_path / "shot.usda"))
    UsdLux.DistantLight.Define(stage, "/sun")
    stage.Save()
    layer(tmp_path, {"sun": MULTIPLIER})
    # The schema's own intensity of a distant light is 50000, and its colour white.
    after, _ = light(tmp_path / "lights.usda", "/sun")
    np.testing.assert_allclose(after, 50000 * np.array(MULTIPLIER), rtol=FLOAT32)


def test_what_is_not_there_or_moves_is_left(tmp_path: Path) -> None:
    stage = shot(tmp_path / "shot.usda")
    UsdLux.RectLight.Define(stage, "/world/other/key")  # a second light of that name
    fill = UsdLux.LightAPI(stage.GetPrimAtPath("/world/lights/fill"))
    for frame in (1.0, 2.0):
        fill.GetIntensityAttr().Set(10 * frame, frame)
    stage.Save()
    names = ("key", "fill", "gone")
    assert layer(tmp_path, dict.fromkeys(names, MULTIPLIER)).left == names


def test_what_nodes_make_is_left(tmp_path: Path) -> None:
    stage = shot(tmp_path / "shot.usda")
    key = UsdLux.LightAPI(stage.GetPrimAtPath("/world/lights/key"))
    key.GetColorAttr().AddConnection("/world/gel.outputs:color")
    stage.Save()
    assert layer(tmp_path, {"key": MULTIPLIER}).left == ("key",)


@pytest.mark.skipif(not hasattr(Usd, "ColorSpaceAPI"), reason="USD 24.11")
@pytest.mark.parametrize("declared", ["", "lin_ap1_scene", "lin_rec2020_scene"])
def test_light_is_multiplied_in_the_primaries_of_the_renderer(
    tmp_path: Path, declared: str
) -> None:
    """A renderer that works in ACEScg multiplies colour, temperature and texture there."""
    stage = shot(tmp_path / "shot.usda")
    key = UsdLux.RectLight.Get(stage, "/world/lights/key")
    key.CreateEnableColorTemperatureAttr(True)
    key.CreateTextureFileAttr("window.exr")
    if declared:
        space = Usd.ColorSpaceAPI.Apply(stage.GetPrimAtPath("/world"))
        space.CreateColorSpaceNameAttr().Set(declared)
    stage.Save()
    path = tmp_path / "lights.usda"
    text = usd_multipliers(
        {"key": MULTIPLIER}, tmp_path / "shot.usda", tmp_path, primaries=ACESCG
    ).text
    path.write_text(text, encoding="utf-8")
    before, _ = light(tmp_path / "shot.usda", "/world/lights/key")
    after, _ = light(path, "/world/lights/key")
    # From the space of the colour to the renderer's; an undeclared one is that.
    to_own = np.eye(3)
    if declared == "lin_rec2020_scene":
        to_own = from_rec709(ACESCG) @ to_rec709(REC2020)
    own = to_own @ after / (to_own @ before)
    # USD's matrices have the white of the ACES in five digits.
    np.testing.assert_allclose(own, from_rec709(ACESCG) @ MULTIPLIER, rtol=1e-3)
    # What else multiplies the light stays.
    relit = Usd.Stage.Open(str(path))
    again = UsdLux.RectLight.Get(relit, "/world/lights/key")
    assert again.GetEnableColorTemperatureAttr().Get()
    assert again.GetTextureFileAttr().Get().path == "window.exr"


def test_a_layer_warns_of_nothing(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    shot(tmp_path / "shot.usda")
    layer(tmp_path, {"key": MULTIPLIER})
    assert capfd.readouterr() == ("", "")


def test_no_stage(tmp_path: Path) -> None:
    (tmp_path / "shot.usda").write_text("no stage")
    with pytest.raises(OutputError, match="is not a USD stage"):
        layer(tmp_path, {"key": MULTIPLIER})


def test_from_the_command_line(tmp_path: Path) -> None:
    images = pictures(2)
    layers = {"C": images.sum(axis=0), "C_key": images[0], "C_gone": images[1]}
    interleaved(tmp_path / "shot.exr", layers)
    interleaved(tmp_path / "evening.exr", {"": 3 * images[0] + images[1]})
    shot(tmp_path / "shot.usda")
    options = ("-o", "out", "--literal", "--no-template")
    succeed(tmp_path, "solve", "shot.exr", "evening.exr", *options)
    export = ("export", "out/lighting.json", "--to", "usd", "--lights", "shot.exr")
    failed = run(tmp_path, *export)
    assert failed.returncode == 2
    assert "give their stage with --stage" in failed.stderr
    done = run(tmp_path, *export, "--stage", "shot.usda")
    assert done.returncode == 0
    assert "shot.usda has no light with the path, tag or name gone" in done.stdout + done.stderr
    before, _ = light(tmp_path / "shot.usda", "/world/lights/key")
    after, _ = light(tmp_path / "out" / "lights.usda", "/world/lights/key")
    # The painting has the key three times as bright; the solve's own tolerance.
    np.testing.assert_allclose(after, 3 * before, rtol=1e-3)
