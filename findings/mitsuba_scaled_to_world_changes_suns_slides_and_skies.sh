#!/usr/bin/env bash
# Mitsuba 3.9.1 (mitsuba==3.9.1 with its Dr.Jit, numpy==2.4.6), variant scalar_rgb.
#
# The `to_world` of a `directional` emitter says where it shines. Its irradiance is W/m² across that
# direction, and nothing in it has a size, so one expects a scale, as comes along from programs
# whose objects have one, to change nothing; it changes nothing for a `spot`. But directions are not
# made unit vectors again. At a scale of 3 the sun and a `projector` are three times as bright. At a
# scale of 2 `envmap` and `sunsky` show other skies, and even two of them: what `direct` finds by
# samples of the emitter is another floor than by samples of the surface.
#
# Output seen (radiance of a white floor, without a scale and with it):
#   spot                   0.0796 0.0796
#   directional            0.3183 0.9549
#   projector              0.2500 0.7500
#   envmap, emitter's way  0.2393 0.4786
#   envmap, surface's way  0.2367 0.0607
#   sunsky, emitter's way  0.4702 0.8495
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
#: White around +y, black elsewhere.
BRIGHT_TOP = np.zeros((8, 16, 3), np.float32)
BRIGHT_TOP[:3] = 1
SPOT = {"type": "spot", "to_world": DOWN, "intensity": WHITE, "cutoff_angle": 40.0}
SUN = {"type": "directional", "to_world": DOWN, "irradiance": WHITE}
SLIDE = {"type": "projector", "to_world": DOWN, "irradiance": WHITE, "fov": 40}
SKY = {"type": "envmap", "to_world": T(), "bitmap": mi.Bitmap(BRIGHT_TOP)}
SUNSKY = {"type": "sunsky", "to_world": T(), "sun_direction": [0.3, 0.2, 0.9]}


def floor(lamp: dict, scale: float, of_emitter: int = 1, of_surface: int = 0) -> float:
    """Return the radiance of a white floor under a lamp, by samples of emitter and surface."""
    scene = {
        "type": "scene",
        "integrator": {
            "type": "direct",
            "emitter_samples": of_emitter,
            "bsdf_samples": of_surface,
        },
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
        "lamp": {**lamp, "to_world": lamp["to_world"] @ T().scale(scale)},
    }
    return float(np.array(mi.render(mi.load_dict(scene), spp=1024))[..., :3].mean())


#: Name, lamp, scale, samples, and how many times as bright it is seen to be.
ROWS = [
    ("spot", SPOT, 3, (1, 0), 1),
    ("directional", SUN, 3, (1, 0), 3),
    ("projector", SLIDE, 3, (1, 0), 3),
    ("envmap, emitter's way", SKY, 2, (1, 0), 2),
    ("envmap, surface's way", SKY, 2, (0, 1), 0.256),
    ("sunsky, emitter's way", SUNSKY, 2, (1, 0), 1.81),
]
is_seen = True
for name, lamp, scale, samples, expected in ROWS:
    one, scaled = floor(lamp, 1, *samples), floor(lamp, scale, *samples)
    print(f"{name:22} {one:.4f} {scaled:.4f}")
    is_seen &= abs(scaled / one - expected) < 0.03 * expected
sys.exit(not is_seen)
PYTHON
