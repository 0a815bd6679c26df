# SPDX-License-Identifier: GPL-3.0-or-later
"""Light groups: one for each lamp, mesh with emission, and the world; and their names.

Blender turns a dot in a light group's name into an underscore, and gives an EXR's channels 63
bytes, of which the view layer, the pass and the channel take their part. Longer names would become
equal, and lights would be mixed up without a word.
"""

from dataclasses import dataclass, field

from .lit_items import emitters
from .memory import recall, remember

#: Kinds of grouping: each lamp, alike lamps, or a collection as one group.
LAMPS, ALIKE, COLLECTIONS = "LAMPS", "ALIKE", "COLLECTIONS"

#: Bytes of a channel's name in an EXR that Blender writes.
MAX_CHANNEL_BYTES = 63

#: Bytes of a light group's name that are enough for anyone.
MAX_GROUP_BYTES = 40

#: Bytes below which names cannot be distinguished.
MIN_GROUP_BYTES = 8


@dataclass
class Grouping:
    """The light groups of a view layer.

    by: its kind. members: emitters by name of group. left: sentences on what is in none.
    """

    by: str = LAMPS
    members: dict = field(default_factory=dict)
    left: list = field(default_factory=list)


def plan_groups(scene, view_layer, by=LAMPS):
    """Return the groups that a scene's lights should be in; nothing is changed.

    Lights that share their data (a lamp's, or an emissive material) change together, so they are
    in one group. A group keeps the name that it was given first, until they are grouped otherwise.
    """
    found = emitters(scene, view_layer)
    grouping = Grouping(by, left=[f"{x.name}: {x.reason}" for x in found if x.reason])
    limit = group_bytes(view_layer.name)
    if not limit:
        raise ValueError(
            f"the view layer's name has {len(view_layer.name.encode())} bytes, which leaves none "
            "for light groups in an EXR: shorten it to 40"
        )
    parts = _parts([x for x in found if not x.reason], by)
    kept_names = [_kept_name(part, view_layer, by) for part in parts]
    for part, kept in zip(parts, kept_names, strict=True):
        name = kept if kept and kept not in grouping.members else ""
        if not name:
            taken = [*grouping.members, *(other for other in kept_names if other)]
            name = group_name(_part_name(part, by), taken, limit)
        grouping.members[name] = part
    return grouping


def _parts(found, by):
    """Return emitters that share data, a collection or a name, each set of them as one list."""
    parts = []
    for emitter in found:
        keys = set(emitter.shared)
        collections = getattr(emitter.item, "users_collection", ())
        if by == COLLECTIONS and collections:
            keys.add(("Collection", collections[0].name))
        elif by == ALIKE:
            keys.add(("Name", type(emitter.item).__name__, stem(emitter.name)))
        joined = [part for part in parts if part[0] & keys]
        for part in joined:
            parts.remove(part)
        members = [x for part in joined for x in part[1]] + [emitter]
        parts.append((keys.union(*(part[0] for part in joined)), members))
    return [members for _, members in parts]


def _part_name(part, by):
    """Return the name of the thing that a group stands for."""
    first = part[0]
    collections = getattr(first.item, "users_collection", ())
    if by == COLLECTIONS and collections and collections[0].name != "Scene Collection":
        return collections[0].name
    return stem(first.name) if len(part) > 1 else first.name


def _kept_name(part, view_layer, by):
    """Return the group that these emitters had, grouped like this; "" if they had none."""
    memories = [(x.item, recall(x.item)) for x in part]
    names = {item.lightgroup for item, memory in memories if memory.get("by") == by}
    [name] = names if len(names) == 1 else [""]
    return name if name in view_layer.lightgroups else ""


def assign_groups(grouping):
    """Put emitters into their groups, and remember which they were in."""
    for name, members in grouping.members.items():
        for emitter in members:
            item, memory = emitter.item, recall(emitter.item)
            memory.setdefault("group", item.lightgroup)
            remember(item, {**memory, "by": grouping.by})
            if item.lightgroup != name:
                item.lightgroup = name


def clear_others(grouping, view_layer, scene):
    """Take everything else out of these groups: what cannot be changed shall be in none."""
    inside = {id(x.item) for members in grouping.members.values() for x in members}
    named = {x.item.name for members in grouping.members.values() for x in members}
    others = [*view_layer.objects, *[scene.world] * (scene.world is not None)]
    for item in others:
        is_inside = id(item) in inside or item.name in named
        if item.library is None and not is_inside and item.lightgroup in grouping.members:
            memory = recall(item)
            memory.setdefault("group", item.lightgroup)
            remember(item, memory)
            item.lightgroup = ""


def group_bytes(view_layer):
    """Return the bytes that names of groups may have in a view layer; 0 if too few are left."""
    left = MAX_CHANNEL_BYTES - len(f"{view_layer}.Combined_.R".encode("utf-8", "replace"))
    return min(left, MAX_GROUP_BYTES) if left >= MIN_GROUP_BYTES else 0


def group_name(name, taken, limit=MAX_GROUP_BYTES):
    """Return a name for a light group that no other has.

    taken: names of the other groups. What is not a letter of a name in every file and program
    becomes an underscore: dots, quotes, line breaks and the like.
    """
    plain = "".join(c if c.isalnum() or c in " -+()" else "_" for c in name).strip()
    plain = _cut(plain, limit).strip() or "light"
    taken_folded = {other.casefold() for other in taken}
    candidate, number = plain, 1
    while candidate.casefold() in taken_folded:
        number += 1
        end = f"_{number}"
        candidate = _cut(plain, limit - len(end)).rstrip() + end
    return candidate


def stem(name):
    """Return the name that alike objects share: without Blender's number."""
    start, dot, number = name.rpartition(".")
    return start if dot and number.isdigit() and start else name


def _cut(text, limit):
    """Return the beginning of a text that has at most `limit` bytes."""
    return text.encode("utf-8", "replace")[:limit].decode("utf-8", "ignore")
