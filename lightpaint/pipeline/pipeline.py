"""The corridor: obtain bases → solve → improve → analyse → relight → predict, verify, report."""

import math
import time
from dataclasses import replace

from lightpaint.basis import cache
from lightpaint.basis.basis import Basis
from lightpaint.basis.cache_folder import folder
from lightpaint.basis.clean import MOST, clean_planes
from lightpaint.basis.render.obtain import Render, obtain_basis
from lightpaint.basis.render.render import render_basis, samples_for
from lightpaint.images.estimate import Estimate, write_estimate
from lightpaint.keywords import keywords
from lightpaint.lighting.analysis.analysis import Analysis, analyse, with_findings
from lightpaint.lighting.analysis.noise.noise_correction import correct_noise
from lightpaint.lighting.answer.combination import combine
from lightpaint.lighting.problem import Problem
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.solve import solution_of
from lightpaint.pipeline.answer_folder import AnswerFolder, loaded_relit, new_answer
from lightpaint.pipeline.job import Job, PaintedView
from lightpaint.pipeline.results import Look, write_predicted, write_report
from lightpaint.pipeline.settings import Settings
from lightpaint.placement.light_search import suggest_lights
from lightpaint.progress import Listener, Progress, labelled, listener, silent
from lightpaint.relit.detection_power import LightShares, with_power
from lightpaint.relit.render_rounds import refine_by_rendering
from lightpaint.relit.sample_budget import VerificationBudget, verification_budget
from lightpaint.relit.sequential_verification import verify_in_stages
from lightpaint.relit.verification import Verification
from lightpaint.relit.verification_render import verify
from lightpaint.report.basis_memo import make_ahead
from lightpaint.report.page.page import prepare_page
from lightpaint.scene.presets import samples
from lightpaint.scene.scene import Scene


@keywords()
def run(job: Job, progress: Progress = silent, *, bases: list[Basis] | None = None) -> list[Look]:
    """Do `job`: find its lighting, prove it, and write results to its folder.

    Args:
        job: What is asked.
        progress: Hears how far the work has come and, if it is a `Listener`, remarks.
        bases: Of the views on their films, where an earlier run has obtained them; the list is
            emptied, so that no pixel is held twice.

    Returns:
        A look for each view.

    Examples:
        >>> from pathlib import Path
        >>> job = lp.Job((), (lp.Painting("painting.exr"),), Path("evening"), basis)
        >>> [look] = lp.run(job)
        >>> np.round(look.lighting.emission["panel"], 3).tolist()
        [2.0, 1.5, 1.0]
    """
    listen = listener(progress)
    job.results.check()
    for remark in job.remarks:
        listen.say(remark)
    problem = Problem.of(
        _obtained(job, bases, listen),
        [view.target for view in job.views],
        constraints=job.asked,
        fit=job.fit,
    )
    if job.settings.report:
        for basis in problem.views.bases:
            make_ahead(basis, prepare_page)
    solution = _improved(job, solution_of(problem), listen)
    analyses = analyse(solution)
    lighting, scene = with_findings(solution, analyses).lighting, job.views[0].scene
    with new_answer(job.results, lighting, scene=scene, groups=job.groups) as answer:
        looks = [
            _finished(job, answer, view, analysis, _hearing(job, view, listen))
            for view, analysis in zip(job.views, analyses, strict=True)
        ]
    return [_loaded_anew(look) for look in looks] if answer.has_moved_paths else looks


def obtain(
    scene: Scene,
    settings: Settings,
    progress: Progress,
    *,
    views: int = 1,
    render: Render = render_basis,
) -> Basis:
    """The basis of `scene` on its film, kept or rendered.

    views: that share the time there is. render: who renders what is missing.
    """
    listen = listener(progress)
    is_rendered = is_all_rendered = False

    def report(label: str, done: int, total: int, unit: str = "passes") -> None:
        nonlocal is_rendered, is_all_rendered
        is_all_rendered |= not is_rendered and done == 0
        is_rendered = True
        listen(label, done, total, unit)

    asked = samples(settings.quality, spp=settings.spp, time_s=settings.time_s)
    began_s = time.perf_counter()
    basis = obtain_basis(
        scene,
        spp=asked,
        time_s=None if settings.time_s is None else settings.time_s / views,
        seed=settings.seed,
        use_cache=settings.use_cache,
        exact_spp=settings.exact_spp,
        progress=report,
        render=render,
    )
    if is_all_rendered:
        basis = replace(basis, render_s=time.perf_counter() - began_s)
    if settings.use_cache and not cache.is_kept(basis):
        listen.say(
            f"the basis could not be kept in {folder()}, so the next run renders it again: "
            "is the disk full, or the folder not yours?"
        )
    elif settings.use_cache and is_rendered:
        clean_planes(basis, most=MOST, progress=lambda k, n: listen("denoising", k, n, "planes"))
    has = f"basis of {basis.origin.spp} samples per pixel"
    wanted = scene.spp if asked is None else asked
    if not is_rendered and basis.origin.spp > samples_for(scene, asked):
        listen.say(
            f"{has} kept from an earlier run: more than the {wanted} asked for, so the answer may "
            "differ a little from one of these (exact_spp=True takes just them)"
        )
    elif not is_rendered:
        listen.say(f"{has} kept from an earlier run (use_cache=False renders it anew)")
    elif settings.time_s is None and basis.origin.spp > wanted + 1:
        listen.say(f"{has}, not {wanted}: it takes one in each pixel of a block for each half")
    origin, (height, width) = basis.origin, basis.size
    how = "rendered" if is_rendered else "taken from the cache"
    listen.note(
        f"basis {how}: {len(basis.lights)} lights, {width}x{height} pixels, {origin.spp} samples "
        f"per pixel, seed {origin.seed}, {origin.method}"
    )
    return basis


def _obtained(job: Job, bases: list[Basis] | None, listen: Listener) -> list[Basis]:
    """The basis of each view: handed in, given with the job, kept, or rendered."""
    if bases is None:
        made = [_basis_of(job, view, listen) for view in job.views]
    else:
        made = list(bases)
        bases.clear()
    # What the scene's lights file asks by now, whenever they were made.
    return [
        basis if view.scene is None else basis.with_requests(view.scene.requests)
        for basis, view in zip(made, job.views, strict=True)
    ]


def _basis_of(job: Job, view: PaintedView, listen: Listener) -> Basis:
    if view.basis is not None:
        return view.basis
    assert view.scene is not None
    return obtain(view.scene, job.settings, _hearing(job, view, listen), views=len(job.views))


def _hearing(job: Job, view: PaintedView, listen: Listener) -> Listener:
    """`listen`, told of which view, where there are several."""
    return listen if len(job.views) == 1 else labelled(listen, view.folder.name)


def _improved(job: Job, solution: Solution, listen: Listener) -> Solution:
    """What can be done against noise is done."""
    settings, found = job.settings, solution.certificate
    listen.note(
        f"solved in {max(found.sweeps)} sweeps, to a KKT residual of {max(found.kkt_residual):.1e}"
    )
    if settings.corrects_noise(is_known=solution.basis.knows_noise):
        solution = correct_noise(solution)
    pairs = zip((view.scene for view in job.views), solution.problem.views.bases, strict=True)
    scenes = [(scene, basis) for scene, basis in pairs if scene is not None]
    solution = refine_by_rendering(
        scenes, solution, rounds=settings.refine, seed=settings.seed, progress=listen
    )
    lighting = replace(solution.lighting, cd_per_unit=settings.cd_per_unit)
    return replace(solution, lighting=lighting)


def _loaded_anew(look: Look) -> Look:
    """`look` with its relit scene as it is written by now."""
    assert look.relit is not None
    relit = loaded_relit(look.relit, look.relit.path, look.relit.sensor)
    return replace(look, relit=relit)


def _finished(
    job: Job, answer: AnswerFolder, view: PaintedView, analysis: Analysis, listen: Listener
) -> Look:
    """A view predicted, verified and shown."""
    settings, scene, solution = job.settings, view.scene, analysis.solution
    listen.note("analysed, and the lighting written")
    basis = solution.basis
    place = answer.path / view.folder.relative_to(job.folder)
    place.mkdir(exist_ok=True)
    predicted = combine(basis, solution.lighting)
    verification, suggestions, budget, relit = None, None, None, None
    if scene is not None:
        relit = answer.seen_through(scene.sensor)
        budget = _budget(settings, basis, relit)
        if relit.parameters and view is job.views[0]:
            given = " ".join(f"-D{name}={value}" for name, value in relit.parameters.items())
            listen.say(f"relit.xml keeps the scene's own defaults: give Mitsuba {given} with it")
    spp, size = basis.origin.spp, basis.size
    if budget is not None:
        spp, size = budget.spp, budget.scene.size
    write_predicted(
        place / "predicted.exr", predicted, origin=basis.origin, spp=spp, size=size, scene=relit
    )
    if budget is not None and settings.verify:
        listen.say(_spoken(budget, basis, is_fixed=settings.verify_spp is not None))
        verification = _verified(settings, predicted, budget, solution, listen)
        write_estimate(place / "verified.exr", verification.verified, {})
        listen.note(f"verified with {verification.spp} samples per pixel")
    if settings.suggest and scene is not None:
        suggestions = suggest_lights(
            scene, basis, solution, count=settings.suggest, seed=settings.seed, progress=listen
        )
        listen.note("lights suggested")
    look = Look(
        target=view.target,
        basis=basis,
        solution=solution,
        predicted=predicted,
        relit=None if relit is None else relit.moved(answer.path, job.folder),
        verification=verification,
        analysis=analysis,
        suggestions=suggestions,
    )
    write_report(place, look, command=settings.command, is_shown=settings.report)
    listen.note("report written")
    for remark in look.remarks:
        listen.say(remark if len(job.views) == 1 else f"{view.folder.name}: {remark}")
    return look


def _verified(
    settings: Settings,
    predicted: Estimate,
    budget: VerificationBudget,
    solution: Solution,
    listen: Listener,
) -> Verification:
    """Render the relit scene and compare: just the samples asked for, or until it can tell."""
    basis, lighting = solution.basis, solution.lighting
    if settings.verify_spp is None:
        return verify_in_stages(
            predicted,
            budget.scene,
            basis,
            lighting,
            spp=budget.spp,
            seed=settings.seed,
            progress=listen,
        )
    found = verify(predicted, budget.scene, spp=budget.spp, seed=settings.seed, progress=listen)
    return with_power(found, predicted, LightShares.of(basis, lighting))


def _budget(settings: Settings, basis: Basis, relit: Scene) -> VerificationBudget:
    """Return what the verification of `relit`, on its whole film, may cost."""
    most = None if settings.checks_as_basis else settings.spp or relit.spp
    spp = basis.origin.spp
    if settings.time_s is None:
        # A basis that was kept may have many times the samples that are asked for.
        spp = min(spp, samples(settings.quality, spp=settings.spp, time_s=None) or relit.spp)
    return verification_budget(relit, basis.size, spp, most_spp=most, asked_spp=settings.verify_spp)


def _spoken(budget: VerificationBudget, basis: Basis, *, is_fixed: bool) -> str:
    """Return how long a verification takes, said before it starts."""
    height, width = budget.scene.size
    most = "" if is_fixed else "at most "
    its = f"verification of {most}{budget.spp} samples per pixel on {width}x{height}"
    how = "(verify=False skips it)"
    if basis.render_s is not None:
        seconds = math.ceil(budget.share * basis.render_s)
        long = f"{seconds} s" if seconds < 120 else f"{math.ceil(seconds / 60)} min"
        return f"{its}: at most {long} {how}"
    if budget.share <= 1:
        return f"{its}: no longer than that many samples of the basis took {how}"
    return f"{its}: at most {budget.share:.2g} times as long as the basis took {how}"
