"""Runs in Blender: sets lights by set_scene.py, and prints what a white floor then looks like.

Arguments: the file's working space, "" for that of old versions, and a folder with the script. Not
a test by itself: test_scene_script.py runs it.
"""

import json
import runpy
import sys
from pathlib import Path

import bpy
from blender_cycles import empty_scene

FOLDER = Path(sys.argv[-1])
#: Metres of the lamps above the floor.
HEIGHT = 2.0


def material(name, kind, **inputs):
    surface = bpy.data.materials.new(name)
    surface.use_nodes = True
    tree = surface.node_tree
    tree.nodes.clear()
    shader, output = tree.nodes.new(kind), tree.nodes.new("ShaderNodeOutputMaterial")
    for key, value in inputs.items():
        shader.inputs[key].default_value = value
    tree.links.new(shader.outputs[0], output.inputs[0])
    return surface


def added(name, data):
    thing = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(thing)
    return thing


def lamp(name, kind, **properties):
    data = bpy.data.lights.new(name, kind)
    thing = added(name, data)
    thing.location = (0, 0, HEIGHT)
    # Whatever an artist may have left.
    data.energy, data.color = 123, (0.1, 0.9, 0.4)
    for key, value in {"exposure": 2.0, "use_temperature": True, **properties}.items():
        if hasattr(data, key):
            setattr(data, key, value)
    return thing


def with_nodes(light):
    """Multiply a lamp by its nodes."""
    if light.node_tree is None:
        light.use_nodes = True
    emission = next(node for node in light.node_tree.nodes if node.type == "EMISSION")
    emission.inputs["Strength"].default_value = 3.0
    emission.inputs["Color"].default_value = (0.5, 1, 1, 1)


def with_node_group(light):
    """Let a group make the light of a lamp."""
    group = bpy.data.node_groups.new("gel", "ShaderNodeTree")
    group.interface.new_socket("Light", in_out="OUTPUT", socket_type="NodeSocketShader")
    inside, out = group.nodes.new("ShaderNodeEmission"), group.nodes.new("NodeGroupOutput")
    group.links.new(inside.outputs[0], out.inputs[0])
    if light.node_tree is None:
        light.use_nodes = True
    node = light.node_tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    output = next(x for x in light.node_tree.nodes if x.type == "OUTPUT_LIGHT")
    light.node_tree.links.new(node.outputs[0], output.inputs["Surface"])


def floor_and_camera():
    bpy.ops.mesh.primitive_plane_add(size=1)
    bpy.context.object.data.materials.append(
        material("white", "ShaderNodeBsdfDiffuse", Color=(1, 1, 1, 1))
    )
    camera = added("camera", bpy.data.cameras.new("camera"))
    camera.location, camera.data.type, camera.data.ortho_scale = (0, 0, 1), "ORTHO", 0.01
    bpy.context.scene.camera = camera


def radiance():
    """That of the middle of the floor."""
    path = str(FOLDER / "seen.exr")
    bpy.context.scene.render.filepath = path
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(path)
    middle = list(image.pixels)[4 * (4 * 8 + 4) :][:3]
    bpy.data.images.remove(image)
    return middle


def main():
    scene = empty_scene(8, 8, 256)
    if sys.argv[-2]:
        bpy.ops.wm.set_working_color_space(working_space=sys.argv[-2])
    scene.cycles.max_bounces = 0
    floor_and_camera()
    lamps = [
        lamp("bulb", "POINT", shadow_soft_size=0),
        lamp("spot", "SPOT", shadow_soft_size=0, spot_size=1.0, spot_blend=0),
        lamp("sun", "SUN", angle=0),
        lamp("desk", "AREA", shape="RECTANGLE", size=0.01, size_y=0.02, spread=1.0),
    ]
    lamps[-1].scale = (2, 1, 1)
    with_nodes(lamps[0].data)
    grouped = lamp("grouped", "POINT")
    with_node_group(grouped.data)
    bpy.ops.mesh.primitive_plane_add(
        size=0.02, location=(0, 0, HEIGHT), rotation=(3.14159265, 0, 0)
    )
    panel = bpy.context.object
    panel.name = "panel"
    panel.data.materials.append(material("glow", "ShaderNodeEmission"))
    world = bpy.data.worlds.new("sky")
    scene.world, world.use_nodes = world, True
    runpy.run_path(str(FOLDER / "set_scene.py"))
    radiances = {}
    for one in (*lamps, panel, None):
        for other in (*lamps, grouped, panel):
            other.hide_render = other is not one
        scene.world = world if one is None else None
        radiances["sky" if one is None else one.name] = radiance()
    kept = [dict(one.data.get("lightpaint_plain") or {}) for one in lamps]
    print("KEPT " + json.dumps([sorted(x) for x in kept]))
    print("SEEN " + json.dumps(radiances))


main()
