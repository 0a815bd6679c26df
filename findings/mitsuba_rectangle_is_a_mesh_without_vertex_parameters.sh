#!/usr/bin/env bash
# Mitsuba 3.9.1 (mitsuba==3.9.1 with its Dr.Jit, numpy==2.4.6), variant scalar_rgb.
#
# A `rectangle` says `is_mesh() == True`, like a `cube` or a file of triangles. A `cube` has the keys
# vertex_positions and faces in `mi.traverse(shape)`; one expects them of each mesh. A `rectangle`
# has neither (its vertices follow from `to_world`), so that traverse(shape)["vertex_positions"] is
# a KeyError. `vertex_positions_buffer()` and `faces_buffer()` give the triangles of both.
#
# Output seen:
#   rectangle is_mesh True, vertex_positions in traverse: False, buffer: 12 floats
#   cube is_mesh True, vertex_positions in traverse: True, buffer: 72 floats
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
found = []
for kind in ("rectangle", "cube"):
    shape = mi.load_dict({"type": kind})
    has_key = "vertex_positions" in mi.traverse(shape)
    count = np.array(shape.vertex_positions_buffer()).size
    print(f"{kind} is_mesh {shape.is_mesh()}, vertex_positions in traverse: {has_key}, "
          f"buffer: {count} floats")
    found.append((shape.is_mesh(), has_key, count > 0))
sys.exit(found != [(True, False, True), (True, True, True)])
PYTHON
