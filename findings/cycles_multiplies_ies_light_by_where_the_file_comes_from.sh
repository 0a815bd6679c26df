#!/usr/bin/env bash
# bpy 5.0.1 (Blender's Cycles).
#
# The second number of the line before the angles of a photometric file (LM-63) was the
# ballast-lamp photometric factor until 1995. In LM-63-2019 it is the file generation type: 1.00001
# is undefined, 1.10000 a test in an accredited laboratory. Radiance's ies2rad multiplies by the
# number in front of it, the ballast factor, and leaves this one out. One expects Cycles' IES texture
# to do so, too. It multiplies by it: the accredited file is a tenth brighter.
#
# The same web twice, a point light 2 m over a white floor. Output seen:
#   1.00001: 1.000
#   1.10000: 1.100
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

head = "IES:LM-63-2019\n[TEST] invented\n[TESTLAB] invented\n[ISSUEDATE] 01-JAN-2020\n[MANUFAC] invented\n"


def light_of_floor(generation: str) -> float:
    angles, candela = range(0, 91, 15), [500] * 7
    rows = [["1 -1 1 7 1 1 2 0 0 0"], [1, generation, 30], angles, [0], candela]
    web_file = Path(f"{generation}.ies").resolve()
    web_file.write_text(head + "TILT=NONE\n" + "".join(" ".join(map(str, row)) + "\n" for row in rows))

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.device, scene.cycles.samples = "CYCLES", "CPU", 16
    scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
    scene.cycles.max_bounces = 0
    scene.render.resolution_x = scene.render.resolution_y = 9
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
    web.mode, web.filepath = "EXTERNAL", str(web_file)
    emission = next(node for node in tree.nodes if node.type == "EMISSION")
    tree.links.new(web.outputs[0], emission.inputs["Strength"])
    scene.collection.objects.link(lamp)
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location, camera.data.type, camera.data.ortho_scale = (0, 0, 1), "ORTHO", 0.9
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.filepath = str(Path("floor.exr").resolve())
    bpy.ops.render.render(write_still=True)
    pixels = list(bpy.data.images.load(scene.render.filepath).pixels)
    return sum(pixels[::4])


first, second = map(light_of_floor, ("1.00001", "1.10000"))
print(f"1.00001: {1:.3f}\n1.10000: {second / first:.3f}")
sys.exit(first <= 0 or abs(second / first - 1.1) > 0.003)
PYTHON
