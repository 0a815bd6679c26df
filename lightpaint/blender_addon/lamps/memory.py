# SPDX-License-Identifier: GPL-3.0-or-later
"""Memory of what Blender's data was before lightpaint changed it, kept in the .blend itself.

Every scene, object, lamp, material and world that the add-on changes carries one custom property
with JSON, so what it was survives saving, undo and renaming. Reverting removes the properties.
"""

import json

#: Name of the custom property.
MEMORY_KEY = "lightpaint_memory"

#: Blender's lists of data that may carry one.
OWNERS = ("scenes", "objects", "lights", "materials", "worlds")


def recall(owner):
    """Return what a piece of data remembers; an empty dictionary if nothing."""
    text = owner.get(MEMORY_KEY)
    try:
        memory = json.loads(text) if isinstance(text, str) else {}
    except (ValueError, RecursionError):  # somebody has edited it
        return {}
    return memory if isinstance(memory, dict) else {}


def remember(owner, memory):
    """Make a piece of data remember something instead of what it did."""
    text = json.dumps(memory, separators=(",", ":"))
    if owner.get(MEMORY_KEY) != text:
        owner[MEMORY_KEY] = text


def forget(owner):
    """Make a piece of data remember nothing."""
    if MEMORY_KEY in owner:
        del owner[MEMORY_KEY]


def owners_with_memory(data):
    """Return all data of a file, or of one like it, that remembers something."""
    return [
        owner
        for kind in OWNERS
        for owner in getattr(data, kind)
        if owner.library is None and MEMORY_KEY in owner
    ]
