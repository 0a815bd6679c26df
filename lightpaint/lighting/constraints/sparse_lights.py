"""The K lights that serve best, and what more or fewer would miss.

Which lights to use is no convex question. They are added one at a time, each time the one
that helps most, and at K exchanged for others as long as that helps. Each trial is the full
solve of its lights, so the answer is optimal for the lights it uses.
"""

from collections.abc import Collection, Sequence

import numpy as np

from lightpaint.errors import ConstraintError
from lightpaint.lighting.algebra.optimum import minimise
from lightpaint.lighting.constraints.knobs import Knob
from lightpaint.lighting.constraints.reduced_problem import ReducedProblem
from lightpaint.lighting.constraints.reduction import Reduction

#: Sizes beyond K that are tried, so that people see what a few more lights would bring.
BEYOND = 2

#: Share of the objective that an exchange has to gain.
GAIN = 1e-9


class _Trials:
    """Values of the objective, less a constant, with some knobs on and the others at 0."""

    def __init__(self, problems: Sequence[ReducedProblem], reduction: Reduction) -> None:
        self.problems, self.places = problems, reduction.places
        self.known: dict[frozenset[int], float] = {}

    def value(self, chosen: Collection[int]) -> float:
        key = frozenset(chosen)
        if key not in self.known:
            on = {k for knob in key for k in self.places[knob]}
            self.known[key] = sum(_value(problem, on) for problem in self.problems)
        return self.known[key]

    def added(self, chosen: frozenset[int]) -> frozenset[int]:
        """`chosen` and the knob that helps most."""
        rest = [k for k in range(len(self.places)) if k not in chosen]
        return chosen | {min(rest, key=lambda k: self.value(chosen | {k}))}

    def exchanged(self, chosen: frozenset[int], kept: Collection[int]) -> frozenset[int]:
        """`chosen` after all exchanges of one for one that help."""
        while True:
            now = self.value(chosen)
            trials = [
                chosen - {old} | {new}
                for old in chosen.difference(kept)
                for new in range(len(self.places))
                if new not in chosen
            ]
            best = min(trials, key=self.value, default=chosen)
            if self.value(best) >= now - GAIN * abs(now):
                return chosen
            chosen = best


def best_knobs(
    problems: Sequence[ReducedProblem], reduction: Reduction, count: int
) -> list[frozenset[int]]:
    """The knobs to use, one more each time, to `count` of them and a little beyond.

    Several lights on one dimmer count as one. Knobs with a lower limit above 0 are always on.
    Raises ConstraintError if these are more.
    """
    kept = frozenset(k for k, knob in enumerate(reduction.knobs) if _is_on(knob))
    if len(kept) > count:
        raise ConstraintError(
            f"sparse is {count}, but {len(kept)} lights have a lower limit above 0: allow as many"
        )
    trials, chosen, path = _Trials(problems, reduction), kept, [kept] if kept else []
    while len(chosen) < len(reduction.knobs) and len(chosen) < count + BEYOND:
        chosen = trials.added(chosen)
        if len(chosen) == count:
            chosen = trials.exchanged(chosen, kept)
        path.append(chosen)
    return path


def _is_on(knob: Knob) -> bool:
    """Whether a lower limit keeps it from being off."""
    return any(x.lower > 0 for x in knob.unknowns) or (knob.limit is not None and knob.limit[1] > 0)


def _value(problem: ReducedProblem, on: Collection[int]) -> float:
    """min xᵀM x − 2 bᵀx over the unknowns that are on."""
    here = np.array([k for k, i in enumerate(problem.its.tolist()) if i in on], dtype=np.intp)
    p = problem.of(here)
    x = minimise(p.M, p.b, lower=p.lower, upper=p.upper, caps=p.caps).x
    return float(x @ p.M @ x - 2 * p.b @ x)
