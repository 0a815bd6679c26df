#!/usr/bin/env bash
# Mitsuba 3.9.1 (mitsuba==3.9.1 with its Dr.Jit, numpy==2.4.6), variant scalar_rgb.
#
# The documentation calls `irradiance` of a `projector` the irradiance of its image plane, which is
# at distance 1. One expects a plane there to receive what is written, as it does of a `directional`
# light of irradiance 1, or of a `point` of intensity 1 at distance 1. It receives π times that, for
# each field of view, and to its corners.
#
# Output seen (irradiance of a plane, square to the axis, at its middle and near a corner):
#   directional 1.000 1.000
#   point       1.000 0.994
#   projector, fov 20 3.142 3.142
#   projector, fov 90 3.142 3.142
#
# Exit status 0 while that is so, 1 once it changes.
set -euo pipefail
unset PYTHONPATH
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check mitsuba==3.9.1 numpy==2.4.6
"$folder/venv/bin/python" - <<'PYTHON'
import math
import sys

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")
T = mi.ScalarTransform4f
ONE = {"type": "rgb", "value": 1.0}
POSE = {"to_world": T().look_at([0, 0, 1], [0, 0, 0], [0, 1, 0])}
LIGHTS = {
    "directional": {"type": "directional", "direction": [0, 0, -1], "irradiance": ONE},
    "point": {"type": "point", "position": [0, 0, 1], "intensity": ONE},
    "projector, fov 20": {"type": "projector", "fov": 20, "irradiance": ONE, **POSE},
    "projector, fov 90": {"type": "projector", "fov": 90, "irradiance": ONE, **POSE},
}


def irradiance(light: dict) -> tuple[float, float]:
    """Return what a diffuse plane at distance 1 shows, as irradiance: at its middle and corner."""
    side = 0.1
    scene = {
        "type": "scene",
        "integrator": {"type": "direct"},
        "sensor": {
            "type": "orthographic",
            "to_world": T().look_at([0, 0, 0.5], [0, 0, 0], [0, 1, 0]) @ T().scale([side / 2] * 3),
            "near_clip": 0.001,
            "film": {"type": "hdrfilm", "width": 9, "height": 9, "rfilter": {"type": "box"}},
        },
        "plane": {"type": "rectangle", "bsdf": {"type": "diffuse", "reflectance": {**ONE}}},
        "light": light,
    }
    picture = np.array(mi.render(mi.load_dict(scene), spp=16))[..., 0] * math.pi
    return float(picture[4, 4]), float(picture[0, 0])


found = {name: irradiance(light) for name, light in LIGHTS.items()}
for name, (middle, corner) in found.items():
    print(f"{name:11} {middle:.3f} {corner:.3f}")
expected = {name: math.pi if "projector" in name else 1.0 for name in LIGHTS}
sys.exit(any(abs(found[name][0] / expected[name] - 1) > 0.01 for name in LIGHTS))
PYTHON
