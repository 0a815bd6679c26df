"""Bases of a batch's tasks: saved or cached, or rendered for all looks that share them, maybe with
lights at places that these looks share, too.
"""

import tempfile
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

from lightpaint.basis import Basis, write_basis
from lightpaint.basis.cache import basis_cache
from lightpaint.batch.distributed_work import PartwiseRender
from lightpaint.batch.engine import Engine
from lightpaint.batch.plan.plan_steps import PlaceGroup
from lightpaint.batch.work.item_execution import SharedPlacing, job_fields
from lightpaint.batch.work.work_items import SceneFilm, Task, key_of_scene
from lightpaint.batch.work.worker_storage import WorkerCache
from lightpaint.display_text import some_names
from lightpaint.errors import SceneError
from lightpaint.files import write_bytes, write_text
from lightpaint.images import write_estimate
from lightpaint.images.formats import png_bytes
from lightpaint.pipeline import SceneFile, Settings, moved_basis, obtain, say_changes
from lightpaint.placement import PlacementRecord, read_placement
from lightpaint.progress import Listener
from lightpaint.report import HungLight, rig_drawing
from lightpaint.scene import Scene
from lightpaint.scene.quality_presets import on_film

#: Rough seconds of a search on one thread, to detect hung workers.
SEARCH_S = 300.0


def has_basis(task: Task, worker_cache: WorkerCache) -> bool:
    """Return whether the basis of a task is saved or cached, so that it need not be rendered."""
    fields = job_fields(task, worker_cache)
    if fields["basis"] is not None:
        return True
    settings: Settings = fields["settings"]
    [scene] = fields["scenes"]
    film = on_film(scene.content, settings.quality, settings.resolution)
    requested_spp = replace(settings, time_s=None).basis_spp
    sensor = film.sensor_names[film.sensor]
    cached_spp = basis_cache.cached_spp(film.identity, sensor, settings.seed, film.size)
    goal_spp = film.spp if requested_spp is None else requested_spp
    has_enough = cached_spp == goal_spp if settings.exact_spp else cached_spp >= goal_spp
    return settings.use_cache and has_enough


def obtain_bases(
    task: Task, engine: Engine, worker_cache: WorkerCache, listen: Listener
) -> list[Basis]:
    """Return the bases of a task from the cache or a render, once for all looks.
    The list is empty if the basis is a file already.
    """
    fields = job_fields(task, worker_cache)
    if fields["basis"] is not None:
        return []
    settings: Settings = fields["settings"]
    return [
        _obtain_scene_basis(key, scene, settings, engine, worker_cache, listen)
        for key, scene in zip(task.bases, fields["scenes"], strict=True)
    ]


def _obtain_scene_basis(
    key: str,
    scene: SceneFile,
    settings: Settings,
    engine: Engine,
    worker_cache: WorkerCache,
    listen: Listener,
) -> Basis:
    """Return the basis of a scene from the cache or a render, and keep it by its key."""
    basis = worker_cache.basis(key)
    if basis is None:
        film = on_film(scene.content, settings.quality, settings.resolution)
        scene_film = SceneFilm(scene, settings.quality, settings.resolution, _scene_files(scene))
        render = PartwiseRender(engine, scene_film)
        basis = obtain(film, settings, listen, render=render, names_cache=False)
        worker_cache.put(key, basis)
    return basis


def _obtain_moved_basis(
    scene: SceneFile,
    unmoved_basis: Basis,
    record: PlacementRecord,
    places: str,
    settings: Settings,
    engine: Engine,
    listen: Listener,
) -> Basis:
    """Return the basis of a scene with moved lights; an engine renders their planes.

    unmoved_basis: the basis without the moves. places: the file of `record`, for workers.
    """
    film = on_film(scene.content, settings.quality, settings.resolution)
    [moved_scene] = record.hung_in([film]).scenes
    files = (*_scene_files(scene), places)
    scene_film = SceneFilm(scene, settings.quality, settings.resolution, files, places=places)
    render = PartwiseRender(engine, scene_film)
    return moved_basis(
        moved_scene, unmoved_basis, settings, listen, render=render, names_cache=False
    )


def save_bases(bases: Sequence[Basis], stack: ExitStack) -> tuple[str, ...]:
    """Save the bases to files that exist as long as `stack` is open, and return their paths."""
    folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="lightpaint-")))
    files = [folder / f"{k}.basis.exr" for k in range(len(bases))]
    for file, basis in zip(files, bases, strict=True):
        write_basis(file, basis)
    return tuple(map(str, files))


def save_former_looks(bases: Sequence[Basis], stack: ExitStack) -> tuple[str, ...]:
    """Save the looks before the lights of some bases were moved, which their files lack.

    Returns their paths, "" for bases whose lights are where they were.
    """
    folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="lightpaint-")))
    files = []
    for k, basis in enumerate(bases):
        files.append("" if basis.former is None else str(folder / f"{k}.former.exr"))
        if basis.former is not None:
            write_estimate(Path(files[-1]), basis.former, {})
    return tuple(files)


def _scene_files(scene: SceneFile) -> tuple[str, ...]:
    """Return all files of a scene."""
    return tuple(map(str, scene.read_files))


def obtain_placed_bases(
    task: Task, group: PlaceGroup, engine: Engine, cache: WorkerCache, listen: Listener
) -> list[Basis]:
    """Return the bases of a task with the lights at the places of its group.

    Places and planes that are missing are computed, once for all looks of the group.
    """
    record = group.read_record()
    views = {} if record is not None else _views_of_group(group, cache)
    fields = job_fields(task, cache)
    keys = [key_of_scene(scene, fields["settings"]) for scene in fields["scenes"]]
    views |= dict(zip(keys, fields["scenes"], strict=True))
    settings: Settings = fields["settings"]
    unmoved_bases = {
        key: _obtain_scene_basis(key, scene, settings, engine, cache, listen)
        for key, scene in views.items()
    }
    if record is None:
        deciding = {key: unmoved_bases[key] for key in _views_of_group(group, cache)}
        record = _find_places(group, deciding, engine, listen)
        first = next(iter(deciding))
        _draw_room(group, record, views[first].content, deciding[first])
    bases = []
    for key, old_key, scene in zip(task.bases, keys, fields["scenes"], strict=True):
        basis = _obtain_moved_basis(
            scene, unmoved_bases[old_key], record, str(group.file), settings, engine, listen
        )
        cache.put(key, basis)
        bases.append(basis)
    cache.keep_only(task.bases)
    return bases


def _views_of_group(group: PlaceGroup, cache: WorkerCache) -> dict[str, SceneFile]:
    """Return the scene files of all views of a group, by the keys of their bases."""
    views = {}
    for task in group.tasks:
        fields = job_fields(task, cache)
        for scene in fields["scenes"]:
            views[key_of_scene(scene, fields["settings"])] = scene
    return views


def _draw_room(group: PlaceGroup, record: PlacementRecord, scene: Scene, basis: Basis) -> None:
    """Draw plan and elevation of the room with its lights, before and after."""
    [placed_scene] = record.hung_in([scene]).scenes
    emissions = {member.name: member.emission for member in placed_scene.emitters}
    lights = [HungLight(place, emissions[place.name]) for place in placed_scene.emitter_places]
    drawing = rig_drawing(basis.features, lights, up=placed_scene.up)
    if drawing is not None:
        write_bytes(group.picture, png_bytes(drawing))


def _find_places(
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
        raise SceneError("no places were found: ", result.failure)
    group.file.parent.mkdir(parents=True, exist_ok=True)
    write_text(group.file, result.value)
    record = read_placement(group.file)
    say_changes(record, listen)
    return record
