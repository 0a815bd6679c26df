# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders a shot by Cycles into its folder, and leaves the scene's output settings as they were."""

import hashlib

import bpy

from ..lamps.lamp_levels import (
    commit_base,
    grouped_places,
    place_names,
    present_levels,
    rendered_levels,
)
from ..lamps.memory import recall, remember
from .scene_digest import scene_digest

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
    ("cycles.use_denoising", False),
)

#: Key of a scene's memory with the settings to put back.
RENDERING = "rendering"


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
    """Put back the settings of before a shot's render, if one has set them."""
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
