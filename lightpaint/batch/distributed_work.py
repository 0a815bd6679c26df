"""Work that an engine's workers share: bases, sums of looks that need only a lighting, and final
renders.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.basis import Basis
from lightpaint.basis.render import (
    ONE_PASS,
    Part,
    PartSums,
    basis_lights,
    check_memory,
    check_size,
    method_of,
    plan_parts,
    render_basis,
    renders_in_bands,
    training_samples,
    with_first_hits,
)
from lightpaint.batch.engine import Engine
from lightpaint.batch.work import work_items
from lightpaint.batch.work.item_execution import attempt, job_fields, publish_solved_lights
from lightpaint.batch.work.worker_storage import Spool, WorkerCache
from lightpaint.errors import BasisError, SceneError
from lightpaint.images import Estimate
from lightpaint.lighting import Sums
from lightpaint.pipeline import Job, Painting, SceneFile
from lightpaint.progress import Listener, Progress
from lightpaint.scene import Scene, estimate_of, passes_of, ranges_of
from lightpaint.scene.quality_presets import samples


class PartwiseRender:
    """A `render_basis` for `obtain_basis` that renders one film by an engine."""

    def __init__(self, engine: Engine, film: work_items.SceneFilm) -> None:
        self._engine = engine
        self._film = film.without_content()

    def __call__(
        self,
        scene: Scene,
        *,
        spp: int | None,
        time_s: float | None,
        seed: int,
        start: Basis | None = None,
        progress: Progress,
        **options: Any,
    ) -> Basis:
        """Render as `render_basis` does. This process alone spends and measures a time budget."""
        if time_s is not None:
            budget_options: dict[str, Any] = {
                "time_s": time_s,
                "seed": seed,
                "progress": progress,
                **options,
            }
            return render_basis(scene, start=start, **budget_options)
        spp = scene.spp if spp is None else spp
        if start is not None and start.origin.spp >= spp:
            return with_first_hits(start.with_requests(scene.requests), scene, seed)
        if start is not None and start.origin.method != method_of(scene):
            start = None
        if start is not None and start.sums is not None and method_of(scene) == ONE_PASS:
            # Adding whole parts to earlier sums changes the last bits, compared with one render.
            # That is acceptable only for a finished basis, which was rounded anyway.
            start = None
        check_size(scene)
        check_memory(scene, in_bands=renders_in_bands(scene, start))
        parts = plan_parts(scene, spp, start=start)
        spool = Spool(scene, parts, seed=seed, start=start)
        film = self._film_of(scene)
        guide_table = _obtain_guide_table(self._engine, film, scene, seed, start, spool)
        sums = PartSums(scene, parts, seed=seed, start=start)
        self._add_all(scene, parts, sums, seed, spool, progress)
        basis = sums.basis(guide_table)
        spool.drop()
        return basis

    def _film_of(self, scene: Scene) -> work_items.SceneFilm:
        """Return the film of `scene`, which may have only some of the lights."""
        return replace(self._film, light_names=scene.chosen)

    def _add_all(
        self,
        scene: Scene,
        parts: list[Part],
        sums: PartSums,
        seed: int,
        spool: Spool,
        progress: Progress,
    ) -> None:
        """Add all parts to `sums`: those that are cached, and those that the engine renders."""
        guide_file = str(spool.guide_file) if spool.guide_file.is_file() else ""
        missing = {}
        for k, part in enumerate(parts):
            cached = spool.part(part)
            if cached is not None:
                sums.add(part, *cached)
                continue
            pixels = (part.bottom - part.top) * scene.size[1]
            lights = len(scene.lights) if part.light is None else 1
            samples = pixels * part.spp * (2 if part.half is None else 1)
            expected_s = work_items.render_seconds(samples, lights)
            item = work_items.PartOfBasis(
                f"part {k}", self._film_of(scene), part, seed, guide_file, expected_s
            )
            missing[item.name] = item
        progress("basis", len(parts) - len(missing), len(parts), "parts")
        for count, result in enumerate(self._engine.run(list(missing.values()))):
            if result.failure:
                raise BasisError(result.failure)
            part, (planes, first_hits) = missing[result.look].part, result.value
            spool.keep_part(part, planes, first_hits)
            sums.add(part, planes, first_hits)
            progress("basis", len(parts) - len(missing) + count + 1, len(parts), "parts")


def _obtain_guide_table(
    engine: Engine,
    film: work_items.SceneFilm,
    scene: Scene,
    seed: int,
    start: Basis | None,
    spool: Spool,
) -> Floats | None:
    """Return the guide's table by which parts choose emitters, and store it in the spool.

    None where parts do without, as in separate renders.
    """
    if method_of(scene) != ONE_PASS:
        return None
    table = spool.guide_table() if start is None else start.guide_table
    if table is None:
        expected_s = work_items.render_seconds(sum(training_samples(scene)), len(scene.lights))
        [result] = engine.run([work_items.GuideTraining("training", film, seed, expected_s)])
        if result.failure:
            raise BasisError(result.failure)
        table = result.value
        assert table is not None
    if not spool.guide_file.is_file():
        spool.keep_guide_table(table)
    return table


def solve_by_sums(
    tasks: Sequence[work_items.Task], engine: Engine, cache: WorkerCache, listen: Listener
) -> list[work_items.ItemResult]:
    """Solve looks that share one basis and request nothing but the lighting."""
    jobs: list[Job] = []
    outcomes: list[work_items.ItemResult] = []

    def make_job(task: work_items.Task) -> Callable[[], None]:
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
    task: work_items.Task, jobs: Sequence[Job], engine: Engine, cache: WorkerCache, listen: Listener
) -> list[Sums]:
    """Return the sums of each job's problem over all rows, added in the order of the rows."""
    scene, settings = jobs[0].views[0].scene, jobs[0].settings
    assert scene is not None
    requested_spp = samples(settings.quality, spp=settings.spp, time_s=settings.time_s)
    spp = scene.spp if requested_spp is None else requested_spp
    parts = plan_parts(scene, spp)
    file = replace(job_fields(task, cache)["scenes"][0])
    film = work_items.SceneFilm(
        file, settings.quality, settings.resolution, tuple(map(str, file.read_files))
    )
    spool = Spool(scene, parts, seed=settings.seed, start=None)
    _obtain_guide_table(engine, film, scene, settings.seed, None, spool)
    paintings = tuple(
        work_items.PaintingOfSums(_file_of(job), job.fit.emitters, job.settings.resize)
        for job in jobs
    )
    source_files = tuple(dict.fromkeys(str(x) for job in jobs for x in job.views[0].target.files))
    items = []
    for k, part in enumerate(parts):
        pixels = (part.bottom - part.top) * scene.size[1]
        expected_s = work_items.render_seconds(2 * pixels * part.spp, len(scene.lights))
        options: dict[str, Any] = {"film": film, "part": part, "seed": settings.seed}
        options |= {
            "guide_file": str(spool.guide_file),
            "paintings": paintings,
            "files": source_files,
        }
        items.append(work_items.SumsOfRows(f"rows {k}", expected_s=expected_s, **options))
    total = _add_in_order(items, engine, listen)
    spool.drop()
    return total


def _add_in_order(
    items: Sequence[work_items.SumsOfRows], engine: Engine, listen: Listener
) -> list[Sums]:
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


def distributed_renderer(
    engine: Engine, task: work_items.Task, variant: str | None, listen: Listener
) -> Callable[[Scene], Estimate]:
    """Return a function that renders a look's relit scene by `engine`, in ranges of passes.

    variant: Mitsuba variant of the look's scene.
    """

    def render(relit: Scene) -> Estimate:
        # The answer has written this scene; writing it again gives the same file.
        path = str(Path(task.output_folder) / "relit.xml")
        scene = SceneFile(
            path,
            relit.sensor,
            parameters=dict(relit.parameters),
            variant=variant,
            use_lights_file=False,
            lamps=("*",),
        )
        files = tuple(map(str, scene.content.read_files))
        height, width = relit.size
        passes = passes_of(relit, task.final.spp)
        items = []
        for range_ in ranges_of(relit, passes):
            samples = height * width * sum(passes[k][1] for k in range_)
            name, expected_s = f"{task.look} {range_.start}", samples * work_items.SAMPLE_S
            bounds = range_.start, range_.stop
            item = work_items.Passes(name, scene, task.final, *bounds, files, expected_s)
            items.append(replace(item, observer=relit.observer if relit.is_spectral else None))
        results = {}
        sums, next_item = np.zeros((2, height, width, 3), np.float64), 0
        for count, result in enumerate(engine.run(items)):
            if result.failure:
                raise SceneError(result.failure)
            results[result.look] = result.value
            while next_item < len(items) and items[next_item].name in results:
                for half, half_sum in results.pop(items[next_item].name).items():
                    sums[half] += half_sum
                next_item += 1
            listen("relit", count + 1, len(items), "ranges of passes")
        return estimate_of(sums, passes)

    return render
