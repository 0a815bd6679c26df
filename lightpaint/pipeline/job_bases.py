"""The bases of a job: given, kept from an earlier run, or rendered, with samples added where the
painting needs them until lights are as certain as requested; and the problem on them.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lightpaint import lighting
from lightpaint.arrays import Doubles, Indices
from lightpaint.basis import Basis, texel_lights
from lightpaint.basis.cache import Render, basis_cache, folder, obtain_basis, top_up_basis
from lightpaint.basis.render import ONE_PASS, KeptTracer, kept_loaded, render_basis, samples_for
from lightpaint.colour import LUMINANCE
from lightpaint.errors import BasisError
from lightpaint.pipeline.job.settings import PILOT_SPP, Settings
from lightpaint.pipeline.job.solve_job import Job, PaintedView
from lightpaint.progress import Announcement, Listener, Pace, Progress, labelled, listener
from lightpaint.report import LEAST_SHARE, picture_errors, spoken_percent
from lightpaint.scene import Scene
from lightpaint.sentences import Hint, Sentence, Word
from lightpaint.validation import MAX_SPP

#: Rounds of samples, each of which at most doubles their number.
MAX_ROUNDS = 20

#: Samples that a round may add, as fractions of those so far. The smallest one is taken that is
#: expected to bring the squared error below AIM times the requested one.
ROUND_SIZES, AIM = (1 / 4, 1 / 2, 1), 0.7


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
    if settings.use_cache and not basis_cache.is_cached(basis):
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


def problem_of(job: Job, bases: Sequence[Basis]) -> lighting.Problem:
    """Return the problem of a job and the bases of its views."""
    targets = [view.target for view in job.views]
    return lighting.Problem.of(list(bases), targets, constraints=job.all_constraints, fit=job.fit)


def without_noise(job: Job, solution: lighting.Solution) -> lighting.Solution:
    """Return a solution whose noise is corrected, if the settings ask for it."""
    is_known = solution.basis.knows_noise
    return (
        lighting.correct_noise(solution)
        if job.settings.corrects_noise(is_known=is_known)
        else solution
    )


@dataclass(frozen=True)
class Certainty:
    """An answer and its errors. light: the least certain one. errors: (n,), of `picture_errors`."""

    solution: lighting.Solution
    light: str
    errors: Doubles

    @classmethod
    def of(cls, solution: lighting.Solution) -> "Certainty":
        """Return the certainty of a solution whose basis knows its noise, which samples lower."""
        uncertainty = lighting.error_bars(solution, with_painting=False)
        assert uncertainty is not None
        errors = picture_errors(solution.basis, uncertainty)
        return cls(solution, solution.basis.names[int(np.argmax(errors))], errors)

    @property
    def error(self) -> float:
        """Error of the least certain light."""
        return float(self.errors.max(initial=0))


def add_needed_samples(job: Job, bases: list[Basis], listen: Listener) -> list[Basis]:
    """Return the bases of a job with as many samples as the requested error needs.

    Rounds of a solve and of samples where they lower the errors of the lights most, until the
    largest error is as small as was asked for, or the time is over.
    """
    settings, begin_s = job.settings, time.monotonic()
    assert settings.error is not None
    limit_s = np.inf if settings.time_s is None else settings.time_s

    def is_over() -> bool:
        return time.monotonic() - begin_s > limit_s

    earlier_spp = [basis.origin.mean_spp for basis in bases]
    with kept_loaded([view.scene for view in job.views if view.scene is not None]) as tracers:
        for _ in range(MAX_ROUNDS):
            state = Certainty.of(without_noise(job, lighting.solution_of(problem_of(job, bases))))
            most_spp = max(basis.origin.mean_spp for basis in bases)
            if state.error <= settings.error or is_over() or most_spp >= MAX_SPP:
                break
            listen.note(_text(state, bases))
            if all(basis.origin.method == ONE_PASS for basis in bases):
                bases = _topped_up(job, bases, state, is_over, tracers, listen)
            else:
                bases = _doubled(job, bases, listen)
    has_added_samples = sum(x.origin.mean_spp for x in bases) > sum(earlier_spp)
    text = _text(state, bases)
    if state.error > settings.error:
        text += f"; ± {spoken_percent(settings.error)} was asked for"
    if has_added_samples or state.error > settings.error:
        listen.say(text)
    return bases


def _text(state: Certainty, bases: Sequence[Basis]) -> str:
    """Return the largest error, and the samples so far, as text."""
    mean = sum(basis.origin.mean_spp for basis in bases) / len(bases)
    extra = sum(basis.origin.extra_spp for basis in bases) / len(bases)
    extra_text = f", {_spoken(extra)} of them where the painting needs them" if extra else ""
    least_text = f"one below {spoken_percent(LEAST_SHARE)} of the picture's light counts as that"
    lights = state.solution.basis.lights
    texels = texel_lights(lights)
    noun = "texels" if texels.all() else "lights and texels" if texels.any() else "lights"
    return (
        f"{_spoken(mean)} samples per pixel{extra_text}: {noun} are known to "
        f"± {spoken_percent(state.error)} (least sure: {state.light}; {least_text})"
    )


def _spoken(samples: float) -> str:
    return f"{samples:.2g}" if samples < 10 else f"{samples:.0f}"


def aims_of(state: Certainty) -> Doubles:
    """Return the directions of the weights whose errors are to fall, (n, 3 n), channel by channel.

    Each is the error of a light as `picture_errors` counts it, times itself: so the largest error
    counts most.
    """
    basis, weights = state.solution.basis, state.solution.weights
    brightness = (basis.totals * weights) @ LUMINANCE
    scale = state.errors / np.maximum(brightness, LEAST_SHARE * brightness.sum())
    n = len(brightness)
    aims = np.zeros((n, 3, n))
    aims[np.arange(n), :, np.arange(n)] = basis.totals * LUMINANCE * scale[:, None]
    return aims.reshape(n, -1)


def needed_counts(state: Certainty, bases: Sequence[Basis], error: float) -> list[Indices]:
    """Return the samples to add to each half of each pixel of each view, (h, w) each."""
    views, solution = state.solution.problem.views, state.solution
    variances = lighting.pixel_variances(solution, aims_of(state))
    existing_halves = [_half_samples(basis) for basis in bases]
    new_halves = [
        lighting.sample_demand(
            views.part(variances, k), views.part(solution.importance, k) > 0, existing_halves[k]
        )
        for k in range(len(bases))
    ]
    variance = np.concatenate([x.variance.ravel() for x in new_halves])
    density = np.concatenate([x.density.ravel() for x in new_halves])
    existing = np.concatenate([x.ravel() for x in existing_halves])
    goal = AIM * (error / state.error) ** 2 * variance.sum()
    for size in ROUND_SIZES:
        counts = lighting.top_up_counts(density, existing, size * existing.sum())
        if (variance * existing / (existing + counts)).sum() <= goal:
            break
    ends = np.cumsum([x.size for x in existing_halves])[:-1]
    parts = zip(np.split(counts, ends), bases, strict=True)
    return [part.reshape(basis.size) for part, basis in parts]


def _half_samples(basis: Basis) -> Doubles:
    """Return the samples of half A of each pixel, (h, w)."""
    existing_halves = np.full(basis.size, float(basis.origin.halves[0]))
    return existing_halves if basis.extra is None else existing_halves + basis.extra


def _topped_up(
    job: Job,
    bases: Sequence[Basis],
    state: Certainty,
    is_over: Callable[[], bool],
    tracers: KeptTracer,
    listen: Listener,
) -> list[Basis]:
    """Return the bases with a round of samples where they are needed."""
    assert job.settings.error is not None
    refined_bases = []
    for view, basis, counts in zip(
        job.views, bases, needed_counts(state, bases, job.settings.error), strict=True
    ):
        assert view.scene is not None
        topped_up_basis = top_up_basis(
            view.scene,
            basis,
            counts,
            use_cache=job.settings.use_cache,
            progress=view_listener(job, view, listen),
            is_enough=is_over,
            tracers=tracers,
        )
        refined_bases.append(replace(topped_up_basis, former=basis.former))
    return refined_bases


def _doubled(job: Job, bases: Sequence[Basis], listen: Listener) -> list[Basis]:
    """Return the bases with twice as many samples in all pixels, where lights render alone."""
    doubled_bases = []
    for view, basis in zip(job.views, bases, strict=True):
        assert view.scene is not None
        spp = 2 * max(PILOT_SPP, basis.origin.spp)
        doubled_basis = obtain_basis(
            view.scene,
            spp=spp,
            seed=job.settings.seed,
            use_cache=job.settings.use_cache,
            progress=view_listener(job, view, listen),
        )
        doubled_bases.append(replace(doubled_basis, former=basis.former))
    return doubled_bases
