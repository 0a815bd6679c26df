#!/usr/bin/env bash
# pyoidn 2.5.1 (pyoidn==2.5.1, which has Open Image Denoise 2.5 in it, numpy==2.4.6), on a CPU.
#
# A picture that is 0.5 everywhere has no noise. One expects it back from the RT filter, to a percent
# at most. Its inside does come back, but pixels near its borders are up to 5 % off, in bright and
# dark waves, whatever its size; so pictures of a few pixels are off altogether. With 16 pixels of
# mirrored margin, cut off afterwards, all of it is right to half a percent.
#
# Output seen (lowest and highest value):
#   4 x 4           0.336 0.610
#   256 x 256       0.480 0.514
#   4 x 4, margin   0.499 0.501
#
# Exit status 0 while that is so, 1 once it changes.
set -euo pipefail
unset PYTHONPATH
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check pyoidn==2.5.1 numpy==2.4.6
"$folder/venv/bin/python" - <<'PYTHON'
import sys

import numpy as np
import pyoidn

MARGIN = 16


def off(size: int, margin: int) -> float:
    """Return by how much a flat picture is off at most, and print its lowest and highest value."""
    side = size + 2 * margin
    clean = pyoidn.denoise(np.full((side, side, 3), 0.5, np.float32), hdr=True)
    inside = clean[margin : margin + size, margin : margin + size]
    name = f"{size} x {size}{', margin' if margin else ''}"
    print(f"{name:15} {inside.min():.3f} {inside.max():.3f}")
    return float(abs(inside / 0.5 - 1).max())


small, large, padded = off(4, 0), off(256, 0), off(4, MARGIN)
sys.exit(not (small > 0.1 and large > 0.02 and padded < 0.006))
PYTHON
