#!/usr/bin/env bash
# Mitsuba 3.9.1.
#
# A conductor's `eta` and `k` may be given as <rgb>. One expects a grey one to reflect in a spectral
# variant what it does in an RGB variant, as surfaces with an <rgb> reflectance do. It reflects a
# third: 0.20 in the place of 0.61 for eta 1.5 and k 3, without a warning. With the same numbers as
# <spectrum> both variants agree. So scenes of RGB look different, and darker, with spectra.
#
# Output seen:
#   rgb: 0.607 in scalar_rgb, 0.200 in scalar_spectral
#   spectrum: 0.607 in scalar_rgb, 0.607 in scalar_spectral
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


def reflected(variant, kind):
    """Return what a conductor reflects of a white sky, straight towards the camera."""
    mi.set_variant(variant)
    metal = {key: {"type": kind, "value": x} for key, x in {"eta": 1.5, "k": 3.0}.items()}
    place = mi.ScalarTransform4f().look_at([0, 0, 4], [0, 0, 0], [0, 1, 0])
    film = {"type": "hdrfilm", "width": 4, "height": 4}
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "direct"},
            "camera": {"type": "perspective", "fov": 10, "to_world": place, "film": film},
            "mirror": {"type": "rectangle", "bsdf": {"type": "conductor", **metal}},
            "sky": {"type": "constant", "radiance": {"type": "rgb", "value": 1.0}},
        }
    )
    return float(np.array(mi.render(scene, spp=4096, seed=1))[..., 1].mean())


found = {}
for kind in ("rgb", "spectrum"):
    found[kind] = [reflected(variant, kind) for variant in ("scalar_rgb", "scalar_spectral")]
    a, b = found[kind]
    print(f"{kind}: {a:.3f} in scalar_rgb, {b:.3f} in scalar_spectral")
a, b = found["rgb"]
c, d = found["spectrum"]
sys.exit(0 if b < 0.5 * a and abs(c - d) < 0.01 else 1)
PYTHON
