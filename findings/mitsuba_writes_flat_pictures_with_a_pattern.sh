#!/usr/bin/env bash
# mitsuba 3.9.1.
#
# `Bitmap.convert`, which `mi.util.write_bitmap` uses for PNG and JPEG, documents that a value is
# clamped, given the sRGB curve and written. One expects the nearest of 256 numbers (or 65,536), so
# that a flat picture stays flat. It dithers, in 8 bits and in 16, and there is no way to switch it
# off: a flat 0.3 of a step becomes 0 in 70 % of the pixels and 1 in 30 %, always in the same ones.
# Whoever compares such a file with another one finds differences of a step all over the picture.
#
# Output seen:
#   8 bits: 0 in 70 %, 1 in 30 %
#   16 bits: 0 in 70 %, 1 in 30 %
#   a flat 0.5, written as PNG: 187 in 48 %, 188 in 52 %
#
# Exit status 0 while that is so, 1 once it changes.
set -euo pipefail
unset PYTHONPATH
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check mitsuba==3.9.1 numpy==2.2.6
cd "$folder"
"$folder/venv/bin/python" - <<'PYTHON'
import sys

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")


def shares(title, picture):
    found = dict(zip(*(part.tolist() for part in np.unique(picture, return_counts=True))))
    found = {number: count / picture.size for number, count in found.items()}
    print(f"{title}: " + ", ".join(f"{number} in {share:.0%}".replace("%", " %")
                                   for number, share in found.items()))
    return found


def converted(kind, step):
    flat = mi.Bitmap(np.full((256, 256, 1), 0.3 * step, np.float32))
    return np.array(flat.convert(component_format=kind, srgb_gamma=False))


all_found = [
    shares("8 bits", converted(mi.Struct.Type.UInt8, 1 / 255)),
    shares("16 bits", converted(mi.Struct.Type.UInt16, 1 / 65535)),
]
mi.util.write_bitmap("flat.png", mi.TensorXf(np.full((64, 64, 3), 0.5, np.float32)), write_async=False)
all_found.append(shares("a flat 0.5, written as PNG", np.array(mi.Bitmap("flat.png"))))
sys.exit([sorted(found) for found in all_found] != [[0, 1], [0, 1], [187, 188]])
PYTHON
