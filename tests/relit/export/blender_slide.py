"""Runs in Blender: shines through a slide by set_scene.py, and prints how a white floor looks.

Arguments: a folder with the script and the image, and what lamp is there before: "new" for none, or
its kind. Not a test by itself: test_slides.py runs it.
"""

import json
import runpy
import sys
from pathlib import Path

import bpy
from blender_cycles import empty_scene
from mathutils import Matrix

FOLDER, BEFORE = Path(sys.argv[-2]), sys.argv[-1]
#: Side of the floor in metres, and of its picture in pixels.
SIDE, PIXELS = 3.0, 24


def floor_and_camera(scene):
    bpy.ops.mesh.primitive_plane_add(size=2 * SIDE)
    surface = bpy.data.materials.new("white")
    surface.use_nodes = True
    surface.node_tree.nodes.clear()
    shader = surface.node_tree.nodes.new("ShaderNodeBsdfDiffuse")
    shader.inputs["Color"].default_value = (1, 1, 1, 1)
    output = surface.node_tree.nodes.new("ShaderNodeOutputMaterial")
    surface.node_tree.links.new(shader.outputs[0], output.inputs[0])
    bpy.context.object.data.materials.append(surface)
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location, camera.data.type, camera.data.ortho_scale = (0, 0, 9), "ORTHO", SIDE
    scene.collection.objects.link(camera)
    scene.camera = camera


def main():
    scene = empty_scene(PIXELS, PIXELS, 4)
    scene.cycles.max_bounces = 0
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BLACKMAN_HARRIS", 0.01
    floor_and_camera(scene)
    if BEFORE != "new":
        data = bpy.data.lights.new("slide", BEFORE)
        data.energy, data.color = 123, (0.1, 0.9, 0.4)
        item = bpy.data.objects.new("slide", data)
        scene.collection.objects.link(item)
        item.matrix_world = Matrix(json.loads((FOLDER / "matrix.json").read_text()))
    script = str(FOLDER / "set_scene.py")
    runpy.run_path(script)
    count = len(bpy.data.objects["slide"].data.node_tree.nodes)
    runpy.run_path(script)  # a second run changes nothing
    assert len(bpy.data.objects["slide"].data.node_tree.nodes) == count
    assert [item.name for item in bpy.data.objects if item.type == "LIGHT"] == ["slide"]
    path = str(FOLDER / "seen.exr")
    scene.render.filepath = path
    bpy.ops.render.render(write_still=True)
    print("SEEN " + json.dumps(list(bpy.data.images.load(path).pixels)))


main()
