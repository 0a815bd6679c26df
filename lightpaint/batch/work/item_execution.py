"""The work that an item stands for: computing its value, or writing its files."""

import errno
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from lightpaint.basis.basis import Basis
from lightpaint.basis.lightgroups.light_groups import LightGroups
from lightpaint.basis.render.basis_render import train_guide
from lightpaint.batch.manifest.keys import Space, with_manifest_keys
from lightpaint.batch.manifest.sequence import interpolate
from lightpaint.batch.manifest.variations import shift
from lightpaint.batch.work.derived_looks import derived_folder, dimmer_lights, publish_derived
from lightpaint.batch.work.shared_places import SharedPlacing, find_shared_places
from lightpaint.batch.work.sums_answer import answer_by_sums, sums_of_rows
from lightpaint.batch.work.task import EXPORT, Task
from lightpaint.batch.work.work_items import (
    GuideTraining,
    ItemResult,
    PartOfBasis,
    Passes,
    SumsOfRows,
    WorkItem,
)
from lightpaint.batch.work.worker_cache import WorkerCache
from lightpaint.errors import LightpaintError
from lightpaint.files import first_line, one_line
from lightpaint.images.estimate import Estimate
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.lighting.answer.lighting_file import read_lighting
from lightpaint.pipeline.job.job import Job
from lightpaint.pipeline.job.job_record import decode_job
from lightpaint.pipeline.job.settings import Settings
from lightpaint.pipeline.job.sources import BasisFile, GroupsFile, content
from lightpaint.pipeline.pipeline import run
from lightpaint.pipeline.relit_renders import relight_look, relit_folder
from lightpaint.pipeline.results.result_folder import ResultFolder
from lightpaint.pipeline.results.results import view_names
from lightpaint.progress import Listener
from lightpaint.relit.formats.export_format import Source
from lightpaint.relit.formats.formats import names_of_forms, write_content, writers_of
from lightpaint.scene.scene import Scene

#: Error numbers of a full disk.
DISK_FULL_ERRNOS = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}

#: Longest text of a failure, in characters.
MAX_REASON_LENGTH = 600

#: Text of the failure of an item that needs too much memory.
OUT_OF_MEMORY_TEXT = (
    "it takes more memory than there is: lower settings.resolution, or use fewer workers"
)


def run_item(item: WorkItem, cache: WorkerCache, listen: Listener) -> ItemResult:
    """Run one item; an error becomes the failure of this item alone, in one line."""
    return attempt(item, lambda: _run(item, cache, listen))


def attempt(item: WorkItem, work: Callable[[], Any]) -> ItemResult:
    """Call `work`, which runs `item`, and return its result or its failure."""
    start_s = time.perf_counter()
    failure, disk_full, is_lost, value = "", False, False, None
    try:
        value = work()
    except LightpaintError as error:
        failure, disk_full = with_manifest_keys(str(error)), is_disk_full(error)
    except MemoryError:
        failure, is_lost = OUT_OF_MEMORY_TEXT, True
    except OSError as error:
        failure, disk_full = first_line(error), error.errno in DISK_FULL_ERRNOS
    except Exception as error:  # a bug here or in a library: the other items go on
        failure = f"{type(error).__name__}: {first_line(error)}"
    spent_s = time.perf_counter() - start_s
    failure = one_line(failure, limit=MAX_REASON_LENGTH)
    return ItemResult(item.name, item.kind, failure, disk_full, is_lost, spent_s, value=value)


def _run(item: WorkItem, cache: WorkerCache, listen: Listener) -> Any:
    """Run an item; return its value, or None if it writes files instead."""
    if isinstance(item, GuideTraining):
        cache.release_renderer()
        return train_guide(cache.film(item.film), item.seed)
    if isinstance(item, PartOfBasis):
        return cache.renderer(item).render(item.part)
    if isinstance(item, SumsOfRows):
        return sums_of_rows(item, cache)
    if isinstance(item, SharedPlacing):
        cache.release_renderer()
        return find_shared_places(item, cache, listen)
    if isinstance(item, Passes):
        return cache.frame(item).sum(range(item.first, item.last))
    cache.release_renderer()
    assert isinstance(item, Task)
    cache.keep_only(item.bases)
    runners = {"answer": _answer, "render": final_render, "export": _export}
    return runners[item.kind](item, cache, listen)


def is_disk_full(error: BaseException) -> bool:
    """Return whether a full disk caused an error."""
    return any(isinstance(x, OSError) and x.errno in DISK_FULL_ERRNOS for x in _causes(error))


def _causes(error: BaseException | None) -> Iterator[BaseException]:
    while error is not None:
        yield error
        error = error.__cause__ or error.__context__


def job_fields(task: Task, cache: WorkerCache) -> dict[str, Any]:
    """Return the fields of the task's job, with scenes and basis shared."""
    fields = decode_job(task.job)
    fields["scenes"] = tuple(map(cache.scene, fields["scenes"]))
    if isinstance(fields["basis"], BasisFile | GroupsFile):
        fields["basis"] = cache.source(fields["basis"])
    return fields


def _answer(task: Task, cache: WorkerCache, listen: Listener) -> None:
    fields = job_fields(task, cache)
    former_look_files = task.former_look_files or ("",) * len(task.bases)
    for key, file, former_look_file in zip(task.bases, task.files, former_look_files, strict=True):
        cache.load(key, file, former_look_file)
    if task.lightings:
        _derive_answer(task, fields, cache)
        return
    job = Job(**fields)
    bases = None
    if job.basis is None:
        bases = [basis for key in task.bases if (basis := cache.basis(key)) is not None]
    if task.is_by_sums:
        answer_by_sums(job, job.views[0].basis or (bases or [])[0])
        return
    run(job, listen, bases=bases)


def _derive_answer(task: Task, fields: dict[str, Any], cache: WorkerCache) -> None:
    """Write an answer derived from others: a lighting unchanged, warmer, or between two."""
    settings: Settings = fields["settings"]
    scenes: list[Scene] = [file.content for file in fields["scenes"]]
    source = content(fields["basis"])
    groups = source if isinstance(source, LightGroups) else None
    bases: list[Basis] = [source if groups is None else groups.basis]
    if source is None:
        bases = [basis for key in task.bases if (basis := cache.basis(key)) is not None]
    lighting = derive_lighting(task.lightings, bases[0], share=task.share, space=task.space)
    if task.mireds:
        lighting = shift(lighting, task.mireds, dimmer_lights(bases[0]))
    lighting = replace(lighting.for_target(task.look), cd_per_unit=settings.cd_per_unit)
    views = view_names(scenes) if fields["by_sensor"] else [""]
    scene = scenes[0] if scenes else None
    options: dict[str, Any] = {"views": views, "groups": groups}
    results = derived_folder(
        fields["folder"], scene, task.lightings, **options, force=settings.force
    )
    publish_derived(results, lighting, bases, **options, scene=scene, spp=settings.spp)


def derive_lighting(
    files: tuple[str, ...], basis: Basis, *, share: float, space: Space
) -> Lighting:
    """Return the lighting of one file, or a mix of two files' lightings. Raises LightingError."""
    lightings = [read_lighting(file) for file in files]
    lighting = lightings[0] if len(lightings) == 1 else interpolate(lightings, share, space=space)
    lighting.weights_for(basis)
    return lighting


def final_render(
    task: Task,
    cache: WorkerCache,
    listen: Listener,
    render: Callable[[Scene], Estimate] | None = None,
) -> None:
    """Render an answered look, once for each view.

    render: renders a scene elsewhere, instead of in this process, if given.
    """
    fields = job_fields(task, cache)
    [lighting] = map(Path, task.lightings)
    scenes: list[Scene] = [file.content for file in fields["scenes"]]
    views = view_names(scenes) if fields["by_sensor"] else [""]
    force = fields["settings"].force
    results = relit_folder(scenes[0], lighting, fields["folder"], views=views, force=force)
    options: dict[str, Any] = {"spp": task.final.spp, "seed": task.final.seed}
    options["resolution"] = task.final.resolution
    relight_look(
        dict(zip(views, scenes, strict=True)),
        read_lighting(lighting),
        results,
        progress=listen,
        render_elsewhere=render,
        **options,
    )


def _export(task: Task, cache: WorkerCache, listen: Listener) -> None:
    """Write an answered look's exports for other programs."""
    fields = job_fields(task, cache)
    lighting, folder = Path(task.lightings[0]), fields["folder"] / EXPORT
    basis_source = fields["basis"]
    source = Source(
        fields["scenes"][0].content if fields["scenes"] else None,
        basis_source.content if isinstance(basis_source, GroupsFile) else None,
        Path(task.handover.stage) if task.handover.stage else None,
    )
    names = names_of_forms(task.handover.to, source)
    answer = read_lighting(lighting)
    writers, remark = writers_of(names, answer, source, folder, listen)
    files, input_files = tuple(folder / name for name in writers), (lighting, *source.files)
    force = fields["settings"].force
    results = ResultFolder(folder, files, input_files, (lighting,), force=force)
    results.check()
    if remark:
        listen.say(remark)
    with results.filled() as stage:
        for name, make in writers.items():
            write_content(stage / name, make())
