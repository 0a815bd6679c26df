"""The solve of a linear problem: its weights, their certificate, and the lighting.

With `sparse`, the choice of lights is not a convex problem. A greedy search adds one light at a
time, always the one that helps most, and at K exchanges lights as long as that helps. Each trial
solves for its lights in full, so the answer is optimal for the lights it uses.

Nor is the choice of a slot of a colour wheel. It comes after the solve for a mix of slots, in whose
colours each lamp gets the closest slot; then all are solved for again, with these slots, and a
short search moves single wheels where the loss falls.
"""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Generic, Protocol, TypeVar

import numpy as np

from lightpaint.arrays import Bools, Doubles, as_rgb
from lightpaint.errors import ConstraintError
from lightpaint.lighting.algebra.optimum import minimise
from lightpaint.lighting.answer.certificate import Certificate, Software
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.lighting.linear_problem import LinearProblem
from lightpaint.lighting.loss.weight_penalty import pull_to_current
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.unknowns.knobs import Knob
from lightpaint.lighting.unknowns.reduced_problem import (
    ReducedOptimum,
    ReducedProblem,
    reduced_problems,
    solve_reduced,
)
from lightpaint.lighting.unknowns.reduction import Reduction, only_knobs
from lightpaint.lighting.unknowns.some_lights import parts_of
from lightpaint.lighting.unknowns.white_mixes import Multipliers, solve_on_locus

#: Sizes beyond K that are tried, so that people see the gain of a few more lights.
EXTRA_SIZES = 2

#: Share of the objective that an exchange has to gain.
MIN_GAIN = 1e-9

#: Gradient, with a unit diagonal and relative to b, from which a constraint has an effect.
MIN_PULL = 1e-7

#: Number of lights from which knobs that depend on no others are solved for a few at a time.
MANY_APART = 160

_Problem = TypeVar("_Problem", bound=LinearProblem)


def nearest_allowed(power: Doubles, reduction: Reduction, weights: Doubles) -> Doubles:
    """Return the allowed weights (n, 3) of least Σᵢ powerᵢ (wᵢ − weightsᵢ)²; all are (n, 3).

    Without requirements, which couple all lights, each knob has a problem of its own. The matrix of
    all together takes seconds and a quarter of a gigabyte for a thousand lights.
    """
    if len(weights) < MANY_APART or reduction.requirements is not None:
        return solve_reduced(pull_to_current(power, weights), reduction, weights).weights
    nearest = reduction.fixed_weights.copy()
    for some in parts_of(reduction):
        near = weights[some.lights]
        pull = pull_to_current(power[some.lights], near)
        nearest[some.lights] = solve_reduced(pull, some.reduction, near).weights
    return nearest


class _Trials:
    """Values of the objective, less a constant, with some knobs on and the others at 0."""

    def __init__(self, problems: Sequence[ReducedProblem], reduction: Reduction) -> None:
        self.problems, self.places = problems, reduction.places
        self.values: dict[frozenset[int], float] = {}

    def value(self, chosen: Collection[int]) -> float:
        """Return the least objective with only the chosen knobs on."""
        key = frozenset(chosen)
        if key not in self.values:
            on = {k for knob in key for k in self.places[knob]}
            self.values[key] = sum(_least_objective(problem, on) for problem in self.problems)
        return self.values[key]

    def with_best(self, chosen: frozenset[int]) -> frozenset[int]:
        """Return `chosen` with the knob that helps most."""
        rest = [k for k in range(len(self.places)) if k not in chosen]
        return chosen | {min(rest, key=lambda k: self.value(chosen | {k}))}

    def after_exchanges(self, chosen: frozenset[int], always_on: Collection[int]) -> frozenset[int]:
        """Return `chosen` after all one-for-one exchanges that help."""
        while True:
            now = self.value(chosen)
            trials = [
                chosen - {old} | {new}
                for old in chosen.difference(always_on)
                for new in range(len(self.places))
                if new not in chosen
            ]
            best = min(trials, key=self.value, default=chosen)
            if self.value(best) >= now - MIN_GAIN * abs(now):
                return chosen
            chosen = best


def _choose_knobs(
    problems: Sequence[ReducedProblem], reduction: Reduction, count: int
) -> list[frozenset[int]]:
    """Return the knobs to use, one more each time, up to a few more than `count`.

    Several lights on one dimmer count as one. Knobs with a lower limit above 0 are always on.
    Raises ConstraintError if these are more.
    """
    always_on = frozenset(k for k, knob in enumerate(reduction.knobs) if _is_on(knob))
    if len(always_on) > count:
        raise ConstraintError(
            f"sparse is {count}, but {len(always_on)} lights have a lower limit above 0: allow at "
            "least as many"
        )
    trials, chosen, path = _Trials(problems, reduction), always_on, [always_on] if always_on else []
    while len(chosen) < len(reduction.knobs) and len(chosen) < count + EXTRA_SIZES:
        chosen = trials.with_best(chosen)
        if len(chosen) == count:
            chosen = trials.after_exchanges(chosen, always_on)
        path.append(chosen)
    return path


def _is_on(knob: Knob) -> bool:
    """Return whether a lower limit keeps the knob from being off."""
    return any(x.lower > 0 for x in knob.unknowns) or (knob.limit is not None and knob.limit[1] > 0)


def _least_objective(problem: ReducedProblem, on: Collection[int]) -> float:
    """Return min xᵀM x − 2 bᵀx over the unknowns that are on."""
    active = np.array(
        [k for k, i in enumerate(problem.unknowns.tolist()) if i in on], dtype=np.intp
    )
    p = problem.restricted(active)
    x = minimise(p.M, p.b, lower=p.lower, upper=p.upper, caps=p.caps).x
    return float(x @ p.M @ x - 2 * p.b @ x)


@dataclass(frozen=True)
class LinearAnswer(Generic[_Problem]):
    """The optimum of the squares of a problem, as weights and as a lighting.

    problem: with the lights that `sparse` has chosen, and the whites, sides of gamuts and slots
    that lights came to. optimum: of `equations`, the squares with the pull. found: (n, 3), the
    weights that stand for it. reached: (n, 3), the channels in which lights reach something. tried,
    curve: see `Solution` and `Certificate`.
    """

    problem: _Problem
    optimum: ReducedOptimum
    equations: NormalEquations
    found: Doubles
    reached: Bools
    tried: tuple[tuple[int, Doubles], ...] = ()
    curve: tuple[tuple[int, float], ...] = ()

    @cached_property
    def weights(self) -> Doubles:
        """(n, 3), the weights without those that round-off made."""
        is_constrained = np.array([bool(x) for x in self.problem.reduction.labels], dtype=bool)
        return self.problem.remove_traces(self.found, is_constrained)

    @cached_property
    def lighting(self) -> Lighting:
        """The lighting, with its certificate."""
        problem = self.problem
        return Lighting.of_weights(
            problem.lights,
            self.weights,
            labels=_labels_and_effects(problem, self.equations, self.optimum),
            reached=self.reached,
            lamps=problem.reduction.lamps,
            mixed_emissions=problem.reduction.mixed_emissions,
            target=problem.name,
            certificate=self._certificate(),
            scene_identity=problem.scene_identity,
            cd_per_unit=problem.constraints.cd_per_unit,
        )

    def with_problem(self, problem: _Problem) -> "LinearAnswer[_Problem]":
        """Return this lighting as the answer to a problem with less freedom."""
        changed = replace(self, problem=problem)
        vars(changed).update(weights=self.weights, lighting=self.lighting)  # as they are cached
        return changed

    def _certificate(self) -> Certificate:
        problem, optimum, transform = self.problem, self.optimum, self.problem.transform
        names = problem.lights.names
        return Certificate(
            kkt_residual=as_rgb(optimum.kkt_residual),
            objective=(0, 0, 0),
            relative_objective=(0, 0, 0),
            sweeps=optimum.sweeps,
            converged=optimum.converged,
            unreached=tuple(n for n, ok in zip(names, self.reached, strict=True) if not ok.any()),
            display="" if transform is None else transform.spoken,
            hold=problem.fit.hold or 0.0,
            colors=problem.fit.colors or "free",
            noise_removed=problem.noise_removed,
            software=Software.installed(),
            basis_spp=problem.spp,
            curve=self.curve,
        ).with_objective(problem.objective(self.weights), problem.norm2)


def solve_squares(problem: _Problem, start: Doubles) -> LinearAnswer[_Problem]:
    """Solve the squares from weights (n, 3); with `sparse`, for the best lights alone. Colour
    wheels come to slots.
    """
    mixed = solve_mixed(problem, start)
    answer = at_slots(mixed, solve_linear)
    if answer is None:
        return mixed
    answer = at_better_slots(answer, solve_linear, _loss_with_pull)
    answer = replace(answer, tried=mixed.tried, curve=mixed.curve)
    return answer.with_problem(answer.problem.with_final_slots())


class _Answered(Protocol):
    """An answer to a problem, with weights (n, 3)."""

    @property
    def problem(self) -> LinearProblem: ...
    @property
    def weights(self) -> Doubles: ...


_Answer = TypeVar("_Answer", bound=_Answered)


def at_slots(mixed: _Answer, solve_again: Callable[[Any, Doubles], _Answer]) -> _Answer | None:
    """Return an answer whose colour wheels are at slots; None without a wheel.

    mixed: the answer whose wheels mix their slots. solve_again: solves its problem with other
    slots, from weights (n, 3).
    """
    if mixed.problem.reduction.open_wheels:
        return solve_again(mixed.problem.with_slots(mixed.weights), mixed.weights)
    return mixed if mixed.problem.reduction.slots else None


def at_better_slots(
    answer: _Answer,
    solve_again: Callable[[Any, Doubles], _Answer],
    loss: Callable[[_Answer], float],
) -> _Answer:
    """Return the better of an answer with wheels at slots and one with the slots that a short
    search finds. solve_again: as for `at_slots`.
    """
    better = answer.problem.with_better_slots(answer.weights)
    return answer if better is None else min(answer, solve_again(better, answer.weights), key=loss)


def _loss_with_pull(answer: LinearAnswer[_Problem]) -> float:
    problem = answer.problem
    return float(problem.with_pull(problem.solved).objective(answer.weights).sum())


def solve_mixed(problem: _Problem, start: Doubles) -> LinearAnswer[_Problem]:
    """Solve as `solve_squares` does, but for colour wheels, which mix their slots."""
    count = problem.constraints.sparse
    if count is None or not problem.full.knobs:
        return solve_linear(problem, start)
    equations, curve = problem.with_pull(problem.solved), []
    path = _choose_knobs(reduced_problems(equations, problem.full), problem.full, count)
    for chosen in path:
        _, optimum = solve_on_locus(equations, only_knobs(problem.full, chosen), start)
        curve.append((len(chosen), optimum.weights))
    best = max((chosen for chosen in path if len(chosen) <= count), key=len)
    answer = solve_linear(problem.with_reduction(only_knobs(problem.full, best)), start)
    # Chosen lights that come out dark are left out as well.
    on = [k for k, x in enumerate(problem.full.knobs) if answer.weights[list(x.lights)].any()]
    solved = answer.problem.with_reduction(only_knobs(answer.problem.full, on))
    norm = np.where(problem.norm2 > 0, problem.norm2, 1).sum()
    errors = [(n, float(np.sqrt(problem.objective(w).sum() / norm))) for n, w in curve]
    return replace(answer, tried=tuple(curve), curve=tuple(errors)).with_problem(solved)


def solve_linear(
    problem: _Problem,
    start: Doubles,
    reached: Bools | None = None,
    *,
    steps: int | None = None,
    near: Multipliers | None = None,
) -> LinearAnswer[_Problem]:
    """Solve the squares from weights (n, 3) under the current reduction.

    reached: (n, 3), the channels in which lights reach something, if known from before: in the last
    linear problem of a loss they may reach less. steps, near: for an answer under a moving brush,
    see `solve_on_locus`.
    """
    equations, method = problem.with_pull(problem.solved), problem.fit.method
    reduction, optimum = solve_on_locus(
        equations, problem.reduction, start, steps=steps, near=near, method=method
    )
    reached = optimum.reached if reached is None else reached
    solved = problem.with_whites(reduction)
    return LinearAnswer(solved, optimum, equations, optimum.weights, reached)


def _labels_and_effects(
    problem: LinearProblem, equations: NormalEquations, optimum: ReducedOptimum
) -> Sequence[tuple[str, bool]]:
    """Return the constraint on each light, and whether the light would change without it."""
    labels = problem.reduction.labels
    if not any(labels):
        return [(label, False) for label in labels]
    effects = _has_effect(equations, problem.lights.is_scalar, optimum)
    for k, is_at_most in _lamps_at_most(problem.reduction, optimum).items():
        effects[k] = is_at_most
    return [
        (label, bool(label) and bool(effect)) for label, effect in zip(labels, effects, strict=True)
    ]


def _lamps_at_most(reduction: Reduction, optimum: ReducedOptimum) -> dict[int, bool]:
    """Return, by the index of a light that mixes emitters, whether one of them would be driven
    beyond its largest drive, or all together beyond their limit.

    An emitter at 0 holds a lamp back no more than a channel at 0 does other lights.
    """
    held, scale = optimum.multipliers, np.abs(optimum.multipliers).max(initial=0)
    # Slots that a wheel does not show are at 0, whatever they would do.
    is_held = (
        (optimum.x >= reduction.upper)
        & (reduction.upper > reduction.lower)
        & (held < -MIN_PULL * scale)
    )
    capped = {
        cap.unknowns[0]: bool(multiplier)
        for cap, multiplier in zip(reduction.caps, optimum.cap_multipliers, strict=True)
    }
    return {
        knob.lights[0]: bool(is_held[list(places)].any()) or capped.get(places[0], False)
        for knob, places in zip(reduction.knobs, reduction.places, strict=True)
        if len(knob.lights) == 1 and knob.lights[0] in reduction.lamps and len(places) > 1
    }


def _has_effect(equations: NormalEquations, scalar: Bools, optimum: ReducedOptimum) -> Bools:
    """Return, (n,), whether a light would change if it alone were released.

    scalar: (n,), of which there is one weight for all channels. The gradient g = M w − b must
    vanish for a free light that is on, and may not be negative for one that is off; where it does
    not do so, something holds the light.
    """
    lit = equations.reached
    power = np.where(lit, np.einsum("cii->ic", equations.M), 0)
    weights = optimum.weights
    g = np.where(lit, optimum.gradient(equations), 0)
    size = np.abs(equations.b.T[lit] / np.sqrt(power[lit])).max(initial=0) or 1.0
    # The channels of a light with one weight pull together.
    g[scalar], power[scalar] = (x[scalar].sum(axis=1, keepdims=True) for x in (g, power))
    root = np.sqrt(np.where(power > 0, power, 1))
    violation = np.abs(np.minimum(weights * root, g / root))
    return np.asarray((violation > MIN_PULL * size).any(axis=1))
