#!/usr/bin/env bash
# OpenEXR 3.5.3 for Python (openexr==3.5.3, numpy==2.4.6).
#
# LJ2K is a lossy compression. A part with the layers `a` and `b`, of R, G and B each, comes back with
# `a` changed by up to 1 % of its range and with `b` to the bit: only the first layer of red, green
# and blue in a part (the plain one, if there is one) is compressed with loss, and every other channel
# is exact. One expects all colour channels to be changed, as DWAA does with the same pixels. So a
# picture that is stored beside the layers it consists of is no longer their sum, although the layers
# are exact.
#
# Output seen (largest error by layer, of values from 0 to 1):
#   LJ2K a, b: a 0.0126, b 0.0000
#   LJ2K plain, a: plain 0.0126, a 0.0000
#   DWAA a, b: a 0.0178, b 0.0169
#
# Exit status 0 while that is so, 1 once it changes.
set -euo pipefail
unset PYTHONPATH
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check openexr==3.5.3 numpy==2.4.6
"$folder/venv/bin/python" - "$folder/a.exr" <<'PYTHON'
import sys

import numpy as np
import OpenEXR


def errors(compression, layers):
    """The largest error of each layer, written in a part with this compression, and read."""
    random = np.random.default_rng(0)
    written = {}
    for layer in layers:
        for channel in "RGB":
            name = f"{layer}.{channel}" if layer else channel
            written[name] = random.random((64, 64)).astype(np.float32)
    header = {"type": OpenEXR.scanlineimage, "compression": compression}
    OpenEXR.File([OpenEXR.Part(header, dict(written), "")]).write(sys.argv[1])
    read = OpenEXR.File(sys.argv[1], separate_channels=True).parts[0].channels
    off = {name: float(np.abs(read[name].pixels - pixels).max()) for name, pixels in written.items()}
    return {x: max(v for k, v in off.items() if k.rpartition(".")[0] == x) for x in layers}


found = []
for title, compression, layers in (
    ("LJ2K a, b:", OpenEXR.LJ2K_COMPRESSION, ("a", "b")),
    ("LJ2K plain, a:", OpenEXR.LJ2K_COMPRESSION, ("", "a")),
    ("DWAA a, b:", OpenEXR.DWAA_COMPRESSION, ("a", "b")),
):
    worst = errors(compression, layers)
    print(title, ", ".join(f"{layer or 'plain'} {error:.4f}" for layer, error in worst.items()))
    found.append([error > 0.001 for error in worst.values()])
sys.exit(found != [[True, False], [True, False], [True, True]])
PYTHON
