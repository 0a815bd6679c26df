# SPDX-License-Identifier: GPL-3.0-or-later
"""Multipliers of light groups, set in lamps: a preview until they are applied; and their drives.

The owner of each level remembers four: `original`, before lightpaint changed anything; `base`, as
rendered; `kept`, to which a discarded preview returns; and `last`, which the add-on has set last.
Somebody who changes a lamp by hand makes a new `kept`.

Drives of the emitters that mix a light, 0 to 1, are for scripts, drivers and exporters. Each lamp,
material or world of a light group whose lamp has emitters in the lights file carries them as a
custom property, {"red": 0.4, "white": 1.0}, beside the levels that they give.
"""

from .lamp_units import are_equal, in_space
from .lit_items import (
    KEYED,
    LampEmission,
    NodeEmission,
    PlainColour,
    action_curves,
    emitters,
    remove_curves,
)
from .memory import recall, remember

#: Key of a scene's memory: whether the lamps show a preview.
PREVIEWS = "is_preview"

#: Name of the custom property.
DRIVES_KEY = "lightpaint_drives"

#: Key of an owner's memory with the drives that a discarded preview returns to.
KEPT = "drives"


def grouped_places(scene, view_layer):
    """Return the places of each light group's levels, each place once."""
    groups = {}
    for emitter in emitters(scene, view_layer):
        memory = recall(emitter.item)
        if not emitter.reason and "group" in memory and emitter.item.lightgroup:
            known = groups.setdefault(emitter.item.lightgroup, {})
            for place in emitter.places:
                known.setdefault((place.owner.name_full, place.slot), place)
    return {name: list(places.values()) for name, places in groups.items()}


def present_levels(groups):
    """Return the levels of all places, by owner and slot."""
    return {(place.owner.name_full, place.slot): place.values() for place in _each(groups)}


def place_names(groups):
    """Return where the places of each group are by names, which outlive undo and deletion."""
    return [
        (name, owner_kind(place.owner), place.owner.name, place.slot)
        for name, places in groups.items()
        for place in places
    ]


def named_places(data, names):
    """Find the lamps, materials and worlds of each group in a file; None if one is missing.

    names: of each, its group, the list of `data` that has it, its name and its slot.
    """
    groups = {}
    for group, kind, owner_name, slot in names:
        owner = getattr(data, kind).get(owner_name)
        place = _place(owner, slot) if owner is not None and owner.library is None else None
        if place is None:
            return None
        groups.setdefault(group, []).append(place)
    return groups


def owner_kind(owner):
    """Return the name of the list in which a lamp, a material or a world is."""
    identifier = owner.bl_rna.identifier
    return {"Material": "materials", "World": "worlds"}.get(identifier, "lights")


def commit_base(groups, levels):
    """Take levels, as `present_levels` returned them, as those that are rendered."""
    for place in _each(groups):
        values = levels.get((place.owner.name_full, place.slot))
        if values is None:  # it has come since
            continue
        slot = _slot(place)
        slot.setdefault("original", values)
        slot.setdefault("kept", values)
        if not are_equal(values, slot.get("last", values)):  # changed by hand
            slot["kept"] = values
        _store(place, {**slot, "base": values, "last": place.values()})


def adopt_levels(groups):
    """Take the present levels of places that know of no render as those that were rendered."""
    unknown = {
        name: [place for place in places if "base" not in _slot(place)]
        for name, places in groups.items()
    }
    commit_base(unknown, present_levels(unknown))


def show_factors(groups, factors, space=None):
    """Set levels to multiples of what was rendered. Return the number of places that changed.

    factors: multipliers of red, green and blue by name of group; groups without one stay. space:
    the working space of the file, see lamp_units.py.
    """
    changed = 0
    for name, places in groups.items():
        if name not in factors:
            continue
        for place in places:
            slot = _slot(place)
            if "base" not in slot:
                continue
            values = place.values()
            if not are_equal(values, slot["last"]):  # changed by hand since
                slot["kept"] = values
            wanted = place.scaled(slot["base"], in_space(factors[name], space))
            if not are_equal(values, wanted):
                place.assign(wanted)
                changed += 1
            _store(place, {**slot, "last": place.values()})
    return changed


def keep_levels(groups):
    """Make the levels that are shown be the ones that a discarded preview returns to."""
    for place in _each(groups):
        if slot := _slot(place):
            values = place.values()
            _store(place, {**slot, "kept": values, "last": values})


def discard_levels(groups):
    """Put back the levels of before the preview, but for lamps changed by hand since."""
    for place in _each(groups):
        slot = _slot(place)
        if slot and are_equal(place.values(), slot["last"]):
            place.assign(slot["kept"])
            _store(place, {**slot, "last": place.values()})


def rendered_levels(groups):
    """Set the levels that were rendered where nobody changed them since; return what undoes that.

    So that what was rendered can be compared with what would be rendered.
    """
    undo = []
    for place in _each(groups):
        slot = _slot(place)
        values = place.values()
        if slot and are_equal(values, slot["last"]) and not are_equal(values, slot["base"]):
            place.assign(slot["base"])
            undo.append((place, values))
    return undo


def key_levels(groups, frame):
    """Insert a keyframe for each level at a frame; remember which curves are lightpaint's."""
    for place in _each(groups):
        place.make_keyable()
        owner, paths = place.animated_target()
        memory = recall(place.owner)
        before = {curve.data_path for curve in action_curves(owner)}
        had_animation = getattr(owner, "animation_data", None) is not None
        for path in paths:
            owner.keyframe_insert(path, frame=frame)
        new = [path for path in paths if path not in before]
        memory[KEYED] = sorted({*memory.get(KEYED, ()), *new})
        memory.setdefault("had_animation", had_animation)
        remember(place.owner, memory)


def remove_keys(owner, memory):
    """Delete the keyframes that lightpaint has inserted into a lamp, a material or a world."""
    if not memory.get(KEYED):
        return
    for animated in (owner, owner.node_tree):
        if animated is None:
            continue
        remove_curves(animated, memory[KEYED])
        if not memory.get("had_animation", True) and not action_curves(animated):
            action = animated.animation_data.action if animated.animation_data else None
            animated.animation_data_clear()
            if action is not None and action.users == 0:
                _delete_action(action)


def put_back_levels(owner, memory):
    """Set all levels of an owner to those before lightpaint changed anything."""
    for name, slot in memory.get("slots", {}).items():
        if (place := _place(owner, name)) is not None:
            place.assign(slot["original"])


def _place(owner, slot):
    """Return the place of a level by its name; None if it is no longer there."""
    if slot == LampEmission.slot:
        return LampEmission(owner)
    if slot == PlainColour.slot:
        return PlainColour(owner)
    node = owner.node_tree.nodes.get(slot) if owner.node_tree else None
    return NodeEmission(owner, node) if node else None


def _delete_action(action):
    import bpy

    bpy.data.actions.remove(action)


def _each(groups):
    return [place for places in groups.values() for place in places]


def _slot(place):
    return recall(place.owner).get("slots", {}).get(place.slot, {})


def _store(place, slot):
    memory = recall(place.owner)
    memory.setdefault("slots", {})[place.slot] = slot
    remember(place.owner, memory)


def show_drives(groups, drives):
    """Write drives by name of group and emitter; groups without any lose what they had."""
    for name, places in groups.items():
        for place in places:
            _set(place.owner, drives.get(name, {}))


def keep_drives(groups):
    """Make the drives that are shown be the ones that a discarded preview returns to."""
    for place in _each(groups):
        memory = recall(place.owner)
        if (shown := _shown(place.owner)) or KEPT in memory:
            remember(place.owner, {**memory, KEPT: shown})


def discard_drives(groups):
    """Put back the drives of before the preview."""
    for place in _each(groups):
        _set(place.owner, recall(place.owner).get(KEPT, {}))


def forget_drives(owner):
    """Remove the drives of a piece of data."""
    _set(owner, {})


def _shown(owner):
    found = owner.get(DRIVES_KEY)
    # Blender returns a group of properties.
    plain = found.to_dict() if hasattr(found, "to_dict") else found
    return dict(plain) if plain else {}


def _set(owner, drives):
    if _shown(owner) == drives:
        return
    if drives:
        owner[DRIVES_KEY] = dict(drives)
    elif DRIVES_KEY in owner:
        del owner[DRIVES_KEY]
