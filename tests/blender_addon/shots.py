"""Scenes of Blender that tests light; imported within Blender only."""

import bpy

#: Samples and size of all renders: as little as tells lamps apart.
SAMPLES, SIZE = 16, (160, 90)


def available_view(view):
    """Return a view transform of this Blender: before 4.0 there is no AgX, but Filmic."""
    return "Filmic" if view == "AgX" and bpy.app.version < (4, 0) else view


def new_shot(*, view: str = "Standard") -> bpy.types.Scene:
    """Empty the file, and build a corner with one lamp of each kind, meshes that emit, a world."""
    for kind in ("objects", "meshes", "lights", "materials", "cameras", "worlds"):
        for owner in list(getattr(bpy.data, kind)):
            getattr(bpy.data, kind).remove(owner)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising = SAMPLES, False
    scene.cycles.use_adaptive_sampling = False
    scene.cycles.sample_clamp_indirect = 0
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    scene.render.resolution_percentage = 100
    scene.view_settings.view_transform = available_view(view)
    add_room(scene)
    add_lamps()
    add_emitting_meshes(scene)
    scene.world = bpy.data.worlds.new("Sky")
    set_background(scene.world, (0.2, 0.3, 0.5), 0.3)
    bpy.context.view_layer.update()
    return scene


def add_room(scene: bpy.types.Scene) -> None:
    """Add a floor, a wall, a sphere and a camera."""
    bpy.ops.mesh.primitive_plane_add(size=12)
    bpy.ops.mesh.primitive_plane_add(size=12, location=(0, 4, 0), rotation=(1.5708, 0, 0))
    bpy.ops.mesh.primitive_uv_sphere_add(
        radius=0.8, location=(0, 1, 0.8), segments=16, ring_count=8
    )
    bpy.ops.object.camera_add(location=(0, -8, 3), rotation=(1.35, 0, 0))
    scene.camera = bpy.context.view_layer.objects.active


def add_lamps() -> None:
    """Add a point, a spot, an area and a sun, each with a colour of its own."""
    for kind, energy, colour, place in (
        ("POINT", 120.0, (1, 0.8, 0.6), (-3, 0, 2)),
        ("SPOT", 300.0, (0.6, 0.8, 1), (3, -1, 4)),
        ("AREA", 80.0, (1, 1, 1), (0, 2, 4)),
        ("SUN", 0.4, (1, 0.9, 0.8), (5, -5, 6)),
    ):
        lamp = bpy.data.lights.new(kind.title(), kind)
        lamp.energy, lamp.color = energy, colour
        item = bpy.data.objects.new(kind.title(), lamp)
        item.location = place
        if kind == "SUN":
            item.rotation_euler = (0.9, 0.2, 0.4)
        bpy.context.scene.collection.objects.link(item)


def add_emitting_meshes(scene: bpy.types.Scene) -> None:
    """Add a cube that emits a plain colour, and one that emits a texture."""
    for name, place, is_textured in (("Tube", (-2, 3, 3), False), ("Screen", (2, 3, 1), True)):
        bpy.ops.mesh.primitive_cube_add(size=0.7, location=place)
        cube = bpy.context.view_layer.objects.active
        cube.name = name
        material = bpy.data.materials.new(name)
        if bpy.app.version < (5, 0):
            material.use_nodes = True
        nodes, links = material.node_tree.nodes, material.node_tree.links
        nodes.clear()
        emission = nodes.new("ShaderNodeEmission")
        emission.inputs["Strength"].default_value = 4.0
        emission.inputs["Color"].default_value = (0.9, 0.5, 0.2, 1)
        if is_textured:
            links.new(nodes.new("ShaderNodeTexChecker").outputs["Color"], emission.inputs["Color"])
        output = nodes.new("ShaderNodeOutputMaterial")
        links.new(emission.outputs[0], output.inputs["Surface"])
        cube.data.materials.append(material)


def set_background(world: bpy.types.World, colour: tuple[float, ...], strength: float) -> None:
    """Give a world a background node of this colour."""
    if bpy.app.version < (5, 0):
        world.use_nodes = True
    node = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
    node.inputs["Color"].default_value = (*colour, 1)
    node.inputs["Strength"].default_value = strength
