"""The answer to a shot for other programs: keys, and files with #### in their names."""

import csv
import io
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from blender import found_in_blender
from light_groups import interleaved, pictures

import lightpaint as lp
from lightpaint.basis.lightgroups.frame_sequence import find_frames
from lightpaint.basis.lightgroups.light_groups import LightGroups, first_frame
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.lighting.answer.lighting_keys import LightingKey
from lightpaint.relit.export.exports import blender_script, lights_table, render_identity
from lightpaint.relit.export.fixtures import fixtures_csv, fixtures_json
from lightpaint.relit.export.nuke import nuke_script

#: Files hold float32, scripts nine digits.
DIGITS = 1e-6

NAMES = ("fill", "key", "rim")


def write_shot(folder: Path, frames: tuple[int, ...] = (1, 13, 25), *, seed: int = 0) -> Path:
    """Write frames of three light groups, and return their pattern."""
    folder.mkdir(exist_ok=True, parents=True)
    for frame in frames:
        images = pictures(seed=seed + frame)
        layers = {f"RGBA_{name}": x for name, x in zip(NAMES, images, strict=True)}
        interleaved(folder / f"shot.{frame:04d}.exr", {"RGBA": images.sum(axis=0), **layers})
    return folder / "shot.####.exr"


@pytest.fixture
def groups(tmp_path: Path) -> LightGroups:
    return first_frame(find_frames(write_shot(tmp_path)), has_rest=False)


def keyed(groups: LightGroups) -> Lighting:
    """Lights that change from frame 1 by 13 to 25."""
    weights = np.random.default_rng(4).uniform(0, 2, (3, 3, 3))
    weights[1, 0] = 0
    keys = tuple(
        LightingKey(frame, tuple(map(tuple, rows)))
        for frame, rows in zip((1, 13, 25), weights.tolist(), strict=True)
    )
    return lp.Lighting(
        lp.Lighting.of_weights(groups.basis, weights[0]).lights, "dusk", animation=keys
    )


def test_nuke_reads_all_frames_and_has_a_key_at_each(groups: LightGroups, tmp_path: Path) -> None:
    lighting = keyed(groups)
    script = nuke_script(groups, lighting, tmp_path)
    assert f'file "{tmp_path}/shot.####.exr"\n first 1\n last 25\n' in script
    curves = re.findall(r"\{curve ([^}]*)\}", script)
    assert len(curves) == 9
    for curve, (name, channel) in zip(
        curves, [(n, c) for n in NAMES for c in range(3)], strict=True
    ):
        points = re.findall(r"x(-?\d+) (\S+)", curve)
        assert [int(x) for x, _ in points] == list(range(27))
        for x, y in points:
            expected = lighting.at_frame(int(x))[name].weight[channel]
            assert float(y) == pytest.approx(expected, rel=DIGITS, abs=DIGITS)


def test_nuke_gets_one_multiplier_if_lights_stay_the_same(
    groups: LightGroups, tmp_path: Path
) -> None:
    script = nuke_script(groups, lp.Lighting.current(groups.basis), tmp_path)
    assert "curve" not in script
    assert script.count("value {1 1 1 1}") == 3


def test_tables_have_each_frame(groups: LightGroups) -> None:
    lighting = keyed(groups)
    for text in (lights_table(groups, lighting), fixtures_csv(lighting)):
        rows = [*csv.DictReader(io.StringIO(text))]
        assert [int(row["frame"]) for row in rows[::3]] == list(range(1, 26))
        middle = [row for row in rows if row["frame"] == "13"]
        assert [float(row["red"]) for row in middle] == pytest.approx(
            [rgb[0] for rgb in lighting.animation[1].weights], rel=DIGITS
        )


def test_dimmers_have_one_scale_over_all_frames(groups: LightGroups) -> None:
    lighting = keyed(groups)
    document = json.loads(fixtures_json(lighting))
    levels = {
        max(x["red"], x["green"], x["blue"]): x["dmx"]["dimmer"]
        for frame in document["frames"]
        for x in frame["fixtures"]
    }
    full = max(levels)
    for brightest, dimmer in levels.items():
        assert dimmer == round(255 * brightest / full)


def test_the_render_of_a_shot_is_one_whichever_frame_is_painted(tmp_path: Path) -> None:
    sequence = find_frames(write_shot(tmp_path / "a"))
    identities = []
    for frame in sequence.frames:
        groups = lp.read_light_groups(sequence.path(frame))
        identities.append(
            render_identity(lp.LightGroups(**{**vars_of(groups), "sequence": sequence}))
        )
    assert len(set(identities)) == 1
    other = first_frame(find_frames(write_shot(tmp_path / "b", seed=1)), has_rest=False)
    assert render_identity(other) != identities[0]


def vars_of(groups: LightGroups) -> dict[str, Any]:
    return {name: getattr(groups, name) for name in groups.__dataclass_fields__}


@pytest.mark.nightly
def test_keys_in_blender_follow_the_curves(
    groups: LightGroups, tmp_path: Path, blender: list[str]
) -> None:
    lighting = keyed(groups)
    (tmp_path / "set_lights.py").write_text(blender_script(groups, lighting), encoding="utf-8")
    found = found_in_blender(blender, Path(__file__).parent / "blender_keys.py", tmp_path, {})
    for frame in range(27):
        lit = lighting.at_frame(frame)
        expected = [lit["key"].weight, lit["rim"].weight]
        np.testing.assert_allclose(found["once"][str(frame)], expected, rtol=1e-4, atol=1e-5)
        still = [lighting["key"].weight, lighting["rim"].weight]
        np.testing.assert_allclose(found["still"][str(frame)], still, rtol=1e-4, atol=1e-5)
        key, rim = found["another"][str(frame)]
        assert key == found["once"][str(frame)][0]
        np.testing.assert_allclose(rim, np.square(lit["rim"].weight), rtol=1e-4, atol=1e-5)
    assert found["twice"] == found["once"]
    assert found["own"] == 10  # a lamp that somebody animates stays as it is


def test_usd_has_a_time_sample_at_each_frame(groups: LightGroups, tmp_path: Path) -> None:
    pytest.importorskip("pxr", reason="lightpaint[usd] is not installed")
    from pxr import Gf, Usd, UsdLux

    from lightpaint.relit.export.usd_groups import usd_multipliers

    stage = Usd.Stage.CreateNew(str(tmp_path / "shot.usda"))
    for name in NAMES:
        light = UsdLux.SphereLight.Define(stage, f"/{name}")
        light.CreateIntensityAttr(40.0)
        light.CreateColorAttr(Gf.Vec3f(1.0, 0.25, 0.5))
    stage.Save()
    lighting = keyed(groups)
    by_frame = {
        frame: {light.name: light.weight for light in lit.lights}
        for frame, lit in lighting.by_frame.items()
    }
    layer = usd_multipliers(by_frame[1], tmp_path / "shot.usda", tmp_path, by_frame=by_frame)
    (tmp_path / "lights.usda").write_text(layer.text, encoding="utf-8")
    opened = Usd.Stage.Open(str(tmp_path / "lights.usda"))
    for frame in (-5, 1, 7, 13, 25, 99):
        lit = lighting.at_frame(frame)
        for name in NAMES:
            light = UsdLux.LightAPI(opened.GetPrimAtPath(f"/{name}"))
            color = np.array(light.GetColorAttr().Get(frame))
            emitted = light.GetIntensityAttr().Get(frame) * color
            np.testing.assert_allclose(
                emitted, 40 * np.multiply((1, 0.25, 0.5), lit[name].weight), rtol=1e-5, atol=1e-5
            )
