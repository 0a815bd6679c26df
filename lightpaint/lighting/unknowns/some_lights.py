"""A reduction of a few of many lights, without the others."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from lightpaint.arrays import Doubles, Indices
from lightpaint.lighting.constraints.constraint_table import Requirements
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.unknowns.gamuts import GamutsOfSome
from lightpaint.lighting.unknowns.knobs import Knob, Unknown
from lightpaint.lighting.unknowns.lamp_parts import watts_of
from lightpaint.lighting.unknowns.reduction import Reduction

#: Number of knobs that are solved for together where no light depends on another one.
KNOBS_APART = 64


@dataclass(frozen=True)
class SomeLights:
    """A choice of knobs of a reduction, and the lights that they move.

    whole: the reduction of all lights. places: of the knobs, in ascending order.
    """

    whole: Reduction
    places: tuple[int, ...]

    @classmethod
    def of(cls, whole: Reduction, order: Sequence[int], count: int) -> "SomeLights":
        """Return the knobs of the first of some lights, until they move `count` lights.

        order: lights, by number; locked ones, which have no knob, are skipped.
        """
        knob_of = {light: k for k, knob in enumerate(whole.knobs) for light in knob.lights}
        places, moved = dict[int, None](), 0
        for light in order:
            k = knob_of.get(int(light))
            if k is not None and k not in places:
                places[k] = None
                moved += len(whole.knobs[k].lights)
            if moved >= count:
                break
        return cls(whole, tuple(sorted(places)))

    @cached_property
    def lights(self) -> Indices:
        """(m,), the lights by number, in ascending order."""
        return np.array(sorted(x for k in self.places for x in self.whole.knobs[k].lights), np.intp)

    @cached_property
    def reduction(self) -> Reduction:
        """The reduction of these lights alone, numbered by their places in `lights`."""
        number = {int(light): k for k, light in enumerate(self.lights)}
        gamuts = self.whole.gamuts
        return Reduction(
            np.zeros((len(self.lights), 3)),
            tuple(self.whole.labels[light] for light in self.lights),
            tuple(_renumbered(self.whole.knobs[k], number) for k in self.places),
            self.whole.is_joined,
            None if gamuts is None else GamutsOfSome(gamuts, self.lights),
        )

    def reduction_beside(self, weights: Doubles) -> Reduction:
        """Return `reduction` with what the requirements of all lights leave to these, while the
        others keep their weights (n, 3).

        Where these weights miss a requirement, none asks for more than they reach.
        """
        requirements = self.whole.requirements
        if requirements is None:
            return self.reduction
        lamps = self.whole.lamps
        number = {int(light): k for k, light in enumerate(self.lights)}
        own = {number[light]: lamp for light, lamp in lamps.items() if light in number}
        others = {light: lamp for light, lamp in lamps.items() if light not in number}
        reached = np.einsum("mnc,nc->m", requirements.rows, weights)
        rows, shone = requirements.rows[:, self.lights], weights[self.lights]
        by_own = np.einsum("mnc,nc->m", rows, shone)
        least = requirements.least - (reached - by_own)
        if requirements.watts.any():
            least = least - requirements.watts * watts_of(weights, others)
            by_own = by_own + requirements.watts * watts_of(shone, own)
        part = Requirements(rows, requirements.watts, np.minimum(least, by_own))
        return replace(self.reduction, lamps=own).with_requirements(part)

    def put_back(self, part: Reduction) -> Reduction:
        """Return the reduction of all lights with the knobs of `part`, one of these lights."""
        own = self.reduction.knobs
        changed = [j for j, knob in enumerate(part.knobs) if knob is not own[j]]
        if not changed:
            return self.whole
        number = dict(enumerate(self.lights.tolist()))
        knobs = [*self.whole.knobs]
        for j in changed:
            knobs[self.places[j]] = _renumbered(part.knobs[j], number)
        return replace(self.whole, knobs=tuple(knobs))

    def part_of(self, equations: NormalEquations) -> NormalEquations:
        """Return the terms of `equations`, of all lights, in the squares of these lights: without
        the knobs of the other lights, and the knobs of one of each.
        """
        lights, coupling = self.lights, equations.coupling
        return NormalEquations(
            equations.M[:, lights[:, None], lights],
            equations.b[:, lights],
            equations.target_norm2,
            None if coupling is None else coupling[lights],
        )


def parts_of(whole: Reduction) -> Iterator[SomeLights]:
    """Yield all knobs of a reduction, some at a time."""
    for first in range(0, len(whole.knobs), KNOBS_APART):
        last = min(first + KNOBS_APART, len(whole.knobs))
        yield SomeLights(whole, tuple(range(first, last)))


def _renumbered(knob: Knob, number: dict[int, int]) -> Knob:
    """Return a knob whose lights have other numbers."""
    unknowns = tuple(
        Unknown(tuple((number[light], rgb) for light, rgb in x.columns), x.lower, x.upper)
        for x in knob.unknowns
    )
    renumbered = replace(
        knob, lights=tuple(number[light] for light in knob.lights), unknowns=unknowns
    )
    vars(renumbered)["has_any_colour"] = knob.has_any_colour  # as `cached_property` keeps it
    return renumbered
