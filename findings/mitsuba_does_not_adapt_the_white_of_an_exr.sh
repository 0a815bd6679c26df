#!/usr/bin/env bash
# mitsuba 3.9.1, with OpenEXR 3.4.4 and colour-science 0.4.7.
#
# Mitsuba converts pictures whose EXR header names other `chromaticities` to Rec. 709, which is more
# than one expects. Where it does, one expects white to stay white, as in OpenColorIO or in OpenEXR's
# own reader of ACES files, which adapt it. Mitsuba converts colours as measured: the white of ACEScg
# (D60) becomes 5 % red and 8 % short of blue, that of DCI-P3 green. So a neutral sky from an ACES
# pipeline lights a scene warmer than in the program that it comes from. White D65 stays.
#
# Output seen:
#   ACEScg       1.047 0.995 0.915  (adapted: 1.000 1.000 1.000)
#   DCI-P3       0.886 1.049 0.855  (adapted: 1.000 1.000 1.000)
#   Display P3   1.000 1.000 1.000  (adapted: 1.000 1.000 1.000)
#
# Exit status 0 while that is so, 1 once it changes.
set -euo pipefail
unset PYTHONPATH
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check mitsuba==3.9.1 OpenEXR==3.4.4 \
  colour-science==0.4.7 numpy==2.2.6
cd "$folder"
"$folder/venv/bin/python" -W ignore - <<'PYTHON'
import sys

import colour
import mitsuba as mi
import numpy as np
import OpenEXR

mi.set_variant("scalar_rgb")
seen = {"ACEScg": (1.047, 0.995, 0.915), "DCI-P3": (0.886, 1.049, 0.855), "Display P3": (1, 1, 1)}
white = np.ones(3, np.float32)
same = True
for name, expected in seen.items():
    space = colour.RGB_COLOURSPACES[name]
    corners = [*space.primaries.ravel(), *space.whitepoint]
    header = {"type": OpenEXR.scanlineimage, "compression": OpenEXR.ZIP_COMPRESSION,
              "chromaticities": tuple(float(number) for number in corners)}
    with OpenEXR.File(header, {"RGB": np.ones((2, 2, 3), np.float32)}) as file:
        file.write("white.exr")
    read = np.array(mi.Bitmap("white.exr"))[0, 0]
    adapted = colour.matrix_RGB_to_RGB(space, colour.RGB_COLOURSPACES["sRGB"], "Bradford") @ white
    numbers = (" ".join(f"{number:.3f}" for number in row) for row in (read, adapted))
    print(f"{name:12} {next(numbers)}  (adapted: {next(numbers)})")
    same &= bool(np.allclose(read, expected, atol=2e-3) and np.allclose(adapted, 1, atol=2e-3))
sys.exit(not same)
PYTHON
