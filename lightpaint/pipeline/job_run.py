"""The pipeline: obtain bases → solve → improve → analyse → relight → predict, verify, report."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from lightpaint.arrays import as_rgb, release_freed_memory
from lightpaint.basis import Basis
from lightpaint.colour import daylight
from lightpaint.images import Estimate, write_estimate
from lightpaint.keywords import keywords
from lightpaint.lighting import (
    Analysis,
    Lighting,
    LightingKey,
    PlanesAnswer,
    Problem,
    Solution,
    SurfaceColor,
    analyse,
    answer_as_multiplied,
    answer_to_render,
    choose_mixes,
    default_answer,
    hold_to_current,
    solution_of,
    surface_colors,
    tie_frames,
    with_findings,
)
from lightpaint.pipeline import job_bases, result_folder
from lightpaint.pipeline.job.settings import Settings
from lightpaint.pipeline.job.solve_job import Job, PaintedView
from lightpaint.pipeline.look import Look, write_predicted, write_report
from lightpaint.pipeline.placed_lights import find_suns, place_lights, suggest_move
from lightpaint.pipeline.wished_planes import (
    MeasuredPlanes,
    answer_on_planes,
    planes_of_job,
    require,
)
from lightpaint.placement import MoveSuggestion, Placement, Suggestion, suggest_lights
from lightpaint.progress import Listener, Progress, listener, silent, spoken_duration, stage
from lightpaint.relit import (
    SPECTRAL_DOUBLINGS,
    LightShares,
    Verification,
    VerificationBudget,
    refine_by_rendering,
    verification_budget,
    verify,
    verify_in_stages,
    with_light_tests,
)
from lightpaint.report import answer_remarks, make_ahead, prepare_page
from lightpaint.scene import Scene, render_reflectances
from lightpaint.sentences import Hint, Sentence, Word

#: Advice on stages that every answer needs.
SOLVE_ADVICE = Sentence(
    ": a basis of fewer pixels takes less (", Hint("resolution", Word("1/2")), ")"
)


@keywords()
def run(job: Job, progress: Progress = silent, *, bases: list[Basis] | None = None) -> list[Look]:
    """Run `job`: find its lighting, verify it, and write results to its folder.

    Args:
        job: The job to run.
        progress: Receives progress and, if it is a `Listener`, remarks.
        bases: Bases of the views on their films, if an earlier run has obtained them; the list is
            emptied to save memory.

    Returns:
        A look for each view.

    Examples:
        >>> from pathlib import Path
        >>> job = lp.Job((), (lp.Painting("painting.exr"),), Path("evening"), basis)
        >>> [look] = lp.run(job)
        >>> np.round(look.lighting.emission["panel"], 2).tolist()
        [2.0, 1.5, 1.0]
    """
    listen = listener(progress)
    job.results.check()
    for remark in job.remarks:
        listen.say(remark)
    job, obtained, placement = place_lights(
        job, job_bases.obtain_bases_of(job, bases, listen), listen
    )
    job, obtained = find_suns(job, obtained, listen)
    if job.settings.error is not None:
        obtained = job_bases.add_needed_samples(job, obtained, listen)
    planes = planes_of_job(job, obtained[0].lights, listen)
    found = answer_job(job, obtained, listen, placement=placement, planes=planes)
    rig = _suggest(job, found, placement, listen)
    lighting, scene = found.lighting, job.views[0].scene
    with result_folder.new_answer(job.results, lighting, scene=scene, groups=job.groups) as answer:
        looks = [
            _finish_view(
                job, answer, view, analysis, rig, job_bases.view_listener(job, view, listen)
            )
            for view, analysis in zip(job.views, found.analyses, strict=True)
        ]
    return [_reloaded(look) for look in looks] if answer.has_moved_paths else looks


@dataclass(frozen=True)
class _RigFindings:
    """The places found for lights, suggestions of others, and what the answer gives on measuring
    planes; all views count in them.
    """

    placement: Placement | None
    planes: PlanesAnswer | None
    suggestions: tuple[Suggestion, ...] | None = None
    move: MoveSuggestion | None = None


@dataclass(frozen=True)
class JobAnswer:
    """An answer before it is written.

    solution: of all views together, or of the first frame if lights change. analyses: of each view.
    lighting: with what the analyses found. planes: what it gives on measuring planes, None without.
    """

    solution: Solution
    analyses: tuple[Analysis, ...]
    lighting: Lighting
    planes: PlanesAnswer | None = None


def answer_job(
    job: Job,
    bases: list[Basis],
    listen: Listener,
    *,
    placement: Placement | None = None,
    planes: MeasuredPlanes | None = None,
) -> JobAnswer:
    """Solve a job and analyse its answer.

    bases: of its views; the list is emptied. placement: of lights whose places were searched for.
    planes: on which the answer has to give some illuminance.
    """
    if job.settings.animate:
        return _animated_answer(job, bases, listen)
    with stage("solving", listen, SOLVE_ADVICE):
        problem = job_bases.problem_of(job, bases)
        bases.clear()
        required = None if planes is None else require(problem, planes, job.settings, listen)
        problem = problem if required is None else required.problem
        release_freed_memory()
        if job.settings.report:
            for basis in problem.views.bases:
                make_ahead(basis, prepare_page)
        solution = solution_of(problem)
    solution = _finished(job, solution, listen)
    del problem  # some of its arrays are as large as the pictures
    release_freed_memory()
    level_errors = () if placement is None else placement.level_errors
    with stage("analysis", listen, SOLVE_ADVICE):
        analyses = analyse(
            solution, level_errors=level_errors, has_error_bars=job.settings.error_bars
        )
        on_planes = None
        if planes is not None and required is not None:
            on_planes = answer_on_planes(solution, planes, required)
        solution.problem.squares.release()
        release_freed_memory()  # by error bars, before the report needs as much
        lighting = with_findings(solution, analyses).lighting
        return JobAnswer(solution, analyses, lighting, on_planes)


def _finished(job: Job, solution: Solution, listen: Listener) -> Solution:
    """Return the solution corrected for noise and refined by rendering, as the settings ask, with
    the mixes that lamps prefer then.
    """
    settings, certificate = job.settings, solution.certificate
    listen.note(
        f"solved in {max(certificate.sweeps)} sweeps, to a KKT residual of "
        f"{max(certificate.kkt_residual):.1e}"
    )
    with stage("noise correction", listen, Sentence(" (", Hint("literal", True), " skips it)")):
        solution = job_bases.without_noise(job, solution)
    finish = partial(_finish_answer, job)
    with stage("render as painting", listen):
        solution = answer_to_render(answer_as_multiplied(solution), finish)
    solution = hold_to_current(solution, finish)
    for remark in answer_remarks(solution):
        listen.say(remark)
    pairs = zip((view.scene for view in job.views), solution.problem.views.bases, strict=True)
    scenes = [(scene, basis) for scene, basis in pairs if scene is not None]
    solution = refine_by_rendering(
        scenes, solution, rounds=settings.refine, seed=settings.seed, progress=listen
    )
    solution = choose_mixes(solution)
    lighting = result_folder.with_places(solution.lighting, job.views[0].scene)
    return replace(solution, lighting=lighting)


def _finish_answer(job: Job, solution: Solution) -> Solution:
    """Return an answer corrected for noise and for the primaries of a renderer."""
    return answer_as_multiplied(job_bases.without_noise(job, solution))


def _animated_answer(job: Job, bases: list[Basis], listen: Listener) -> JobAnswer:
    """Return the answer with a key for each painted frame."""
    problems = [
        Problem.of(basis, view.target, constraints=job.all_constraints, fit=job.fit)
        for basis, view in zip(bases, job.views, strict=True)
    ]
    bases.clear()
    with stage("solving", listen, SOLVE_ADVICE):
        solutions = tie_frames([default_answer(x) for x in problems], job.painted_frames)
    del problems
    sweeps = max(max(solution.certificate.sweeps) for solution in solutions)
    listen.note(f"{len(solutions)} frames solved, each in at most {sweeps} sweeps")
    with stage("analysis", listen, SOLVE_ADVICE):
        has_error_bars = job.settings.error_bars
        analyses = tuple(analyse(x, has_error_bars=has_error_bars)[0] for x in solutions)
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


def _reloaded(look: Look) -> Look:
    """Return `look` with its relit scene read again from disk."""
    assert look.relit is not None
    relit = result_folder.reload_relit(look.relit, look.relit.path, look.relit.sensor)
    return replace(look, relit=relit)


def _finish_view(
    job: Job,
    answer: result_folder.AnswerFolder,
    view: PaintedView,
    analysis: Analysis,
    rig: _RigFindings,
    listen: Listener,
) -> Look:
    """Predict, verify and report a view; return its look."""
    settings, scene, solution = job.settings, view.scene, analysis.solution
    basis = solution.basis
    listen.note("analysed, and the lighting written")
    folder = answer.path / view.folder.relative_to(job.folder)
    folder.mkdir(exist_ok=True)
    with stage("prediction", listen):
        predicted = basis.predict(solution.weights)
    verification, budget, relit = None, None, None
    if scene is not None:
        relit = answer.seen_through(scene.sensor)
        budget = _budget(settings, basis, relit)
        if view is job.views[0]:
            _remark_on_parameters(relit, listen)
            if rig.planes is not None and settings.planes is not None:
                origin, measured = (
                    f"{scene.path.name} lit by {result_folder.LIGHTING}",
                    rig.planes.wished,
                )
                lit, glare = rig.planes.weights_by_case, rig.planes.glare
                result_folder.write_planes(
                    answer.path, measured.illuminance, lit, origin, glare=glare
                )
    _write_prediction(folder, predicted, basis, budget, relit)
    if budget is not None and settings.verify:
        verification = _verify(settings, predicted, budget, solution, listen)
        write_estimate(folder / "verified.exr", verification.verified, {})
    look = Look(
        target=view.target,
        basis=basis,
        solution=solution,
        predicted=predicted,
        relit=None if relit is None else relit.relocated(answer.path, job.folder),
        verification=verification,
        analysis=analysis,
        suggestions=rig.suggestions,
        placement=rig.placement,
        move_suggestion=rig.move,
        planes=rig.planes,
        surfaces=_surface_colors(scene, solution),
        job_remarks=tuple(job.remarks),
    )
    # The files of the relit scene come to its final folder together with the report.
    with stage("report", listen, Sentence(" (", Hint("report", False), " skips it)")):
        write_report(folder, look, command=settings.command, relit=relit, is_shown=settings.report)
    listen.note("report written")
    for remark in look.remarks:
        listen.say(remark if len(job.views) == 1 else Sentence(f"{view.folder.name}: ", remark))
    return look


def _surface_colors(scene: Scene | None, solution: Solution) -> tuple[SurfaceColor, ...]:
    """Return the colours of objects under an answer that was found with spectra."""
    objects = solution.basis.objects
    if scene is None or not scene.is_spectral or objects is None:
        return ()
    return surface_colors(solution, render_reflectances(scene, objects), daylight())


def _write_prediction(
    folder: Path,
    predicted: Estimate,
    basis: Basis,
    budget: VerificationBudget | None,
    relit: Scene | None,
) -> None:
    """Write predicted.exr for a verification with this budget, or else like the basis."""
    spp, size = basis.origin.spp, basis.size
    if budget is not None:
        spp, size = budget.spp, budget.scene.size
    file = folder / "predicted.exr"
    write_predicted(file, predicted, origin=basis.origin, spp=spp, size=size, scene=relit)


def _remark_on_parameters(relit: Scene, listen: Listener) -> None:
    """Say which parameters Mitsuba needs with the relit scene, if it has any."""
    if relit.parameters:
        arguments = " ".join(f"-D{name}={value}" for name, value in relit.parameters.items())
        listen.say(f"relit.xml keeps the scene's own defaults: pass {arguments} to Mitsuba with it")


def _suggest(
    job: Job, found: JobAnswer, placement: Placement | None, listen: Listener
) -> _RigFindings:
    """Suggest lights to add, and a move unless the job has searched for moves itself."""
    settings, solution = job.settings, found.solution
    scenes = [view.scene for view in job.views if view.scene is not None]
    if not settings.suggest or not scenes:
        return _RigFindings(placement, found.planes)
    suggestions = suggest_lights(
        scenes,
        solution.problem.views.bases,
        solution,
        count=settings.suggest,
        seed=settings.seed,
        progress=listen,
    )
    move = None if job.all_rigging else suggest_move(job, solution, listen)
    listen.note("lights suggested")
    return _RigFindings(placement, found.planes, suggestions, move)


def _verify(
    settings: Settings,
    predicted: Estimate,
    budget: VerificationBudget,
    solution: Solution,
    listen: Listener,
) -> Verification:
    """Render the relit scene and compare, with the given samples or until the result is clear."""
    basis, lighting, is_fixed = solution.basis, solution.lighting, settings.verify_spp is not None
    listen.say(_verification_text(budget, basis, is_fixed=is_fixed))
    options: dict[str, Any] = {"spp": budget.spp, "seed": settings.seed, "progress": listen}
    if is_fixed:
        verification = verify(predicted, budget.scene, **options)
        verification = with_light_tests(verification, predicted, LightShares.of(basis, lighting))
    else:
        options["doublings"] = budget.doublings
        verification = verify_in_stages(predicted, budget.scene, basis, lighting, **options)
    listen.note(f"verified with {verification.spp} samples per pixel")
    return verification


def _budget(settings: Settings, basis: Basis, relit: Scene) -> VerificationBudget:
    """Return the budget for the verification of `relit`, on its whole film."""
    max_spp = None if settings.checks_as_basis else settings.spp or relit.spp
    spp = round(basis.origin.mean_spp)
    if settings.time_s is None and settings.error is None:
        # A cached basis may have many times the requested samples.
        spp = min(spp, settings.basis_spp or relit.spp)
    budget = verification_budget(
        relit, basis.size, spp, most_spp=max_spp, asked_spp=settings.verify_spp
    )
    is_limited = settings.verify_spp is not None or settings.time_s is not None
    return replace(
        budget, doublings=SPECTRAL_DOUBLINGS if relit.is_spectral and not is_limited else 0
    )


def _verification_text(budget: VerificationBudget, basis: Basis, *, is_fixed: bool) -> Sentence:
    """Return the remark on how long a verification takes, shown before it starts."""
    height, width = budget.scene.size
    budget = budget.largest
    limit = "" if is_fixed else "at most "
    subject = f"verification of {limit}{budget.spp} samples per pixel on {width}x{height}"
    hint = Sentence(" (", Hint("verify", False), " skips it)")
    if basis.render_s is not None:
        return f"{subject}: at most {spoken_duration(budget.share * basis.render_s)}" + hint
    if budget.share <= 1:
        return f"{subject}: no longer than that many samples of the basis took" + hint
    return f"{subject}: at most {budget.share:.2g} times as long as the basis took" + hint
