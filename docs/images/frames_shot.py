"""Runs in Blender: renders a shot with light groups, of a ball that rolls through a room.

Arguments: a folder, the width in pixels, samples, and frames from 1 to 24. Not a picture by itself:
frames.py and benchmarks/frames.py run it.
"""

import math
import sys
from pathlib import Path

import bpy
from mathutils import Vector


def material(name, color, roughness=0.6):
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    shader = next(node for node in made.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Base Color"].default_value = (*color, 1)
    shader.inputs["Roughness"].default_value = roughness
    return made


def group(thing, name):
    if name not in bpy.context.view_layer.lightgroups:
        bpy.ops.scene.view_layer_add_lightgroup(name=name)
    thing.lightgroup = name


def lamp(name, kind, energy, color, place, size=0.0):
    data = bpy.data.lights.new(name, kind)
    data.energy, data.color = energy, color
    if kind == "AREA":
        data.size = size
    thing = bpy.data.objects.new(name, data)
    thing.location = place
    way = Vector((0, 0, 0.8)) - Vector(place)
    thing.rotation_euler = way.to_track_quat("-Z", "Y").to_euler()
    bpy.context.scene.collection.objects.link(thing)
    group(thing, name)


def room():
    bpy.ops.mesh.primitive_plane_add(size=16)
    bpy.context.object.data.materials.append(material("floor", (0.55, 0.5, 0.45)))
    bpy.ops.mesh.primitive_plane_add(size=16, location=(0, 3.5, 0), rotation=(math.pi / 2, 0, 0))
    bpy.context.object.data.materials.append(material("wall", (0.5, 0.52, 0.6)))
    bpy.ops.mesh.primitive_cube_add(size=1.3, location=(1.8, 1.2, 0.65), rotation=(0, 0, 0.5))
    bpy.context.object.data.materials.append(material("box", (0.7, 0.35, 0.25)))
    bpy.ops.mesh.primitive_cylinder_add(radius=0.35, depth=2.6, location=(-0.6, 2.0, 1.3))
    bpy.context.object.data.materials.append(material("post", (0.4, 0.55, 0.45)))
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.8, segments=48, ring_count=24)
    ball = bpy.context.object
    bpy.ops.object.shade_smooth()
    ball.data.materials.append(material("ball", (0.8, 0.75, 0.7), 0.35))
    for frame, place in ((1, (-2.6, 0, 0.8)), (24, (2.6, -0.6, 0.8))):
        ball.location = place
        ball.keyframe_insert("location", frame=frame)


def lights():
    lamp("key", "AREA", 420, (1, 0.93, 0.85), (4.5, -4, 5), 1.5)
    lamp("fill", "AREA", 140, (0.75, 0.85, 1), (-5, -4, 3), 2.5)
    lamp("rim", "SPOT", 900, (1, 1, 1), (-3, 3.0, 5.5))
    lamp("lamp", "POINT", 60, (1, 0.7, 0.4), (0.6, 2.4, 1.6))
    sky = bpy.data.worlds.new("sky")
    bpy.context.scene.world = sky
    sky.use_nodes = True
    background = next(node for node in sky.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = (0.35, 0.45, 0.7, 1)
    background.inputs["Strength"].default_value = 0.25
    group(sky, "sky")


def main(folder, width, samples, *frames):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device, scene.cycles.samples = "CPU", int(samples)
    scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
    scene.cycles.sample_clamp_indirect = 0
    scene.render.resolution_x, scene.render.resolution_y = int(width), int(width) * 9 // 16
    image = scene.render.image_settings
    if hasattr(image, "media_type"):
        image.media_type = "MULTI_LAYER_IMAGE"
    image.file_format, image.color_depth = "OPEN_EXR_MULTILAYER", "16"
    room()
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location, camera.rotation_euler, camera.data.lens = (0, -8.2, 3.0), (1.32, 0, 0), 40
    scene.collection.objects.link(camera)
    scene.camera = camera
    lights()
    for frame in frames:
        scene.frame_set(int(frame))
        scene.render.filepath = str(Path(folder) / f"shot.{int(frame):04d}.exr")
        bpy.ops.render.render(write_still=True)


main(*sys.argv[sys.argv.index("--") + 1 if "--" in sys.argv else 1 :])
