"""Answers that are only a lighting: sums over rows, and the lighting solved from them."""

from dataclasses import replace

from lightpaint.basis.basis import Basis
from lightpaint.basis.lights import Lights
from lightpaint.basis.render.one_pass_basis import basis_of_sums
from lightpaint.batch.work.work_items import SumsOfRows
from lightpaint.batch.work.worker_cache import WorkerCache
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.lighting.fit import Fit
from lightpaint.lighting.linear_problem import Sums, sum_rows, summed_problem
from lightpaint.lighting.linear_solve import solve_linear
from lightpaint.lighting.problem import Problem
from lightpaint.lighting.solve import solution_of
from lightpaint.pipeline.job.job import Job
from lightpaint.pipeline.results.answer_folder import new_answer


def sums_of_rows(item: SumsOfRows, cache: WorkerCache) -> list[Sums]:
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


def answer_by_sums(job: Job, basis: Basis) -> None:
    """Solve with the sums of a basis in memory, and write the lighting."""
    [view] = job.views
    basis = basis if view.scene is None else basis.with_requests(view.scene.requests)
    if not basis.knows_noise:
        # Only pixels show which differences are rounding alone (see lighting/problem.py).
        problem = Problem.of(basis, view.target, constraints=job.all_constraints, fit=job.fit)
        publish_lighting_only(job, solution_of(problem).lighting)
        return
    sums = sum_rows(basis, view.target, slice(None), job.fit)
    origin = basis.origin
    publish_solved_lights(
        job, basis.lights, sums, scene_identity=origin.scene_identity, spp=origin.spp
    )


def publish_solved_lights(
    job: Job, lights: Lights, sums: Sums, *, scene_identity: str, spp: int
) -> None:
    """Solve, and write the lighting. The other parameters are those of `summed_problem`."""
    problem = summed_problem(
        lights,
        job.views[0].target.name,
        sums,
        constraints=job.all_constraints,
        fit=job.fit,
        scene_identity=scene_identity,
        spp=spp,
    )
    publish_lighting_only(job, solve_linear(problem, problem.start).lighting)


def publish_lighting_only(job: Job, lighting: Lighting) -> None:
    """Write the lighting and the relit scene."""
    [view] = job.views
    lighting = replace(lighting, cd_per_unit=job.settings.cd_per_unit)
    with new_answer(job.results, lighting, scene=view.scene):
        pass  # there are no pictures
