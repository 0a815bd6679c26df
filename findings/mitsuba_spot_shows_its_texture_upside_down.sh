#!/usr/bin/env bash
# Mitsuba 3.9.1 (mitsuba==3.9.1 with its Dr.Jit, numpy==2.4.6), variant scalar_rgb.
#
# A slide can be put into a `projector` (its `irradiance`) or before a `spot` (its `texture`). With
# one `to_world` and one bitmap, one expects one picture on the wall. The projector shows the slide
# as a camera at that place would see it, upright; the spot shows it turned by 180 degrees.
#
# Output seen (the quarters of the wall, as a camera at the lamp sees them; r, g, b: colours of the
# slide at its upper left, upper right and lower left):
#   projector r g / b .
#   spot      . b / g r
#
# Exit status 0 while that is so, 1 once it changes.
set -euo pipefail
unset PYTHONPATH
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check mitsuba==3.9.1 numpy==2.4.6
"$folder/venv/bin/python" - <<'PYTHON'
import sys

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")
pose = mi.ScalarTransform4f().look_at([0, 0, 10], [0, 0, 0], [0, 1, 0])
image = np.zeros((2, 2, 3), np.float32)
image[0, 0, 0] = image[0, 1, 1] = image[1, 0, 2] = 1
slide = {"type": "bitmap", "bitmap": mi.Bitmap(image), "raw": True, "filter_type": "nearest"}
LIGHTS = {
    "projector": {"type": "projector", "to_world": pose, "fov": 20, "irradiance": slide},
    "spot": {"type": "spot", "to_world": pose, "cutoff_angle": 20, "texture": slide},
}


def quarters(light: dict) -> str:
    """Return the colours of the quarters of a wall, seen from the place of the lamp."""
    scene = {
        "type": "scene",
        "integrator": {"type": "direct"},
        "sensor": {
            "type": "perspective",
            "to_world": pose,
            "fov": 8,
            "film": {"type": "hdrfilm", "width": 2, "height": 2, "rfilter": {"type": "box"}},
        },
        "wall": {"type": "rectangle", "to_world": mi.ScalarTransform4f().scale(5)},
        "light": light,
    }
    picture = np.array(mi.render(mi.load_dict(scene), spp=64))
    rows = [[".rgb"[1 + int(p.argmax()) if p.max() > 1e-6 else 0] for p in row] for row in picture]
    return " / ".join(" ".join(row) for row in rows)


found = {name: quarters(light) for name, light in LIGHTS.items()}
for name, colours in found.items():
    print(f"{name:9} {colours}")
sys.exit(found != {"projector": "r g / b .", "spot": ". b / g r"})
PYTHON
