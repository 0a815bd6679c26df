"""Bases of a batch's tasks: saved or cached, or rendered for all looks that share them."""

import tempfile
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

from lightpaint.basis.basis import Basis
from lightpaint.basis.cache import cache
from lightpaint.basis.file.basis_file import write_basis
from lightpaint.batch.distribution.basis_parts import PartwiseRender
from lightpaint.batch.distribution.engine import Engine
from lightpaint.batch.work.item_execution import job_fields
from lightpaint.batch.work.task import Task
from lightpaint.batch.work.work_items import SceneFilm
from lightpaint.batch.work.worker_cache import WorkerCache
from lightpaint.images.estimate import write_estimate
from lightpaint.pipeline.job.settings import Settings
from lightpaint.pipeline.job.sources import SceneFile
from lightpaint.pipeline.job_bases import obtain
from lightpaint.pipeline.placed_lights import moved_basis
from lightpaint.placement.placement import PlacementRecord
from lightpaint.progress import Listener
from lightpaint.scene.quality_presets import on_film


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
    cached_spp = cache.cached_spp(film.identity, sensor, settings.seed, film.size)
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
        obtain_scene_basis(key, scene, settings, engine, worker_cache, listen)
        for key, scene in zip(task.bases, fields["scenes"], strict=True)
    ]


def obtain_scene_basis(
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


def obtain_moved_basis(
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
    return tuple(map(str, scene.content.read_files))
