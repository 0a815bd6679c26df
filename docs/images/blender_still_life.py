"""A still life on a table, for the pictures of Blender's add-on; imported within Blender only."""

import math
from typing import Any

import bpy

#: Size and samples of its render.
SIZE, SAMPLES = (480, 270), 48

Colour = tuple[float, float, float]


def new_shot() -> bpy.types.Scene:
    """Empty the file, and build the still life with four lamps and a dim sky."""
    for kind in ("objects", "meshes", "lights", "materials", "cameras", "worlds"):
        for owner in list(getattr(bpy.data, kind)):
            getattr(bpy.data, kind).remove(owner)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.preview_samples = SAMPLES, 64
    scene.cycles.use_denoising = False
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    scene.view_settings.view_transform = "Filmic"
    add_room()
    add_things()
    add_lamps()
    scene.world = bpy.data.worlds.new("Sky")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.2, 0.3, 0.5, 1)
    scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.05
    bpy.ops.object.camera_add(location=(0.2, -3.4, 1.7), rotation=(math.radians(80), 0, 0))
    scene.camera = bpy.context.view_layer.objects.active
    scene.camera.data.lens = 42
    bpy.context.view_layer.update()
    return scene


def dress(name: str, colour: Colour, roughness: float = 0.6, metallic: float = 0.0) -> Any:
    """Name the active object, and give it a material."""
    item = bpy.context.view_layer.objects.active
    item.name = name
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    shader = material.node_tree.nodes["Principled BSDF"].inputs
    shader["Base Color"].default_value = (*colour, 1)
    shader["Roughness"].default_value, shader["Metallic"].default_value = roughness, metallic
    item.data.materials.append(material)
    return item


def add_room() -> None:
    """Add a floor, two walls, and a table."""
    bpy.ops.mesh.primitive_plane_add(size=12)
    dress("Floor", (0.22, 0.12, 0.06), 0.4)
    bpy.ops.mesh.primitive_plane_add(size=12, location=(0, 2.2, 0), rotation=(math.pi / 2, 0, 0))
    dress("Wall", (0.5, 0.42, 0.36), 0.9)
    turn = (math.pi / 2, 0, math.pi / 2)
    bpy.ops.mesh.primitive_plane_add(size=12, location=(-2.6, 0, 0), rotation=turn)
    dress("Side Wall", (0.35, 0.42, 0.45), 0.9)
    bpy.ops.mesh.primitive_cube_add(location=(0.2, 0.4, 0.75))
    bpy.context.view_layer.objects.active.scale = (1.5, 0.7, 0.04)
    dress("Table", (0.3, 0.16, 0.07), 0.3)
    for x in (-1.2, 1.6):
        bpy.ops.mesh.primitive_cylinder_add(radius=0.05, depth=0.72, location=(x, 0.3, 0.36))
        dress("Leg", (0.2, 0.11, 0.05), 0.4)


def add_things() -> None:
    """Add a head, a bowl with fruit, a bottle and a ball on the table."""
    bpy.ops.mesh.primitive_monkey_add(size=0.62, location=(-0.45, 0.45, 1.06))
    head = dress("Head", (0.75, 0.7, 0.62), 0.35)
    head.rotation_euler = (-0.35, 0, 0.45)
    head.modifiers.new("Smooth", "SUBSURF").render_levels = 2
    head.modifiers["Smooth"].levels = 2
    bpy.ops.mesh.primitive_cylinder_add(radius=0.11, depth=0.46, location=(0.95, 0.6, 1.02))
    dress("Bottle", (0.05, 0.25, 0.12), 0.08)
    bpy.ops.mesh.primitive_cone_add(
        radius1=0.11, radius2=0.035, depth=0.1, location=(0.95, 0.6, 1.3)
    )
    dress("Shoulder", (0.05, 0.25, 0.12), 0.08)
    bpy.ops.mesh.primitive_cylinder_add(radius=0.035, depth=0.2, location=(0.95, 0.6, 1.42))
    dress("Neck", (0.05, 0.25, 0.12), 0.08)
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.17, location=(1.35, 0.25, 0.96))
    dress("Ball", (0.9, 0.85, 0.75), 0.12, 1.0)
    for k, (x, y, colour) in enumerate(
        (
            (0.3, 0.3, (0.7, 0.12, 0.05)),
            (0.52, 0.22, (0.75, 0.4, 0.05)),
            (0.4, 0.5, (0.5, 0.5, 0.08)),
        )
    ):
        bpy.ops.mesh.primitive_uv_sphere_add(radius=0.11, location=(x, y, 0.9))
        dress(f"Fruit {k + 1}", colour, 0.4)
    for item in bpy.data.objects:
        if item.type == "MESH" and len(item.data.polygons) > 100:
            item.data.polygons.foreach_set("use_smooth", [True] * len(item.data.polygons))


def add_lamps() -> None:
    """Add a window, a pendant, a spot on the wall, and a lamp behind the head."""
    for name, kind, energy, colour, place, turn in (
        ("Window", "AREA", 40.0, (0.55, 0.75, 1.0), (-2.4, -0.6, 1.9), (0, -1.4, 0)),
        ("Pendant", "POINT", 35.0, (1.0, 0.72, 0.42), (0.75, 0.2, 2.1), (0, 0, 0)),
        ("Picture Spot", "SPOT", 90.0, (1.0, 0.85, 0.7), (1.6, 0.6, 2.7), (0.55, 0, 0)),
        ("Behind", "POINT", 3.0, (1.0, 0.5, 0.25), (-1.3, 1.6, 1.1), (0, 0, 0)),
    ):
        lamp = bpy.data.lights.new(name, kind)
        lamp.energy, lamp.color = energy, colour
        if kind == "AREA":
            lamp.size = 1.2
        if kind == "POINT":
            lamp.shadow_soft_size = 0.08
        item = bpy.data.objects.new(name, lamp)
        item.location, item.rotation_euler = place, turn
        bpy.context.scene.collection.objects.link(item)
