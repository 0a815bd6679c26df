"""set_scene.py in Blender itself: Cycles renders what Mitsuba's quantities come to on a floor."""

import json
import math
from pathlib import Path

import numpy as np
from blender import in_blender

from lightpaint.relit.export.scene_script import scene_script

#: Standard errors of 256 samples of a small lamp from afar, and its size over its distance.
NOISE = 0.01


def test_a_floor_in_blender_is_lit_as_in_the_scene(tmp_path: Path, new_blender: list[str]) -> None:
    rgb = np.array([8.0, 4.0, 1.0])
    kinds = {
        **dict.fromkeys(("panel", "desk", "sky"), "radiance"),
        **dict.fromkeys(("bulb", "spot"), "intensity"),
        "sun": "irradiance",
        "gone": "radiance",
    }
    emitters = [(name, kind, tuple(rgb)) for name, kind in kinds.items()]
    text = scene_script("evening", "hall.xml", [*emitters, ("dome", "", (2.0, 2.0, 2.0))])
    (tmp_path / "set_scene.py").write_text(text, encoding="utf-8")
    output = in_blender(new_blender, Path(__file__).parent / "blender_lit.py", tmp_path)
    assert "lightpaint: 'gone' is left as it is" in output
    assert "lightpaint: 'dome' is left as it is" in output
    values = json.loads(next(x for x in output.splitlines() if x.startswith("SEEN"))[5:])
    # Irradiance of a white floor: I/d², L·A/d² of what is small, all of a sky π L; over π of it.
    falls = {"bulb": 1 / 4, "spot": 1 / 4, "sun": 1.0, "sky": math.pi}
    falls |= {"panel": 0.02**2 / 4, "desk": 0.02 * 0.02 / 4}
    for name, share in falls.items():
        np.testing.assert_allclose(values[name], rgb * share / math.pi, rtol=NOISE)
