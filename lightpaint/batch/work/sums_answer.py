"""Answers of which only the lighting is wanted, solved from sums."""

from dataclasses import replace

from lightpaint.basis.basis import Basis
from lightpaint.basis.lights import Lights
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.lighting.linear_solve import solve_linear
from lightpaint.lighting.problem import Problem
from lightpaint.lighting.problem_sums import Sums, problem_of_sums, sums_of
from lightpaint.lighting.solve import solution_of
from lightpaint.pipeline.answer_folder import new_answer
from lightpaint.pipeline.job import Job


def answer_by_sums(job: Job, basis: Basis) -> None:
    """Solve with a basis in memory, of which only sums are used."""
    [view] = job.views
    basis = basis if view.scene is None else basis.with_requests(view.scene.requests)
    if not basis.knows_noise:
        # Only pixels tell what rounding alone has made (see lighting/round_off.py).
        problem = Problem.of(basis, view.target, constraints=job.asked, fit=job.fit)
        write_lighting_only(job, solution_of(problem).lighting)
        return
    sums = sums_of(basis, view.target, slice(None), job.fit)
    origin = basis.origin
    write_solved_lights(
        job, basis.lights, sums, scene_identity=origin.scene_identity, spp=origin.spp
    )


def write_solved_lights(
    job: Job, lights: Lights, sums: Sums, *, scene_identity: str, spp: int
) -> None:
    """Solve, and write the lighting. Other parameters are those of `problem_of_sums`."""
    problem = problem_of_sums(
        lights,
        job.views[0].target.name,
        sums,
        constraints=job.asked,
        fit=job.fit,
        scene_identity=scene_identity,
        spp=spp,
    )
    write_lighting_only(job, solve_linear(problem, problem.start).lighting)


def write_lighting_only(job: Job, lighting: Lighting) -> None:
    """Write the lighting, and the scene that has it."""
    [view] = job.views
    lighting = replace(lighting, cd_per_unit=job.settings.cd_per_unit)
    with new_answer(job.results, lighting, scene=view.scene):
        pass  # no pictures of it
