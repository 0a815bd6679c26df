"""Looks that need only a lighting: workers send sums, and no process stores the basis."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from lightpaint.basis.render.render_origin import basis_lights
from lightpaint.basis.render.render_parts import plan_parts
from lightpaint.batch.distribution.basis_parts import obtain_guide_table
from lightpaint.batch.distribution.engine import Engine
from lightpaint.batch.work.item_execution import attempt, job_fields, publish_solved_lights
from lightpaint.batch.work.spool import Spool
from lightpaint.batch.work.task import Task
from lightpaint.batch.work.work_items import (
    ItemResult,
    PaintingOfSums,
    SceneFilm,
    SumsOfRows,
    render_seconds,
)
from lightpaint.batch.work.worker_cache import WorkerCache
from lightpaint.errors import BasisError
from lightpaint.lighting.linear_problem import Sums
from lightpaint.pipeline.job.job import Job
from lightpaint.pipeline.job.sources import Painting
from lightpaint.progress import Listener
from lightpaint.scene.quality_presets import samples


def solve_by_sums(
    tasks: Sequence[Task], engine: Engine, cache: WorkerCache, listen: Listener
) -> list[ItemResult]:
    """Solve looks that share one basis and request nothing but the lighting."""
    jobs: list[Job] = []
    outcomes: list[ItemResult] = []

    def make_job(task: Task) -> Callable[[], None]:
        return lambda: jobs.append(Job(**job_fields(task, cache)))

    runnable = []
    for task in tasks:
        if (outcome := attempt(task, make_job(task))).failure:
            outcomes.append(outcome)
        else:
            runnable.append(task)
    if not runnable:
        return outcomes
    sums: list[Sums] = []
    results = attempt(
        runnable[0], lambda: sums.extend(_render_sums(runnable[0], jobs, engine, cache, listen))
    )
    for k, task in enumerate(runnable):
        if results.failure:
            outcomes.append(replace(results, look=task.look))
            continue
        outcomes.append(attempt(task, partial(_solve_and_write, jobs[k], sums[k])))
    return outcomes


def _render_sums(
    task: Task, jobs: Sequence[Job], engine: Engine, cache: WorkerCache, listen: Listener
) -> list[Sums]:
    """Return the sums of each job's problem over all rows, added in the order of the rows."""
    scene, settings = jobs[0].views[0].scene, jobs[0].settings
    assert scene is not None
    requested_spp = samples(settings.quality, spp=settings.spp, time_s=settings.time_s)
    spp = scene.spp if requested_spp is None else requested_spp
    parts = plan_parts(scene, spp)
    file = replace(job_fields(task, cache)["scenes"][0])
    film = SceneFilm(file, settings.quality, settings.resolution, tuple(map(str, scene.read_files)))
    spool = Spool(scene, parts, seed=settings.seed, start=None)
    obtain_guide_table(engine, film, scene, settings.seed, None, spool)
    paintings = tuple(
        PaintingOfSums(_file_of(job), job.fit.emitters, job.settings.resize) for job in jobs
    )
    source_files = tuple(dict.fromkeys(str(x) for job in jobs for x in job.views[0].target.files))
    items = []
    for k, part in enumerate(parts):
        pixels = (part.bottom - part.top) * scene.size[1]
        expected_s = render_seconds(2 * pixels * part.spp, len(scene.lights))
        options: dict[str, Any] = {"film": film, "part": part, "seed": settings.seed}
        options |= {
            "guide_file": str(spool.guide_file),
            "paintings": paintings,
            "files": source_files,
        }
        items.append(SumsOfRows(f"rows {k}", expected_s=expected_s, **options))
    total = _add_in_order(items, engine, listen)
    spool.drop()
    return total


def _add_in_order(items: Sequence[SumsOfRows], engine: Engine, listen: Listener) -> list[Sums]:
    """Run items; return the sums of all rows. Raises BasisError if an item failed."""
    results: dict[str, list[Sums]] = {}
    total: list[Sums] = []
    remaining_items = iter(items)
    item = next(remaining_items, None)
    listen("basis", 0, len(items), "ranges of rows")
    for count, result in enumerate(engine.run(items)):
        if result.failure:
            raise BasisError(result.failure)
        results[result.look] = result.value
        listen("basis", count + 1, len(items), "ranges of rows")
        # Add in the order of the rows, whatever order they arrive in.
        while item is not None and item.name in results:
            next_sums = results.pop(item.name)
            total = [a + b for a, b in zip(total, next_sums, strict=True)] if total else next_sums
            item = next(remaining_items, None)
    return total


def _solve_and_write(job: Job, sums: Sums) -> None:
    """Solve a job from its sums, and write the lighting and the relit scene."""
    scene = job.views[0].scene
    assert scene is not None
    requested_spp = samples(job.settings.quality, spp=job.settings.spp, time_s=None)
    half = -(-(scene.spp if requested_spp is None else requested_spp) // 2)
    publish_solved_lights(
        job, basis_lights(scene), sums, scene_identity=scene.identity, spp=2 * half
    )


def _file_of(job: Job) -> Painting:
    """Return the job's painting, not yet read."""
    [painting] = job.targets
    assert isinstance(painting, Painting)
    return painting.without_content()
