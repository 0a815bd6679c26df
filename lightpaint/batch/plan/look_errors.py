"""All errors of a look that cannot be planned, found one by one, so that none hides another."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from lightpaint.basis.lightgroups.light_groups import LightGroups
from lightpaint.basis.lights import BasisLight
from lightpaint.basis.render.render_origin import basis_lights
from lightpaint.batch.manifest.entries import LookEntry
from lightpaint.batch.manifest.keys import Mistakes
from lightpaint.batch.work.worker_cache import WorkerCache
from lightpaint.errors import LOOK_ERRORS, LightpaintError
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.unknowns.constraint_reduction import reduce_to
from lightpaint.pipeline.job.sources import check_nothing_unused, content
from lightpaint.scene.quality_presets import on_film


def collect_errors(entry: LookEntry, cache: WorkerCache, mistakes: Mistakes) -> None:
    """Add errors in scene, sensors, settings and constraints, each checked alone, to the mistakes.

    cache: scenes and bases that are already loaded. Errors that fail one look alone, like a basis
    that cannot be read, are no mistakes of the manifest.
    """

    def attempt(call: Callable[[], Any]) -> Any:
        try:
            return call()
        except LOOK_ERRORS:
            return None
        except LightpaintError as error:
            mistakes.add(entry.label, str(error))
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


def _split_constraints(constraints: Constraints) -> Iterator[Constraints]:
    """Yield the constraints on each light, each tie, and on all lights."""
    for light in constraints.lights:
        yield Constraints(lights=(light,))
    for tie in constraints.ties:
        yield Constraints(ties=(tie,))
    yield Constraints(prefer_current=constraints.prefer_current, sparse=constraints.sparse)
