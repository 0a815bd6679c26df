# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders a shot by Cycles into its folder, and leaves the scene's output settings as they were.

A digest says what a render depends on, so that nothing is rendered twice. It reads every property
of every datablock that the scene uses, and the points and faces of meshes. What it cannot see (a
simulation's cache, a picture that is painted and not saved) may change a render without changing
the digest: *Render again* is for that.
"""

import array
import hashlib
import os

import bpy

from ..lamps.lamp_levels import (
    commit_base,
    grouped_places,
    place_names,
    present_levels,
    rendered_levels,
)
from ..lamps.memory import recall, remember

#: Settings while a shot is rendered: groups and whole picture alike, in one file, nothing behind.
SETTINGS = (
    ("render.use_compositing", False),
    ("render.use_sequencer", False),
    ("render.use_single_layer", True),
    ("render.use_multiview", False),
    ("render.use_file_extension", False),
    ("render.use_overwrite", True),
    ("render.image_settings.media_type", "MULTI_LAYER_IMAGE"),
    ("render.image_settings.file_format", "OPEN_EXR_MULTILAYER"),
    ("render.image_settings.color_depth", "16"),
    ("render.image_settings.exr_codec", "ZIP"),
    ("render.image_settings.color_management", "FOLLOW_SCENE"),
    ("cycles.use_denoising", False),
)

#: Key of a scene's memory with the settings to put back.
RENDERING = "rendering"

#: Properties that say how Blender shows something, or what it is called this time.
IGNORED = frozenset(
    [
        "rna_type",
        "bl_rna",
        "name_full",
        "session_uid",
        "tag",
        "users",
        "select",
        "location_absolute",
        "width",
        "height",
        "dimensions",
        "preview",
        "asset_data",
        "library_weak_reference",
        "original",
        "use_fake_user",
        "use_extra_user",
        "active_index",
        "active_material_index",
        "animation_visualization",
        "image_settings",
        "filepath_raw",
        "lightgroups",
        "layer_collection",
        "active_lightgroup",
        "lightgroup",
        "active_lightgroup_index",
        "tool_settings",
        "depsgraph",
        "sequence_editor",
        "bake",
        "ffmpeg",
        "view_center",
        "bindcode",
        "cursor",
        "active_layer_collection",
        "keying_sets",
        "keying_sets_all",
        "display",
        "shading",
        "grease_pencil",
        "engine",
        "filepath",
        "color_tag",
        "lightpaint_settings",
        "parent_type",
        "id_data",
        "node",
        "socket",
        "modifier",
        "motion_path",
        "hide_viewport",
        "view_layers",
        "active",
        "objects_active",
        "selected_objects",
        "location",
        "rotation_euler",
        "scale",
        "frame_start",
        "frame_end",
        "frame_step",
        "fps",
        "users_collection",
        "users_scene",
        "active_input",
        "active_output",
        "cycles_visibility",
        "transform_orientation_slots",
        "mode",
        "use_select",
        "active_view_transform",
        "active_clip",
        "rigidbody_world",
    ]
)

#: Collections that repeat what others have, or that say nothing about a render.
SKIPPED_COLLECTIONS = frozenset(
    [
        "edges",
        "attributes",
        "loop_triangles",
        "loop_triangle_polygons",
        "vertex_colors",
        "color_attributes",
        "edge_creases",
        "vertex_creases",
        "corner_normals",
        "vertex_normals",
        "polygon_normals",
        "sculpt_vertex_colors",
        "skin_vertices",
        "polygon_layers_int",
        "vertex_layers_int",
        "timeline_markers",
        "all_objects",
        "children_recursive",
        "render_slots",
        "packed_files",
        "views",
        "stereo_views",
        "id_properties",
    ]
)

#: Pointers to these lead out of what is rendered.
OUTSIDE = ("Screen", "WindowManager", "Workspace", "WorkSpace", "Text", "Brush", "Library")


def shot_digest(scene, view_layer, groups):
    """Return a digest of a scene, and of which lights are in which group."""
    members = [(name, sorted(place_names({name: places}))) for name, places in groups.items()]
    text = f"{scene_digest(scene, view_layer)} {sorted(members)!r}"
    return hashlib.sha256(text.encode("utf-8", "replace")).hexdigest()


def current_digest(scene, view_layer):
    """Return the digest of a scene as it would be rendered but for what lightpaint has set."""
    groups = grouped_places(scene, view_layer)
    undo = rendered_levels(groups)
    try:
        if undo:
            view_layer.update()
        return shot_digest(scene, view_layer, groups)
    finally:
        for place, values in undo:
            place.assign(values)


class ShotRender:
    """A render of a shot. `is_done` once Blender has ended it, `is_cancelled` if somebody has."""

    def __init__(self, scene, view_layer, folder):
        groups = grouped_places(scene, view_layer)
        # What is rendered are the present levels, a preview as well; these become the base.
        self.folder, self.digest = folder, shot_digest(scene, view_layer, groups)
        self.scene_name, self.layer_name = scene.name, view_layer.name
        self.groups, self._levels = list(groups), present_levels(groups)
        self.is_done = self.is_cancelled = False

    def start(self, scene, *, waits):
        """Start to render, or render before this returns. Raises OSError, RuntimeError."""
        self.folder.check_writable()
        self.folder.part.unlink(missing_ok=True)
        set_output(scene, str(self.folder.part))
        try:
            if waits:
                bpy.ops.render.render(write_still=True, scene=scene.name)
                self.is_done = True
            else:
                bpy.ops.render.render("INVOKE_DEFAULT", write_still=True, scene=scene.name)
        except BaseException:
            put_back_output(scene)
            raise

    def finish(self):
        """Put the output settings back, and keep the render. Return a sentence if that failed."""
        scene = bpy.data.scenes.get(self.scene_name)
        if scene is not None:
            put_back_output(scene)
        if self.is_cancelled or scene is None:
            self.folder.part.unlink(missing_ok=True)
            return "the render was stopped: the shot is as it was"
        try:
            self.folder.finish_render(self.digest, self.groups)
        except OSError as error:
            return f"the render was not written into {self.folder.path}: {error.strerror}"
        commit_base(grouped_places(scene, scene.view_layers[self.layer_name]), self._levels)
        return ""


def set_output(scene, path):
    """Set what a shot's render needs, and remember what was set."""
    memory, before = recall(scene), []
    for name, value in [*SETTINGS, ("render.filepath", path)]:
        holder, attribute = _resolve(scene, name)
        if holder is not None and hasattr(holder, attribute):
            before.append((name, getattr(holder, attribute)))
            setattr(holder, attribute, value)
    # Settings that others depend on come first both ways.
    remember(scene, {**memory, RENDERING: before})


def put_back_output(scene):
    """Restore the output settings that a shot's render has changed, if one has."""
    memory = recall(scene)
    before = memory.pop(RENDERING, None)
    if before is None:
        return
    for name, value in before:
        holder, attribute = _resolve(scene, name)
        try:
            setattr(holder, attribute, value)
        except (TypeError, AttributeError):
            continue  # a format that this file's other settings rule out
    remember(scene, memory)


def _resolve(scene, name):
    *holders, attribute = name.split(".")
    holder = scene
    for part in holders:
        holder = getattr(holder, part, None)
    return holder, attribute


def scene_digest(scene, view_layer):
    """Return a digest of a scene as a view layer of it is rendered now."""
    digest = hashlib.sha256(f"{bpy.app.version_string} {view_layer.name}".encode())
    reader = _SceneReader(digest)
    reader.read(view_layer)
    reader.waiting.append(scene)
    while reader.waiting:
        owner = reader.waiting.pop()
        reader.read(owner)
        if isinstance(owner, bpy.types.Object):
            digest.update(repr([list(row) for row in owner.matrix_world]).encode())
        if isinstance(owner, bpy.types.Image):
            digest.update(_file_state(owner.filepath, owner.library).encode("utf-8", "replace"))
    return digest.hexdigest()


class _SceneReader:
    """Adds pieces of data to a digest, each once, and collects datablocks that they point to."""

    def __init__(self, digest):
        self.waiting, self._digest, self._seen = [], digest, set()

    def read(self, struct):
        """Add all properties of a piece of data."""
        key = (type(struct).__name__, struct.as_pointer())
        if key in self._seen:
            return
        self._seen.add(key)
        self._add(type(struct).__name__, getattr(struct, "name", ""))
        if isinstance(struct, bpy.types.Mesh):
            self._read_mesh(struct)
        for prop in struct.bl_rna.properties:
            name = prop.identifier
            is_plain = prop.type not in ("POINTER", "COLLECTION")
            if name.startswith("uv_layer") and name != "uv_layers":
                continue  # the active one and the like
            is_shown = name.startswith("show_") and name != "show_render"
            if name in IGNORED or is_shown or (is_plain and prop.is_readonly):
                continue
            try:
                value = getattr(struct, name)
            except (AttributeError, RuntimeError, TypeError, ValueError):
                continue
            self._read_value(struct, name, prop, value)

    def _read_value(self, struct, name, prop, value):
        if prop.type == "POINTER":
            self._follow(name, value)
        elif prop.type == "COLLECTION":
            if name == "links" and isinstance(struct, bpy.types.NodeTree):
                self._add(name, sorted(map(_ends, value)))
            elif name not in SKIPPED_COLLECTIONS and not _is_read_at_once(struct, name):
                self._add(name, len(value))
                for item in value:
                    self._follow(name, item)
        elif getattr(prop, "is_array", False):
            self._add(name, _plain(value))
        else:
            self._add(name, sorted(value) if isinstance(value, set) else value)

    def _follow(self, name, value):
        """Add what a property points to: datablocks by name and later, parts at once."""
        if value is None or type(value).__name__ in OUTSIDE:
            return
        if isinstance(value, bpy.types.ID) and not getattr(value, "is_embedded_data", False):
            self._add(name, value.name_full)
            self.waiting.append(value)
        else:
            self.read(value)

    def _read_mesh(self, mesh):
        for name, (attribute, count, kind) in MESH_ARRAYS.items():
            self._add_numbers(getattr(mesh, name), attribute, count, kind)
        for layer in mesh.uv_layers:
            self._add_numbers(layer.data, "uv", 2, "f")

    def _add_numbers(self, collection, attribute, count, kind):
        numbers = array.array(kind, [0]) * (len(collection) * count)
        collection.foreach_get(attribute, numbers)
        self._digest.update(numbers.tobytes())

    def _add(self, name, value):
        self._digest.update(f"{name}={value!r};".encode("utf-8", "replace"))


#: Collections of a mesh that are read at once: an attribute, how many numbers it has, their type.
MESH_ARRAYS = {
    "vertices": ("co", 3, "f"),
    "polygons": ("material_index", 1, "i"),
    "loops": ("vertex_index", 1, "i"),
}


def _is_read_at_once(struct, name):
    return isinstance(struct, bpy.types.Mesh) and (name in MESH_ARRAYS or name == "uv_layers")


def _ends(link):
    """Return what a link connects; the order of links depends on when they were made."""
    sockets = (link.from_node, link.from_socket), (link.to_node, link.to_socket)
    return [(node.name, socket.identifier) for node, socket in sockets]


def _plain(value):
    """Return an array of any dimension as lists."""
    return [_plain(x) for x in value] if hasattr(value, "__len__") else value


def _file_state(path, library):
    """Return size and time of a picture's file."""
    try:
        state = os.stat(bpy.path.abspath(path, library=library))
    except (OSError, ValueError):
        return path
    return f"{path} {state.st_size} {state.st_mtime_ns}"
