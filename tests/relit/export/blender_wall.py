"""Runs in Blender: shines with the image of a wall by set_scene.py, and prints what is seen.

Arguments: a folder with the script and the image, the file of the wall's mesh or "plane", columns
and rows. Not a test by itself: test_wall_images.py runs it.
"""

import json
import runpy
import sys
from pathlib import Path

import bpy
from blender_cycles import empty_scene

FOLDER, MESH = Path(sys.argv[-4]), sys.argv[-3]
COLUMNS, ROWS = map(int, sys.argv[-2:])
#: Half the width and height of the wall.
HALF = (1.5, 1.0)


def wall():
    if MESH == "plane":
        bpy.ops.mesh.primitive_plane_add(size=2)
        bpy.context.object.scale = (*HALF, 1)
    elif MESH == "wall.ply" and bpy.app.version < (3, 6):
        bpy.ops.import_mesh.ply(filepath=str(FOLDER / MESH))
    else:
        read = {".obj": bpy.ops.wm.obj_import, ".ply": bpy.ops.wm.ply_import}[Path(MESH).suffix]
        read(filepath=str(FOLDER / MESH), forward_axis="Y", up_axis="Z")
    item = bpy.context.object
    item.name = "screen"
    glow = bpy.data.materials.new("glow")
    glow.use_nodes = True
    shader = glow.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (0, 0, 0, 1)
    shader.inputs["Emission Strength"].default_value = 7.0
    item.data.materials.clear()
    item.data.materials.append(glow)
    return glow


def main():
    scene = empty_scene(COLUMNS, ROWS, 4)
    # The middles of pixels, which are those of texels.
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BLACKMAN_HARRIS", 0.01
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location, camera.data.type, camera.data.ortho_scale = (0, 0, 3), "ORTHO", 2 * HALF[0]
    scene.collection.objects.link(camera)
    scene.camera = camera
    glow = wall()
    script = str(FOLDER / "set_scene.py")
    runpy.run_path(script)
    runpy.run_path(script)  # a second run changes nothing
    assert len([node for node in glow.node_tree.nodes if node.type == "TEX_IMAGE"]) == 1
    path = str(FOLDER / "seen.exr")
    scene.render.filepath = path
    bpy.ops.render.render(write_still=True)
    print("SEEN " + json.dumps(list(bpy.data.images.load(path).pixels)))


main()
