"""Runs in Blender: makes lamps, hangs them by set_scene.py, and prints where they are then.

Arguments: a folder with the scripts set_scene.py and again.py. Not a test by itself:
test_scene_places.py runs it.
"""

import json
import runpy
import sys
from pathlib import Path

import bpy
from mathutils import Matrix

FOLDER = Path(sys.argv[-1])


def hung():
    """Matrix, cone and area of each lamp."""
    transforms = {}
    for item in bpy.data.objects:
        if item.type != "LIGHT":
            continue
        data = item.data
        cone = [data.spot_size, data.spot_blend] if data.type == "SPOT" else None
        size = [data.size, data.size_y] if data.type == "AREA" else None
        matrix = [list(row) for row in item.matrix_world]
        transforms[item.name] = {"type": data.type, "matrix": matrix, "cone": cone, "size": size}
    return transforms


def main():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    settings = json.loads((FOLDER / "lamps.json").read_text())
    scene = bpy.context.scene
    parent = bpy.data.objects.new("rig", None)
    scene.collection.objects.link(parent)
    parent.matrix_world = Matrix(settings["rig"])
    for name, (kind, matrix) in settings["lamps"].items():
        data = bpy.data.lights.new(name, kind)
        if kind == "SPOT":
            data.spot_size, data.spot_blend = settings["cone"]
        item = bpy.data.objects.new(name, data)
        scene.collection.objects.link(item)
        item.parent = parent
        bpy.context.view_layer.update()
        item.matrix_world = Matrix(matrix)
    bpy.context.view_layer.update()
    snapshots = [hung()]
    for script in ("set_scene.py", "set_scene.py", "again.py"):
        runpy.run_path(str(FOLDER / script))
        bpy.context.view_layer.update()
        snapshots.append(hung())
    print("SEEN " + json.dumps(snapshots))


main()
