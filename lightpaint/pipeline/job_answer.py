"""The answer to a job: one lighting for all views, or one for each painted frame of a shot."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from lightpaint.arrays import as_rgb
from lightpaint.basis.basis import Basis
from lightpaint.lighting.analysis.analysis import Analysis, analyse, with_findings
from lightpaint.lighting.animated_solve import solve_frames
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.lighting.answer.lighting_keys import LightingKey
from lightpaint.lighting.problem import Problem
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.solve import solution_of
from lightpaint.pipeline.job.job import Job
from lightpaint.pipeline.needed_samples import problem_of, without_noise
from lightpaint.pipeline.results.answer_folder import with_places
from lightpaint.placement.placement import Placement
from lightpaint.progress import Listener
from lightpaint.relit.render_rounds import refine_by_rendering
from lightpaint.report.basis_memo import make_ahead
from lightpaint.report.page.page import prepare_page


@dataclass(frozen=True)
class JobAnswer:
    """An answer before it is written.

    solution: of all views together, or of the first frame if lights change. analyses: of each view.
    lighting: with what the analyses found.
    """

    solution: Solution
    analyses: tuple[Analysis, ...]
    lighting: Lighting


def answer_job(
    job: Job,
    bases: list[Basis],
    listen: Listener,
    *,
    placement: Placement | None = None,
) -> JobAnswer:
    """Solve a job and analyse its answer.

    bases: of its views; the list is emptied. placement: of lights whose places were searched for.
    """
    if job.settings.animate:
        return _animated_answer(job, bases, listen)
    problem = problem_of(job, bases)
    bases.clear()
    if job.settings.report:
        for basis in problem.views.bases:
            make_ahead(basis, prepare_page)
    solution = _reduce_noise(job, solution_of(problem), listen)
    del problem  # some of its arrays are as large as the pictures
    level_errors = () if placement is None else placement.level_errors
    analyses = analyse(solution, level_errors=level_errors)
    solution.problem.squares.release()
    return JobAnswer(solution, analyses, with_findings(solution, analyses).lighting)


def _reduce_noise(job: Job, solution: Solution, listen: Listener) -> Solution:
    """Return the solution corrected for noise and refined by rendering, as the settings ask."""
    settings, certificate = job.settings, solution.certificate
    listen.note(
        f"solved in {max(certificate.sweeps)} sweeps, to a KKT residual of "
        f"{max(certificate.kkt_residual):.1e}"
    )
    solution = without_noise(job, solution)
    pairs = zip((view.scene for view in job.views), solution.problem.views.bases, strict=True)
    scenes = [(scene, basis) for scene, basis in pairs if scene is not None]
    solution = refine_by_rendering(
        scenes, solution, rounds=settings.refine, seed=settings.seed, progress=listen
    )
    lighting = replace(solution.lighting, cd_per_unit=settings.cd_per_unit)
    lighting = with_places(lighting, job.views[0].scene)
    return replace(solution, lighting=lighting)


def _animated_answer(job: Job, bases: list[Basis], listen: Listener) -> JobAnswer:
    """Return the answer with a key for each painted frame."""
    problems = [
        Problem.of(basis, view.target, constraints=job.all_constraints, fit=job.fit)
        for basis, view in zip(bases, job.views, strict=True)
    ]
    bases.clear()
    solutions = solve_frames(problems, job.painted_frames)
    del problems
    sweeps = max(max(solution.certificate.sweeps) for solution in solutions)
    listen.note(f"{len(solutions)} frames solved, each in at most {sweeps} sweeps")
    analyses = tuple(analyse(solution)[0] for solution in solutions)
    lighting = with_findings(solutions[0], analyses[:1]).lighting
    return JobAnswer(solutions[0], analyses, _with_keys(lighting, job.painted_frames, solutions))


def _with_keys(
    lighting: Lighting, frames: Sequence[int], solutions: Sequence[Solution]
) -> Lighting:
    """Return the lighting of the first frame with a key for each."""
    keys = []
    for frame, solution in zip(frames, solutions, strict=True):
        weights = tuple(as_rgb(rgb) for rgb in solution.weights)
        keys.append(LightingKey(frame, weights, solution.problem.name))
    return replace(lighting, animation=tuple(keys))
