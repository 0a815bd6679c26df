"""Adds samples where a painting needs them, until the lights are as certain as requested."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lightpaint.arrays import Doubles, Indices
from lightpaint.basis import Basis, texel_lights
from lightpaint.basis.cache import obtain_basis, top_up_basis
from lightpaint.basis.render import ONE_PASS, KeptTracer, kept_loaded
from lightpaint.colour import LUMINANCE
from lightpaint.lighting import (
    Solution,
    error_bars,
    pixel_variances,
    sample_demand,
    solution_of,
    top_up_counts,
)
from lightpaint.pipeline.job.job import Job
from lightpaint.pipeline.job.settings import PILOT_SPP
from lightpaint.pipeline.job_bases import problem_of, view_listener, without_noise
from lightpaint.progress import Listener
from lightpaint.report import LEAST_SHARE, picture_errors, spoken_percent
from lightpaint.scene.limits import MAX_SPP

#: Rounds of samples, each of which at most doubles their number.
MAX_ROUNDS = 20

#: Samples that a round may add, as fractions of those so far. The smallest one is taken that is
#: expected to bring the squared error below AIM times the requested one.
ROUND_SIZES, AIM = (1 / 4, 1 / 2, 1), 0.7


@dataclass(frozen=True)
class Certainty:
    """An answer and its errors. light: the least certain one. errors: (n,), of `picture_errors`."""

    solution: Solution
    light: str
    errors: Doubles

    @classmethod
    def of(cls, solution: Solution) -> "Certainty":
        """Return the certainty of a solution whose basis knows its noise, which samples lower."""
        uncertainty = error_bars(solution, with_painting=False)
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
            state = Certainty.of(without_noise(job, solution_of(problem_of(job, bases))))
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
    variances = pixel_variances(solution, aims_of(state))
    existing_halves = [_half_samples(basis) for basis in bases]
    new_halves = [
        sample_demand(
            views.part(variances, k), views.part(solution.importance, k) > 0, existing_halves[k]
        )
        for k in range(len(bases))
    ]
    variance = np.concatenate([x.variance.ravel() for x in new_halves])
    density = np.concatenate([x.density.ravel() for x in new_halves])
    existing = np.concatenate([x.ravel() for x in existing_halves])
    goal = AIM * (error / state.error) ** 2 * variance.sum()
    for size in ROUND_SIZES:
        counts = top_up_counts(density, existing, size * existing.sum())
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
