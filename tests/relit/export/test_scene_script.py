"""set_scene.py in Blender itself: Cycles renders what Mitsuba's quantities come to on a floor."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from blender import has_working_spaces, in_blender
from nightly import nightly

from lightpaint.colour.primaries import ACESCG, REC709, REC2020, from_rec709
from lightpaint.relit.export.exports import scene_script

#: Meshes of blender_lit.py, and whether nodes let all through that one of them emits.
MESHES = {"half": False, "twice": False, "coated": False, "whole": True}

#: Standard errors of 256 samples of a small lamp from afar, and its size over its distance.
NOISE = 0.01


@pytest.mark.parametrize("space", ["", *map(nightly, ["ACEScg", "Linear Rec.2020"])])
def test_a_floor_in_blender_is_lit_as_in_the_scene(
    tmp_path: Path, new_blender: list[str], space: str
) -> None:
    if space and not has_working_spaces(new_blender):
        pytest.skip("Blender 5 (LIGHTPAINT_BPY: a Python with its module bpy)")
    rgb = np.array([8.0, 4.0, 1.0])
    kinds = {
        **dict.fromkeys(("panel", "desk", "sky", *MESHES), "radiance"),
        **dict.fromkeys(
            ("bulb", "spot", "grouped", "profile", "tile", "stored", "wrong sun"), "intensity"
        ),
        **dict.fromkeys(("sun", "wrong bulb"), "irradiance"),
        "gone": "radiance",
    }
    emitters = [(name, kind, tuple(rgb)) for name, kind in kinds.items()]
    text = scene_script("evening", "hall.xml", [*emitters, ("dome", "", (2.0, 2.0, 2.0))])
    (tmp_path / "set_scene.py").write_text(text, encoding="utf-8")
    output = in_blender(new_blender, Path(__file__).parent / "blender_lit.py", space, tmp_path)
    assert "lightpaint: 'gone' is left as it is" in output
    for name in ("dome", "wrong sun", "wrong bulb"):
        assert f"lightpaint: '{name}' is left as it is" in output
    for name in ("grouped", "profile"):
        assert f"lightpaint: nodes of '{name}' change its light" in output
    assert "nodes of 'bulb'" not in output
    for name, is_whole in MESHES.items():
        assert (f"nodes of '{name}'" in output) != is_whole, name
    for name, is_seen in {"bulb": True, "spot": False, "desk": False}.items():
        assert (f"keeps '{name}' from" in output) != is_seen, name
    for name, is_hidden in {"stored": True, "half": True, "bulb": False, "sky": False}.items():
        assert (f"'{name}' is hidden from renders" in output) == is_hidden, name
    values = json.loads(next(x for x in output.splitlines() if x.startswith("SEEN"))[5:])
    # Irradiance of a white floor: I/d², L·A/d² of what is small, all of a sky π L; over π of it.
    falls = {"bulb": 1 / 4, "spot": 1 / 4, "tile": 1 / 4, "sun": 1.0, "sky": math.pi}
    falls |= {"panel": 0.02**2 / 4, "desk": 0.02 * 0.02 / 4}
    primaries = {"ACEScg": ACESCG, "Linear Rec.2020": REC2020}.get(space, REC709)
    in_file = from_rec709(primaries) @ rgb
    for name, share in falls.items():
        np.testing.assert_allclose(values[name], in_file * share / math.pi, rtol=NOISE)
    # What multiplied the lamps before is not lost.
    kept = json.loads(next(x for x in output.splitlines() if x.startswith("KEPT"))[5:])
    assert {"Emission Color", "Emission Strength"} <= {*kept[0]}
    assert "spread" in kept[3]
    assert "is_portal" in kept[4]
