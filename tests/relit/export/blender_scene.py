"""Runs in Blender: makes small scenes with light groups, and checks what set_lights.py does.

Arguments: what to do, and a folder. Not a test by itself: test_exports.py runs it.
"""

import json
import math
import runpy
import sys
from pathlib import Path

import bpy

WHAT, FOLDER = sys.argv[-2], Path(sys.argv[-1])
SCRIPT = str(FOLDER / "set_lights.py")


def empty(samples=256):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device, scene.cycles.samples = "CPU", samples
    scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
    scene.cycles.sample_clamp_indirect = 0
    scene.render.resolution_x, scene.render.resolution_y = 32, 24
    scene.render.threads_mode, scene.render.threads = "FIXED", 2
    image = scene.render.image_settings
    if hasattr(image, "media_type"):
        image.media_type = "MULTI_LAYER_IMAGE"
    image.file_format, image.color_depth = "OPEN_EXR_MULTILAYER", "32"
    return scene


def group(thing, name):
    if name not in bpy.context.view_layer.lightgroups:
        bpy.ops.scene.view_layer_add_lightgroup(name=name)
    thing.lightgroup = name


def light(name, kind, energy, color, place, member_of=None):
    data = bpy.data.lights.new(name, kind)
    data.energy, data.color = energy, color
    thing = bpy.data.objects.new(name, data)
    thing.location = place
    bpy.context.scene.collection.objects.link(thing)
    if member_of:
        group(thing, member_of)
    return thing


def emitting(name, color, strength):
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    emission = tree.nodes.new("ShaderNodeEmission")
    emission.inputs["Color"].default_value = (*color, 1)
    emission.inputs["Strength"].default_value = strength
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(emission.outputs[0], output.inputs[0])
    return material


def cube(size, place, material, member_of=None):
    bpy.ops.mesh.primitive_cube_add(size=size, location=place)
    thing = bpy.context.object
    thing.data.materials.append(material)
    if member_of:
        group(thing, member_of)
    return thing


def sky(color, strength, member_of):
    world = bpy.data.worlds.new("sky")
    bpy.context.scene.world = world
    world.use_nodes = True
    background = next(n for n in world.node_tree.nodes if n.type == "BACKGROUND")
    background.inputs["Color"].default_value = (*color, 1)
    background.inputs["Strength"].default_value = strength
    group(world, member_of)
    return background


def stage():
    scene = empty()
    bpy.ops.mesh.primitive_plane_add(size=20)
    bpy.ops.mesh.primitive_uv_sphere_add(location=(0, 0, 1))
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location, camera.rotation_euler = (0, -8, 4), (1.15, 0, 0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    light("key", "AREA", 300, (1, 0.8, 0.6), (3, -2, 4), 'Key "Area"')
    light("fill", "POINT", 200, (0.3, 0.5, 1), (-3, -1, 3), "fill")
    light("fill 2", "SPOT", 300, (1, 0.2, 0.2), (-3, 0, 5), "fill")
    light("stray", "POINT", 60, (1, 1, 1), (0, 3, 4))
    glow = emitting("glow", (0.2, 1, 0.3), 6)
    cube(0.6, (1.8, -1, 0.3), glow, "glow")
    cube(0.4, (-2, -1.5, 0.2), glow)  # of the same material, and in no group
    sky((0.3, 0.35, 0.5), 0.4, "world")


def render(name, *, seed=0):
    scene = bpy.context.scene
    scene.cycles.seed = seed
    scene.render.filepath = str(FOLDER / f"{name}.exr")
    bpy.ops.render.render(write_still=True)


def again():
    blend = str(FOLDER / "scene.blend")
    bpy.ops.wm.open_mainfile(filepath=blend)
    runpy.run_path(SCRIPT)
    render("once", seed=7)
    render("seed", seed=8)
    runpy.run_path(SCRIPT)
    saved = str(FOLDER / "saved.blend")
    bpy.ops.wm.save_as_mainfile(filepath=saved)
    bpy.ops.wm.open_mainfile(filepath=saved)
    runpy.run_path(SCRIPT)
    render("thrice", seed=7)


def near(actual, expected):
    assert len(actual) == len(expected), (list(actual), expected)
    assert all(abs(f - w) < 1e-5 * max(1, abs(w)) for f, w in zip(actual, expected, strict=True)), (
        list(actual),
        expected,
    )


def emitted(data):
    return [data.energy * c for c in data.color]


def kinds():
    """The groups a: 2 0.5 0, b: 0.1 1 3, linked: off, world: 1.25 1.25 0.3 of test_exports.py."""
    empty()
    sun = light("sun", "SUN", 3, (1, 0.5, 0.25), (0, 0, 5), "a")
    shared, twin = light("x", "POINT", 10, (1, 1, 1), (0, 0, 1), "a"), None
    twin = bpy.data.objects.new("twin", shared.data)
    bpy.context.scene.collection.objects.link(twin)
    group(twin, "b")
    free = light("free", "POINT", 7, (1, 1, 1), (1, 0, 1))
    dark_light = light("off", "AREA", 5, (0.5, 1, 1), (1, 0, 1), "linked")

    # Principled, its emission textured; one of its two users is in another group.
    textured = bpy.data.materials.new("textured")
    textured.use_nodes = True
    tree = textured.node_tree
    principled = next(n for n in tree.nodes if n.type == "BSDF_PRINCIPLED")
    noise = tree.nodes.new("ShaderNodeTexNoise")
    color = principled.inputs.get("Emission Color") or principled.inputs["Emission"]
    tree.links.new(noise.outputs["Color"], color)
    principled.inputs["Emission Strength"].default_value = 2
    one, two = cube(1, (0, 0, 0), textured, "a"), cube(1, (3, 0, 0), textured, "b")
    dull = bpy.data.materials.new("dull")
    dull.use_nodes = True
    cube(1, (6, 0, 0), dull, "a")

    # Emission inside a node group is told, not guessed at.
    inner = bpy.data.node_groups.new("hidden", "ShaderNodeTree")
    inner.nodes.new("ShaderNodeEmission")
    outer = emitting("outer", (1, 1, 1), 1)
    outer.node_tree.nodes.new("ShaderNodeGroup").node_tree = inner
    cube(1, (9, 0, 0), outer, "b")
    background = sky((0.5, 0.5, 0.5), 1, "world")

    def check():
        near(emitted(sun.data), [6, 0.75, 0])
        assert abs(max(sun.data.color) - 1) < 1e-6
        near(emitted(shared.data), [20, 5, 0])
        near(emitted(twin.data), [1, 10, 30])
        near(emitted(free.data), [7, 7, 7])
        assert dark_light.data.energy == 0
        near(list(dark_light.data.color), [0.5, 1, 1])
        for thing, factor in ((one, [2, 0.5, 0]), (two, [0.1, 1, 3])):
            nodes = thing.material_slots[0].material.node_tree.nodes
            [multiply] = [n for n in nodes if n.type == "VECT_MATH"]
            near(list(multiply.inputs[1].default_value), factor)
            assert multiply.inputs[0].links[0].from_node.type == "TEX_NOISE"
        assert len(dull.node_tree.nodes) == 2
        assert len(inner.nodes) == 1
        [multiply] = [n for n in outer.node_tree.nodes if n.type == "VECT_MATH"]
        near(list(multiply.inputs[1].default_value), [0.1, 1, 3])
        [multiply] = [n for n in bpy.data.worlds["sky"].node_tree.nodes if n.type == "VECT_MATH"]
        near(list(multiply.inputs[1].default_value), [1.25, 1.25, 0.3])
        assert background.inputs["Color"].links[0].from_node == multiply

    for _ in range(3):
        runpy.run_path(SCRIPT)
        check()

    # A new render of what the scene has become: its multipliers come on top.
    text = Path(SCRIPT).read_text(encoding="utf-8")
    start = text.index("RENDER = ")
    text = text[:start] + "RENDER = 'another'" + text[text.index("\n", start) :]
    (FOLDER / "second.py").write_text(text, encoding="utf-8")
    for _ in range(2):
        runpy.run_path(str(FOLDER / "second.py"))
        near(emitted(sun.data), [12, 0.375, 0])
        nodes = two.material_slots[0].material.node_tree.nodes
        [multiply] = [n for n in nodes if n.type == "VECT_MATH"]
        near(list(multiply.inputs[1].default_value), [0.01, 1, 9])
    print("all as expected")


def space():
    """The lamps of `kinds` in a file that works in ACEScg; Blender converts what they were."""
    empty()
    sun = light("sun", "SUN", 3, (1, 0.5, 0.25), (0, 0, 5), "a")
    lamp = light("x", "POINT", 10, (1, 1, 1), (0, 0, 1), "b")
    glow = emitting("glow", (1, 0.25, 0.0625), 1)
    cube(1, (0, 0, 0), glow, "b")
    bpy.ops.wm.set_working_color_space(working_space="ACEScg", convert_colors=True)
    for _ in range(2):
        runpy.run_path(SCRIPT)
    [multiply] = [n for n in glow.node_tree.nodes if n.type == "VECT_MATH"]
    glows = [math.prod(x.default_value[c] for x in multiply.inputs[:2]) for c in range(3)]
    found = emitted(sun.data), emitted(lamp.data), glows
    print("FOUND " + json.dumps(found))


if WHAT == "render":
    stage()
    bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / "scene.blend"))
    render("first")
else:
    {"again": again, "kinds": kinds, "space": space}[WHAT]()
