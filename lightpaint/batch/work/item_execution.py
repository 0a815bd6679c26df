"""The work that an item stands for: computing its value, or writing its files."""

import errno
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from lightpaint import pipeline
from lightpaint.basis import Basis, LightGroups, Lights
from lightpaint.basis.render import basis_of_sums, train_guide
from lightpaint.batch.manifest.keys import Space, as_key, shift
from lightpaint.batch.manifest.sequence import interpolate
from lightpaint.batch.work import derived_looks, work_items
from lightpaint.batch.work.worker_storage import WorkerCache
from lightpaint.errors import LightpaintError
from lightpaint.files import first_line, one_line
from lightpaint.images import Estimate
from lightpaint.lighting import (
    Fit,
    Lighting,
    Problem,
    Sums,
    answer_as_multiplied,
    read_lighting,
    solution_of,
    solve_squares,
    sum_rows,
    summed_problem,
)
from lightpaint.placement import record_of
from lightpaint.progress import Listener
from lightpaint.relit import Source, names_of_forms, write_content, writers_of
from lightpaint.scene import Scene

#: Error numbers of a full disk.
DISK_FULL_ERRNOS = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}

#: Longest text of a failure, in characters.
MAX_REASON_LENGTH = 600

#: Text of the failure of an item that needs too much memory.
OUT_OF_MEMORY_TEXT = (
    "it takes more memory than there is: lower settings.resolution, or use fewer workers"
)


def run_item(
    item: work_items.WorkItem, cache: WorkerCache, listen: Listener
) -> work_items.ItemResult:
    """Run one item; an error becomes the failure of this item alone, in one line."""
    return attempt(item, lambda: _run(item, cache, listen))


def attempt(item: work_items.WorkItem, work: Callable[[], Any]) -> work_items.ItemResult:
    """Call `work`, which runs `item`, and return its result or its failure."""
    start_s = time.perf_counter()
    failure, disk_full, is_lost, value = "", False, False, None
    try:
        value = work()
    except LightpaintError as error:
        failure, disk_full = error.sentence.spelled(as_key), is_disk_full(error)
    except MemoryError:
        failure, is_lost = OUT_OF_MEMORY_TEXT, True
    except OSError as error:
        failure, disk_full = first_line(error), error.errno in DISK_FULL_ERRNOS
    except Exception as error:  # a bug here or in a library: the other items go on
        failure = f"{type(error).__name__}: {first_line(error)}"
    spent_s = time.perf_counter() - start_s
    failure = one_line(failure, limit=MAX_REASON_LENGTH)
    return work_items.ItemResult(
        item.name, item.kind, failure, disk_full, is_lost, spent_s, value=value
    )


def _run(item: work_items.WorkItem, cache: WorkerCache, listen: Listener) -> Any:
    """Run an item; return its value, or None if it writes files instead."""
    if isinstance(item, work_items.GuideTraining):
        cache.release_renderer()
        return train_guide(cache.film(item.film), item.seed)
    if isinstance(item, work_items.PartOfBasis):
        return cache.renderer(item).render(item.part)
    if isinstance(item, work_items.SumsOfRows):
        return _sums_of_rows(item, cache)
    if isinstance(item, SharedPlacing):
        cache.release_renderer()
        return _find_shared_places(item, cache, listen)
    if isinstance(item, work_items.Passes):
        return cache.frame(item).sum(range(item.first, item.last))
    cache.release_renderer()
    assert isinstance(item, work_items.Task)
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


def job_fields(task: work_items.Task, cache: WorkerCache) -> dict[str, Any]:
    """Return the fields of the task's job, with scenes and basis shared."""
    fields = pipeline.decode_job(task.job)
    fields["scenes"] = tuple(map(cache.scene, fields["scenes"]))
    if isinstance(fields["basis"], pipeline.BasisFile | pipeline.GroupsFile):
        fields["basis"] = cache.source(fields["basis"])
    return fields


def _answer(task: work_items.Task, cache: WorkerCache, listen: Listener) -> None:
    fields = job_fields(task, cache)
    former_look_files = task.former_look_files or ("",) * len(task.bases)
    for key, file, former_look_file in zip(task.bases, task.files, former_look_files, strict=True):
        cache.load(key, file, former_look_file)
    if task.lightings:
        _derive_answer(task, fields, cache, listen)
        return
    job = pipeline.Job(**fields)
    bases = None
    if job.basis is None:
        bases = [basis for key in task.bases if (basis := cache.basis(key)) is not None]
    if task.is_by_sums:
        _answer_by_sums(job, job.views[0].basis or (bases or [])[0])
        return
    pipeline.run(job, listen, bases=bases)


def _derive_answer(
    task: work_items.Task, fields: dict[str, Any], cache: WorkerCache, listen: Listener
) -> None:
    """Write an answer derived from others: a lighting unchanged, warmer, or between two."""
    settings: pipeline.Settings = fields["settings"]
    scenes: list[Scene] = [file.content for file in fields["scenes"]]
    source = pipeline.content(fields["basis"])
    groups = source if isinstance(source, LightGroups) else None
    bases: list[Basis] = [source if groups is None else groups.basis]
    if source is None:
        bases = [basis for key in task.bases if (basis := cache.basis(key)) is not None]
    lighting = derive_lighting(task.lightings, bases[0], share=task.share, space=task.space)
    if task.mireds:
        lighting = shift(lighting, task.mireds, derived_looks.dimmer_lights(bases[0]))
    scale = settings.cd_per_unit or lighting.cd_per_unit
    lighting = replace(lighting.for_target(task.look), cd_per_unit=scale)
    views = pipeline.view_names(scenes) if fields["by_sensor"] else [""]
    scene = scenes[0] if scenes else None
    options: dict[str, Any] = {"views": views, "groups": groups}
    results = derived_looks.derived_folder(
        fields["folder"],
        scene,
        task.lightings,
        **options,
        planes=settings.planes,
        force=settings.force,
    )
    options["planes"] = derived_looks.measure_derived(
        scene, lighting, fields["constraints"], settings, listen
    )
    derived_looks.publish_derived(
        results, lighting, bases, **options, scene=scene, spp=settings.spp
    )


def derive_lighting(
    files: tuple[str, ...], basis: Basis, *, share: float, space: Space
) -> Lighting:
    """Return the lighting of one file, or a mix of two files' lightings. Raises LightingError."""
    lightings = [read_lighting(file) for file in files]
    lighting = lightings[0] if len(lightings) == 1 else interpolate(lightings, share, space=space)
    lighting.weights_for(basis)
    return lighting


def final_render(
    task: work_items.Task,
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
    views = pipeline.view_names(scenes) if fields["by_sensor"] else [""]
    force = fields["settings"].force
    results = pipeline.relit_folder(scenes[0], lighting, fields["folder"], views=views, force=force)
    options: dict[str, Any] = {"spp": task.final.spp, "seed": task.final.seed}
    options["resolution"] = task.final.resolution
    pipeline.relight_look(
        dict(zip(views, scenes, strict=True)),
        read_lighting(lighting),
        results,
        progress=listen,
        render_elsewhere=render,
        **options,
    )


def _export(task: work_items.Task, cache: WorkerCache, listen: Listener) -> None:
    """Write an answered look's exports for other programs."""
    fields = job_fields(task, cache)
    lighting, folder = Path(task.lightings[0]), fields["folder"] / work_items.EXPORT
    basis_source = fields["basis"]
    source = Source(
        fields["scenes"][0].content if fields["scenes"] else None,
        basis_source.content if isinstance(basis_source, pipeline.GroupsFile) else None,
        Path(task.handover.stage) if task.handover.stage else None,
    )
    names = names_of_forms(task.handover.to, source)
    answer = read_lighting(lighting)
    writers, remark = writers_of(names, answer, source, folder, listen)
    files, input_files = tuple(folder / name for name in writers), (lighting, *source.files)
    force = fields["settings"].force
    results = pipeline.ResultFolder(folder, files, input_files, (lighting,), force=force)
    results.check()
    if remark:
        listen.say(remark)
    with results.filled() as stage:
        for name, make in writers.items():
            write_content(stage / name, make())


def _sums_of_rows(item: work_items.SumsOfRows, cache: WorkerCache) -> list[Sums]:
    """Return the sums with each painting over some rows.

    The images are those that a whole basis has in these rows, to the last bit.
    """
    renderer, scene = cache.renderer(item), cache.film(item.film)
    part = item.part
    halves, is_hit = renderer.render(part)
    is_hit = is_hit.sum(axis=0) > 0
    basis = basis_of_sums(scene, item.seed, list(halves), is_hit, part.spp, None, start=None)
    rows = slice(part.top, part.bottom)
    return [
        sum_rows(basis, cache.target(request, scene.size), rows, Fit(emitters=request.emitters))
        for request in item.paintings
    ]


def _answer_by_sums(job: pipeline.Job, basis: Basis) -> None:
    """Solve with the sums of a basis in memory, and write the lighting."""
    [view] = job.views
    basis = basis if view.scene is None else basis.with_requests(view.scene.requests)
    if not basis.knows_noise:
        # Only pixels show which differences are rounding alone (see lighting/problem.py).
        problem = Problem.of(basis, view.target, constraints=job.all_constraints, fit=job.fit)
        _publish_lighting_only(job, answer_as_multiplied(solution_of(problem)).lighting)
        return
    sums = sum_rows(basis, view.target, slice(None), job.fit)
    origin = basis.origin
    publish_solved_lights(
        job, basis.lights, sums, scene_identity=origin.scene_identity, spp=origin.spp
    )


def publish_solved_lights(
    job: pipeline.Job, lights: Lights, sums: Sums, *, scene_identity: str, spp: int
) -> None:
    """Solve, and write the lighting. The other parameters are as in `summed_problem`."""
    problem = summed_problem(
        lights,
        job.views[0].target.name,
        sums,
        constraints=job.all_constraints,
        fit=job.fit,
        scene_identity=scene_identity,
        spp=spp,
    )
    _publish_lighting_only(job, solve_squares(problem, problem.start).lighting)


def _publish_lighting_only(job: pipeline.Job, lighting: Lighting) -> None:
    """Write the lighting and the relit scene."""
    [view] = job.views
    with pipeline.new_answer(job.results, lighting, scene=view.scene):
        pass  # there are no pictures


@dataclass(frozen=True)
class SharedPlacing:
    """An item that searches for places; its value is the record as text.

    tasks: answers of the looks whose paintings decide. bases: keys of the bases of all their views;
    files: where these are saved, "" if they are in memory. fingerprint: of the group.
    """

    name: str
    tasks: tuple[work_items.Task, ...]
    bases: tuple[str, ...]
    files: tuple[str, ...]
    fingerprint: str
    expected_s: float
    kind: Literal["places"] = "places"
    output_folder: str = ""

    @property
    def input_files(self) -> tuple[str, ...]:
        """Files of the scene and of the paintings."""
        return tuple(dict.fromkeys(file for task in self.tasks for file in task.source_files))

    @property
    def local_files(self) -> tuple[str, ...]:
        """Saved bases."""
        return tuple(file for file in self.files if file)


def _find_shared_places(item: SharedPlacing, cache: WorkerCache, listen: Listener) -> str:
    """Return the record of the places that all looks of an item want."""
    for key, file in zip(item.bases, item.files, strict=True):
        cache.load(key, file)
    bases = [basis for key in item.bases if (basis := cache.basis(key)) is not None]
    jobs = [pipeline.Job(**_unplaced_fields(task, cache)) for task in item.tasks]
    placement = pipeline.find_places(jobs, bases, listen)
    looks: Sequence[str] = [task.look for task in item.tasks]
    looks = looks if len(looks) > 1 else ()
    return record_of(placement, looks=looks, made_of=item.fingerprint).to_json()


def _unplaced_fields(task: work_items.Task, cache: WorkerCache) -> dict[str, Any]:
    """Return the fields of a look's job, whose lights are where the scene has them."""
    fields = pipeline.decode_job(task.job)
    return fields | {"scenes": tuple(map(cache.scene, fields["scenes"])), "placement": None}
