"""Files of Blender that work in another space than Rec.709: light is multiplied as was solved."""

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from blender import has_working_spaces, in_blender
from nightly import nightly
from renderer import REPOSITORY

import lightpaint as lp
from lightpaint.colour.primaries import ACESCG, REC2020, from_rec709
from lightpaint.relit.export.exports import filled_script

#: Multipliers of lights whose temperature, nodes or texture multiply their colour, too.
FACTORS = {
    "plain": (2.0, 0.5, 0.125),
    "warm": (2.0, 1.0, 0.5),
    "tinted": (1.5, 1.0, 0.5),
    "nodes": (2.0, 0.5, 0.125),
    "both": (1.5, 1.0, 0.5),
    "texture": (2.0, 0.5, 0.125),
    "sky": (0.25, 1.0, 2.0),
}

#: The largest relative error of 16 samples that are the same before and after, of a lamp's disk.
NOISE = 2e-3

#: Largest relative error of multipliers, and of a picture by the same paths, where rounds end at a
#: difference of 5e-5; lights of similar pictures are told apart less well than these are.
FOUND, SAME_PATHS = 1e-2, 1e-3


@pytest.mark.parametrize("way", ["script", "addon", nightly("keys")])
@pytest.mark.parametrize("space", ["ACEScg", nightly("Linear Rec.2020")])
def test_what_is_textured_or_tinted_is_multiplied_whole(
    tmp_path: Path, new_blender: list[str], space: str, way: str
) -> None:
    if not has_working_spaces(new_blender):
        pytest.skip("Blender 5 (LIGHTPAINT_BPY: a Python with its module bpy)")
    # Half-way between two keys without slopes is their mean.
    still = (0.0, 0.0, 0.0)
    keys = {name: [(1, (1.0,) * 3, still), (5, factor, still)] for name, factor in FACTORS.items()}
    text = filled_script(
        "set_lights.py.in",
        target="evening",
        source="shot.exr",
        multipliers=repr(FACTORS),
        keys=repr(keys if way == "keys" else {}),
        render=repr("render"),
        to_render=repr(np.eye(3).tolist()),
    )
    (tmp_path / "set_lights.py").write_text(text, encoding="utf-8")
    (tmp_path / "factors.json").write_text(json.dumps(FACTORS))
    shutil.copytree(REPOSITORY / "lightpaint" / "blender_addon", tmp_path / "lightpaint_addon")
    script = Path(__file__).parent / "blender_spaces.py"
    output = in_blender(
        new_blender, script, space, way, tmp_path, variables={"PYTHONPATH": str(tmp_path)}
    )
    lines = [line for line in output.splitlines() if line.startswith("SEEN ")]
    before, after = json.loads(lines[0].partition(" ")[2])
    to_file = from_rec709({"ACEScg": ACESCG, "Linear Rec.2020": REC2020}[space])
    for name, whole in FACTORS.items():
        factor = (1 + np.array(whole)) / 2 if way == "keys" else np.array(whole)
        if way == "addon":  # as a renderer multiplies
            expected = np.array(before[name]) * (to_file @ factor)
        else:
            expected = to_file @ (np.linalg.solve(to_file, before[name]) * factor)
        # Light cannot be negative, which colours outside the space would have to be.
        assert expected.min() > 0, name
        np.testing.assert_allclose(after[name], expected, rtol=NOISE, err_msg=name)


@pytest.mark.parametrize("space", ["ACEScg", nightly("Linear Rec.2020")])
def test_a_painting_by_cycles_has_its_multipliers_in_any_space(
    tmp_path: Path, new_blender: list[str], space: str
) -> None:
    """Lights of a room with coloured walls, multiplied by hand; found, and set by the script."""
    if not has_working_spaces(new_blender):
        pytest.skip("Blender 5 (LIGHTPAINT_BPY: a Python with its module bpy)")
    to_file = from_rec709({"ACEScg": ACESCG, "Linear Rec.2020": REC2020}[space])
    # Lights in the colours of Rec.709, as every painting for displays asks for.
    own = {name: (to_file @ factor).tolist() for name, factor in FACTORS.items()}
    (tmp_path / "factors.json").write_text(json.dumps(own))
    script = Path(__file__).parent / "blender_spaces.py"
    in_blender(new_blender, script, space, "render", tmp_path)
    groups = lp.read_light_groups(tmp_path / "first.exr")
    painted = beauty(tmp_path / "painted.exr")
    lighting = lp.solve(groups.basis, lp.Target.of(painted)).lighting
    for name, factor in FACTORS.items():
        np.testing.assert_allclose(lighting[name].weight, factor, rtol=FOUND, err_msg=name)
    lp.write_exports(tmp_path, groups, lighting)
    in_blender(new_blender, script, space, "again", tmp_path)
    again = beauty(tmp_path / "again.exr")
    error = np.sqrt(np.square(again - painted).mean() / np.square(painted).mean())
    assert error < SAME_PATHS
    # Multiplied in Rec.709, these lights would be another picture.
    weights = lighting.weights_for(groups.basis)
    apart = groups.basis.planes.mix(weights) - painted
    assert np.sqrt(np.square(apart).mean() / np.square(painted).mean()) > 0.1


def beauty(path: Path) -> Any:
    """The whole picture of a file with light groups, (h, w, 3) in Rec.709."""
    layer = lp.read_light_groups(path).beauty
    assert layer is not None
    return layer.in_rec709(layer.image)
