"""The basis to solve with: a cached one if it fits, completed by rendering."""

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from lightpaint.arrays import Indices
from lightpaint.basis.basis import Basis
from lightpaint.basis.cache import cache
from lightpaint.basis.cache.plane_reuse import (
    counts_of,
    gather_planes,
    least_sampled_lights,
    merge,
    restrict,
)
from lightpaint.basis.file.basis_file import as_stored, is_large
from lightpaint.basis.file.basis_reader import leave_indirect
from lightpaint.basis.render.basis_render import render_basis
from lightpaint.basis.render.render_origin import (
    ONE_PASS,
    basis_lights,
    is_of,
    is_on_the_way,
    method_of,
)
from lightpaint.basis.render.top_up import KeptTracer, top_up
from lightpaint.errors import BasisError, SceneError
from lightpaint.images.pixel_blocks import whole_factor
from lightpaint.progress import Progress, silent
from lightpaint.scene.scene import Scene
from lightpaint.screen import some_names

#: Seconds that a render is asked for at least: in less it renders one step, too.
SHORTEST_S = 1e-3

#: `render_basis`, or another that takes and gives the same.
Render = Callable[..., Basis]
#: Hears how many of how many lights are taken from earlier runs.
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
) -> Basis:
    """Return the basis of `scene`: cached planes, and missing samples rendered.

    A plane serves every scene that has its identity (`Scene.light_identities`): after a lamp was
    moved, only that lamp is rendered. Its samples follow the same camera paths as in a render of
    all lights, but choose among fewer emitters, so the planes have the same means as a full render,
    and other noise.

    time_s: instead of spp, seconds of rendering to add to what was kept. Lights with fewer samples
    than others get the time until they have as many.
    use_cache: False neither looks for one nor keeps it.
    exact_spp: whether the basis has exactly the requested samples, whatever is cached. Then no
    planes come from another state of the scene. A cached basis with more samples stays in the
    cache.
    is_final: False for a basis to be gone on from: its exact sums are kept beside it, so that a
    basis with more samples has the bits of one render, as it has after an interrupt.
    render: who renders what is missing.
    report_reuse: told how many of the lights are taken, and of how many, where others are rendered.
    before: a basis of the scene in another state, of the same seed and film, whose planes are taken
    as well.

    Raises SceneError for exact_spp with a time, which asks for no number.
    """
    if exact_spp and time_s is not None:
        raise SceneError("exact_spp=True goes with a number of samples, not with time_s=...")
    if not use_cache:
        start, options = None, dict[str, Any](time_s=time_s, seed=seed, progress=progress)
        if before is not None:
            options["keep"] = lambda basis: False
            start = gather_planes(scene, None, spp=spp, seed=seed, before=before, use_cache=False)
        goal = None if time_s is not None else scene.spp if spp is None else spp
        return as_stored(_completed(scene, start, spp=goal, render=render, options=options))
    cached = cache.find(scene.identity, scene.sensor_names[scene.sensor], seed, scene.size)
    if cached is not None and not is_of(scene, cached, seed):
        cached = None
    goal_spp = None if time_s is not None else scene.spp if spp is None else spp
    start = _starting_planes(
        scene, cached, goal_spp=goal_spp, seed=seed, exact_spp=exact_spp, before=before
    )
    is_composed = start is not None and start.origin.is_composed

    def keep(basis: Basis) -> bool:
        return (cached is None or basis.origin.mean_spp >= cached.origin.mean_spp) and cache.keep(
            _marked(basis, is_composed=is_composed)
        )

    if start is not None:
        # One kept by an earlier version may know less of the same lights.
        start = replace(start, lights=basis_lights(scene), source=str(scene.path))
        enough = [
            sum(counts[:2]) >= (1 if goal_spp is None else goal_spp) for counts in counts_of(start)
        ]
        if 0 < sum(enough) < len(enough):
            report_reuse(sum(enough), len(enough))
    options = dict[str, Any](
        time_s=time_s, seed=seed, keep=keep, is_final=is_final, progress=progress
    )
    basis = _completed(scene, start, spp=goal_spp, render=render, options=options)
    if basis is start:
        return basis
    basis = _marked(basis, is_composed=is_composed)
    return _as_from_cache(scene, basis, keep)


def _starting_planes(
    scene: Scene,
    cached: Basis | None,
    *,
    goal_spp: int | None,
    seed: int,
    exact_spp: bool,
    before: Basis | None,
) -> Basis | None:
    """Return the planes to which a render adds samples; None to begin without any.

    cached: the basis of the present scene. goal_spp: None for a time, whose samples add to any. The
    other arguments are those of `obtain_basis`.
    """
    lacks_samples = goal_spp is None or cached is None or cached.origin.spp < goal_spp
    start = cached
    if cached is not None and lacks_samples:
        start = replace(cached, sums=cache.sums_of(cached))
    if exact_spp:
        is_usable = start is not None and is_on_the_way(scene, start, goal_spp)
        return start if is_usable else None
    if goal_spp is not None and lacks_samples:
        return gather_planes(scene, start, spp=goal_spp, seed=seed, before=before)
    if cached is None:
        return gather_planes(scene, None, spp=None, seed=seed, before=before)
    return start


def _as_from_cache(scene: Scene, basis: Basis, keep: Callable[[Basis], bool]) -> Basis:
    """Keep a basis in the cache, and return it as it is read from there."""
    if not is_large(len(basis.lights), basis.size):
        # Rounded as in its file, so that the next run gets the same.
        basis = replace(as_stored(basis, keep), sums=None)
        file = cache.file_of(basis)
        return basis if file is None else leave_indirect(basis, file)
    if keep(basis):
        of_file = cache.find(scene.identity, basis.origin.sensor, basis.origin.seed, basis.size)
        if of_file is not None and of_file.origin == basis.origin:
            basis = replace(basis, planes=of_file.planes, noise=of_file.noise)
            return replace(basis, indirect=of_file.indirect, sums=None)
    return replace(as_stored(basis), sums=None)


def _completed(
    scene: Scene, start: Basis | None, *, spp: int | None, render: Render, options: dict[str, Any]
) -> Basis:
    """Return `start` with the samples that are missing, of lights that have fewest first.

    spp: None for the time in `options`, which are other arguments of `render`. That adds as many
    samples to all lights in one pass.
    """
    end_s = None if options["time_s"] is None else time.monotonic() + options["time_s"]

    def budget(goal: int | None) -> dict[str, Any]:
        if end_s is None:
            return {"spp": goal}
        left_s = max(end_s - time.monotonic(), SHORTEST_S)
        return {"spp": None, "time_s": left_s} | ({} if goal is None else {"until_spp": goal})

    while start is not None and method_of(scene) == ONE_PASS:
        names, goal = least_sampled_lights(start, spp)
        if not names:
            break
        alone, whole = scene.only(names), start

        def keep(part: Basis, whole: Basis = whole) -> bool:
            return bool(options["keep"](merge(scene, whole, part)))

        part_options = options | budget(goal) | {"keep": keep}
        part = render(alone, start=restrict(whole, alone), **part_options)
        start = merge(scene, whole, part)
        if end_s is not None and time.monotonic() >= end_s:
            return start
    return render(scene, start=start, **options | budget(spp))


def _marked(basis: Basis, *, is_composed: bool) -> Basis:
    """Return `basis`, which says whether it went on from planes of other states of its scene."""
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
    """Return `basis` with further samples of some pixels, kept in its place. See `top_up`."""
    keep = cache.keep if use_cache else None
    refined = top_up(
        scene,
        basis,
        counts,
        keep=keep,
        progress=progress,
        is_enough=is_enough,
        tracers=tracers,
    )
    return as_stored(refined) if keep is None else as_stored(refined, keep)


def check_same_view(scene: Scene, basis: Basis) -> None:
    """Raise BasisError unless `basis` was rendered from the present `scene`, through its sensor."""
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
            f"{scene.size[1]}x{scene.size[0]}, of which no square blocks are as many: make it again"
        )
