"""The parts of a painting that delivery is measured for: wishes, layers and groups, with names."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.images import Objects
from lightpaint.lighting.analysis.appearance.error_place import object_with_most
from lightpaint.target import Wish

#: A group of layers, a layer, or a part of a layer or of a painting without layers.
WishKind = Literal["wish", "layer", "group"]

#: Share of the picture from which an area lies in no ninth of it.
LARGE = 0.5

#: Share of an area that an object takes which tells it from other areas nearby.
FAIR_SHARE = 0.25

#: Names of the thirds of a picture, from the top and from the left.
ROWS, COLUMNS = ("top", "middle", "bottom"), ("left", "middle", "right")


@dataclass(frozen=True, eq=False)
class WishPart:
    """A wish, a layer or a group. area: (h, w) from 0 to 1; the other fields as in `Delivery`."""

    name: str
    area: Floats
    layers: tuple[int, ...]
    group: str
    kind: WishKind


def wish_parts(wishes: Sequence[Wish], objects: Objects | None) -> list[WishPart]:
    """Return the wishes, each layer of several after its wishes, and each group after its layers.

    objects: those of the picture, by which parts of a layer are named.
    """
    parts: list[WishPart] = []
    names = _names(wishes, objects)
    for k, (wish, name) in enumerate(zip(wishes, names, strict=True)):
        later, layer = wishes[k + 1 :], wish.layer
        siblings = [x for x in wishes if layer is not None and x.layer == layer]
        layers = () if layer is None else (layer,)
        kind: WishKind = "layer" if len(siblings) == 1 else "wish"
        parts.append(WishPart(name, wish.area, layers, wish.group, kind))
        if len(siblings) > 1 and all(x.layer != layer for x in later):
            parts.append(WishPart(wish.name, _joint_area(siblings), layers, wish.group, "layer"))
        if wish.group and all(x.group != wish.group for x in later):
            members = [x for x in wishes if x.group == wish.group]
            ids = tuple(dict.fromkeys(x.layer for x in members if x.layer is not None))
            parts.append(WishPart(wish.group, _joint_area(members), ids, wish.group, "group"))
    return parts


def _joint_area(wishes: Sequence[Wish]) -> Floats:
    return np.asarray(np.minimum(np.sum([wish.area for wish in wishes], axis=0), 1))


def _names(wishes: Sequence[Wish], objects: Objects | None) -> list[str]:
    """Return names that differ: `Strokes, vase` for a part of a layer; only the place, with a
    capital, for a part of a painting without layers. Parts in one ninth of the picture are told
    apart by what is in them, `Right (vase)`, or by numbers.
    """
    counts = Counter((wish.layer, wish.name) for wish in wishes)
    is_part = [counts[wish.layer, wish.name] > 1 for wish in wishes]
    names = [
        _part_name(wish, objects) if part else wish.name
        for wish, part in zip(wishes, is_part, strict=True)
    ]
    alike = Counter(names)
    if objects is not None:
        names = [
            _with_object(name, wish.area, objects) if part and alike[name] > 1 else name
            for name, wish, part in zip(names, wishes, is_part, strict=True)
        ]
    seen: Counter[str] = Counter()
    for k, name in enumerate(names):
        seen[name] += 1
        if is_part[k] and seen[name] > 1:
            names[k] = f"{name} ({seen[name]})"
    return names


def _part_name(wish: Wish, objects: Objects | None) -> str:
    place = _place_name(wish.area, objects)
    return f"{place[:1].upper()}{place[1:]}" if wish.layer is None else f"{wish.name}, {place}"


def _with_object(name: str, area: Floats, objects: Objects) -> str:
    """Return a name with the object that takes most of the area, if one takes a fair part of it."""
    index = objects.index.ravel().astype(np.intp)
    weights = area.ravel().astype(np.float64)
    found = object_with_most(objects, index, weights, least=FAIR_SHARE).replace("_", " ").strip()
    return f"{name} ({found})" if found and found.lower() != name.lower() else name


def _place_name(area: Floats, objects: Objects | None) -> str:
    """Return where an area, (h, w), lies: `vase` for an object, `top left` for a ninth."""
    if area.mean() > LARGE:
        return "most of the picture"
    if objects is not None:
        index = objects.index.ravel().astype(np.intp)
        if name := object_with_most(objects, index, area.ravel().astype(np.float64)):
            return name.replace("_", " ").strip()
    total = max(float(area.sum()), 1e-12)
    centers = [
        float(area.sum(axis=1 - axis) @ np.arange(length)) / total / length
        for axis, length in enumerate(area.shape)
    ]
    row, column = (min(int(3 * center), 2) for center in centers)
    if row == 1:
        return COLUMNS[column]
    return ROWS[row] if column == 1 else f"{ROWS[row]} {COLUMNS[column]}"
