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


def with_profile(light):
    """Multiply a lamp by the profile of an IES file."""
    if light.node_tree is None:
        light.use_nodes = True
    tree = light.node_tree
    emission = next(node for node in tree.nodes if node.type == "EMISSION")
    tree.links.new(tree.nodes.new("ShaderNodeTexIES").outputs[0], emission.inputs["Strength"])


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


def mesh_light(name):
    """Add a mesh that is not rendered, whose nodes mix what they emit."""
    bpy.ops.mesh.primitive_plane_add(size=0.02)
    thing = bpy.context.object
    thing.name, thing.hide_render = name, True
    coated = name == "coated"
    glow = material(name, "ShaderNodeBsdfPrincipled" if coated else "ShaderNodeEmission")
    thing.data.materials.append(glow)
    nodes, link = glow.node_tree.nodes, glow.node_tree.links.new
    shader, output = nodes[0], nodes[1]
    if coated:
        key = "Coat Weight" if "Coat Weight" in shader.inputs else "Alpha"
        shader.inputs[key].default_value = 0.5
        return
    other = nodes.new("ShaderNodeBsdfDiffuse" if name == "half" else "ShaderNodeEmission")
    mix = nodes.new("ShaderNodeAddShader" if name == "twice" else "ShaderNodeMixShader")
    for socket, one in zip(
        [x for x in mix.inputs if x.type == "SHADER"], (shader, other), strict=True
    ):
        link(one.outputs[0], socket)
    link(mix.outputs[0], output.inputs[0])


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
    # What was a point in the scene, and lamps that cannot have what their names had there.
    lamps.append(lamp("tile", "AREA", shape="SQUARE", size=0.01))
    lamp("wrong sun", "SUN").hide_render = lamp("wrong bulb", "POINT").hide_render = True
    with_nodes(lamps[0].data)
    grouped = lamp("grouped", "POINT")
    with_node_group(grouped.data)
    profile = lamp("profile", "POINT")
    with_profile(profile.data)
    bpy.ops.mesh.primitive_plane_add(
        size=0.02, location=(0, 0, HEIGHT), rotation=(3.14159265, 0, 0)
    )
    panel = bpy.context.object
    panel.name = "panel"
    panel.data.materials.append(material("glow", "ShaderNodeEmission"))
    world = bpy.data.worlds.new("sky")
    scene.world, world.use_nodes = world, True
    for name in ("half", "twice", "coated", "whole"):
        mesh_light(name)
    if hasattr(lamps[1], "light_linking"):
        lamps[1].light_linking.receiver_collection = bpy.data.collections.new("all")
        lamps[1].light_linking.receiver_collection.objects.link(bpy.data.objects["Plane"])
    lamps[3].visible_glossy = False
    # A portal gives no light, and one without shadows too much.
    lamps[4].data.cycles.is_portal, lamps[0].data.use_shadow = True, False
    away = bpy.data.collections.new("away")
    scene.collection.children.link(away)
    away.hide_render = True
    inner = bpy.data.collections.new("inner")
    away.children.link(inner)
    stored = lamp("stored", "POINT")
    scene.collection.objects.unlink(stored)
    inner.objects.link(stored)
    runpy.run_path(str(FOLDER / "set_scene.py"))
    radiances = {}
    for one in (*lamps, panel, None):
        for other in (*lamps, grouped, profile, panel):
            other.hide_render = other is not one
        scene.world = world if one is None else None
        radiances["sky" if one is None else one.name] = radiance()
    kept = [dict(one.data.get("lightpaint_plain") or {}) for one in lamps]
    print("KEPT " + json.dumps([sorted(x) for x in kept]))
    print("SEEN " + json.dumps(radiances))


main()
