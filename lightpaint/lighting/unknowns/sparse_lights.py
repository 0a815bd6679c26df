"""The K lights that serve best, and the error with more or fewer.

The choice of lights is no convex problem. A greedy search adds one light at a time, always the one
that helps most, and at K exchanges lights as long as that helps. Each trial solves for its lights
in full, so the answer is optimal for the lights it uses.
"""

from collections.abc import Collection, Sequence

import numpy as np

from lightpaint.errors import ConstraintError
from lightpaint.lighting.algebra.optimum import minimise
from lightpaint.lighting.unknowns.knobs import Knob
from lightpaint.lighting.unknowns.reduced_problem import ReducedProblem
from lightpaint.lighting.unknowns.reduction import Reduction

#: Sizes beyond K that are tried, so that people see the gain of a few more lights.
EXTRA_SIZES = 2

#: Share of the objective that an exchange has to gain.
MIN_GAIN = 1e-9


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


def choose_knobs(
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
