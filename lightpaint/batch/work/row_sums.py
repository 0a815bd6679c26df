"""Rows of a basis, of which a worker keeps nothing but sums."""

from typing import Any

from lightpaint.basis.basis import Basis
from lightpaint.basis.planes import as_planes
from lightpaint.basis.render.render import IN_PARTS, basis_lights, origin_of
from lightpaint.basis.render.sums import mean_and_half_difference
from lightpaint.batch.work.work_items import SumsOfRows
from lightpaint.batch.work.worker_cache import WorkerCache
from lightpaint.lighting.fit import Fit
from lightpaint.lighting.problem_sums import Sums, sums_of


def sums_of_rows(item: SumsOfRows, cache: WorkerCache) -> list[Sums]:
    """Return the sums with each painting, of the very images that a whole basis has in
    these rows.
    """
    renderer, scene = cache.renderer(item), cache.film(item.film)
    halves: list[Any] = [None, None]
    spp, seen = [0, 0], None
    for part in item.parts:
        planes, its = renderer.render(part)
        before = halves[part.half]
        halves[part.half] = planes if before is None else before + planes
        seen = its if seen is None else seen + its
        spp[part.half] += part.spp
    assert seen is not None
    images, differences = mean_and_half_difference(halves, spp)
    rows = slice(item.parts[0].top, item.parts[0].bottom)
    origin = origin_of(scene, item.seed, IN_PARTS, (spp[0], spp[1]), (1, 1))
    basis = Basis(basis_lights(scene), as_planes(images), as_planes(differences), seen > 0, origin)
    return [
        sums_of(basis, cache.target(wanted, scene.size), rows, Fit(emitters=wanted.emitters))
        for wanted in item.paintings
    ]
