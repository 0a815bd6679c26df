#!/usr/bin/env bash
# Mitsuba 3.9.1 (mitsuba==3.9.1 with its Dr.Jit, numpy==2.4.6), variant scalar_rgb.
#
# The `to_world` of a `directional` emitter says where it shines. Its irradiance is W/m² across that
# direction, and nothing in it has a size, so that one expects a scale, as lamps come along from
# programs whose objects have one, to change nothing; as it changes nothing for a `spot`. But the
# axis is not made a unit vector again: at a scale of 3 the sun is three times as bright. So is a
# `projector`; and a `sunsky` shows another sky, with a sun of another size.
#
# Output seen (radiance of a white floor, at scales 1 and 3):
#   spot         0.0796 0.0796
#   directional  0.3183 0.9549
#   projector    0.2500 0.7500
#   sunsky       0.4665 0.7468, at scales 1 and 2
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
T = mi.ScalarTransform4f
WHITE = {"type": "rgb", "value": 1.0}
DOWN = T().look_at([0, 0, 2], [0, 0, 0], [0, 1, 0])
LAMPS = {
    "spot": {"to_world": DOWN, "intensity": WHITE, "cutoff_angle": 40.0, "beam_width": 39.0},
    "directional": {"to_world": DOWN, "irradiance": WHITE},
    "projector": {"to_world": DOWN, "irradiance": WHITE, "fov": 40},
    "sunsky": {"to_world": T(), "sun_direction": [0.3, 0.2, 0.9]},
}


def floor(kind: str, scale: float) -> float:
    """Return the radiance of a white floor under a lamp."""
    lamp = dict(LAMPS[kind])
    scene = {
        "type": "scene",
        "integrator": {"type": "direct"},
        "sensor": {
            "type": "perspective",
            "fov": 5,
            "to_world": T().look_at([0, 0, 1], [0, 0, 0], [0, 1, 0]),
            "film": {"type": "hdrfilm", "width": 8, "height": 8, "rfilter": {"type": "box"}},
        },
        "floor": {
            "type": "rectangle",
            "to_world": T().scale(10),
            "bsdf": {"type": "diffuse", "reflectance": WHITE},
        },
        "lamp": {"type": kind, **lamp, "to_world": lamp["to_world"] @ T().scale(scale)},
    }
    return float(np.array(mi.render(mi.load_dict(scene), spp=256))[..., :3].mean())


ratios = {}
for kind in LAMPS:
    one, other = floor(kind, 1), floor(kind, 2 if kind == "sunsky" else 3)
    ratios[kind] = other / one
    print(f"{kind:12} {one:.4f} {other:.4f}")
expected = {"spot": 1, "directional": 3, "projector": 3}
is_seen = all(abs(ratios[kind] - x) < 0.02 * x for kind, x in expected.items())
sys.exit(not (is_seen and abs(ratios["sunsky"] - 1) > 0.1))
PYTHON
