"""A short local search for better slots of colour wheels.

Each choice of slots leaves a convex problem; the choice itself is not one. The search moves one
wheel at a time, solves for all lights again, and keeps the slot with which the loss is least,
until no slot of a single wheel is better or the trials are used up.
"""

from dataclasses import dataclass, replace

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.unknowns.reduced_problem import solve_reduced
from lightpaint.lighting.unknowns.reduction import Reduction

#: Slots of a wheel for which all lights are solved again: those best while other lights stay.
TRIED_SLOTS = 8

#: Solves of all lights that a search may take.
MAX_TRIALS = 400

#: Share of the loss that another slot has to gain.
MIN_GAIN = 1e-3

#: Least change of the picture's error, relative to the painting, that people see: the step of
#: brightness of which Weber's law speaks.
VISIBLE = 0.01


def improve_slots(
    equations: NormalEquations, reduction: Reduction, weights: Doubles, norm2: float
) -> Reduction:
    """Return the reduction with wheels at slots that bring the picture closer.

    equations: of the squares, with the pull. weights: (n, 3), their optimum under `reduction`.
    norm2: the loss of a black picture. A wheel in front of emitters that mix stays open unless a
    slot brings the picture visibly closer.
    """
    if reduction.requirements is not None:
        return reduction
    return _SlotSearch(equations, norm2 or 1.0, MAX_TRIALS).improve(reduction, weights)


@dataclass
class _SlotSearch:
    """The trials of a search. Errors are of the picture, relative to the painting."""

    equations: NormalEquations
    norm2: float
    trials_left: int

    def improve(self, reduction: Reduction, weights: Doubles) -> Reduction:
        """Return the reduction after moves of single wheels, until none helps."""
        error, has_moved = self._error(weights), True
        while has_moved and self.trials_left > 0:
            has_moved = False
            for k in reduction.wheels:
                place, weights, error = self._best_slot(reduction, k, weights, error)
                if place != reduction.slots[k].at:
                    reduction, has_moved = reduction.at_slots({k: place}), True
        return reduction

    def _best_slot(
        self, reduction: Reduction, k: int, weights: Doubles, error: float
    ) -> tuple[int, Doubles, float]:
        """Return the best slot of the wheel of knob k, and weights and error with it."""
        choices = reduction.slots[k]
        found = {choices.at: (weights, error)}
        for place in self._promising(reduction, k, weights):
            if self.trials_left > 0:
                self.trials_left -= 1
                trial = reduction.at_slots({k: place})
                solved = solve_reduced(self.equations, trial, weights).weights
                found[place] = solved, self._error(solved)
        best = min(found, key=lambda place: found[place][1])
        if choices.is_filter and 0 in found and found[0][1] - found[best][1] < VISIBLE:
            best = 0
        elif found[best][1] ** 2 >= (1 - MIN_GAIN) * found[choices.at][1] ** 2:
            best = choices.at
        return best, *found[best]

    def _promising(self, reduction: Reduction, k: int, weights: Doubles) -> list[int]:
        """Return the slots of a wheel to try: those best while all other lights stay, and the
        open one.
        """
        choices = reduction.slots[k]
        others = [place for place in range(len(choices.options)) if place != choices.at]
        if len(others) > TRIED_SLOTS:
            alone = {place: self._error_alone(reduction, k, place, weights) for place in others}
            others = sorted(others, key=lambda place: (place != 0, alone[place]))
        return others[:TRIED_SLOTS]

    def _error_alone(self, reduction: Reduction, k: int, place: int, weights: Doubles) -> float:
        """Return the error if one wheel alone goes to a slot, and its lamp dims for it."""
        knob = reduction.slots[k].options[place].knob
        fixed = weights.copy()
        fixed[list(knob.lights)] = 0
        alone = replace(reduction, fixed_weights=fixed, knobs=(knob,), slots={}, gamuts=None)
        return self._error(solve_reduced(self.equations, alone, weights).weights)

    def _error(self, weights: Doubles) -> float:
        loss = float(np.sum(self.equations.objective(weights)))
        return float(np.sqrt(max(loss, 0.0) / self.norm2))
