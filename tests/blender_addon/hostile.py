"""Odd names, hundreds of lamps, lights that cannot be changed, and things that are missing."""

import contextlib
import json
import os
import signal
import sys
from typing import Any

sys.path.insert(0, os.path.dirname(__file__))

import bpy
from scripted_painter import contents, controller, open_painter, start_addon, wait_until
from shots import new_shot

folder = sys.argv[-1]
found: dict[str, Any] = {}


def message_of(operator: Any, **values: Any) -> str:
    """Return the sentence that an operator ends with."""
    controller.message = ""
    with contextlib.suppress(RuntimeError):
        operator(**values)
    return controller.message


def add_lamp(name: str, energy: float = 10.0) -> Any:
    lamp = bpy.data.lights.new(name, "POINT")
    lamp.energy = energy
    item = bpy.data.objects.new(name, lamp)
    item.location = (0, -2, 2)
    bpy.context.scene.collection.objects.link(item)
    return item


def add_hidden_emission(item: Any) -> None:
    """Give an object a material whose emission is inside a node group."""
    hidden = bpy.data.node_groups.new("deep", "ShaderNodeTree")
    if hasattr(hidden, "interface"):
        hidden.interface.new_socket("Out", in_out="OUTPUT", socket_type="NodeSocketShader")
    else:
        hidden.outputs.new("NodeSocketShader", "Out")
    emission, end = hidden.nodes.new("ShaderNodeEmission"), hidden.nodes.new("NodeGroupOutput")
    hidden.links.new(emission.outputs[0], end.inputs[0])
    material = bpy.data.materials.new("deep")
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    group, output = tree.nodes.new("ShaderNodeGroup"), tree.nodes.new("ShaderNodeOutputMaterial")
    group.node_tree = hidden
    tree.links.new(group.outputs[0], output.inputs["Surface"])
    item.data.materials.append(material)


scene = new_shot()
start_addon(os.path.join(folder, "shot"))

# Names that no file and no script likes, and two that Blender would make one.
odd_names = ['"quoted"', "line\nbreak", "a.b", "a_b", "x" * 60, "x" * 59 + "y", "=1+1", "ламп ☀"]
for name in odd_names:
    add_lamp(name)
scene.render.resolution_x, scene.render.resolution_y, scene.cycles.samples = 32, 18, 1

# What stays as it is: dark, negative, driven, keyed, shared, hidden in a group.
add_lamp("dark", 0.0)
add_lamp("negative", -5.0)
driven, keyed = add_lamp("driven"), add_lamp("keyed")
driven.data.driver_add("energy").driver.expression = "12"
keyed.data.keyframe_insert("energy", frame=1)
add_hidden_emission(bpy.data.objects["Sphere"])
twin = bpy.data.objects.new("twin", bpy.data.objects["Point"].data)
scene.collection.objects.link(twin)

# A lamp of another file.
library = os.path.join(folder, "library.blend")
other = bpy.data.lights.new("linked", "POINT")
bpy.data.libraries.write(library, {other})
bpy.data.lights.remove(other)
with bpy.data.libraries.load(library, link=True) as (_, wanted):
    wanted.lights = ["linked"]
scene.collection.objects.link(bpy.data.objects.new("linked", wanted.lights[0]))

scene.frame_set(1)
before = contents()
found["prepared"] = message_of(bpy.ops.lightpaint.prepare)
found["left"] = list(controller.left)
found["groups"] = contents()["groups"]
found["shared"] = [twin.lightgroup, bpy.data.objects["Point"].lightgroup]
bpy.data.objects["a.b"].name = "renamed"
bpy.ops.lightpaint.prepare()
found["kept on rename"] = contents()["groups"] == found["groups"]
bpy.data.objects["renamed"].name = "a.b"
scene.lightpaint_settings.grouping = "COLLECTIONS"
bpy.ops.lightpaint.prepare()
found["grouped"] = contents()["groups"]
scene.lightpaint_settings.grouping = "LAMPS"
bpy.ops.lightpaint.prepare()
found["kept on regrouping"] = sorted(contents()["groups"]) == sorted(found["groups"])
bpy.ops.lightpaint.render()
found["rendered"] = controller.message
scene.lightpaint_settings.grouping = "COLLECTIONS"
bpy.ops.lightpaint.render()
found["rendered in other groups"] = controller.message
scene.lightpaint_settings.grouping = "LAMPS"
bpy.ops.lightpaint.render()
bpy.ops.lightpaint.render()
found["rendered already"] = controller.message

# No program, no folder, no camera.
path = os.environ["PATH"]
os.environ["PATH"] = folder
found["not installed"] = message_of(bpy.ops.lightpaint.paint)
os.environ["PATH"] = path
file = os.path.join(folder, "file")
open(file, "w").close()
scene.lightpaint_settings.folder = os.path.join(file, "shot")
found["no folder"] = message_of(bpy.ops.lightpaint.render)
scene.lightpaint_settings.folder = os.path.join(folder, "shot")
camera, scene.camera = scene.camera, None
found["no camera"] = message_of(bpy.ops.lightpaint.render)
scene.camera = camera
missing = bpy.data.images.new("missing", 4, 4)
missing.source, missing.filepath = "FILE", os.path.join(folder, "missing.png")
bpy.context.tool_settings.image_paint.canvas = missing
found["no pixels"] = message_of(bpy.ops.lightpaint.solve_image)
found["no reference"] = message_of(
    bpy.ops.lightpaint.look_like, filepath=os.path.join(folder, "no.png")
)

# A painter that is killed.
open_painter()
os.kill(controller.session._run._process.pid, signal.SIGKILL)
wait_until(lambda: controller.session.is_over, "a painter that has gone")
found["killed"] = controller.session.message
# And the next one, in the same folder.
open_painter()
found["again"] = controller.session.is_connected

bpy.ops.lightpaint.revert()
after = contents()
found["reverted"] = [key for key in before if before[key] != after.get(key)]

# Three hundred lamps.
for index in range(300):
    add_lamp(f"many.{index:03d}")
many = contents()
bpy.ops.lightpaint.prepare()
found["many"] = len(contents()["groups"])
scene.lightpaint_settings.folder = os.path.join(folder, "many")
bpy.ops.lightpaint.render()
found["many rendered"] = controller.message
bpy.ops.lightpaint.revert()
after = contents()
found["many reverted"] = [key for key in many if many[key] != after.get(key)]
with open(os.path.join(folder, "found.json"), "w") as record:
    json.dump(found, record)
