"""Bases assembled from earlier planes, by the planes' identities.

A moved light has a plane of another identity. The planes of all other lights still equal a new
render, up to noise. So only missing planes are rendered, together, and lights may have unequal
numbers of samples (`Origin.each_light`).
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
    cached: Basis | None,
    *,
    spp: int | None,
    seed: int,
    before: Basis | None = None,
    use_cache: bool = True,
) -> Basis | None:
    """Return a basis of `scene` from cached planes, whatever scene they were rendered from.

    Lights without a cached plane are black and have no samples. None if no plane is cached.

    cached: the basis of the present scene, returned itself if no other adds to it. spp: samples per
    pixel that suffice; None for as many as possible. before: a basis of the same seed and film, of
    the scene in another state, whose planes are taken as well. use_cache: False to take of no
    other.
    """
    identities = scene.light_identities
    planes: list[KeptPlane | None] = [None] * len(identities)
    if cached is not None:
        planes = [KeptPlane(cached, i) for i in range(len(identities))]
    if before is not None:
        planes = [
            _better_sampled(plane, before, identity)
            for plane, identity in zip(planes, identities, strict=True)
        ]

    def gain(entry: cache.Entry) -> int:
        assert entry.origin is not None
        has = entry.origin.spp if spp is None else min(entry.origin.spp, spp)
        covered = (
            plane
            for name, plane in zip(identities, planes, strict=True)
            if name in entry.identities
        )
        return sum(
            max(0, has - (0 if plane is None else sum(plane.counts[:2]))) for plane in covered
        )

    entries = cache.entries() if use_cache else []
    candidates = [entry for entry in entries if _is_like(entry, scene, seed)]
    while candidates:
        best = max(candidates, key=gain)
        if gain(best) == 0:
            break
        candidates.remove(best)
        if (other := cache.read(best)) is not None:
            planes = [
                _better_sampled(plane, other, identity)
                for plane, identity in zip(planes, identities, strict=True)
            ]
    sources = {id(plane.basis): plane.basis for plane in planes if plane is not None}
    if not sources or [*sources.values()] == [cached]:
        return cached
    return _compose_basis(scene, seed, planes, _emitters_seen_in(scene, [*sources.values()]))


def least_sampled_lights(basis: Basis, spp: int | None) -> tuple[list[str], int | None]:
    """Return which lights are to be rendered next, and how many samples per pixel they come to.

    Those with fewest, up to those that come next, until all have `spp`; None for a time, which is
    for all of them then. No names: all have enough, or as many as each other.
    """
    counts = counts_of(basis)
    totals = [sum(light_counts[:2]) for light_counts in counts]
    fewest = min(totals)
    if len({light_counts[:2] for light_counts in counts}) == 1 or (
        spp is not None and fewest >= spp
    ):
        return [], spp
    halves = counts[totals.index(fewest)][:2]
    names = [
        name
        for name, light_counts in zip(basis.names, counts, strict=True)
        if light_counts[:2] == halves
    ]
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
    merged = _compose_basis(scene, whole.origin.seed, sources, seen)
    return replace(merged, features=part.features, objects=part.objects)


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


def _better_sampled(plane: KeptPlane | None, other: Basis, identity: str) -> KeptPlane | None:
    """Return the plane of that identity in `other`, if it has more samples than `plane`."""
    has = 0 if plane is None else sum(plane.counts[:2])
    for i, light in enumerate(other.lights):
        if light.identity == identity != "":
            candidate = KeptPlane(other, i)
            # The noise of a single half is unknown.
            if min(candidate.counts[:2]) and sum(candidate.counts[:2]) > has:
                return candidate
    return plane


def _compose_basis(
    scene: Scene, seed: int, sources: Sequence[KeptPlane | None], seen: Bools
) -> Basis:
    """Return a basis of `scene` of these planes; None stands for a black one."""
    lights, size = basis_lights(scene), scene.size
    methods = [source.basis.origin.method for source in sources if source is not None]
    is_one_pass = method_of(scene) == ONE_PASS
    counts = _count_fields(
        [(0, 0, 0, 0) if source is None else source.counts for source in sources],
        is_one_pass=is_one_pass,
    )
    origin = origin_of(scene, seed, methods[-1], counts["halves"], counts["passes"])
    in_memory = not is_large(len(lights), size)

    def compose(picks: Sequence[PlaneReference]) -> Planes:
        return compose_planes(picks, size, in_memory=in_memory)

    # Known of all lights or of none.
    parts = [None if source is None else source.indirect for source in sources]
    is_split = all(
        (source is None) == (part is None) for source, part in zip(sources, parts, strict=True)
    )
    return Basis(
        lights,
        compose([None if source is None else source.plane for source in sources]),
        compose([None if source is None else source.noise for source in sources]),
        seen,
        replace(origin, each_light=counts["each_light"], is_composed=True),
        indirect=IndirectLight(*(compose([p and p[k] for p in parts]) for k in range(2)))
        if is_split
        else None,
        source=str(scene.path),
    )


def _count_fields(each_light: Sequence[Counts], *, is_one_pass: bool) -> dict[str, Any]:
    """Return the fields of an Origin that say how many samples there are.

    In one pass numbers follow from the samples alone, and passes are only counted.
    """
    if is_one_pass:
        passes = max(counts[2] for counts in each_light), max(counts[3] for counts in each_light)
        each_light = [(*counts[:2], *(passes if any(counts) else (0, 0))) for counts in each_light]
    least = np.array(each_light).min(axis=0).tolist()
    if len(set(each_light)) == 1:
        return {"halves": tuple(least[:2]), "passes": tuple(least[2:]), "each_light": ()}
    spp, passes_each = min(least[:2]), min(least[2:])
    return {
        "halves": (spp, spp),
        "passes": (passes_each, passes_each),
        "each_light": tuple(each_light),
    }


def _emitters_seen_in(scene: Scene, sources: Sequence[Basis]) -> Bools:
    """Return where an emitter is visible in `scene`, from bases of it with other lights.

    They share the emitting shapes, but maybe not the environment.
    """
    is_surrounded = any(emitter.plugin in ENVIRONMENTS for emitter in scene.emitters)
    alike = [
        source.emitters_seen for source in sources if _is_surrounded(source.lights) == is_surrounded
    ]
    seen: Bools = np.logical_or.reduce(alike) if alike else emitters_seen(scene)
    return seen


def _is_surrounded(lights: Lights) -> bool:
    return any(plugin in ENVIRONMENTS for light in lights for plugin in light.plugin.split(" + "))
