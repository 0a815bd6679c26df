"""Looks of which the lighting alone is wanted: workers send sums, and nobody has the basis."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from lightpaint.basis.render.parts import Part, plan_parts
from lightpaint.basis.render.render import basis_lights
from lightpaint.batch.plan.cost_estimate import rendered_s
from lightpaint.batch.work.basis_parts import lesson_by
from lightpaint.batch.work.engine import Engine
from lightpaint.batch.work.spool import Spool
from lightpaint.batch.work.sums_answer import leave_lights
from lightpaint.batch.work.task import Task
from lightpaint.batch.work.work import attempted, fields_of
from lightpaint.batch.work.work_items import Done, PaintingOfSums, SceneFilm, SumsOfRows
from lightpaint.batch.work.worker_cache import WorkerCache
from lightpaint.errors import BasisError
from lightpaint.lighting.problem_sums import Sums
from lightpaint.pipeline.job import Job
from lightpaint.pipeline.sources import Painting
from lightpaint.progress import Listener
from lightpaint.scene.presets import samples


def solved_by_sums(
    tasks: Sequence[Task], engine: Engine, held: WorkerCache, listen: Listener
) -> list[Done]:
    """Do looks that share one basis, of which nothing but the lighting is wanted."""
    jobs: list[Job] = []
    done: list[Done] = []

    def born(task: Task) -> Callable[[], None]:
        return lambda: jobs.append(Job(**fields_of(task, held)))

    able = []
    for task in tasks:
        if (its := attempted(task, born(task))).failure:
            done.append(its)
        else:
            able.append(task)
    if not able:
        return done
    sums: list[Sums] = []
    came = attempted(able[0], lambda: sums.extend(_rendered(able[0], jobs, engine, held, listen)))
    for k, task in enumerate(able):
        if came.failure:
            done.append(replace(came, look=task.look))
            continue
        done.append(attempted(task, lambda job=jobs[k], its=sums[k]: _write(job, its)))  # type: ignore[misc]
    return done


def _rendered(
    task: Task, jobs: Sequence[Job], engine: Engine, held: WorkerCache, listen: Listener
) -> list[Sums]:
    """The sums of each job's problem, over all rows in their order."""
    scene, settings = jobs[0].views[0].scene, jobs[0].settings
    assert scene is not None
    asked = samples(settings.quality, spp=settings.spp, time_s=settings.time_s)
    spp = scene.spp if asked is None else asked
    parts = plan_parts(scene, spp)
    file = replace(fields_of(task, held)["scenes"][0])
    film = SceneFilm(file, settings.quality, settings.resolution, tuple(map(str, scene.read_files)))
    spool = Spool(scene, parts, seed=settings.seed, start=None)
    lesson_by(engine, film, scene, spp, settings.seed, None, spool)
    paintings = tuple(
        PaintingOfSums(_file_of(job), job.fit.emitters, job.settings.resize) for job in jobs
    )
    reads = tuple(dict.fromkeys(str(x) for job in jobs for x in job.views[0].target.files))
    tiles: dict[tuple[int, int], list[Part]] = {}
    for part in sorted(parts, key=lambda part: (part.top, part.half, part.first)):
        tiles.setdefault((part.top, part.bottom), []).append(part)
    errands = []
    for k, ((top, bottom), its) in enumerate(tiles.items()):
        pixels = (bottom - top) * scene.size[1]
        expected_s = rendered_s(pixels * sum(part.spp for part in its), len(scene.lights))
        how: dict[str, Any] = {"film": film, "parts": tuple(its), "seed": settings.seed}
        how |= {"learned": str(spool.learned), "paintings": paintings, "files": reads}
        errands.append(SumsOfRows(f"rows {k}", expected_s=expected_s, **how))
    came: dict[str, list[Sums]] = {}
    added: list[Sums] = []
    following = iter(errands)
    errand = next(following, None)
    listen("basis", 0, len(errands), "ranges of rows")
    for count, done in enumerate(engine.run(errands)):
        if done.failure:
            raise BasisError(done.failure)
        came[done.look] = done.value
        listen("basis", count + 1, len(errands), "ranges of rows")
        # In the order of the rows, whatever order they come in.
        while errand is not None and errand.name in came:
            more = came.pop(errand.name)
            added = [a + b for a, b in zip(added, more, strict=True)] if added else more
            errand = next(following, None)
    spool.drop()
    return added


def _write(job: Job, sums: Sums) -> None:
    """Solve, and write the lighting, and the scene that has it."""
    scene = job.views[0].scene
    assert scene is not None
    asked = samples(job.settings.quality, spp=job.settings.spp, time_s=None)
    half = -(-(scene.spp if asked is None else asked) // 2)
    leave_lights(job, basis_lights(scene), sums, scene_identity=scene.identity, spp=2 * half)


def _file_of(job: Job) -> Painting:
    """The painting, not read yet."""
    [painting] = job.targets
    assert isinstance(painting, Painting)
    return painting.unread()
