"""Obtains a basis: reuses planes from the cache and renders only what is missing."""

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from lightpaint.arrays import Indices
from lightpaint.basis.cache import basis_cache, plane_reuse
from lightpaint.basis.file.basis_file import as_stored, is_large, leave_indirect, note_file
from lightpaint.basis.light_basis import Basis
from lightpaint.basis.render import rendered_basis
from lightpaint.basis.render.basis_render import render_basis
from lightpaint.basis.render.pixel_top_up import KeptTracer, top_up
from lightpaint.display_text import some_names
from lightpaint.errors import BasisError, SceneError
from lightpaint.images import whole_factor
from lightpaint.progress import Progress, silent
from lightpaint.scene import Scene
from lightpaint.sentences import Hint

#: Smallest time budget of a render in seconds, which still renders one step.
SHORTEST_S = 1e-3

#: `render_basis`, or a function with the same signature.
Render = Callable[..., Basis]
#: Called with the number of lights taken from earlier runs, and the number of all lights.
ReuseReport = Callable[[int, int], None]


def obtain_basis(
    scene: Scene,
    *,
    spp: int | None = None,
    time_s: float | None = None,
    seed: int = 0,
    use_cache: bool = True,
    exact_spp: bool = False,
    is_final: bool = True,
    progress: Progress = silent,
    render: Render = render_basis,
    report_reuse: ReuseReport = lambda count, of: None,
    before: Basis | None = None,
    as_clean_as: Basis | None = None,
) -> Basis:
    """Return the basis of `scene`, from cached planes and newly rendered samples.

    A plane serves every scene that has its identity (`Scene.light_identities`): if one lamp of a
    scene was moved, only that lamp is rendered. Its samples follow the same camera paths as in a
    render of all lights, but choose among fewer emitters. So the planes have the same means as
    the planes of a complete render, but less noise, and such a lamp needs fewer samples: once it is
    as clean, in relation to its light, as the others are on average, it counts as having as many.

    time_s: seconds of rendering to add to the cached samples, instead of spp. If some lights have
    fewer samples than others, they get the time until they have caught up.
    use_cache: whether the cache is read and written.
    exact_spp: whether the basis must have exactly the requested samples, whatever is cached. Then
    no plane of another state of the scene is used, and a cached basis with more samples stays in
    the cache.
    is_final: False for a basis that gets more samples later: its exact sums are cached with it, so
    that the continued basis has the bits of a single render, as after an interrupt.
    render: function that renders what is missing.
    report_reuse: called with the number of reused lights and of all lights, if some are reused and
    others are rendered.
    before: a basis of the scene in another state, with the same seed and film, whose planes are
    reused as well.
    as_clean_as: a basis of other lights in the same picture; a light of `scene` that is as clean as
    its lights counts as having all its samples.
    Raises SceneError for exact_spp together with time_s, which gives no number of samples.
    """
    if exact_spp and time_s is not None:
        exact, time = Hint("exact_spp", True), Hint("time_s")
        raise SceneError(exact, " goes with a number of samples, not with ", time)
    goal_spp = None if time_s is not None else scene.spp if spp is None else spp
    options = dict[str, Any](time_s=time_s, seed=seed, progress=progress)
    if not use_cache:
        start = None
        if before is not None:
            options["keep"] = lambda basis: False
            start = plane_reuse.gather_planes(
                scene, None, spp=spp, seed=seed, before=before, use_cache=False
            )
        return as_stored(_completed(scene, start, as_clean_as, goal_spp, render, options))
    cached = _cached_basis(scene, seed)
    start = _starting_planes(
        scene, cached, goal_spp=goal_spp, seed=seed, exact_spp=exact_spp, before=before
    )
    is_composed = start is not None and start.origin.is_composed

    def keep(basis: Basis) -> bool:
        is_best = cached is None or basis.origin.mean_spp >= cached.origin.mean_spp
        return is_best and basis_cache.keep(_marked(basis, is_composed=is_composed))

    if start is not None:
        # A basis cached by an earlier version may know less about the same lights.
        start = replace(start, lights=rendered_basis.basis_lights(scene), source=str(scene.path))
        _report_reused(start, goal_spp, report_reuse)
    options |= {"keep": keep, "is_final": is_final}
    basis = _completed(scene, start, as_clean_as, goal_spp, render, options)
    if basis is start:
        return basis
    return _as_from_cache(scene, _marked(basis, is_composed=is_composed), keep)


def _cached_basis(scene: Scene, seed: int) -> Basis | None:
    """Return the cached basis of the scene in its present state, if there is one."""
    cached = basis_cache.find(scene.identity, scene.sensor_names[scene.sensor], seed, scene.size)
    return cached if cached is not None and rendered_basis.is_of(scene, cached, seed) else None


def _report_reused(start: Basis, goal_spp: int | None, report_reuse: ReuseReport) -> None:
    """Report how many lights need no more samples, if some do and others do not."""
    least = 1 if goal_spp is None else goal_spp
    is_sufficient = [sum(counts[:2]) >= least for counts in plane_reuse.counts_of(start)]
    if 0 < sum(is_sufficient) < len(is_sufficient):
        report_reuse(sum(is_sufficient), len(is_sufficient))


def _starting_planes(
    scene: Scene,
    cached: Basis | None,
    *,
    goal_spp: int | None,
    seed: int,
    exact_spp: bool,
    before: Basis | None,
) -> Basis | None:
    """Return the planes to which a render adds samples; None to start from scratch.

    cached: the basis of the scene in its current state. goal_spp: None for a time budget, whose
    samples are added to any. The other arguments are as in `obtain_basis`.
    """
    lacks_samples = goal_spp is None or cached is None or cached.origin.spp < goal_spp
    start = cached
    if cached is not None and lacks_samples:
        start = replace(cached, sums=basis_cache.sums_of(cached))
    if exact_spp:
        is_usable = start is not None and rendered_basis.is_on_the_way(scene, start, goal_spp)
        return start if is_usable else None
    if goal_spp is not None and lacks_samples:
        return plane_reuse.gather_planes(scene, start, spp=goal_spp, seed=seed, before=before)
    if cached is None:
        return plane_reuse.gather_planes(scene, None, spp=None, seed=seed, before=before)
    return start


def _as_from_cache(scene: Scene, basis: Basis, keep: Callable[[Basis], bool]) -> Basis:
    """Store a basis in the cache, and return it as it would be read back."""
    if not is_large(len(basis.lights), basis.size):
        # The next run, which reads the file, must find the same planes.
        basis = replace(as_stored(basis, keep), sums=None)
        if (file := basis_cache.file_of(basis)) is None:
            return basis
        basis = leave_indirect(basis, file)
        note_file(basis, file)
        return basis
    if keep(basis):
        of_file = basis_cache.find(
            scene.identity, basis.origin.sensor, basis.origin.seed, basis.size
        )
        if of_file is not None and of_file.origin == basis.origin:
            basis = replace(basis, planes=of_file.planes, noise=of_file.noise)
            return replace(basis, indirect=of_file.indirect, sums=None)
    return replace(as_stored(basis), sums=None)


def _completed(
    scene: Scene,
    start: Basis | None,
    as_clean_as: Basis | None,
    spp: int | None,
    render: Render,
    options: dict[str, Any],
) -> Basis:
    """Return `start` with the missing samples added, beginning with the lights that have the
    fewest, until they are as clean as the others.

    as_clean_as: as in `obtain_basis`. spp: None for the time in `options`, which holds the other
    arguments of `render`. Once all lights have equal numbers of samples, one pass adds to all of
    them.
    """
    end_s = None if options["time_s"] is None else time.monotonic() + options["time_s"]

    def budget(goal: int | None, variance: float | None) -> dict[str, Any]:
        until = {} if variance is None else {"until_variance": variance}
        if end_s is None:
            return {"spp": goal} | until
        left_s = max(end_s - time.monotonic(), SHORTEST_S)
        until |= {} if goal is None else {"until_spp": goal}
        return {"spp": None, "time_s": left_s} | until

    while start is not None and rendered_basis.method_of(scene) == rendered_basis.ONE_PASS:
        names, goal = plane_reuse.least_sampled_lights(start, spp)
        if not names:
            break
        lights_scene, whole = scene.only(names), start
        variance = None if goal is None else plane_reuse.mean_variance(whole, goal)

        def keep(part: Basis, whole: Basis = whole) -> bool:
            return bool(options["keep"](plane_reuse.merge(scene, whole, part)))

        part_options = options | budget(goal, variance) | {"keep": keep}
        part = render(lights_scene, start=plane_reuse.restrict(whole, lights_scene), **part_options)
        start = plane_reuse.merge(scene, whole, plane_reuse.as_sampled(part, goal, variance))
        if end_s is not None and time.monotonic() >= end_s:
            return start
    variance = (
        None if as_clean_as is None or spp is None else plane_reuse.mean_variance(as_clean_as, spp)
    )
    return plane_reuse.as_sampled(
        render(scene, start=start, **options | budget(spp, variance)), spp, variance
    )


def _marked(basis: Basis, *, is_composed: bool) -> Basis:
    """Return `basis`, marked if it continues planes of other states of its scene."""
    if basis.origin.is_composed or not is_composed:
        return basis
    return replace(basis, origin=replace(basis.origin, is_composed=True))


def top_up_basis(
    scene: Scene,
    basis: Basis,
    counts: Indices,
    *,
    use_cache: bool = True,
    progress: Progress = silent,
    is_enough: Callable[[], bool] = lambda: False,
    tracers: KeptTracer | None = None,
) -> Basis:
    """Return `basis` with additional samples in some pixels, and replace it in the cache. See
    `top_up`.
    """
    keep = basis_cache.keep if use_cache else None
    topped_up_basis = top_up(
        scene,
        basis,
        counts,
        keep=keep,
        progress=progress,
        is_enough=is_enough,
        tracers=tracers,
    )
    return as_stored(topped_up_basis) if keep is None else as_stored(topped_up_basis, keep)


def check_same_view(scene: Scene, basis: Basis) -> None:
    """Raise BasisError unless `basis` was made from `scene` in its current state, through its
    sensor.
    """
    origin, sensor = basis.origin, scene.sensor_names[scene.sensor]
    scene_members = {light.name: light.member_names for light in scene.lights}
    basis_members = {light.name: light.members for light in basis.lights}
    if scene_members != basis_members:
        raise BasisError(
            f"the basis has the lights {some_names(basis_members)}, and {scene.path} was loaded "
            f"with {some_names(scene_members)}: load it with the same lights and groups"
        )
    if (origin.scene_identity, origin.sensor) != (scene.identity, sensor):
        difference = "another state of the scene" if origin.sensor == sensor else "another sensor"
        raise BasisError(
            f"the basis shows {difference}: it was made of {origin.scene} through {origin.sensor}, "
            f"not of {scene.path} as it is through {sensor}; make it again"
        )
    if whole_factor(scene.size, basis.size) is None:
        raise BasisError(
            f"the basis is {basis.size[1]}x{basis.size[0]} but {scene.path} renders "
            f"{scene.size[1]}x{scene.size[0]}, which does not "
            "divide into as many square blocks: make it again"
        )
