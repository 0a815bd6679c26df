#!/usr/bin/env bash
# bpy 5.0.1 (Blender's Cycles).
#
# In a photometric file of type C (LM-63), half-planes follow each other in one sense about the
# vertical: Radiance's ies2rad puts C0 at +x and C90 at +y. One expects Cycles' IES texture to put
# them somewhere else at most by a turn. It puts C0 at -y and C90 at -x: a web that is not the same on
# both sides of its C0-C180 plane comes out mirrored, which no rotation of the lamp corrects.
#
# A point light 2 m over a white floor, with 800, 400, 200 and 100 cd at C0, C90, C180 and C270.
# Output seen, relative to -y:
#   -y 1.000  -x 0.502  +y 0.252  +x 0.126
#
# Exit status 0 while that is so, 1 once it changes.
set -euo pipefail
unset PYTHONPATH
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check bpy==5.0.1
cd "$folder"
"$folder/venv/bin/python" - <<'PYTHON'
import sys
from pathlib import Path

import bpy

candela = (800, 400, 200, 100, 800)
rows = [range(0, 181, 15), range(0, 361, 90), *([x] * 13 for x in candela)]
text = "IESNA:LM-63-2002\n[TEST] invented\nTILT=NONE\n1 -1 1 13 5 1 2 0 0 0\n1 1 30\n"
Path("lamp.ies").write_text(text + "".join(" ".join(map(str, row)) + "\n" for row in rows))

bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
scene.render.engine, scene.cycles.device, scene.cycles.samples = "CYCLES", "CPU", 16
scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
scene.cycles.max_bounces = 0
scene.render.resolution_x = scene.render.resolution_y = 51
scene.render.image_settings.file_format = "OPEN_EXR"
bpy.ops.mesh.primitive_plane_add(size=20)
material = bpy.data.materials.new("white")
material.use_nodes = True
bpy.context.object.data.materials.append(material)
lamp = bpy.data.objects.new("lamp", bpy.data.lights.new("lamp", "POINT"))
lamp.location, lamp.data.energy, lamp.data.shadow_soft_size = (0, 0, 2), 100, 0
lamp.data.use_nodes = True
tree = lamp.data.node_tree
web = tree.nodes.new("ShaderNodeTexIES")
web.mode, web.filepath = "EXTERNAL", str(Path("lamp.ies").resolve())
emission = next(node for node in tree.nodes if node.type == "EMISSION")
tree.links.new(web.outputs[0], emission.inputs["Strength"])
scene.collection.objects.link(lamp)
camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
# It looks down from 1 m; pixels are 0.1 m apart, x to the right and y up.
camera.location, camera.data.type, camera.data.ortho_scale = (0, 0, 1), "ORTHO", 5.1
scene.collection.objects.link(camera)
scene.camera = camera
scene.render.filepath = str(Path("floor.exr").resolve())
bpy.ops.render.render(write_still=True)
pixels = list(bpy.data.images.load(scene.render.filepath).pixels)
places = {"-y": (25, 5), "-x": (5, 25), "+y": (25, 45), "+x": (45, 25)}
found = {side: pixels[4 * (51 * row + column)] for side, (column, row) in places.items()}
shares = {side: value / found["-y"] for side, value in found.items()}
print("  ".join(f"{side} {share:.3f}" for side, share in shares.items()))
expected = {"-y": 1, "-x": 0.5, "+y": 0.25, "+x": 0.125}
sys.exit(any(abs(shares[side] / x - 1) > 0.03 for side, x in expected.items()))
PYTHON
