# SPDX-License-Identifier: GPL-3.0-or-later
"""Names of light groups, made of names that objects have.

Blender turns a dot in a light group's name into an underscore, and gives an EXR's channels 63
bytes, of which the view layer, the pass and the channel take their part. Longer names would become
equal, and lights would be mixed up without a word.
"""

#: Bytes of a channel's name in an EXR that Blender writes.
MAX_CHANNEL_BYTES = 63

#: Bytes of a light group's name that are enough for anyone.
MAX_GROUP_BYTES = 40

#: Bytes below which no two names can be told apart.
MIN_GROUP_BYTES = 8


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
