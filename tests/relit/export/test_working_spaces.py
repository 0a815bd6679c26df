"""Files of Blender that work in another space than Rec.709: light is multiplied as was solved."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from blender import has_working_spaces, in_blender
from nightly import nightly
from renderer import REPOSITORY

from lightpaint.colour.primaries import ACESCG, REC2020, from_rec709
from lightpaint.relit.export.exports import filled_script

#: Multipliers of lights whose temperature, nodes or texture multiply their colour, too.
FACTORS = {
    "plain": (2.0, 0.5, 0.125),
    "warm": (2.0, 1.0, 0.5),
    "tinted": (1.5, 1.0, 0.5),
    "nodes": (2.0, 0.5, 0.125),
    "texture": (2.0, 0.5, 0.125),
    "sky": (0.25, 1.0, 2.0),
}

#: The largest relative error of 16 samples that are the same before and after, of a lamp's disk.
NOISE = 2e-3


@pytest.mark.parametrize("way", ["script", "addon", nightly("keys")])
@pytest.mark.parametrize("space", ["ACEScg", nightly("Linear Rec.2020")])
def test_what_is_textured_or_tinted_is_multiplied_in_rec709(
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
        factor = (1 + np.array(whole)) / 2 if way == "keys" else whole
        shown = np.linalg.solve(to_file, before[name]) * factor
        expected = to_file @ shown
        # Light cannot be negative, which colours outside the space would have to be.
        assert expected.min() > 0, name
        np.testing.assert_allclose(after[name], expected, rtol=NOISE, err_msg=name)
