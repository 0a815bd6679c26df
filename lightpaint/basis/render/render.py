"""Rendering the basis: all lights in one pass where that is possible, else one by one."""

import gc
from collections.abc import Callable
from dataclasses import replace

from lightpaint.basis.basis import Basis, Origin
from lightpaint.basis.lights import BasisLight, Lights
from lightpaint.basis.planes import as_planes
from lightpaint.basis.render.budget import Budget, Keeper, passes
from lightpaint.basis.render.integrators import why_not_one_pass
from lightpaint.basis.render.separate import (
    LightSums,
    emitters_seen,
    plan_of_light,
    render_separately,
)
from lightpaint.errors import BasisError, SceneError
from lightpaint.keywords import keywords
from lightpaint.progress import Interrupted, Progress, silent
from lightpaint.scene.mitsuba_errors import render_errors
from lightpaint.scene.runtime.render_lock import MITSUBA, tracing
from lightpaint.scene.scene import Scene
from lightpaint.scene.scene_render import SAMPLES_PER_PASS, plan_passes, view_seed
from lightpaint.scene.surfaces import render_first_hits

#: Camera samples that choices of emitters are learned from before any counts.
REHEARSAL = 2**18

ONE_PASS = "one pass"
SEPARATE = "separate renders"
#: The first of these, by parts.py: the same samples, but for which emitters they ask.
IN_PARTS = "one pass, in parts"


@keywords()
def render_basis(
    scene: Scene,
    *,
    spp: int | None = None,
    time_s: float | None = None,
    seed: int = 0,
    start: Basis | None = None,
    keep: Callable[[Basis], bool] | None = None,
    progress: Progress = silent,
) -> Basis:
    """Render the image of each light of `scene` alone, at unit emission.

    Args:
        scene: As `load_scene` returns it.
        spp: Samples per pixel (the scene's own number by default).
        time_s: Instead, seconds to render for, besides what `start` took; whole pairs of passes.
        seed: Any number >= 0; other seeds give independent bases.
        start: An earlier basis of the same scene, sensor and seed: its samples count, and only what
            is missing to `spp` is rendered, or as many more as `time_s` allows.
        keep: Called with what there is, now and then and when Ctrl-C ends the work early; returns
            whether it could be kept.
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
    budget = Budget(scene.spp if spp is None else spp, time_s)
    if len(scene.lights) * height * width * 3 >= 2**32:
        raise SceneError(
            f"{len(scene.lights)} lights at {width}x{height} are more than one basis can hold: "
            "use resolution=... or fewer lights"
        )
    check_memory(scene)
    if start is not None and not is_of(scene, start, seed):
        raise BasisError("the basis to go on from was made of another scene, sensor, film or seed")
    if start is not None and budget.met_by(start.origin.spp):
        return with_first_hits(start.with_requests(scene.requests), scene, seed)
    method = method_of(scene)
    if start is not None and not goes_on(start.origin.method, method):
        # Nothing to go on from, but nothing to be replaced by less either.
        start, keep = None, None
    if start is not None and method == ONE_PASS and start.origin.each_light:
        raise BasisError(
            "the lights of the basis to go on from have unequal numbers of samples, and one pass "
            "adds as many to each: render the others first, with scene.only([...])"
        )
    render_all = _render_together if method == ONE_PASS else _render_one_by_one
    with render_errors(scene.path):
        made = render_all(scene, budget, seed, start, Keeper(keep), progress)
    if start is not None:
        made = replace(made, features=start.features, objects=start.objects)
    return with_first_hits(made, scene, seed)


def goes_on(its: str, method: str) -> bool:
    """Return True if samples by `method` can be added to those of a basis by the method `its`."""
    return (ONE_PASS if its == IN_PARTS else its) == method


def with_first_hits(basis: Basis, scene: Scene, seed: int) -> Basis:
    """Return `basis` with its features: one from an earlier version may lack them."""
    if basis.features is not None and basis.objects is not None:
        return basis
    features, objects = render_first_hits(scene, seed=seed)
    return replace(basis, features=features, objects=objects)


def memory_needed(scene: Scene) -> int:
    """Return the peak memory of rendering a basis, in bytes, for any number of samples."""
    height, width = scene.size
    images = len(scene.lights) * height * width * 3 * 4
    # Sums of two halves, the images and half differences made of them, and a copy of both
    # where they are written to a file; passes are small beside that.
    return 6 * images + 512 * SAMPLES_PER_PASS


def check_memory(scene: Scene) -> None:
    """Raise SceneError if a basis of `scene` would not fit, instead of being killed for it."""
    needed, free = memory_needed(scene), _free_memory()
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
    )
    return of == mine and basis.size == scene.size


def is_on_the_way(
    scene: Scene, basis: Basis, spp: int | None, *, is_in_parts: bool = False
) -> bool:
    """Return True if a render to `spp` samples per pixel passes through those of `basis`.

    So does one that an interrupt ended, and not one that was made for fewer samples: its passes
    end elsewhere. spp: the scene's own number if None. is_in_parts: whether it is rendered by
    parts.py, which comes by nothing but its end.
    """
    origin = basis.origin
    if origin.is_composed:
        return False
    if is_in_parts and method_of(scene) == ONE_PASS:
        return origin.method == IN_PARTS and origin.spp == samples_for(scene, spp)
    if origin.method != method_of(scene):
        return False
    plan = _plan(scene, spp)
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
    return sum(size for _, size in _plan(scene, spp))


def _plan(scene: Scene, spp: int | None) -> list[tuple[int, int]]:
    """Return the passes of all lights, or of each, up to `spp`, by default the scene's own."""
    (height, width), spp = scene.size, scene.spp if spp is None else spp
    if method_of(scene) == ONE_PASS:
        return plan_passes(height * width, spp)
    return plan_of_light(scene, spp)


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


@MITSUBA.taken()
def _render_together(
    scene: Scene,
    budget: Budget,
    seed: int,
    start: Basis | None,
    keeper: Keeper,
    progress: Progress,
) -> Basis:
    """Render all lights in one path-traced pass after another (see one_pass.py)."""
    from lightpaint.basis.render.half_sums import HalfSums
    from lightpaint.basis.render.one_pass import Tracer

    height, width = scene.size
    sums = HalfSums(len(scene.lights), scene.size) if start is None else HalfSums.of(start)
    numbers = view_seed(seed, scene.sensor)
    tracer = Tracer(scene, numbers, start.learned if start is not None else None)
    knows_nothing = start is None or start.learned is None

    def basis(*, is_last: bool = False) -> Basis:
        images, half_differences = sums.mean_and_half_difference(is_last=is_last)
        halves, passes = (sums.spp[0], sums.spp[1]), (sums.passes[0], sums.passes[1])
        return Basis(
            basis_lights(scene),
            as_planes(images),
            as_planes(half_differences),
            sums.emitters_seen(),
            origin_of(scene, seed, ONE_PASS, halves, passes),
            tracer.guide.learned(),
            source=str(scene.path),
        )

    try:
        with tracing() as let_others_through:
            for half, spp in passes(height * width, budget, sums.spp, progress):
                if knows_nothing:
                    knows_nothing = False
                    tracer.rehearse(max(1, REHEARSAL // (height * width)))
                let_others_through()
                tracer.add_pass(sums, half, spp)
                if all(sums.spp):
                    keeper.now_and_then(basis)
        return basis(is_last=True)
    except KeyboardInterrupt:
        if keeper.keep is None:
            raise
        if not all(sums.spp):
            raise Interrupted("too early for anything to be kept") from None
        if not keeper.keep(basis(is_last=True)):
            raise
        of = "" if budget.time_s is not None else f" of {budget.spp}"
        raise Interrupted(
            f"{sum(sums.spp)}{of} samples per pixel are kept; the same command goes on"
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
) -> Basis:
    """Render one light after the other, by the scene's own integrator (see separate.py)."""
    sums = LightSums(len(scene.lights), scene.size) if start is None else LightSums.of(start)
    seen = emitters_seen(scene) if start is None else start.emitters_seen
    nothing = origin_of(scene, seed, SEPARATE, (0, 0), (0, 0))

    def basis() -> Basis:
        images, half_differences = sums.mean_and_half_difference()
        origin = replace(nothing, **sums.counts())
        lights = basis_lights(scene)
        source = str(scene.path)
        return Basis(
            lights, as_planes(images), as_planes(half_differences), seen, origin, source=source
        )

    numbers = view_seed(seed, scene.sensor)
    render_separately(
        scene, budget, seed=numbers, sums=sums, basis=basis, keeper=keeper, progress=progress
    )
    return basis()
