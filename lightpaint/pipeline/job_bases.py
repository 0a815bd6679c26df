"""The bases of a job: given, kept from an earlier run, or rendered; and the problem on them."""

import time
from collections.abc import Sequence
from dataclasses import replace

from lightpaint.basis import Basis
from lightpaint.basis.cache import Render, cache, folder, obtain_basis
from lightpaint.basis.render import render_basis, samples_for
from lightpaint.errors import BasisError
from lightpaint.lighting import Problem, Solution, correct_noise
from lightpaint.pipeline.job.job import Job, PaintedView
from lightpaint.pipeline.job.settings import Settings
from lightpaint.progress import Announcement, Listener, Pace, Progress, labelled, listener
from lightpaint.scene import Scene
from lightpaint.sentences import Hint, Sentence, Word


def obtain(
    scene: Scene,
    settings: Settings,
    progress: Progress,
    *,
    views: int = 1,
    render: Render | None = None,
    before: Basis | None = None,
    names_cache: bool = True,
) -> Basis:
    """Return the basis of `scene` on its film, from the cache or rendered.

    views: number of views that share the rendering time. render: function that renders missing
    samples, by default `render_basis`. before: a basis of the scene with lights elsewhere, whose
    other planes are taken. names_cache: whether remarks name the argument that does without the
    cache.
    """
    listen = listener(progress)
    watch = _RenderWatch(listen, has_moved=before is not None, names_cache=names_cache)
    spp, time_s = settings.basis_spp, None if settings.error else settings.time_s
    began_s = time.perf_counter()
    basis = obtain_basis(
        scene,
        spp=spp,
        time_s=None if time_s is None else time_s / views,
        seed=settings.seed,
        use_cache=settings.use_cache,
        exact_spp=settings.exact_spp,
        progress=watch.report,
        render=render or render_basis,
        report_reuse=watch.report_reuse,
        before=before,
    )
    if watch.is_all_rendered and not watch.is_reused:
        basis = replace(basis, render_s=time.perf_counter() - began_s)
    if settings.use_cache and not cache.is_cached(basis):
        listen.say(
            f"the basis could not be saved in {folder()}, so the next run renders it again: "
            "is the disk full, or the folder not yours?"
        )
    _remark_on_samples(scene, basis, settings, spp, watch)
    return basis


class _RenderWatch:
    """A watch on how a basis is obtained, which passes reports on and remembers what happened."""

    def __init__(self, listen: Listener, *, has_moved: bool, names_cache: bool) -> None:
        self.listen, self._has_moved, self._names_cache = listen, has_moved, names_cache
        self.is_rendered = self.is_all_rendered = self.is_reused = False
        advice = ": fewer samples or pixels take less"
        hints = (" (", Hint("spp"), ", ", Hint("resolution", Word("1/2")), ")") * names_cache
        self._pace, self._begin_s = Pace(), time.monotonic()
        self._announcement = Announcement("rendering", Sentence(advice, *hints))

    def report(self, label: str, done: int, total: int, unit: str = "passes") -> None:
        """Pass progress on. All is rendered if the first report has nothing done."""
        self.is_all_rendered |= not self.is_rendered and done == 0
        if not self.is_rendered:
            self._pace, self._begin_s = Pace(done), time.monotonic()
        self.is_rendered = True
        # A number of seconds is what was asked for.
        left_s = None if unit == "seconds" else self._pace.left_s(done, total)
        spent_s = time.monotonic() - self._begin_s
        remark = self._announcement.remark(spent_s, left_s, done / max(total, 1))
        if remark is not None:
            self.listen.say(remark)
        self.listen(label, done, total, unit)

    def report_reuse(self, count: int, of: int) -> None:
        """Say how many of all lights are reused."""
        self.is_reused = True
        remainder = of - count
        if self._has_moved:
            self.listen.note(f"{remainder} of {of} lights are rendered where they are now")
            return
        text = (
            f"{count} of {of} lights come from an earlier run; "
            f"{remainder} {'is' if remainder == 1 else 'are'} rendered"
        )
        self.listen.say(text + self.way_to_render("all"))

    def way_to_render(self, what: str) -> Sentence:
        """Return how to render it without the cache, if the caller can."""
        if not self._names_cache:
            return Sentence()
        return Sentence(" (", Hint("use_cache", False), f" renders {what} again)")


def _remark_on_samples(
    scene: Scene,
    basis: Basis,
    settings: Settings,
    spp: int | None,
    watch: _RenderWatch,
) -> None:
    """Say where a basis comes from, if it has not just the samples that were requested.

    spp: the requested samples per pixel; None for the scene's own.
    """
    listen, is_rendered = watch.listen, watch.is_rendered
    basis_text = f"basis of {basis.origin.samples_text}"
    requested_spp = scene.spp if spp is None else spp
    if not is_rendered and basis.origin.mean_spp > samples_for(scene, spp):
        remark = Sentence(
            f"{basis_text} kept from an earlier run: more than the {requested_spp} requested, so "
            "the answer may differ a little from one with exactly these (",
            Hint("exact_spp", True),
            ")",
        )
        listen.say(remark)
    elif not is_rendered:
        listen.say(f"{basis_text} kept from an earlier run" + watch.way_to_render("it"))
    elif settings.time_s is None and basis.origin.spp > requested_spp + 1:
        listen.say(
            f"{basis_text}, not {requested_spp}: a block needs a sample in each pixel for each half"
        )
    origin, (height, width) = basis.origin, basis.size
    origin_text = "rendered" if is_rendered else "taken from the cache"
    listen.note(
        f"basis {origin_text}: {len(basis.lights)} lights, {width}x{height} pixels, "
        f"{origin.samples_text}, seed {origin.seed}, {origin.method}"
    )


def obtain_bases_of(job: Job, bases: list[Basis] | None, listen: Listener) -> list[Basis]:
    """Return the basis of each view: passed in, given with the job, cached or rendered."""
    if bases is None:
        new_bases = [_basis_of(job, view, listen) for view in job.views]
    else:
        if len(bases) != len(job.views):
            raise BasisError(f"{len(bases)} bases for {len(job.views)} views: give one for each")
        new_bases = list(bases)
        bases.clear()
    # With the current requests of the lights file, even for bases from before it changed.
    return [
        basis if view.scene is None else basis.with_requests(view.scene.requests)
        for basis, view in zip(new_bases, job.views, strict=True)
    ]


def _basis_of(job: Job, view: PaintedView, listen: Listener) -> Basis:
    if view.basis is not None:
        return view.basis
    assert view.scene is not None
    return obtain(view.scene, job.settings, view_listener(job, view, listen), views=len(job.views))


def view_listener(job: Job, view: PaintedView, listen: Listener) -> Listener:
    """Return `listen`, which names the view if there are several."""
    return listen if len(job.views) == 1 else labelled(listen, view.folder.name)


def problem_of(job: Job, bases: Sequence[Basis]) -> Problem:
    """Return the problem of a job and the bases of its views."""
    targets = [view.target for view in job.views]
    return Problem.of(list(bases), targets, constraints=job.all_constraints, fit=job.fit)


def without_noise(job: Job, solution: Solution) -> Solution:
    """Return a solution whose noise is corrected, if the settings ask for it."""
    is_known = solution.basis.knows_noise
    return correct_noise(solution) if job.settings.corrects_noise(is_known=is_known) else solution
