"""Runs in Blender: what a luminaire with an IES file gives in Cycles to the four sides of a floor.

Arguments: a folder, with lamp.ies. Not a test by itself: test_emitters.py runs it.
"""

import json
import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent.parent / "relit" / "export"))
from blender_cycles import empty_scene

FOLDER = Path(sys.argv[-1])
#: Metres of the lamp above the floor, which are those from its foot to each side as well.
HEIGHT = 2.0


def main():
    scene = empty_scene(51, 51, 16)
    scene.cycles.max_bounces = 0
    bpy.ops.mesh.primitive_plane_add(size=20)
    material = bpy.data.materials.new("white")
    material.use_nodes = True
    bpy.context.object.data.materials.append(material)
    lamp = bpy.data.objects.new("lamp", bpy.data.lights.new("lamp", "POINT"))
    lamp.location, lamp.data.energy, lamp.data.shadow_soft_size = (0, 0, HEIGHT), 100, 0
    lamp.data.use_nodes = True
    tree = lamp.data.node_tree
    web = tree.nodes.new("ShaderNodeTexIES")
    web.mode, web.filepath = "EXTERNAL", str(FOLDER / "lamp.ies")
    emission = next(node for node in tree.nodes if node.type == "EMISSION")
    tree.links.new(web.outputs[0], emission.inputs["Strength"])
    scene.collection.objects.link(lamp)
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    # Pixels are 0.1 m apart; it looks down, with y up and x to the right.
    camera.location, camera.data.type, camera.data.ortho_scale = (0, 0, 1), "ORTHO", 5.1
    scene.collection.objects.link(camera)
    scene.camera = camera
    path = str(FOLDER / "floor.exr")
    scene.render.filepath = path
    bpy.ops.render.render(write_still=True)
    pixels = list(bpy.data.images.load(path).pixels)
    sides = {"+x": (45, 25), "+y": (25, 45), "-x": (5, 25), "-y": (25, 5)}
    found = {side: pixels[4 * (51 * row + column)] for side, (column, row) in sides.items()}
    (FOLDER / "found.json").write_text(json.dumps(found))


main()
