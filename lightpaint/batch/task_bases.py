"""Bases of a batch's tasks: saved or cached, or rendered for all looks that share them."""

import tempfile
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path

from lightpaint.basis import cache
from lightpaint.basis.basis import Basis
from lightpaint.basis.file import write_basis
from lightpaint.batch.work.basis_parts import PartwiseRender
from lightpaint.batch.work.engine import Engine
from lightpaint.batch.work.task import Task
from lightpaint.batch.work.work import job_fields
from lightpaint.batch.work.work_items import SceneFilm
from lightpaint.batch.work.worker_cache import WorkerCache
from lightpaint.pipeline.job_bases import obtain
from lightpaint.pipeline.settings import Settings
from lightpaint.pipeline.sources import SceneFile
from lightpaint.progress import Listener
from lightpaint.scene.quality_presets import on_film, samples


def has_basis(task: Task, known: WorkerCache) -> bool:
    """Return whether the basis of a task is saved or cached, so that nothing is to be
    rendered.
    """
    fields = job_fields(task, known)
    if fields["basis"] is not None:
        return True
    settings: Settings = fields["settings"]
    [scene] = fields["scenes"]
    film = on_film(scene.content, settings.quality, settings.resolution)
    asked = samples(settings.quality, spp=settings.spp, time_s=None)
    sensor = film.sensor_names[film.sensor]
    kept = cache.spp_of(film.identity, sensor, settings.seed, film.size)
    exact = settings.exact_spp or not settings.use_cache
    return not exact and kept >= (film.spp if asked is None else asked)


def obtain_bases(task: Task, engine: Engine, known: WorkerCache, listen: Listener) -> list[Basis]:
    """Return the bases of a task that are no files already: cached or rendered, once for all
    looks.
    """
    fields = job_fields(task, known)
    if fields["basis"] is not None:
        return []
    settings: Settings = fields["settings"]
    bases = []
    for key, scene in zip(task.bases, fields["scenes"], strict=True):
        film = on_film(scene.content, settings.quality, settings.resolution)
        basis = known.basis(key)
        if basis is None:
            its = SceneFilm(scene, settings.quality, settings.resolution, _scene_files(scene))
            render = PartwiseRender(engine, its)
            basis = obtain(film, settings, listen, render=render)
            known.put(key, basis)
        bases.append(basis)
    return bases


def save_bases(bases: Sequence[Basis], stack: ExitStack) -> tuple[str, ...]:
    """Save these bases to files, as long as `stack` is open."""
    folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="lightpaint-")))
    files = [folder / f"{k}.basis.exr" for k in range(len(bases))]
    for file, basis in zip(files, bases, strict=True):
        write_basis(file, basis)
    return tuple(map(str, files))


def _scene_files(scene: SceneFile) -> tuple[str, ...]:
    """Return all files of a scene."""
    return tuple(map(str, scene.content.read_files))
