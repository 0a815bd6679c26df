# SPDX-License-Identifier: GPL-3.0-or-later
"""Cycles, light groups and passes of a view layer: switched on, remembered, and put back."""

from operator import attrgetter

import bpy

from ..lamps.grouping import assign_groups, clear_others, plan_groups
from ..lamps.lamp_levels import forget_drives, put_back_levels, remove_keys
from ..lamps.memory import forget, owners_with_memory, recall, remember

#: Passes that denoise the painter's pictures, and the mattes that it selects objects by.
PASSES = ("cycles.denoising_store_passes", "use_pass_cryptomatte_object")


def prepare(scene, view_layer, by):
    """Give each light its group. Return the grouping, with what could not be grouped.

    Raises ValueError if no name of a group fits.
    """
    grouping = plan_groups(scene, view_layer, by)
    memory = recall(scene)
    memory.setdefault("engine", scene.render.engine)
    layers = memory.setdefault("layers", {})
    layers.setdefault(view_layer.name, _layer_state(view_layer))
    remember(scene, memory)
    if scene.render.engine != "CYCLES":
        scene.render.engine = "CYCLES"
    for path in PASSES:
        set_property(view_layer, path, True)
    view_layer.use_pass_combined = True
    _set_groups(scene, view_layer, list(grouping.members))
    clear_others(grouping, view_layer, scene)
    assign_groups(grouping)
    return grouping


def revert(scene):
    """Put back everything that lightpaint has changed in this file. Return names of what is left.

    Lamps and nodes that somebody has deleted since cannot be put back, and need not be.
    """
    problems = []
    for owner in owners_with_memory(bpy.data):
        memory = recall(owner)
        try:
            remove_keys(owner, memory)
            put_back_levels(owner, memory)
            if "group" in memory:
                owner.lightgroup = memory["group"]
            if "engine" in memory:
                _put_back_scene(owner, memory)
        except (AttributeError, RuntimeError, TypeError, KeyError) as error:
            problems.append(f"{owner.name}: {error}")
        forget_drives(owner)
        forget(owner)
    return problems


def _put_back_scene(scene, memory):
    for name, state in memory.get("layers", {}).items():
        view_layer = scene.view_layers.get(name)
        if view_layer is None:
            continue
        _set_groups(scene, view_layer, state["groups"])
        for path, value in state["passes"].items():
            set_property(view_layer, path, value)
    if scene.render.engine == "CYCLES":
        scene.render.engine = memory["engine"]


def set_property(owner, path, value):
    """Set a property of a piece of data, or of one within it: `cycles.use_denoising`."""
    *holders, name = path.split(".")
    setattr(attrgetter(".".join(holders))(owner) if holders else owner, name, value)


def _layer_state(view_layer):
    """Return what a view layer has before it is prepared."""
    values = {"use_pass_combined": view_layer.use_pass_combined}
    values |= {path: attrgetter(path)(view_layer) for path in PASSES}
    return {"groups": [group.name for group in view_layer.lightgroups], "passes": values}


def _set_groups(scene, view_layer, names):
    """Make a view layer have these light groups and no others."""
    present = [group.name for group in view_layer.lightgroups]
    if present == names:
        return
    for name in present:
        if name not in names:
            _remove_group(scene, view_layer, name)
    for name in names:
        if name not in view_layer.lightgroups:
            view_layer.lightgroups.add(name=name)


def _remove_group(scene, view_layer, name):
    """Remove a light group; Blender 3.4 can only remove the active one, by an operator."""
    groups = view_layer.lightgroups
    if hasattr(groups, "remove"):
        groups.remove(groups[name])
        return
    view_layer.active_lightgroup_index = groups.find(name)
    with bpy.context.temp_override(scene=scene, view_layer=view_layer):
        bpy.ops.scene.view_layer_remove_lightgroup()
