# SPDX-License-Identifier: GPL-3.0-or-later
"""Drives of the emitters that mix a light, 0 to 1, for scripts, drivers and exporters.

Each lamp, material or world of a light group whose lamp has emitters in the lights file carries
them as a custom property, {"red": 0.4, "white": 1.0}, beside the levels that they give.
"""

from .memory import recall, remember

#: Name of the custom property.
DRIVES_KEY = "lightpaint_drives"

#: Key of an owner's memory with the drives that a discarded preview returns to.
KEPT = "drives"


def show_drives(groups, drives):
    """Write drives by name of group and emitter; groups without any lose what they had."""
    for name, places in groups.items():
        for place in places:
            _set(place.owner, drives.get(name, {}))


def keep_drives(groups):
    """Make the drives that are shown be the ones that a discarded preview returns to."""
    for places in groups.values():
        for place in places:
            memory = recall(place.owner)
            if (shown := _shown(place.owner)) or KEPT in memory:
                remember(place.owner, {**memory, KEPT: shown})


def discard_drives(groups):
    """Put back the drives of before the preview."""
    for places in groups.values():
        for place in places:
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
