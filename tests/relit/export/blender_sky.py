"""Runs in Blender: shines with the map of a sky by set_scene.py, and prints what is seen.

Arguments: a folder with the script, the map and directions.json, in Blender's axes. Not a test by
itself: test_sky_maps.py runs it.
"""

import json
import runpy
import sys
from pathlib import Path

import bpy
from blender_cycles import empty_scene
from mathutils import Vector

FOLDER = Path(sys.argv[-1])


def main():
    scene = empty_scene(3, 3, 4)
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.type, camera.data.lens = "PERSP", 5000
    scene.collection.objects.link(camera)
    scene.camera, camera.rotation_mode = camera, "QUATERNION"
    world = bpy.data.worlds.new("sky")
    scene.world, world.use_nodes = world, True
    script = str(FOLDER / "set_scene.py")
    runpy.run_path(script)
    runpy.run_path(script)  # a second run changes nothing
    textures = [node for node in world.node_tree.nodes if node.type == "TEX_ENVIRONMENT"]
    assert len(textures) == 1, textures
    seen = []
    for direction in json.loads((FOLDER / "directions.json").read_text()):
        camera.rotation_quaternion = Vector(direction).to_track_quat("-Z", "Y")
        path = str(FOLDER / "seen.exr")
        scene.render.filepath = path
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(path)
        seen.append(list(image.pixels)[4 * 4 :][:3])
        bpy.data.images.remove(image)
    print("SEEN " + json.dumps(seen))


main()
