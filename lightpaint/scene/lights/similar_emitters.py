"""Many emitters that are alike, and that nobody has named, are one light unless they are parted.

A street of three hundred lamps without ids is three hundred unknowns that nobody can tell apart by
`area_217`, and that take three hundred planes of the basis.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import count, pairwise

from lightpaint.scene.emission import Scaling
from lightpaint.scene.lights.emitters import Emitter

#: So many that are alike stay apart: they can be looked at one by one.
FEW = 24

#: Ratio of two sizes up to which they are the same: what float32 makes of a shape that was turned.
SAME = 1.001


def alike_groups(
    emitters: Sequence[Emitter], taken: Collection[str]
) -> dict[str, tuple[Emitter, ...]]:
    """Name of a light → its emitters, of more than FEW that are alike and have no name.

    Alike are those of one plugin and one emission that hang on the same material, file or parent
    or, where that has no name, are of the same size. taken: names that no light may have.
    """
    by_kind: dict[object, list[Emitter]] = {}
    for emitter in emitters:
        if not emitter.has_name and _is_lamp(emitter):
            key = (emitter.plugin, emitter.kind, emitter.emission, emitter.hangs_on)
            by_kind.setdefault(key, []).append(emitter)
    groups: dict[str, tuple[Emitter, ...]] = {}
    for its in by_kind.values():
        for members in _of_one_size(its) if not its[0].hangs_on else [its]:
            if len(members) > FEW:
                stem = members[0].hangs_on or f"{members[0].plugin}_lights"
                groups[_free(stem, {*taken, *groups})] = tuple(members)
    return groups


def without(
    groups: Mapping[str, Sequence[Emitter]], parted: Collection[str]
) -> dict[str, tuple[Emitter, ...]]:
    """The groups without the emitters of these names, and without those that are small then."""
    left = {name: tuple(m for m in its if m.name not in parted) for name, its in groups.items()}
    return {name: members for name, members in left.items() if len(members) > 1}


def _is_lamp(emitter: Emitter) -> bool:
    """Whether all there is to it is a colour and a size, so that others can be the same."""
    is_colour = emitter.kind is not None and emitter.kind.scaling is Scaling.COLOUR
    return is_colour and not emitter.obstacle and emitter.unit_flux is not None


def _of_one_size(emitters: Sequence[Emitter]) -> Iterator[list[Emitter]]:
    """Runs of emitters whose sizes follow each other without a gap."""
    by_size = sorted(emitters, key=lambda emitter: (emitter.unit_flux or 0.0, emitter.node))
    run = by_size[:1]
    for smaller, larger in pairwise(by_size):
        if (larger.unit_flux or 0.0) > SAME * (smaller.unit_flux or 0.0):
            yield sorted(run, key=lambda emitter: emitter.node)
            run = []
        run.append(larger)
    yield sorted(run, key=lambda emitter: emitter.node)


def _free(stem: str, taken: Collection[str]) -> str:
    """`stem`, or `stem_2`, `stem_3`, … where it is taken."""
    names = (stem if k == 1 else f"{stem}_{k}" for k in count(1))
    return next(name for name in names if name not in taken)
