"""Runs in Blender: sets keyed lights by set_lights.py, and leaves what they are at each frame.

Argument: a folder with set_lights.py. Not a test by itself: test_frame_exports.py runs it.
"""

import json
import math
import runpy
import sys
from pathlib import Path

import bpy

FOLDER = Path(sys.argv[-1])


def group(thing, name):
    if name not in bpy.context.view_layer.lightgroups:
        bpy.ops.scene.view_layer_add_lightgroup(name=name)
    thing.lightgroup = name


def lamp(name, member_of):
    data = bpy.data.lights.new(name, "POINT")
    data.energy, data.color = 10, (1, 0.5, 0.25)
    thing = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(thing)
    group(thing, member_of)
    return data


bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
key, own = lamp("key", "key"), lamp("own", "fill")
own.keyframe_insert("energy", frame=1)
sky = bpy.data.worlds.new("sky")
scene.world = sky
sky.use_nodes = True
group(sky, "rim")


def lights():
    """Return the light of the lamp and the world at each frame, relative to their first light."""
    found = {}
    for frame in range(0, 27):
        scene.frame_set(frame)
        nodes = [x for x in sky.node_tree.nodes if x.type == "VECT_MATH"]
        glow = [math.prod(x.inputs[1].default_value[c] for x in nodes) for c in range(3)]
        emitted = [
            key.energy * c / (10 * b) for c, b in zip(key.color, (1, 0.5, 0.25), strict=True)
        ]
        found[frame] = [emitted, glow]
    return found


runpy.run_path(str(FOLDER / "set_lights.py"))
once = lights()
runpy.run_path(str(FOLDER / "set_lights.py"))
twice = lights()
still = (FOLDER / "set_lights.py").read_text(encoding="utf-8")
start = still.index("KEYS = {")
(FOLDER / "still.py").write_text(
    still[:start] + "KEYS = {}" + still[still.index("\n}", start) + 2 :]
)
runpy.run_path(str(FOLDER / "still.py"))
still_found = lights()

# An answer for a new render: keys of a lamp are nobody's base, a multiplication gets another one.
runpy.run_path(str(FOLDER / "set_lights.py"))
start = still.index("RENDER = ")
text = still[:start] + "RENDER = 'another'" + still[still.index("\n", start) :]
(FOLDER / "another.py").write_text(text, encoding="utf-8")
for _ in range(2):
    runpy.run_path(str(FOLDER / "another.py"))
found = {"once": once, "twice": twice, "still": still_found, "another": lights(), "own": own.energy}
(FOLDER / "found.json").write_text(json.dumps(found))
