"""Checks of looks before anything is rendered, and all errors of a look that cannot be planned."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from lightpaint.basis.basis import Basis
from lightpaint.basis.lightgroups.light_groups import LightGroups
from lightpaint.basis.lights import BasisLight
from lightpaint.basis.render.integrators import why_not_one_pass
from lightpaint.basis.render.render_origin import basis_lights
from lightpaint.batch.manifest.entries import LookEntry
from lightpaint.batch.manifest.keys import Mistakes, with_manifest_keys
from lightpaint.batch.work.worker_cache import WorkerCache
from lightpaint.display_text import some_names
from lightpaint.errors import LOOK_ERRORS, BatchError, LightpaintError
from lightpaint.lighting.answer.lighting_file import read_lighting
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.constraints.start_lighting import start_weights
from lightpaint.lighting.linear_problem import reason_against_sums
from lightpaint.lighting.unknowns.reduction import reduce_to
from lightpaint.pipeline.job.job import Job
from lightpaint.pipeline.job.sources import check_nothing_unused, content
from lightpaint.relit.relight import scene_of
from lightpaint.scene.quality_presets import on_film
from lightpaint.scene.scene import Scene


def collect_errors(entry: LookEntry, cache: WorkerCache, mistakes: Mistakes) -> None:
    """Add errors in scene, sensors, settings and constraints, each checked alone, to the mistakes.

    cache: scenes and bases that are already loaded. Errors that fail one look alone, like a basis
    that cannot be read, are not mistakes of the manifest.
    """

    def attempt(call: Callable[[], Any]) -> Any:
        try:
            return call()
        except LOOK_ERRORS:
            return None
        except LightpaintError as error:
            mistakes.add(entry.label, with_manifest_keys(str(error)))
            return None

    lights: Sequence[BasisLight] | None = None
    for scene in map(cache.scene, entry.scenes):
        loaded_scene = attempt(partial(content, scene))
        if loaded_scene is None:  # the lights can be checked without a sensor
            without_sensor = cache.scene(replace(scene, sensor=None))
            loaded_scene = attempt(partial(content, without_sensor))
        if loaded_scene is None:
            continue
        lights = basis_lights(loaded_scene)
        attempt(partial(on_film, loaded_scene, entry.settings.quality, entry.settings.resolution))
        if "render" in entry.want:
            attempt(partial(on_film, loaded_scene, None, entry.final.resolution))
    if entry.basis is not None:
        source = cache.source(entry.basis.without_content())
        loaded_scene = attempt(partial(content, source))
        if loaded_scene is not None:
            lights = (
                loaded_scene.basis.lights
                if isinstance(loaded_scene, LightGroups)
                else loaded_scene.lights
            )
        if not entry.scenes:
            attempt(partial(check_nothing_unused, entry.settings, entry.basis))
    if lights is not None:
        for part in _split_constraints(entry.constraints):
            attempt(partial(reduce_to, part, lights))
        for name, emission in entry.constraints.start.items():
            attempt(partial(start_weights, {name: emission}, lights))


def _split_constraints(constraints: Constraints) -> Iterator[Constraints]:
    """Yield the constraints on each light, each tie, and on all lights."""
    for light in constraints.lights:
        yield Constraints(lights=(light,))
    for tie in constraints.ties:
        yield Constraints(ties=(tie,))
    yield replace(constraints, lights=(), ties=(), start={})


def check_by_sums(job: Job) -> None:
    """Raise BatchError if the lighting of a job does not follow from sums alone."""
    [view] = job.views
    reason = reason_against_sums(view.target, job.fit)
    if not reason and view.basis is None and view.scene is not None:
        reason = why_not_one_pass(view.scene) or ""
    if job.all_constraints.near:
        reason = "near depends on the area of the paint"
    if job.all_rigging:
        reason = "lights may move in it, unless move_lights is false"
    if reason:
        raise BatchError(f"want = ['lights'] takes sums alone, and {reason}: want 'solve' instead")


def files_of_lighting_look(
    entry: LookEntry, scene: Scene | None, groups: LightGroups | None
) -> tuple[Path, ...]:
    """Return the files that a look with a given or combined lighting reads."""
    files: tuple[Path, ...] = () if scene is None else scene.read_files
    if groups is not None:
        files += tuple(groups.files)
    elif entry.basis is not None:
        files += (Path(entry.basis.path),)
    return (*files, Path(entry.lighting)) if entry.lighting else files


def check_given_lighting(
    entry: LookEntry, scene: Scene | None, basis: Basis | LightGroups | None
) -> None:
    """Raise BatchError if the lighting of a look has other lights than its scene or basis."""
    lighting = read_lighting(entry.lighting)
    lighting_names = set(lighting)
    if scene is not None:
        scene_names = {light.name for light in scene_of(scene, lighting).lights}
        if lighting_names != scene_names:
            raise BatchError(
                f"{entry.lighting} has the lights {some_names(sorted(lighting_names))}, and the "
                f"scene {some_names(sorted(scene_names))}: load it with the same lights and groups"
            )
    elif isinstance(basis, LightGroups | Basis):
        names = (basis.basis if isinstance(basis, LightGroups) else basis).names
        if lighting_names != set(names):
            raise BatchError(f"{entry.lighting} is of other lights than {entry.basis}")


def remarks_on_suns(job: Job) -> tuple[str, ...]:
    """Return a remark on a sun that a lights file asks for, and that a batch does not find."""
    scene = next((view.scene for view in job.views if view.scene is not None), None)
    if scene is None or not (suns := {k: n for k, n in scene.requests.sun.items() if n}):
        return ()
    return (
        f"the lights file asks for a sun in {some_names(suns)}, which a batch does not find, since "
        "its looks share their basis: the texels stay as they are; solve a look alone for its sun",
    )
