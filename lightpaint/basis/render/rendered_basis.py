"""A rendered basis: its origin, which is its method and number of samples; and its images, from the
sums of a one-pass render, which has two halves of samples.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lightpaint.arrays import Bools, Floats
from lightpaint.basis.light_basis import Basis, Origin
from lightpaint.basis.lights import BasisLight, Lights
from lightpaint.basis.planes import IndirectLight, Planes, as_planes
from lightpaint.basis.render.integrators import why_not_one_pass
from lightpaint.basis.render.render_budget import half_of
from lightpaint.basis.render.separate_renders import LightSums, plan_of_light
from lightpaint.display_text import some_names
from lightpaint.errors import SceneError
from lightpaint.scene import Scene
from lightpaint.sentences import Hint

ONE_PASS = "one pass, several questions"

SEPARATE = "separate renders"

#: Values of `passes` for a one-pass basis, whose samples do not depend on passes: whether it has
#: all requested samples or was interrupted.
FINISHED, UNFINISHED = (1, 1), (0, 0)


def is_of(scene: Scene, basis: Basis, seed: int) -> bool:
    """Return True if `basis` was made from `scene` in its current state, with its sensor, film and
    `seed`.
    """
    start_origin = basis.origin
    current = replace(
        origin_of(scene, seed, start_origin.method, start_origin.halves, start_origin.passes),
        each_light=start_origin.each_light,
        is_composed=start_origin.is_composed,
        extra_spp=start_origin.extra_spp,
    )
    return start_origin == current and basis.size == scene.size


def is_on_the_way(scene: Scene, basis: Basis, spp: int | None) -> bool:
    """Return True if a new render to `spp` samples would pass through exactly the samples of
    `basis`.

    If it has fewer samples, its exact sums are needed, since planes are rounded. Separate renders
    must end at the boundary of a pass. spp: None for the scene's own number.
    """
    origin = basis.origin
    if origin.is_composed or origin.extra_spp or origin.method != method_of(scene):
        return False
    goal = samples_for(scene, spp)
    if origin.spp < goal and basis.sums is None:
        return False
    if origin.method == ONE_PASS:
        return origin.spp <= goal
    plan = plan_of_light(scene, scene.spp if spp is None else spp)
    sizes = [[size for half, size in plan if half == h] for h in range(2)]
    return all(
        count <= len(half_sizes) and sum(half_sizes[:count]) == done
        for a, b, first, second in origin.each_light or ((*origin.halves, *origin.passes),)
        for half_sizes, done, count in zip(sizes, (a, b), (first, second), strict=True)
    )


def samples_for(scene: Scene, spp: int | None) -> int:
    """Return the samples per pixel of a basis for which `spp` were requested.

    The number is rounded up to make the halves equal. Separate renders of pixels that are blocks of
    film pixels round it up further, to one sample in each of these.
    """
    spp = scene.spp if spp is None else spp
    if method_of(scene) == ONE_PASS:
        return 2 * half_of(spp)
    return sum(size for _, size in plan_of_light(scene, spp))


def method_of(scene: Scene) -> str:
    """Return the method for rendering a basis of `scene`: `ONE_PASS` or `SEPARATE`.

    Raises SceneError for images in texels that one pass cannot render: Mitsuba does not sample a
    map in which only texels at a pole are lit. The same for points, which Mitsuba does not measure.
    """
    reason = why_not_one_pass(scene)
    if reason is not None and scene.points is not None:
        raise SceneError(
            f"{reason}, and light at points is only measured where one pass renders all lights: "
            "use ",
            Hint("integrator", "path"),
            " and a variant like llvm_ad_rgb",
        )
    if reason is not None and scene.split:
        raise SceneError(
            f"{reason}, so that each light is rendered by itself, and {some_names(scene.split)} "
            "cannot be split into texels: leave split out, or use ",
            Hint("integrator", "path"),
            " and a variant like llvm_ad_rgb",
        )
    return ONE_PASS if reason is None else SEPARATE


def origin_of(
    scene: Scene, seed: int, method: str, halves: tuple[int, int], passes: tuple[int, int]
) -> Origin:
    """Return the origin of a basis of `scene`."""
    return Origin(
        scene=scene.path.name,
        scene_identity=scene.identity,
        sensor=scene.sensor_names[scene.sensor],
        seed=seed,
        method=method,
        halves=halves,
        passes=passes,
        integrator="" if scene.integrator_choice is None else str(scene.integrator_choice),
        observer=scene.observer.name if scene.is_spectral else "",
    )


def basis_lights(scene: Scene) -> Lights:
    """Return the lights of `scene` as basis lights, with the requests of its lights file."""
    lights = tuple(
        BasisLight(
            x.name,
            x.plugin,
            x.parameter,
            x.unit,
            x.emission,
            x.form,
            x.is_scalar,
            x.is_fixed,
            x.member_names,
            x.unit_flux,
            identity,
            min(x.emission) < 0,
            x.lamp,
        )
        for x, identity in zip(scene.lights, scene.light_identities, strict=True)
    )
    return Lights(lights, scene.requests)


#: Samples per pixel of halves A and B: numbers, or (h, w, 1) float32 if pixels differ.
HalfCounts = Sequence[int] | Sequence[Floats]


def basis_of_sums(
    scene: Scene,
    seed: int,
    halves: Sequence[Floats],
    seen: Bools,
    half_spp: int,
    guide_table: Floats | None,
    *,
    start: Basis | None,
    is_finished: bool = True,
) -> Basis:
    """Return the one-pass basis of the rendered samples and the samples of `start`.

    halves: undivided sums of the two halves of the samples, (n or 2n, h, w, 3), as returned by
    `LightPlanes.sums`; overwritten. seen: (h, w). half_spp: total samples per pixel of each half.
    start: samples that are not in these sums. is_finished: whether all requested samples were
    taken; if not, the basis gets a copy of its sums.
    """
    n, spp = len(scene.lights), half_counts(half_spp, start)
    keeps_sums = not is_finished and start is None
    kept_sums = (halves[0].copy(), halves[1].copy()) if keeps_sums else None
    totals, indirect = [half[:n] for half in halves], [half[n:] for half in halves]
    for total, part in zip(totals, indirect, strict=True):
        total[: len(part)] += part
    is_split = len(indirect[0]) == n and (start is None or start.indirect is not None)
    if start is not None:
        start_counts = half_counts(start.origin.halves[0], start)
        add_halves(totals, start.planes, start.noise, start_counts)
        seen = seen | start.emitters_seen
        if is_split and start.indirect is not None:
            add_halves(indirect, start.indirect.planes, start.indirect.noise, start_counts)
    pairs = [mean_and_half_difference(totals, spp)]
    if is_split:
        pairs.append(mean_and_half_difference(indirect, spp))
    return basis_of_planes(
        [(as_planes(mean), as_planes(half)) for mean, half in pairs],
        scene,
        seed,
        seen,
        half_spp,
        guide_table,
        start=start,
        is_finished=is_finished,
        sums=kept_sums,
    )


def basis_of_planes(
    pairs: Sequence[tuple[Planes, Planes]],
    scene: Scene,
    seed: int,
    seen: Bools,
    half_spp: int,
    guide_table: Floats | None,
    *,
    start: Basis | None = None,
    is_finished: bool,
    sums: tuple[Floats, Floats] | None,
) -> Basis:
    """Return the one-pass basis of pairs of images and half differences: for all light and, if it
    is split, for indirect light. See `basis_of_sums` for the other arguments.
    """
    (images, noise), *indirect = pairs
    origin = origin_of(
        scene, seed, ONE_PASS, (half_spp, half_spp), FINISHED if is_finished else UNFINISHED
    )
    return Basis(
        basis_lights(scene),
        images,
        noise,
        seen,
        origin if start is None else replace(origin, extra_spp=start.origin.extra_spp),
        guide_table,
        indirect=IndirectLight(*indirect[0]) if indirect else None,
        extra=None if start is None else start.extra,
        source=str(scene.path),
        sums=sums,
    )


def basis_of_passes(
    scene: Scene, seed: int, sums: LightSums, seen: Bools, *, is_finished: bool = True
) -> Basis:
    """Return the basis of separate renders. is_finished: whether it goes without its sums."""
    images, half_differences = sums.mean_and_half_difference()
    nothing = origin_of(scene, seed, SEPARATE, (0, 0), (0, 0))
    return Basis(
        basis_lights(scene),
        as_planes(images),
        as_planes(half_differences),
        seen,
        replace(nothing, **sums.counts()),
        source=str(scene.path),
        sums=None if is_finished else (sums.planes[0].copy(), sums.planes[1].copy()),
    )


def half_counts(spp: int, basis: Basis | None) -> HalfCounts:
    """Return the samples of both halves: `spp` each, plus the extra samples of a basis."""
    if basis is None or basis.extra is None:
        return spp, spp
    counts = (spp + basis.extra[..., None]).astype(np.float32)
    return counts, counts


def add_halves(halves: Sequence[Floats], planes: Planes, noise: Planes, spp: HalfCounts) -> None:
    """Add to `halves` the undivided sums from which `planes` and `noise` were computed, up to
    round-off.

    halves: (n, h, w, 3) each. noise: half the differences of the halves. spp: samples per pixel of
    each half.
    """
    a, b = spp
    # The mean is (a A + b B) / (a + b), the half difference (A − B) / 2.
    to_a, to_b = (np.asarray(2 * x / (a + b), np.float32) for x in (b, a))
    for k, (image, half_difference) in enumerate(zip(planes, noise, strict=True)):
        halves[0][k] += a * (image + half_difference * to_a)
        halves[1][k] += b * (image - half_difference * to_b)


def mean_and_half_difference(halves: Sequence[Floats], spp: HalfCounts) -> tuple[Floats, Floats]:
    """Return mean and half difference of undivided sums, computed in place.

    halves: two undivided sums, (n, h, w, 3). spp: samples per pixel of each. Numbers that are not
    finite become 0: a single one among hundreds of millions would make the basis useless.
    """
    (a, b), (mean, half_difference) = spp, halves
    # In place and one light at a time, since these are the largest arrays of all.
    for plane_a, plane_b in zip(mean, half_difference, strict=True):
        plane_a /= a
        plane_b /= -b
        plane_b += plane_a
        plane_b /= 2
        # A equals the overall mean plus B's share of the samples times the difference A − B.
        plane_a -= plane_b * np.asarray(2 * b / (a + b), np.float32)
        if not (np.isfinite(plane_a).all() and np.isfinite(plane_b).all()):
            broken = ~(np.isfinite(plane_a) & np.isfinite(plane_b))
            plane_a[broken] = plane_b[broken] = 0
    return mean, half_difference
