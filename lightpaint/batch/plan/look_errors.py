"""All mistakes of a look that cannot be planned: each is sought by itself, so that none hides."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from lightpaint.basis.lightgroups.read import LightGroups
from lightpaint.basis.lights import BasisLight
from lightpaint.basis.render.render import basis_lights
from lightpaint.batch.manifest.entries import LookEntry
from lightpaint.batch.manifest.keys import Mistakes
from lightpaint.batch.work.worker_cache import WorkerCache
from lightpaint.errors import ALONE, LightpaintError
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.constraints.reduction import reduce_to
from lightpaint.pipeline.sources import check_nothing_idle, content
from lightpaint.scene.presets import on_film


def look_over(entry: LookEntry, held: WorkerCache, mistakes: Mistakes) -> None:
    """Add what is wrong with scene, sensors, settings and constraints, each looked at alone.

    held: scenes and bases, so that none is loaded for this that is there. What fails one look
    alone, as a basis that cannot be read, is no mistake of the manifest.
    """

    def tried(call: Callable[[], Any]) -> Any:
        try:
            return call()
        except ALONE:
            return None
        except LightpaintError as error:
            mistakes.add(entry.where, str(error))
            return None

    lights: Sequence[BasisLight] | None = None
    for scene in map(held.scene, entry.scenes):
        found = tried(partial(content, scene))
        if found is None:  # its lights are there through whichever sensor
            plain = held.scene(replace(scene, sensor=None))
            found = tried(partial(content, plain))
        if found is None:
            continue
        lights = basis_lights(found)
        tried(partial(on_film, found, entry.settings.quality, entry.settings.resolution))
        if "render" in entry.want:
            tried(partial(on_film, found, None, entry.final.resolution))
    if entry.basis is not None:
        saved = held.saved(entry.basis.unread())
        found = tried(partial(content, saved))
        if found is not None:
            lights = found.basis.lights if isinstance(found, LightGroups) else found.lights
        if not entry.scenes:
            tried(partial(check_nothing_idle, entry.settings, entry.basis))
    if lights is not None:
        for one in _one_by_one(entry.constraints):
            tried(partial(reduce_to, one, lights))


def _one_by_one(asked: Constraints) -> Iterator[Constraints]:
    """Yield what is asked of each light, each tie, and of all lights."""
    for light in asked.lights:
        yield Constraints(lights=(light,))
    for tie in asked.ties:
        yield Constraints(ties=(tie,))
    yield Constraints(prefer_current=asked.prefer_current, sparse=asked.sparse)
