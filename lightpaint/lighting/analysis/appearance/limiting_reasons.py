"""Reasons that keep the lights from the painting, and the cost of each.

All shares are of the answer's error over the paint, Σ D ‖V(ψ) − V(x)‖², which the fit minimises
there; each takes another solve. A sample of the pixels finds reasons, and orders them. The share of
the first reason, and of a weaker hold, is then measured with all pixels.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from lightpaint.arrays import Doubles, Floats
from lightpaint.images import is_large
from lightpaint.lighting.analysis.appearance.display_difference import (
    NOTICED,
    PaintComparison,
    UnpaintedChange,
    change_from_scene,
)
from lightpaint.lighting.analysis.appearance.held_answer import answer_released
from lightpaint.lighting.analysis.appearance.pixel_sample import (
    LimitGroup,
    PixelSample,
    limit_groups,
)
from lightpaint.lighting.analysis.noise.noise_correction import correct_noise
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.constraints.light_constraints import ALL_LIGHTS_KINDS, ConstraintKind
from lightpaint.lighting.fit import Fit
from lightpaint.lighting.problem import Problem
from lightpaint.lighting.solution import Solution

#: Share of the error from which a reason counts, and from which a headline names it.
MIN_SHARE, HEADLINE_SHARE = 0.05, 1 / 3

#: Reasons tie if they gain this share of the best one's gain.
TIE_SHARE = 0.9

#: Share of the gain without all reasons that a single one must have; else the reasons are joint.
SINGLE_SHARE = 0.5

#: Number of reasons whose effect is measured with all pixels: as many as sentences name.
MAX_MEASURED = 2

#: Share of the gain of all lights under a constraint that a few of them must have to be named
#: alone, and the most lights of such a few.
FEW_LIGHTS_SHARE, MAX_FEW_LIGHTS = 0.75, 3

#: Share of the gain without hold that a weaker one must have. Measured (docs/benchmarks.md): in the
#: mean of two scenes a half leads closer to the intended picture than any other share tried.
LOOSENED_SHARE = 0.5

#: Most lights whose release is solved with all pixels. The texels of an image are more, and take
#: the weights of the sample: those are allowed, too, and all pixels measure what they gain.
MAX_SOLVED_LIGHTS = 64

#: Steps in the search of the hold, between itself and the share of it that has no effect.
HOLD_STEPS, NO_HOLD = 6, 1e-3


@dataclass(frozen=True)
class Loosening:
    """The strongest hold that still has about half of the gain without any.

    Attributes:
        hold: Its strength; 0 if no weaker one does.
        share: The share of the error over the paint that it removes, measured with all pixels.
        unpainted_change: The change of unpainted pixels under it, from the current scene, as
            `Appearance.unpainted_change` will have it.
        delta_e: Mean ΔE over the paint of the answer, and of that under this hold; None if unknown.
        present_hold: The hold that it replaces; None if unknown.
    """

    hold: float
    share: float
    unpainted_change: UnpaintedChange | None
    delta_e: tuple[float, float] | None = None
    present_hold: float | None = None

    @property
    def is_at_cost(self) -> bool:
        """True if unpainted pixels would visibly change, and by more than painted ones would come
        closer.
        """
        rest = self.unpainted_change
        if rest is None or self.delta_e is None or rest.worst <= NOTICED:
            return False
        before, after = self.delta_e
        return rest.delta_e > max(before - after, 0)


@dataclass(frozen=True)
class Reason:
    """A reason that keeps the lights from the paint.

    Attributes:
        kind: `hold`, `colors` or `views`; or the kind of a constraint.
        names: Of the lights under the constraint, or of the views; none otherwise.
        share: The share of the error over the paint that vanishes without this reason alone; for
            joint reasons, without all of them. By all pixels for the first `MAX_MEASURED` reasons,
            by a sample of them for the others, and for a hold, which has a `loosening`.
        is_joint: Whether it is one of several whose release only helps together.
        loosening: For a hold, a weaker one that helps.
        delta_e: Mean ΔE over the paint of the answer, and of that without this reason alone; None
            if not measured.
    """

    kind: Literal["hold", "colors", "views"] | ConstraintKind
    names: tuple[str, ...] = ()
    share: float = 1.0
    is_joint: bool = False
    loosening: Loosening | None = None
    delta_e: tuple[float, float] | None = None

    @property
    def is_by_hand(self) -> bool:
        """True if it is a constraint by a person."""
        return self.kind not in ("hold", "colors", "views")

    @property
    def group(self) -> LimitGroup:
        """The group of the reason."""
        if self.kind == "hold" or self.kind == "colors" or self.kind == "views":
            return self.kind
        return "constraints"


def reasons_of(solution: Solution, area: Floats | None = None) -> tuple[Reason, ...]:
    """Find the reasons that keep the lights from the painting of one view, the most important
    first.

    Constraints by a person go before reasons that tie with them. If no single reason has half of
    the gain of all, they are joint: first the one without which the others gain least. area:
    (h, w) from 0 to 1, the part of the paint whose error counts; None for all paint.
    """
    if not limit_groups((solution.whole or solution).problem):
        return ()
    sample = PixelSample.of(solution, area)
    look = _comparison(solution, area)
    if sample.current_error <= 0:
        return ()
    everything = sample.share(sample.groups)
    if everything < MIN_SHARE:
        return ()
    reasons: list[Reason] = []
    for kind in sample.groups:
        if kind == "constraints":
            reasons += _constraint_reasons(sample)
        else:
            reasons.append(Reason(kind, sample.limiting_views(kind), sample.share([kind])))
    reasons = _sort_reasons([reason for reason in reasons if reason.share >= MIN_SHARE])
    if (not reasons or reasons[0].share < SINGLE_SHARE * everything) and len(sample.groups) > 1:
        return _joint_reasons(sample, everything)
    measured = [
        x if k >= MAX_MEASURED and x.kind != "hold" else _measure(solution, sample, look, x)
        for k, x in enumerate(reasons)
    ]
    return tuple(x for x in measured if x is not None)


def _comparison(solution: Solution, area: Floats | None) -> PaintComparison:
    """Return the comparison with the paint, or with a part of it, with all pixels."""
    look = PaintComparison.of_problem(solution.problem)
    return look if area is None else look.within(area)


def _measure(
    solution: Solution, sample: PixelSample, look: PaintComparison, reason: Reason
) -> Reason | None:
    """Measure the effect of removing a reason, of a hold the effect of a weaker one, with all
    pixels.

    look: the comparison with the paint in question. Return None if it is too small.
    """
    problem = sample.problem
    if reason.kind == "views":
        return reason
    if reason.kind == "hold":
        if problem.fit.unpainted or not problem.fit.hold:
            return reason  # unpainted pixels have a weight of their own
        loosening = _find_loosening(solution, sample, look, reason.share)
        return None if loosening.share < MIN_SHARE else replace(reason, loosening=loosening)
    if reason.kind == "colors":
        weights = (
            sample.solve(["colors"], sample.other_views)
            if _is_for_sample(problem)
            else released_weights(solution, fit=replace(problem.fit, colors="free"))
        )
    else:
        names = [light.name for light in sample.by_light.lights]
        places = [names.index(name) for name in reason.names]
        released = sample.by_light.without(reason.kind, places)
        weights = (
            sample.solve((), sample.other_views, constraints=released)
            if _is_for_sample(problem)
            else released_weights(solution, constraints=released)
        )
    effect = _effect(solution, look, weights)
    if effect.share < MIN_SHARE:
        return None
    return replace(reason, share=effect.share, delta_e=effect.delta_e)


def _is_for_sample(problem: Problem) -> bool:
    """Return True for more lights than are solved with all pixels again."""
    return len(problem.basis.lights) > MAX_SOLVED_LIGHTS


@dataclass(frozen=True)
class _Effect:
    """The effect of other weights: the removed share of the error, and mean ΔE before and after.

    rest: the change of unpainted pixels from the current scene.
    """

    share: float
    delta_e: tuple[float, float]
    rest: UnpaintedChange | None


def _effect(solution: Solution, look: PaintComparison, weights: Doubles) -> _Effect:
    """Return the effect of weights (n, 3) in place of the weights of `solution`, with all pixels.

    look: the comparison with the paint in question, whose error the share is of; mean ΔE is over
    all paint.
    """
    whole = PaintComparison.of_problem(solution.problem)
    before, after = (solution.basis.mix(x) for x in (solution.weights, weights))
    now, then = (whole.mean(whole.difference(whole.pixels(x))) for x in (before, after))
    rest = change_from_scene(solution, whole, weights, after)
    return _Effect(look.share_removed(before, after), (now, then), rest)


def _sort_reasons(reasons: Sequence[Reason]) -> list[Reason]:
    """Sort by gain; of reasons that tie with the best, constraints by a person come first."""
    tied = TIE_SHARE * max((reason.share for reason in reasons), default=0.0)

    def rank(reason: Reason) -> tuple[bool, float]:
        comes_first = reason.share >= tied and reason.is_by_hand
        return not comes_first, -reason.share

    return sorted(reasons, key=rank)


def _constraint_reasons(sample: PixelSample) -> list[Reason]:
    """Return constraints by a person, by kind, with the fewest lights that have nearly the whole
    gain.
    """
    by_light, reasons = sample.by_light, []
    for kind, lights in by_light.kinds().items():
        whole = sample.share_without(kind, lights)
        if whole < MIN_SHARE:
            continue
        if kind in ALL_LIGHTS_KINDS:
            reasons.append(Reason(kind, (), whole))
            continue
        chosen, gained = lights, whole
        units = by_light.units(lights)
        likely = sorted(units, key=lambda unit: -float(sample.pull[unit].max()))
        # One by one, beginning with the units of the largest effect.
        alone = [(sample.share_without(kind, unit), unit) for unit in likely[: 2 * MAX_FEW_LIGHTS]]
        best = [unit for _, unit in sorted(alone, key=lambda gain: -gain[0])]
        for count in range(1, min(MAX_FEW_LIGHTS, len(units) - 1) + 1):
            few = sorted(k for unit in best[:count] for k in unit)
            part = max(alone)[0] if count == 1 else sample.share_without(kind, few)
            if part >= FEW_LIGHTS_SHARE * whole:
                chosen, gained = tuple(few), part
                break
        reasons.append(Reason(kind, tuple(by_light.lights[k].name for k in chosen), gained))
    return reasons


def _joint_reasons(sample: PixelSample, everything: float) -> tuple[Reason, ...]:
    """Return all reasons, where only several together have a gain."""
    order = sorted(
        sample.groups, key=lambda kind: sample.share([x for x in sample.groups if x != kind])
    )
    reasons: list[Reason] = []
    for kind in order:
        if kind == "constraints":
            for constraint, lights in sample.by_light.kinds().items():
                limited = [k for k in lights if k in sample.limited] or lights
                names = sample.light_names(constraint, limited)
                reasons.append(Reason(constraint, names, everything, is_joint=True))
        else:
            names = sample.limiting_views(kind)
            reasons.append(Reason(kind, names, everything, is_joint=True))
    return tuple(reasons)


def _find_loosening(
    solution: Solution, sample: PixelSample, look: PaintComparison, full_gain: float
) -> Loosening:
    """Find and measure the strongest hold with `LOOSENED_SHARE` of `full_gain`, the gain of
    none."""
    hold = _weaker_hold(sample, LOOSENED_SHARE * full_gain)
    weights = (
        sample.solve((), sample.other_views, hold=hold)
        if _is_for_sample(sample.problem)
        else released_weights(solution, fit=replace(sample.problem.fit, hold=hold))
    )
    effect = _effect(solution, look, weights)
    return Loosening(hold, effect.share, effect.rest, effect.delta_e, sample.problem.fit.hold)


def _weaker_hold(sample: PixelSample, gain: float) -> float:
    """Return the strongest hold that removes a share `gain` of the error; 0 if no hold does."""
    hold = float(sample.problem.fit.hold or 0.0)

    def is_enough(hold: float) -> bool:
        return sample.share_of(sample.solve((), sample.other_views, hold=hold)) >= gain

    # Bisection of logarithms between a hold that is too strong and one that is weak enough.
    too_strong, enough = hold, hold * NO_HOLD
    if not is_enough(enough):
        return 0.0
    for _ in range(HOLD_STEPS):
        between = round_down(float(np.sqrt(too_strong * enough)))
        if not enough < between < too_strong:
            break
        if is_enough(between):
            enough = between
        else:
            too_strong = between
    return enough


def round_down(value: float) -> float:
    """Return the nearest number of two digits that is not larger; `value` > 0."""
    unit = 10.0 ** (np.floor(np.log10(value)) - 1)
    return float(f"{np.floor(value / unit * (1 + 1e-12)) * unit:.2g}")


def released_weights(
    solution: Solution, *, fit: Fit | None = None, constraints: Constraints | None = None
) -> Doubles:
    """Return the weights, (n, 3), of the same views with another fit or other constraints.

    solution: of one view; if it is a part of one of several views, all of them are solved. Noise is
    corrected if it was before.
    """
    problem = (solution.whole or solution).problem
    if is_large(problem.basis.size):  # and no other analysis runs meanwhile
        problem.squares.release()
    # All constraints, also those of the bases' scenes, are among the constraints of the problem.
    bases = [basis.with_requests(type(basis.requests)()) for basis in problem.views.bases]
    # What holds an answer to other lights is no reason that could be released. Nothing else refers
    # to the problem, so that its pictures go once it is solved.
    released_solution = answer_released(
        replace(
            Problem.of(
                bases,
                list(problem.views.targets),
                constraints=problem.constraints if constraints is None else constraints,
                fit=fit or problem.fit,
            ),
            start=problem.start,
            tether=problem.tether,
        ),
        problem.holding,
    )
    if problem.corrected is not None and solution.basis.knows_noise:
        released_solution = correct_noise(released_solution)
    return released_solution.weights
