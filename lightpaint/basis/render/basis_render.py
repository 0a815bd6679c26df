"""Rendering the basis: all lights in one pass where that is possible, else one by one."""

import gc
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from lightpaint.arrays import Bools, Floats
from lightpaint.basis.basis import Basis, IndirectLight, Origin
from lightpaint.basis.lights import BasisLight, Lights
from lightpaint.basis.planes import Planes, as_planes
from lightpaint.basis.render.banded_film import BAND_BYTES, BandedFilm, WholeFilm, is_banded
from lightpaint.basis.render.guide_training import train
from lightpaint.basis.render.half_sums import HalfCounts, add_halves, mean_and_half_difference
from lightpaint.basis.render.integrators import has_indirect_planes, plane_count, why_not_one_pass
from lightpaint.basis.render.render_budget import Budget, Keeper, half_of, steps
from lightpaint.basis.render.separate_renders import (
    LightSums,
    emitters_seen,
    plan_of_light,
    render_separately,
)
from lightpaint.errors import BasisError, SceneError
from lightpaint.keywords import keywords
from lightpaint.progress import Interrupted, Progress, silent
from lightpaint.scene.runtime.mitsuba_errors import render_errors
from lightpaint.scene.runtime.render_lock import MITSUBA, tracing
from lightpaint.scene.scene import Scene
from lightpaint.scene.scene_render import SAMPLES_PER_PASS, view_seed
from lightpaint.scene.surfaces import render_first_hits

ONE_PASS = "one pass, several questions"
SEPARATE = "separate renders"

#: Passes of a one-pass basis, whose samples do not depend on them: whether it has all that were
#: asked for, or an interrupt ended it.
FINISHED, UNFINISHED = (1, 1), (0, 0)


@keywords()
def render_basis(
    scene: Scene,
    *,
    spp: int | None = None,
    time_s: float | None = None,
    until_spp: int | None = None,
    seed: int = 0,
    start: Basis | None = None,
    keep: Callable[[Basis], bool] | None = None,
    is_final: bool = True,
    progress: Progress = silent,
) -> Basis:
    """Render the image of each light of `scene` alone, at unit emission.

    Args:
        scene: As `load_scene` returns it.
        spp: Samples per pixel (the scene's own number by default).
        time_s: Instead, seconds to render for, besides what `start` took; whole steps.
        until_spp: With a time and in one pass, samples per pixel at which it ends though there is
            time left.
        seed: Any number >= 0; other seeds give independent bases.
        start: An earlier basis of the same scene, sensor and seed: its samples count, and only what
            is missing to `spp` is rendered, or as many more as `time_s` allows. With its `sums` the
            result has the bits of one render, else it differs by round-off.
        keep: Called with what there is, now and then and when Ctrl-C ends the work early, its
            `sums` included; returns whether it could be kept.
        is_final: False for a basis that more samples are to be added to: it has its `sums`.
        progress: Hears how far the work has come.

    Raises:
        SceneError: For more lights and pixels than fit.
        Interrupted: For Ctrl-C.

    Examples:
        >>> lp.render_basis(lp.load_scene("room.xml"), spp=4)
        Basis(2 lights, 16x16, 4 spp, of room.xml: panel, bulb)
    """
    height, width = scene.size
    if spp is not None and time_s is not None:
        raise SceneError("give a number of samples or a time to render for, not both")
    budget = Budget(scene.spp if spp is None else spp, time_s, until_spp)
    if len(scene.lights) * height * width * 3 >= 2**32:
        raise SceneError(
            f"{len(scene.lights)} lights at {width}x{height} are more than one basis can hold: "
            "use resolution=... or fewer lights"
        )
    check_memory(scene, in_bands=renders_in_bands(scene, start))
    if start is not None and not is_of(scene, start, seed):
        raise BasisError("the basis to go on from was made of another scene, sensor, film or seed")
    if start is not None and budget.met_by(start.origin.spp):
        return with_first_hits(start.with_requests(scene.requests), scene, seed)
    method = method_of(scene)
    if start is not None and start.origin.method != method:
        # Nothing to go on from, but nothing to be replaced by less either.
        start, keep = None, None
    if start is not None and method == ONE_PASS and start.origin.each_light:
        raise BasisError(
            "the lights of the basis to go on from have unequal numbers of samples, and one pass "
            "adds as many to each: render the others first, with scene.only([...])"
        )
    render_all = _render_together if method == ONE_PASS else _render_one_by_one
    with render_errors(scene.path):
        made = render_all(scene, budget, seed, start, Keeper(keep), progress, is_final=is_final)
    if start is not None:
        made = replace(made, features=start.features, objects=start.objects)
    return with_first_hits(made, scene, seed)


def render_planes_only(scene: Scene, *, spp: int, seed: int) -> Basis:
    """Render a basis without features and objects, for work that never looks at them."""
    check_memory(scene)
    render_all = _render_together if method_of(scene) == ONE_PASS else _render_one_by_one
    with render_errors(scene.path):
        return render_all(scene, Budget(spp, None), seed, None, Keeper(None), silent)


def with_first_hits(basis: Basis, scene: Scene, seed: int) -> Basis:
    """Return `basis` with its features: one from an earlier version may lack them."""
    if basis.features is not None and basis.objects is not None:
        return basis
    features, objects = render_first_hits(scene, seed=seed)
    return replace(basis, features=features, objects=objects)


def renders_in_bands(scene: Scene, start: Basis | None = None) -> bool:
    """Return whether `render_basis` keeps the sums of a film in a file, of which memory has a band.

    start: what it goes on from. Without its exact sums that takes whole planes.
    """
    can_be_read = start is None or start.sums is not None
    return can_be_read and method_of(scene) == ONE_PASS and is_banded(scene)


def memory_needed(scene: Scene, *, in_bands: bool = False) -> int:
    """Return the peak memory of rendering a basis, in bytes, for any number of samples.

    in_bands: as `renders_in_bands` says.
    """
    height, width = scene.size
    images = len(scene.lights) * height * width * 3 * 4
    if in_bands:
        # Half floats of images and half differences, and of indirect light; the rest is of a band.
        return images * plane_count(scene) // len(scene.lights) + 6 * BAND_BYTES
    # Sums of two halves, the images and half differences made of them, and a copy of both
    # where they are written to a file; passes are small beside that.
    sets = 12 if has_indirect_planes(scene) else 6
    return sets * images + 512 * SAMPLES_PER_PASS


def check_memory(scene: Scene, *, in_bands: bool = False) -> None:
    """Raise SceneError if a basis of `scene` would not fit, instead of being killed for it."""
    needed, free = memory_needed(scene, in_bands=in_bands), _free_memory()
    if free is not None and needed > free:
        height, width = scene.size
        raise SceneError(
            f"{len(scene.lights)} lights at {width}x{height} need {needed / 1e9:.1f} GB, and "
            f"{free / 1e9:.1f} GB are free: use resolution=... or fewer lights"
        )


def _free_memory() -> int | None:
    """Return the bytes available without swapping, if the system tells (Linux)."""
    try:
        with open("/proc/meminfo", encoding="ascii") as lines:
            found = [line.split()[1] for line in lines if line.startswith("MemAvailable:")]
    except OSError:
        return None
    return int(found[0]) * 1024 if found else None


def is_of(scene: Scene, basis: Basis, seed: int) -> bool:
    """Return True if `basis` was made of `scene` as it is, with its sensor, film and `seed`."""
    of = basis.origin
    mine = replace(
        origin_of(scene, seed, of.method, of.halves, of.passes),
        each_light=of.each_light,
        is_composed=of.is_composed,
        extra_spp=of.extra_spp,
    )
    return of == mine and basis.size == scene.size


def is_on_the_way(scene: Scene, basis: Basis, spp: int | None) -> bool:
    """Return True if a render from nothing to `spp` samples comes by just those of `basis`.

    With fewer samples it needs its exact sums: without, it was rounded. And those of separate
    renders must not end elsewhere than passes do. spp: the scene's own number if None.
    """
    origin = basis.origin
    if origin.is_composed or origin.extra_spp or origin.method != method_of(scene):
        return False
    wanted = samples_for(scene, spp)
    if origin.spp < wanted and basis.sums is None:
        return False
    if origin.method == ONE_PASS:
        return origin.spp <= wanted
    plan = plan_of_light(scene, scene.spp if spp is None else spp)
    sizes = [[size for half, size in plan if half == h] for h in range(2)]
    return all(
        count <= len(its) and sum(its[:count]) == done
        for a, b, first, second in origin.each_light or ((*origin.halves, *origin.passes),)
        for its, done, count in zip(sizes, (a, b), (first, second), strict=True)
    )


def samples_for(scene: Scene, spp: int | None) -> int:
    """Return the samples per pixel that a basis gets if `spp` are requested.

    One more where that makes the halves equal, and some where a pixel is a block of pixels that
    ordinary renders take one sample of each in.
    """
    spp = scene.spp if spp is None else spp
    if method_of(scene) == ONE_PASS:
        return 2 * half_of(spp)
    return sum(size for _, size in plan_of_light(scene, spp))


def method_of(scene: Scene) -> str:
    """Return how a basis of `scene` is rendered: `ONE_PASS` or `SEPARATE`."""
    return ONE_PASS if why_not_one_pass(scene) is None else SEPARATE


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
        integrator="" if scene.instead is None else str(scene.instead),
    )


def basis_lights(scene: Scene) -> Lights:
    """Return what a basis says of the lights of `scene`, and what its lights file asks of them."""
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
        )
        for x, identity in zip(scene.lights, scene.light_identities, strict=True)
    )
    return Lights(lights, scene.requests)


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
    """Return the one-pass basis of what was rendered, and of `start`.

    halves: undivided sums of two halves of the samples, (n or 2n, h, w, 3), as `LightPlanes.sums`
    returns them; they are overwritten. seen: (h, w). half_spp: samples per pixel of each half in
    all. start: what these sums do not include. is_finished: whether there are as many as were asked
    for; if not, the basis has a copy of its sums.
    """
    n, spp = len(scene.lights), half_counts(half_spp, start)
    keeps_sums = not is_finished and start is None
    kept = (halves[0].copy(), halves[1].copy()) if keeps_sums else None
    totals, indirect = [half[:n] for half in halves], [half[n:] for half in halves]
    for total, part in zip(totals, indirect, strict=True):
        total[: len(part)] += part
    is_split = len(indirect[0]) == n and (start is None or start.indirect is not None)
    if start is not None:
        begun = half_counts(start.origin.halves[0], start)
        add_halves(totals, start.planes, start.noise, begun)
        seen = seen | start.emitters_seen
        if is_split and start.indirect is not None:
            add_halves(indirect, start.indirect.planes, start.indirect.noise, begun)
    pairs = [mean_and_half_difference(totals, spp)]
    if is_split:
        pairs.append(mean_and_half_difference(indirect, spp))
    return _one_pass_basis(
        [(as_planes(mean), as_planes(half)) for mean, half in pairs],
        scene,
        seed,
        seen,
        half_spp,
        guide_table,
        start=start,
        is_finished=is_finished,
        sums=kept,
    )


def _one_pass_basis(
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
    """Return the one-pass basis of images and half differences: of all light, and of indirect
    light where it is apart. For the others see `basis_of_sums`.
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


def half_counts(spp: int, basis: Basis | None) -> HalfCounts:
    """Return the samples of both halves: `spp` of each, and the extra ones of a basis."""
    if basis is None or basis.extra is None:
        return spp, spp
    its = (spp + basis.extra[..., None]).astype(np.float32)
    return its, its


@MITSUBA.taken()
def _render_together(
    scene: Scene,
    budget: Budget,
    seed: int,
    start: Basis | None,
    keeper: Keeper,
    progress: Progress,
    *,
    is_final: bool = True,
) -> Basis:
    """Render all lights by one path tracer (see one_pass.py), step by step."""
    from lightpaint.basis.render.tracer.one_pass import Tracer

    begun = done = 0 if start is None else start.origin.halves[0]
    guide_table = None if start is None else start.guide_table
    tracer = Tracer(scene, view_seed(seed, scene.sensor), guide_table)
    before = None if start is None else start.sums
    rest = start if before is None else None  # what the sums do not begin with
    film: WholeFilm | BandedFilm
    film = (BandedFilm if renders_in_bands(scene, start) else WholeFilm)(tracer, done, before)

    def basis(*, is_last: bool = False, is_finished: bool = False) -> Basis:
        seen = film.seen()
        if start is not None:
            seen |= start.emitters_seen
        of_render = scene, seed, seen, done, tracer.guide_table
        if isinstance(film, BandedFilm):
            sums = None if is_finished else (film.sums.array[0], film.sums.array[1])
            pairs = film.planes(done)
            return _one_pass_basis(pairs, *of_render, is_finished=is_finished, sums=sums)
        halves = film.sums(is_last=is_last)
        return basis_of_sums(
            scene, seed, halves, seen, done, tracer.guide_table, start=rest, is_finished=is_finished
        )

    try:
        with tracing() as let_others_through:
            for spp in steps(film.band_pixels, budget, done, progress):
                if not tracer.is_trained:
                    train(tracer, let_others_through)
                film.add(done, spp, let_others_through)
                done += spp
                keeper.now_and_then(basis)
        return basis(is_last=True, is_finished=is_final)
    except KeyboardInterrupt:
        if keeper.keep is None:
            raise
        if ahead := film.ahead:
            with tracing() as let_others_through:
                film.add(done, ahead, let_others_through)
            done += ahead
        if done == begun == 0:
            raise Interrupted("too early for anything to be kept") from None
        if not keeper.keep(basis(is_last=True)):
            raise
        of = "" if budget.time_s is not None else f" of {budget.spp}"
        raise Interrupted(
            f"{2 * done}{of} samples per pixel are kept; the same command goes on"
        ) from None
    finally:
        tracer.close()
        gc.collect()


@MITSUBA.taken()
def _render_one_by_one(
    scene: Scene,
    budget: Budget,
    seed: int,
    start: Basis | None,
    keeper: Keeper,
    progress: Progress,
    *,
    is_final: bool = True,
) -> Basis:
    """Render one light after the other, by the scene's own integrator (see separate_renders.py)."""
    sums = LightSums(len(scene.lights), scene.size) if start is None else LightSums.of(start)
    seen = emitters_seen(scene) if start is None else start.emitters_seen
    nothing = origin_of(scene, seed, SEPARATE, (0, 0), (0, 0))

    def basis(*, is_finished: bool = False) -> Basis:
        images, half_differences = sums.mean_and_half_difference()
        origin = replace(nothing, **sums.counts())
        lights = basis_lights(scene)
        source = str(scene.path)
        kept = None if is_finished else (sums.planes[0].copy(), sums.planes[1].copy())
        planes = as_planes(images), as_planes(half_differences)
        return Basis(lights, *planes, seen, origin, source=source, sums=kept)

    numbers = view_seed(seed, scene.sensor)
    render_separately(
        scene, budget, seed=numbers, sums=sums, basis=basis, keeper=keeper, progress=progress
    )
    return basis(is_finished=is_final)
