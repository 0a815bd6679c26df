"""Places that looks share, and the bases of scenes whose lights hang there."""

from collections.abc import Mapping
from contextlib import ExitStack

from lightpaint.basis.basis import Basis
from lightpaint.batch.distribution.engine import Engine
from lightpaint.batch.plan.place_groups import PlaceGroup
from lightpaint.batch.task_bases import obtain_moved_basis, obtain_scene_basis, save_bases
from lightpaint.batch.work.item_execution import SharedPlacing, job_fields
from lightpaint.batch.work.task import Task, key_of_scene
from lightpaint.batch.work.worker_cache import WorkerCache
from lightpaint.display_text import some_names
from lightpaint.errors import SceneError
from lightpaint.files import write_bytes, write_text
from lightpaint.images.formats.png import png_bytes
from lightpaint.pipeline.job.settings import Settings
from lightpaint.pipeline.job.sources import SceneFile
from lightpaint.pipeline.placed_lights import say_changes
from lightpaint.placement.placement import PlacementRecord, read_placement
from lightpaint.progress import Listener
from lightpaint.report.rig.hung_lights import HungLight
from lightpaint.report.rig.rig_drawing import rig_drawing
from lightpaint.scene.scene import Scene

#: Rough seconds of a search on one thread, to detect hung workers.
SEARCH_S = 300.0


def obtain_placed_bases(
    task: Task, group: PlaceGroup, engine: Engine, cache: WorkerCache, listen: Listener
) -> list[Basis]:
    """Return the bases of a task with the lights at the places of its group.

    Places and planes that are missing are computed, once for all looks of the group.
    """
    record = group.read_record()
    views = {} if record is not None else _views(group, cache)
    fields = job_fields(task, cache)
    keys = [key_of_scene(scene, fields["settings"]) for scene in fields["scenes"]]
    views |= dict(zip(keys, fields["scenes"], strict=True))
    settings: Settings = fields["settings"]
    unmoved_bases = {
        key: obtain_scene_basis(key, scene, settings, engine, cache, listen)
        for key, scene in views.items()
    }
    if record is None:
        deciding = {key: unmoved_bases[key] for key in _views(group, cache)}
        record = _find(group, deciding, engine, listen)
        first = next(iter(deciding))
        _draw(group, record, views[first].content, deciding[first])
    bases = []
    for key, old_key, scene in zip(task.bases, keys, fields["scenes"], strict=True):
        basis = obtain_moved_basis(
            scene, unmoved_bases[old_key], record, str(group.file), settings, engine, listen
        )
        cache.put(key, basis)
        bases.append(basis)
    cache.keep_only(task.bases)
    return bases


def _views(group: PlaceGroup, cache: WorkerCache) -> dict[str, SceneFile]:
    """Return the scene files of all views of a group, by the keys of their bases."""
    views = {}
    for task in group.tasks:
        fields = job_fields(task, cache)
        for scene in fields["scenes"]:
            views[key_of_scene(scene, fields["settings"])] = scene
    return views


def _draw(group: PlaceGroup, record: PlacementRecord, scene: Scene, basis: Basis) -> None:
    """Draw plan and elevation of the room with its lights, before and after."""
    [placed_scene] = record.hung_in([scene]).scenes
    emissions = {member.name: member.emission for member in placed_scene.emitters}
    lights = [HungLight(place, emissions[place.name]) for place in placed_scene.emitter_places]
    drawing = rig_drawing(basis.features, lights, up=placed_scene.up)
    if drawing is not None:
        write_bytes(group.picture, png_bytes(drawing))


def _find(
    group: PlaceGroup, bases: Mapping[str, Basis], engine: Engine, listen: Listener
) -> PlacementRecord:
    """Search for the places of a group, write their record, and return it."""
    label = some_names(group.looks)
    with ExitStack() as stack:
        files = ("",) * len(bases)
        if engine.is_apart:
            files = save_bases(list(bases.values()), stack)
        item = SharedPlacing(
            f"places of {label}", group.tasks, tuple(bases), files, group.fingerprint, SEARCH_S
        )
        [result] = engine.run([item])
    if result.failure:
        raise SceneError(f"no places were found: {result.failure}")
    group.file.parent.mkdir(parents=True, exist_ok=True)
    write_text(group.file, result.value)
    record = read_placement(group.file)
    say_changes(record, listen)
    return record
