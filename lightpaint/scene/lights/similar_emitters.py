"""Combines many similar unnamed emitters into one light, unless the user separates them.

A street of three hundred lamps without ids would otherwise be three hundred unknowns with
meaningless names such as `area_217`, and take three hundred planes of the basis.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import count, pairwise

from lightpaint.scene.lights.emitters import Emitter
from lightpaint.scene.properties.emission import Scaling

#: Maximum number of similar emitters that stay separate, since they can be inspected one by one.
MAX_SEPARATE = 24

#: Maximum ratio of two sizes that count as equal: float32 rotations change them slightly.
SIZE_TOLERANCE = 1.001


def alike_groups(
    emitters: Sequence[Emitter], taken: Collection[str]
) -> dict[str, tuple[Emitter, ...]]:
    """Return light name → its emitters, for more than MAX_SEPARATE similar, unnamed emitters.

    Similar emitters have the same plugin and emission, and belong to the same material, file or
    parent, or have the same size if that has no name. taken: names that lights must not have.
    """
    by_kind: dict[object, list[Emitter]] = {}
    for emitter in emitters:
        if not emitter.has_name and _is_lamp(emitter):
            key = (emitter.plugin, emitter.kind, emitter.emission, emitter.belongs_to)
            by_kind.setdefault(key, []).append(emitter)
    groups: dict[str, tuple[Emitter, ...]] = {}
    for similar in by_kind.values():
        for members in _of_one_size(similar) if not similar[0].belongs_to else [similar]:
            if len(members) > MAX_SEPARATE:
                stem = members[0].belongs_to or f"{members[0].plugin}_lights"
                groups[_free_name(stem, {*taken, *groups})] = tuple(members)
    return groups


def remove_separated(
    groups: Mapping[str, Sequence[Emitter]], separated: Collection[str]
) -> dict[str, tuple[Emitter, ...]]:
    """Return the groups without the `separated` emitters; groups with a single emitter are
    dropped.
    """
    left = {
        name: tuple(emitter for emitter in emitters if emitter.name not in separated)
        for name, emitters in groups.items()
    }
    return {name: members for name, members in left.items() if len(members) > 1}


def _is_lamp(emitter: Emitter) -> bool:
    """Return True if colour and size describe the emitter completely."""
    is_colour = emitter.kind is not None and emitter.kind.scaling is Scaling.COLOUR
    return is_colour and not emitter.obstacle and emitter.unit_flux is not None


def _of_one_size(emitters: Sequence[Emitter]) -> Iterator[list[Emitter]]:
    """Yield groups of emitters with equal sizes, up to SIZE_TOLERANCE between neighbours."""
    by_size = sorted(emitters, key=lambda emitter: (emitter.unit_flux or 0.0, emitter.node))
    run = by_size[:1]
    for smaller, larger in pairwise(by_size):
        if (larger.unit_flux or 0.0) > SIZE_TOLERANCE * (smaller.unit_flux or 0.0):
            yield sorted(run, key=lambda emitter: emitter.node)
            run = []
        run.append(larger)
    yield sorted(run, key=lambda emitter: emitter.node)


def _free_name(stem: str, taken: Collection[str]) -> str:
    """Return `stem`, or `stem_2`, `stem_3`, … if it is taken."""
    names = (stem if k == 1 else f"{stem}_{k}" for k in count(1))
    return next(name for name in names if name not in taken)
