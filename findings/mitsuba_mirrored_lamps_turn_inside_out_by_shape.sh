#!/usr/bin/env bash
# Mitsuba 3.9.1 (mitsuba==3.9.1 with its Dr.Jit, numpy==2.4.6), variant scalar_rgb.
#
# A lamp may stand in a mirrored copy of a room, with a `to_world` that scales x by -1. All area
# lamps shine outwards; one expects them to do so in the mirror too, or all of them to turn inside
# out. Rectangle, disk, cube and cylinder go on. A sphere is dark from outside. And a square that
# came from a file shines from its back, where the same square as `rectangle` shines from its front.
# `flip_normals` turns each of them back.
#
# Output seen (radiance from the front or outside, of the lamp and of its mirror image):
#   rectangle 1 1
#   disk      1 1
#   cube      1 1
#   cylinder  1 1
#   sphere    1 0
#   ply       1 0
#
# Exit status 0 while that is so, 1 once it changes.
set -euo pipefail
unset PYTHONPATH
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check mitsuba==3.9.1 numpy==2.4.6
cd "$folder"
"$folder/venv/bin/python" - <<'PYTHON'
import sys
from pathlib import Path

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")
T = mi.ScalarTransform4f
Path("square.ply").write_text(
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
    "property float z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n"
    "-1 -1 0\n1 -1 0\n1 1 0\n-1 1 0\n3 0 1 2\n3 0 2 3\n"
)
SHAPES = {kind: {"type": kind} for kind in ("rectangle", "disk", "cube", "cylinder", "sphere")}
SHAPES["cylinder"] |= {"p0": [0, -1, 0], "p1": [0, 1, 0]}
SHAPES["ply"] = {"type": "ply", "filename": "square.ply"}


def seen(shape: dict, scale: list[float]) -> float:
    """Return the radiance of a lamp from +z."""
    scene = {
        "type": "scene",
        "integrator": {"type": "direct"},
        "sensor": {
            "type": "perspective",
            "fov": 5,
            "to_world": T().look_at([0, 0, 5], [0, 0, 0], [0, 1, 0]),
            "film": {"type": "hdrfilm", "width": 4, "height": 4, "rfilter": {"type": "box"}},
        },
        "lamp": {
            **shape,
            "to_world": T().scale(scale),
            "emitter": {"type": "area", "radiance": {"type": "rgb", "value": 1.0}},
        },
    }
    return float(np.array(mi.render(mi.load_dict(scene), spp=4))[..., :3].mean())


found = {kind: (seen(x, [1, 1, 1]), seen(x, [-1, 1, 1])) for kind, x in SHAPES.items()}
for kind, (lamp, mirrored) in found.items():
    print(f"{kind:9} {lamp:.0f} {mirrored:.0f}")
dark = {kind for kind, (lamp, mirrored) in found.items() if lamp > 0.9 and mirrored < 0.1}
lit = {kind for kind, both in found.items() if min(both) > 0.9}
sys.exit((dark, lit) != ({"sphere", "ply"}, {"rectangle", "disk", "cube", "cylinder"}))
PYTHON
