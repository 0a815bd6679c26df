"""Runs in Blender: multiplies lights whose colour something else multiplies, too, and prints how.

Arguments: the working space; "script" for set_lights.py, "keys" for one that animates, at frame 3,
"addon" for the add-on; and a folder with the script and the multipliers. "render" and "again" make
pictures of a room with coloured walls instead: `first.exr` with light groups and `painted.exr`,
whose lights are multiplied by hand in the working space; and `again.exr`, with set_lights.py. Not a
test by itself: test_working_spaces.py runs it.
"""

import json
import runpy
import sys
from pathlib import Path

import bpy
from blender_cycles import empty_scene

SPACE, WAY, FOLDER = sys.argv[-3], sys.argv[-2], Path(sys.argv[-1])
FACTORS = json.loads((FOLDER / "factors.json").read_text())


def added(name, data):
    thing = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(thing)
    return thing


def shader_of(owner, kind):
    return next(node for node in owner.node_tree.nodes if node.type == kind)


def surface(name, kind, color):
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    shader, output = tree.nodes.new(kind), tree.nodes.new("ShaderNodeOutputMaterial")
    shader.inputs["Color"].default_value = (*color, 1)
    tree.links.new(shader.outputs[0], output.inputs[0])
    return material


def lamp(name, color, **properties):
    light = bpy.data.lights.new(name, "POINT")
    light.energy, light.color = 100, color
    for key, value in properties.items():
        setattr(light, key, value)
    if light.node_tree is None:
        light.use_nodes = True
    added(name, light).location = (0, 0, 2)
    return light


def linked(owner, kind, texture, **inputs):
    """Let a node make the colour that a shader of that kind emits."""
    tree = owner.node_tree
    node = tree.nodes.new(texture)
    for key, value in inputs.items():
        node.inputs[key].default_value = value
    tree.links.new(node.outputs[0], shader_of(owner, kind).inputs["Color"])


def lights():
    """Light items by name, in the order of the multipliers."""
    lamp("plain", (1, 0.6, 0.3))
    lamp("warm", (1, 0.6, 0.3), use_temperature=True, temperature=2500.0)
    tinted = lamp("tinted", (1, 0.6, 0.3))
    shader_of(tinted, "EMISSION").inputs["Color"].default_value = (0.2, 0.5, 1, 1)
    for name, color in (("nodes", (1, 1, 1)), ("both", (1, 0.6, 0.3))):
        linked(lamp(name, color), "EMISSION", "ShaderNodeBlackbody", Temperature=4000.0)
    bpy.ops.mesh.primitive_plane_add(size=0.5, location=(0, 0, 2), rotation=(3.14159265, 0, 0))
    panel = bpy.context.object
    panel.name = "texture"
    glow = surface("glow", "ShaderNodeEmission", (1, 1, 1))
    shader_of(glow, "EMISSION").inputs["Strength"].default_value = 30
    linked(glow, "EMISSION", "ShaderNodeRGB")
    shader_of(glow, "RGB").outputs[0].default_value = (0.8, 0.1, 0.05, 1)
    panel.data.materials.append(glow)
    world = bpy.data.worlds.new("sky")
    world.use_nodes = True
    linked(world, "BACKGROUND", "ShaderNodeBlackbody", Temperature=9000.0)
    found = {name: bpy.data.objects.get(name) or world for name in FACTORS}
    for name, item in found.items():
        bpy.ops.scene.view_layer_add_lightgroup(name=name)
        item.lightgroup = name
    return found


def radiances(items):
    """That of the middle of a white floor under each light alone."""
    scene, seen = bpy.context.scene, {}
    for name, item in items.items():
        for other in items.values():
            if other != item and hasattr(other, "hide_render"):
                other.hide_render = True
        scene.world = item if name == "sky" else None
        if name != "sky":
            item.hide_render = False
        path = str(FOLDER / "seen.exr")
        scene.render.filepath = path
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(path)
        image.colorspace_settings.is_data = True
        seen[name] = list(image.pixels)[4 * (4 * 8 + 4) :][:3]
        bpy.data.images.remove(image)
    return seen


def addon_places(items):
    from lightpaint_addon.lamps.lit_items import emitter_of, world_emitter

    return {
        name: (world_emitter(item) if name == "sky" else emitter_of(item, {})).places
        for name, item in items.items()
    }


def node_counts():
    trees = [x.node_tree for x in (*bpy.data.lights, *bpy.data.materials, *bpy.data.worlds)]
    return [len(tree.nodes) for tree in trees if tree] + [len(bpy.data.node_groups)]


def multiply_by_hand(items):
    """Multiply lights by their factors as they are, in the working space."""
    for name, item in items.items():
        factor = FACTORS[name]
        if name in ("texture", "sky"):
            owner = item if name == "sky" else item.data.materials[0]
            socket = shader_of(owner, "BACKGROUND" if name == "sky" else "EMISSION").inputs["Color"]
            node = owner.node_tree.nodes.new("ShaderNodeVectorMath")
            node.operation, node.inputs[1].default_value = "MULTIPLY", factor
            owner.node_tree.links.new(socket.links[0].from_socket, node.inputs[0])
            owner.node_tree.links.new(node.outputs[0], socket)
        else:
            item.data.color = [c * f for c, f in zip(item.data.color, factor, strict=True)]


def room(items):
    """Walls of colours that Rec.709 and the working space multiply otherwise."""
    for k, (name, item) in enumerate(items.items()):
        if name != "sky":
            item.location = (1.5 * (k % 3 - 1), 1.2 * (k // 3) - 1, 1 + 0.4 * k)
    for color, location, rotation in (
        ((0.7, 0.05, 0.02), (0, 0, 0), (0, 0, 0)),
        ((0.03, 0.6, 0.05), (0, 3, 2), (1.5708, 0, 0)),
        ((0.05, 0.08, 0.7), (-3, 0, 2), (0, 1.5708, 0)),
        ((0.6, 0.5, 0.4), (3, 0, 2), (0, -1.5708, 0)),
    ):
        bpy.ops.mesh.primitive_plane_add(size=7, location=location, rotation=rotation)
        bpy.context.object.data.materials.append(surface("wall", "ShaderNodeBsdfDiffuse", color))
    camera = added("camera", bpy.data.cameras.new("camera"))
    camera.location, camera.rotation_euler, camera.data.lens = (0, -6, 2.5), (1.4, 0, 0), 22
    bpy.context.scene.camera = camera


def save_render(name):
    scene = bpy.context.scene
    scene.render.image_settings.media_type = "MULTI_LAYER_IMAGE"
    scene.render.image_settings.file_format = "OPEN_EXR_MULTILAYER"
    scene.render.filepath = str(FOLDER / name)
    bpy.ops.render.render(write_still=True)


def render_room():
    """Render with light groups, and again with lights multiplied by hand."""
    empty_scene(32, 24, 64)
    bpy.ops.wm.set_working_color_space(working_space=SPACE)
    cycles = bpy.context.scene.cycles
    cycles.sample_clamp_indirect = 0
    cycles.use_light_tree = False  # which would sample other lights where these are brighter
    items = lights()
    bpy.context.scene.world = items["sky"]
    room(items)
    save_render("first.exr")
    bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / "room.blend"))
    multiply_by_hand(items)
    save_render("painted.exr")


def main():
    if WAY == "render":
        return render_room()
    if WAY == "again":
        bpy.ops.wm.open_mainfile(filepath=str(FOLDER / "room.blend"))
        runpy.run_path(str(FOLDER / "set_lights.py"))
        return save_render("again.exr")
    return compare_lamps()


def compare_lamps():
    """Print the radiance of a white floor under each lamp before and after its multiplication."""
    scene = empty_scene(8, 8, 16)
    bpy.ops.wm.set_working_color_space(working_space=SPACE)
    scene.cycles.max_bounces = 0
    bpy.ops.mesh.primitive_plane_add(size=1)
    bpy.context.object.data.materials.append(surface("white", "ShaderNodeBsdfDiffuse", (1, 1, 1)))
    camera = added("camera", bpy.data.cameras.new("camera"))
    camera.location, camera.data.type, camera.data.ortho_scale = (0, 0, 1), "ORTHO", 0.01
    scene.camera = camera
    items = lights()
    before = radiances(items)
    if WAY != "addon":
        for _ in range(2):
            runpy.run_path(str(FOLDER / "set_lights.py"))
        scene.frame_set(3)
        after = radiances(items)
    else:
        import lightpaint_addon.lamps.lamp_levels as levels
        from lightpaint_addon.lamps.lamp_units import working_space

        counts = node_counts()
        groups = addon_places(items)
        levels.commit_base(groups, levels.present_levels(groups))
        for _ in range(2):
            levels.show_factors(addon_places(items), FACTORS, working_space(bpy.data))
        after = radiances(items)
        levels.discard_levels(addon_places(items))
        assert node_counts() == counts, (node_counts(), counts)
    print("SEEN " + json.dumps([before, after]))


main()
