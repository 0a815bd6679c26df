"""Bases put together of planes that were rendered before, by the identities of these.

A light that moved has a plane of another identity; the planes of all others are still what a render
of them would come to, but for noise. So only planes that are lacking are rendered, together, and
lights may have unequal numbers of samples, which `Origin.each_light` says.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from lightpaint.arrays import Bools
from lightpaint.basis.basis import Basis, IndirectLight
from lightpaint.basis.cache import cache
from lightpaint.basis.derived_planes import PlaneReference, compose_planes
from lightpaint.basis.file.basis_file import is_large
from lightpaint.basis.lights import Lights
from lightpaint.basis.planes import Planes
from lightpaint.basis.render.render_origin import ONE_PASS, basis_lights, method_of, origin_of
from lightpaint.basis.render.separate_renders import emitters_seen
from lightpaint.scene.properties.emission import ENVIRONMENTS
from lightpaint.scene.scene import Scene
from lightpaint.version import __version__

#: Samples of half A and B, and passes of both.
Counts = tuple[int, int, int, int]


@dataclass(frozen=True)
class KeptPlane:
    """A plane of a basis by its number."""

    basis: Basis
    index: int

    @property
    def plane(self) -> PlaneReference:
        """Its image."""
        return self.basis.planes, self.index

    @property
    def noise(self) -> PlaneReference:
        """Half the difference of its halves."""
        return self.basis.noise, self.index

    @property
    def indirect(self) -> tuple[PlaneReference, PlaneReference] | None:
        """Image and half difference of its indirect part; None where that is not known."""
        parts = self.basis.indirect
        if parts is None:
            return None
        return (parts.planes, self.index), (parts.noise, self.index)

    @property
    def counts(self) -> Counts:
        """Number of its samples."""
        return counts_of(self.basis)[self.index]


def counts_of(basis: Basis) -> Sequence[Counts]:
    """Return the samples and passes of each light."""
    origin = basis.origin
    return origin.each_light or [(*origin.halves, *origin.passes)] * len(basis.lights)


def gather_planes(
    scene: Scene,
    kept: Basis | None,
    *,
    spp: int | None,
    seed: int,
    before: Basis | None = None,
    use_cache: bool = True,
) -> Basis | None:
    """Return a basis of `scene` of the planes that the cache has of it, whatever scene they are of.

    Lights of which it has none are black, without a sample. None where it has none at all.

    kept: the basis of the scene as it is, which is returned itself where no other adds to it. spp:
    samples per pixel beyond which more are no reason to look for others; None for as many as there
    are. before: a basis of the same seed and film, of the scene in another state, whose planes are
    taken as well. use_cache: False to take of no other.
    """
    wanted = scene.light_identities
    found: list[KeptPlane | None] = [None] * len(wanted)
    if kept is not None:
        found = [KeptPlane(kept, i) for i in range(len(wanted))]
    if before is not None:
        found = [
            _better_sampled(its, before, identity)
            for its, identity in zip(found, wanted, strict=True)
        ]

    def gain(entry: cache.Entry) -> int:
        assert entry.origin is not None
        has = entry.origin.spp if spp is None else min(entry.origin.spp, spp)
        covered = (its for name, its in zip(wanted, found, strict=True) if name in entry.identities)
        return sum(max(0, has - (0 if its is None else sum(its.counts[:2]))) for its in covered)

    entries = cache.entries() if use_cache else []
    candidates = [entry for entry in entries if _is_like(entry, scene, seed)]
    while candidates:
        best = max(candidates, key=gain)
        if gain(best) == 0:
            break
        candidates.remove(best)
        if (other := cache.read(best)) is not None:
            found = [
                _better_sampled(its, other, identity)
                for its, identity in zip(found, wanted, strict=True)
            ]
    sources = {id(its.basis): its.basis for its in found if its is not None}
    if not sources or [*sources.values()] == [kept]:
        return kept
    return _compose_basis(scene, seed, found, _emitters_seen_in(scene, [*sources.values()]))


def least_sampled_lights(basis: Basis, spp: int | None) -> tuple[list[str], int | None]:
    """Return which lights are to be rendered next, and how many samples per pixel they come to.

    Those with fewest, up to those that come next, until all have `spp`; None for a time, which is
    for all of them then. No names: all have enough, or as many as each other.
    """
    counts = counts_of(basis)
    totals = [sum(its[:2]) for its in counts]
    fewest = min(totals)
    if len({its[:2] for its in counts}) == 1 or (spp is not None and fewest >= spp):
        return [], spp
    halves = counts[totals.index(fewest)][:2]
    names = [name for name, its in zip(basis.names, counts, strict=True) if its[:2] == halves]
    goals = [total for total in totals if total > fewest]
    return names, min(goals if spp is None else [spp, *goals], default=None)


def restrict(basis: Basis, scene: Scene) -> Basis | None:
    """Return what `basis` has of the lights of `scene`, which is its own with some `only`.

    None where it has no samples of them. They have equal numbers.
    """
    sources = [KeptPlane(basis, basis.names.index(light.name)) for light in scene.lights]
    if not sum(sources[0].counts[:2]):
        return None
    return _compose_basis(scene, basis.origin.seed, sources, basis.emitters_seen)


def merge(scene: Scene, whole: Basis, part: Basis) -> Basis:
    """Return `whole`, a basis of `scene`, with the planes of `part`, of some of its lights."""
    names = part.names
    sources = [
        KeptPlane(part, names.index(name)) if name in names else KeptPlane(whole, i)
        for i, name in enumerate(whole.names)
    ]
    seen = whole.emitters_seen | part.emitters_seen
    made = _compose_basis(scene, whole.origin.seed, sources, seen)
    return replace(made, features=part.features, objects=part.objects)


def _is_like(entry: cache.Entry, scene: Scene, seed: int) -> bool:
    """Return whether planes of a basis in the cache may be those of `scene`, by its origin."""
    origin = entry.origin
    return (
        origin is not None
        and entry.image_size == scene.size
        and (origin.sensor, origin.seed) == (scene.sensor_names[scene.sensor], seed)
        and origin.lightpaint == __version__
        and origin.method == method_of(scene)
    )


def _better_sampled(its: KeptPlane | None, other: Basis, identity: str) -> KeptPlane | None:
    """Return the plane of that identity in `other`, if it has more samples than `its`."""
    has = 0 if its is None else sum(its.counts[:2])
    for i, light in enumerate(other.lights):
        if light.identity == identity != "":
            found = KeptPlane(other, i)
            # Of one half alone the noise is unknown.
            if min(found.counts[:2]) and sum(found.counts[:2]) > has:
                return found
    return its


def _compose_basis(
    scene: Scene, seed: int, sources: Sequence[KeptPlane | None], seen: Bools
) -> Basis:
    """Return a basis of `scene` of these planes; None stands for a black one."""
    lights, size = basis_lights(scene), scene.size
    methods = [its.basis.origin.method for its in sources if its is not None]
    is_one_pass = method_of(scene) == ONE_PASS
    counts = _count_fields(
        [(0, 0, 0, 0) if its is None else its.counts for its in sources], is_one_pass=is_one_pass
    )
    origin = origin_of(scene, seed, methods[-1], counts["halves"], counts["passes"])
    in_memory = not is_large(len(lights), size)

    def compose(picks: Sequence[PlaneReference]) -> Planes:
        return compose_planes(picks, size, in_memory=in_memory)

    # Known of all lights or of none.
    parts = [None if its is None else its.indirect for its in sources]
    is_split = all(
        (its is None) == (part is None) for its, part in zip(sources, parts, strict=True)
    )
    return Basis(
        lights,
        compose([None if its is None else its.plane for its in sources]),
        compose([None if its is None else its.noise for its in sources]),
        seen,
        replace(origin, each_light=counts["each_light"], is_composed=True),
        indirect=IndirectLight(*(compose([p and p[k] for p in parts]) for k in range(2)))
        if is_split
        else None,
        source=str(scene.path),
    )


def _count_fields(each: Sequence[Counts], *, is_one_pass: bool) -> dict[str, Any]:
    """Return the fields of an Origin that say how many samples there are.

    In one pass numbers follow from the samples alone, and passes are only counted.
    """
    if is_one_pass:
        passes = max(its[2] for its in each), max(its[3] for its in each)
        each = [(*its[:2], *(passes if any(its) else (0, 0))) for its in each]
    least = np.array(each).min(axis=0).tolist()
    if len(set(each)) == 1:
        return {"halves": tuple(least[:2]), "passes": tuple(least[2:]), "each_light": ()}
    spp, passes_each = min(least[:2]), min(least[2:])
    return {
        "halves": (spp, spp),
        "passes": (passes_each, passes_each),
        "each_light": tuple(each),
    }


def _emitters_seen_in(scene: Scene, sources: Sequence[Basis]) -> Bools:
    """Return where an emitter is seen in `scene`, of bases of it with other lights.

    Shapes that shine are the same in all of them, and what surrounds them may not be.
    """
    is_surrounded = any(emitter.plugin in ENVIRONMENTS for emitter in scene.emitters)
    alike = [its.emitters_seen for its in sources if _is_surrounded(its.lights) == is_surrounded]
    seen: Bools = np.logical_or.reduce(alike) if alike else emitters_seen(scene)
    return seen


def _is_surrounded(lights: Lights) -> bool:
    return any(plugin in ENVIRONMENTS for its in lights for plugin in its.plugin.split(" + "))
