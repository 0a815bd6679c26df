"""Renders a basis: all lights in one pass if possible, else one by one."""

import gc
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from lightpaint.basis.basis import Basis
from lightpaint.basis.planes import as_planes
from lightpaint.basis.render.banded_film import BandedFilm, WholeFilm
from lightpaint.basis.render.guide_training import train
from lightpaint.basis.render.one_pass_basis import basis_of_planes, basis_of_sums
from lightpaint.basis.render.render_budget import Budget, Keeper, steps
from lightpaint.basis.render.render_memory import check_memory, renders_in_bands
from lightpaint.basis.render.render_origin import (
    ONE_PASS,
    SEPARATE,
    basis_lights,
    is_of,
    method_of,
    origin_of,
)
from lightpaint.basis.render.separate_renders import (
    LightSums,
    emitters_seen,
    render_separately,
)
from lightpaint.errors import BasisError, SceneError
from lightpaint.keywords import keywords
from lightpaint.progress import Interrupted, Progress, silent
from lightpaint.scene.runtime.mitsuba_errors import render_errors
from lightpaint.scene.runtime.render_lock import MITSUBA, tracing
from lightpaint.scene.scene import Scene
from lightpaint.scene.scene_render import view_seed
from lightpaint.scene.surfaces import render_first_hits


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
        scene: From `load_scene`.
        spp: Samples per pixel (by default the scene's own number).
        time_s: Seconds to render for, instead of spp and in addition to the time spent on `start`;
            a step that has begun is finished.
        until_spp: Samples per pixel at which rendering stops before `time_s` is over; one-pass
            renders only.
        seed: Any number >= 0; different seeds give independent bases.
        start: An earlier basis of the same scene, sensor and seed. Its samples count, so only those
            missing to `spp` are rendered, or as many more as `time_s` allows. If it has `sums`, the
            result has the bits of a single render, else it differs by round-off.
        keep: Called with the basis so far, including its `sums`, from time to time and when Ctrl-C
            ends the work early. Returns whether it was stored.
        is_final: False for a basis to which more samples will be added: it keeps its `sums`.
        progress: Called with the progress of the work.

    Raises:
        SceneError: If there are more lights and pixels than fit.
        Interrupted: On Ctrl-C.

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
        raise BasisError("the basis to continue was made from another scene, sensor, film or seed")
    if start is not None and budget.met_by(start.origin.spp):
        return with_first_hits(start.with_requests(scene.requests), scene, seed)
    method = method_of(scene)
    if start is not None and start.origin.method != method:
        # It cannot be continued, but must not be replaced by a basis with fewer samples either.
        start, keep = None, None
    if start is not None and method == ONE_PASS and start.origin.each_light:
        raise BasisError(
            "the lights of the basis to continue have unequal numbers of samples, and one pass "
            "adds the same number to each: render the others first, with scene.only([...])"
        )
    has_first_hits = start is not None and not (start.features is None or start.objects is None)
    arguments = scene, budget, seed, start, Keeper(keep), progress
    with render_errors(scene.path):
        if method == ONE_PASS:
            rendered = _render_together(
                *arguments, is_final=is_final, needs_first_hits=not has_first_hits
            )
        else:
            rendered = _render_one_by_one(*arguments, is_final=is_final)
    if start is not None and has_first_hits:
        rendered = replace(rendered, features=start.features, objects=start.objects)
    return with_first_hits(rendered, scene, seed)


def render_planes_only(scene: Scene, *, spp: int, seed: int) -> Basis:
    """Render a basis without features and objects, for callers that do not need them."""
    check_memory(scene)
    render_all = _render_together if method_of(scene) == ONE_PASS else _render_one_by_one
    with render_errors(scene.path):
        return render_all(scene, Budget(spp, None), seed, None, Keeper(None), silent)


def with_first_hits(basis: Basis, scene: Scene, seed: int, *, loaded: Any = None) -> Basis:
    """Return `basis` with features and objects, which a basis from an earlier version may lack.

    loaded: the loaded `scene`, if available.
    """
    if basis.features is not None and basis.objects is not None:
        return basis
    features, objects = render_first_hits(scene, seed=seed, loaded=loaded)
    return replace(basis, features=features, objects=objects)


@MITSUBA.acquired()
def _render_together(
    scene: Scene,
    budget: Budget,
    seed: int,
    start: Basis | None,
    keeper: Keeper,
    progress: Progress,
    *,
    is_final: bool = True,
    needs_first_hits: bool = False,
) -> Basis:
    """Render all lights step by step with one path tracer (see one_pass.py).

    needs_first_hits: whether to render features and objects while the scene is loaded.
    """
    from lightpaint.basis.render.tracer.one_pass import Tracer

    begun = done = 0 if start is None else start.origin.halves[0]
    guide_table = None if start is None else start.guide_table
    tracer = Tracer(scene, view_seed(seed, scene.sensor), guide_table)
    before = None if start is None else start.sums
    rest = start if before is None else None  # the samples that are not in the initial sums
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
            return basis_of_planes(pairs, *of_render, is_finished=is_finished, sums=sums)
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
        rendered = basis(is_last=True, is_finished=is_final)
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
        budget_text = "" if budget.time_s is not None else f" of {budget.spp}"
        raise Interrupted(
            f"{2 * done}{budget_text} samples per pixel are kept; run the same command to continue"
        ) from None
    else:
        return (
            with_first_hits(rendered, scene, seed, loaded=tracer.loaded)
            if needs_first_hits
            else rendered
        )
    finally:
        tracer.close()
        gc.collect()


@MITSUBA.acquired()
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
    """Render one light after the other with the scene's own integrator (see
    separate_renders.py).
    """
    sums = LightSums(len(scene.lights), scene.size) if start is None else LightSums.of(start)
    seen = emitters_seen(scene) if start is None else start.emitters_seen
    nothing = origin_of(scene, seed, SEPARATE, (0, 0), (0, 0))

    def basis(*, is_finished: bool = False) -> Basis:
        images, half_differences = sums.mean_and_half_difference()
        origin = replace(nothing, **sums.counts())
        lights = basis_lights(scene)
        source = str(scene.path)
        kept_sums = None if is_finished else (sums.planes[0].copy(), sums.planes[1].copy())
        planes = as_planes(images), as_planes(half_differences)
        return Basis(lights, *planes, seen, origin, source=source, sums=kept_sums)

    numbers = view_seed(seed, scene.sensor)
    render_separately(
        scene, budget, seed=numbers, sums=sums, basis=basis, keeper=keeper, progress=progress
    )
    return basis(is_finished=is_final)
