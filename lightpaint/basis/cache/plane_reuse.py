"""Bases composed of planes that were rendered before, found by their identities.

A light that moved has a plane with a new identity; the planes of all other lights still equal a new
render of them, up to noise. So only the missing planes are rendered, all together, and lights may
have unequal numbers of samples, which `Origin.each_light` records.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from lightpaint.arrays import Bools
from lightpaint.basis.cache import basis_cache
from lightpaint.basis.derived_planes import PlaneReference, compose_planes
from lightpaint.basis.file.basis_file import is_large
from lightpaint.basis.light_basis import Basis
from lightpaint.basis.lights import Lights
from lightpaint.basis.planes import IndirectLight, Planes
from lightpaint.basis.render.render_budget import half_of
from lightpaint.basis.render.rendered_basis import ONE_PASS, basis_lights, method_of, origin_of
from lightpaint.basis.render.separate_renders import emitters_seen
from lightpaint.scene import ENVIRONMENTS, Scene
from lightpaint.version import __version__

#: Number of samples of halves A and B, and number of passes of both.
Counts = tuple[int, int, int, int]


@dataclass(frozen=True)
class KeptPlane:
    """A plane of a basis. index: its number there."""

    basis: Basis
    index: int

    @property
    def plane(self) -> PlaneReference:
        """Its image."""
        return self.basis.planes, self.index

    @property
    def noise(self) -> PlaneReference:
        """Half the difference of the two halves of its samples."""
        return self.basis.noise, self.index

    @property
    def indirect(self) -> tuple[PlaneReference, PlaneReference] | None:
        """Image and half difference of its indirect part; None if that part is unknown."""
        parts = self.basis.indirect
        if parts is None:
            return None
        return (parts.planes, self.index), (parts.noise, self.index)

    @property
    def counts(self) -> Counts:
        """Number of its samples."""
        return counts_of(self.basis)[self.index]


def counts_of(basis: Basis) -> Sequence[Counts]:
    """Return the number of samples and passes for each light."""
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
    """Return a basis of `scene` composed of all matching planes in the cache, whichever scene they
    were rendered for.

    Lights without a cached plane are black and have no samples. Returns None if no plane is found.

    cached: the basis of the scene in its current state, returned itself if no other basis adds to
    it. spp: samples per pixel beyond which a plane is good enough; None to take as many as
    possible. before: a basis of the scene in another state, with the same seed and film, whose
    planes are used as well. use_cache: False to use no other planes.
    """
    best = BestPlanes(scene.light_identities, cached)
    if before is not None:
        best.take_from(before)
    entries = basis_cache.entries() if use_cache else []
    candidates = [entry for entry in entries if _is_like(entry, scene, seed)]
    while candidates:
        entry = max(candidates, key=lambda entry: best.gain(entry, spp))
        if best.gain(entry, spp) == 0:
            break
        candidates.remove(entry)
        if (other := basis_cache.read(entry)) is not None:
            best.take_from(other)
    sources = best.bases
    if not sources or sources == [cached]:
        return cached
    return _compose_basis(scene, seed, best.planes, _emitters_seen_in(scene, sources))


class BestPlanes:
    """The plane with the most samples that was found for each light; None where there is none.

    identities: hashes of the planes' contents, in the order of the lights. cached: a basis of all
    of them.
    """

    def __init__(self, identities: Sequence[str], cached: Basis | None) -> None:
        self._identities = identities
        self.planes: list[KeptPlane | None] = [
            None if cached is None else KeptPlane(cached, i) for i in range(len(identities))
        ]

    def take_from(self, other: Basis) -> None:
        """Replace planes by the planes of `other` that have more samples."""
        self.planes = [
            _better_sampled(plane, other, identity)
            for plane, identity in zip(self.planes, self._identities, strict=True)
        ]

    def gain(self, entry: basis_cache.Entry, spp: int | None) -> int:
        """Return the number of samples per pixel that the planes of `entry` would add.

        spp: the number beyond which a plane is good enough.
        """
        assert entry.origin is not None
        cached_spp = entry.origin.spp if spp is None else min(entry.origin.spp, spp)
        covered = (
            plane
            for identity, plane in zip(self._identities, self.planes, strict=True)
            if identity in entry.identities
        )
        return sum(
            max(0, cached_spp - (0 if plane is None else sum(plane.counts[:2])))
            for plane in covered
        )

    @property
    def bases(self) -> list[Basis]:
        """The bases that hold them, each once."""
        return [*{id(x.basis): x.basis for x in self.planes if x is not None}.values()]


def least_sampled_lights(basis: Basis, spp: int | None) -> tuple[list[str], int | None]:
    """Return the names of the lights to render next, and their goal in samples per pixel.

    These are the lights with the fewest samples; the goal is the next larger number, or `spp`. No
    names are returned if all lights have `spp` or equal numbers. spp: None for a time budget, which
    then goes to all lights.
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


def mean_variance(basis: Basis, spp: int) -> float | None:
    """Return the mean relative variance after `spp` samples of the lights that have so many or
    more; None if none of these lights the picture.
    """
    totals = np.array([sum(light_counts[:2]) for light_counts in counts_of(basis)])
    variances = basis.relative_variances
    is_usable = (totals >= spp) & np.isfinite(variances)
    if not is_usable.any():
        return None
    return float(np.mean(variances[is_usable] * totals[is_usable])) / spp


def as_sampled(basis: Basis, spp: int | None, variance: float | None) -> Basis:
    """Return a one-pass basis that is as clean as others of `spp` samples as one of so many.

    What follows then weighs its samples by their variance: those that are added, the choice of the
    better plane, and the count that people read. variance: from `mean_variance`.
    """
    if spp is None or variance is None or basis.origin.spp >= spp:
        return basis
    if (basis.relative_variances > variance).any():
        return basis
    half = half_of(spp)
    return replace(
        basis, origin=replace(basis.origin, halves=(half, half), is_composed=True), sums=None
    )


def restrict(basis: Basis, scene: Scene) -> Basis | None:
    """Return the part of `basis` for the lights of `scene`, which is its scene restricted by
    `only`.

    These lights must have equal numbers of samples. Returns None if they have none.
    """
    sources = [KeptPlane(basis, basis.names.index(light.name)) for light in scene.lights]
    if not sum(sources[0].counts[:2]):
        return None
    return _compose_basis(scene, basis.origin.seed, sources, basis.emitters_seen)


def merge(scene: Scene, whole: Basis, part: Basis) -> Basis:
    """Return `whole`, a basis of `scene`, with the planes of `part` for some of its lights."""
    names = part.names
    sources = [
        KeptPlane(part, names.index(name)) if name in names else KeptPlane(whole, i)
        for i, name in enumerate(whole.names)
    ]
    seen = whole.emitters_seen | part.emitters_seen
    merged_basis = _compose_basis(scene, whole.origin.seed, sources, seen)
    return replace(merged_basis, features=part.features, objects=part.objects)


def _is_like(entry: basis_cache.Entry, scene: Scene, seed: int) -> bool:
    """Return whether a cached basis may have planes of `scene`, judging by its origin."""
    origin = entry.origin
    return (
        origin is not None
        and entry.image_size == scene.size
        and (origin.sensor, origin.seed) == (scene.sensor_names[scene.sensor], seed)
        and origin.lightpaint == __version__
        and origin.method == method_of(scene)
    )


def _better_sampled(plane: KeptPlane | None, other: Basis, identity: str) -> KeptPlane | None:
    """Return the plane with that identity in `other` if it has more samples, else `plane`."""
    cached_spp = 0 if plane is None else sum(plane.counts[:2])
    for i, light in enumerate(other.lights):
        if light.identity == identity != "":
            candidate = KeptPlane(other, i)
            # With only one half, the noise is unknown.
            if min(candidate.counts[:2]) and sum(candidate.counts[:2]) > cached_spp:
                return candidate
    return plane


def _compose_basis(
    scene: Scene, seed: int, sources: Sequence[KeptPlane | None], seen: Bools
) -> Basis:
    """Return a basis of `scene` composed of these planes; None stands for a black plane."""
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

    # Indirect light is known for all lights or for none.
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
    """Return the fields of an Origin that record the number of samples.

    In one pass, random numbers follow from the samples alone, so passes are merely counted.
    """
    if is_one_pass:
        passes = max(counts[2] for counts in each_light), max(counts[3] for counts in each_light)
        each_light = [(*counts[:2], *(passes if any(counts) else (0, 0))) for counts in each_light]
    least_counts = np.array(each_light).min(axis=0).tolist()
    if len(set(each_light)) == 1:
        return {
            "halves": tuple(least_counts[:2]),
            "passes": tuple(least_counts[2:]),
            "each_light": (),
        }
    spp, passes_each = min(least_counts[:2]), min(least_counts[2:])
    return {
        "halves": (spp, spp),
        "passes": (passes_each, passes_each),
        "each_light": tuple(each_light),
    }


def _emitters_seen_in(scene: Scene, sources: Sequence[Basis]) -> Bools:
    """Return the pixels in which an emitter is seen in `scene`, from bases with other lights.

    All of them have the same emitting shapes, but an environment may be missing in some.
    """
    is_surrounded = any(emitter.plugin in ENVIRONMENTS for emitter in scene.emitters)
    matching_masks = [
        source.emitters_seen for source in sources if _is_surrounded(source.lights) == is_surrounded
    ]
    seen: Bools = np.logical_or.reduce(matching_masks) if matching_masks else emitters_seen(scene)
    return seen


def _is_surrounded(lights: Lights) -> bool:
    return any(plugin in ENVIRONMENTS for light in lights for plugin in light.plugin.split(" + "))
