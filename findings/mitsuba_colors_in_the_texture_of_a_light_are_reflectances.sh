#!/usr/bin/env bash
# Mitsuba 3.9.1.
#
# An area light's `radiance` may be a texture, and its <rgb> may be any light. One expects a white
# checkerboard of <rgb> to shine like a white <rgb>. Within the texture an <rgb> is a reflectance:
# above 1 it is refused, though the same number as <spectrum> is taken; and in spectral variants it
# lacks the light of D65 that the plain one has, so white shines pink, with a fifth more red, without
# a warning.
#
# Output seen:
#   <rgb value="5">: 5.00, as <spectrum> in a checkerboard: 5.00, as <rgb> in it: refused
#   <rgb value="0.9"> in scalar_rgb: 0.90 0.90 0.90, in a checkerboard: 0.90 0.90 0.90
#   <rgb value="0.9"> in scalar_spectral: 0.90 0.90 0.90, in a checkerboard: 1.09 0.85 0.82
#
# Exit status 0 while that is so, 1 once it changes.
set -euo pipefail
unset PYTHONPATH
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check mitsuba==3.9.1 numpy==2.3.5
"$folder/venv/bin/python" - <<'PYTHON'
import sys

import mitsuba as mi
import numpy as np


def seen(variant, radiance):
    """Return the light of a panel of this radiance that fills the picture, (3,)."""
    mi.set_variant(variant)
    place = mi.ScalarTransform4f().look_at([0, 0, 4], [0, 0, 0], [0, 1, 0])
    film = {"type": "hdrfilm", "width": 4, "height": 4}
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "direct"},
            "camera": {"type": "perspective", "fov": 10, "to_world": place, "film": film},
            "panel": {"type": "rectangle", "light": {"type": "area", "radiance": radiance}},
        }
    )
    return np.array(mi.render(scene, spp=4096, seed=1))[..., :3].mean(axis=(0, 1))


def checkerboard(color):
    return {"type": "checkerboard", "color0": color, "color1": color}


def text(light):
    return " ".join(f"{x:.2f}" for x in light)


bright = {"type": "rgb", "value": 5.0}
try:
    seen("scalar_rgb", checkerboard(bright))
    refused = False
except RuntimeError as error:
    refused = "must be in the range [0, 1]" in str(error)
plain = seen("scalar_rgb", bright)[1]
spectrum = seen("scalar_rgb", checkerboard({"type": "spectrum", "value": 5.0}))[1]
print(
    f'<rgb value="5">: {plain:.2f}, as <spectrum> in a checkerboard: {spectrum:.2f}, as <rgb> in '
    f"it: {'refused' if refused else 'taken'}"
)
white = {"type": "rgb", "value": 0.9}
both = {}
for variant in ("scalar_rgb", "scalar_spectral"):
    both[variant] = seen(variant, white), seen(variant, checkerboard(white))
    a, b = both[variant]
    print(f'<rgb value="0.9"> in {variant}: {text(a)}, in a checkerboard: {text(b)}')
a, b = both["scalar_rgb"]
c, d = both["scalar_spectral"]
is_pink = d[0] > 1.05 * c[0] and d[2] < 0.97 * c[2]
sys.exit(0 if refused and np.allclose(a, b) and is_pink else 1)
PYTHON
