"""The illuminance that a lighting gives on measuring planes, beside what was wished for."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cached_property

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.basis import Lights
from lightpaint.errors import ConstraintError
from lightpaint.lighting.light_wishes import LightWish, WishedLight, check_powers
from lightpaint.lighting.unknowns.lamp_parts import watts_of
from lightpaint.lighting.unknowns.reduction import Reduction
from lightpaint.photometry import Glare, GlareReading, PlaneReading

#: Relative shortfall from which a wish is not met: rows are met up to round-off.
MISSED = 1e-4

#: Relative distance from its largest at which a drive is at full.
AT_FULL = 1e-3


@dataclass(frozen=True)
class WishOutcome:
    """A wish, and what came of it.

    reached: in the unit of what was asked, at the sure end of its 95 % interval. price: the rise of
    the least power in watts with each unit that is asked; None where a painting was solved for.
    """

    wish: LightWish
    reached: float
    price: float | None = None

    @property
    def is_met(self) -> bool:
        """True if what was asked for is there."""
        asked, room = self.wish.asked, MISSED * abs(self.wish.asked)
        if self.wish.kind in ("max", "power"):
            return self.reached <= asked + room
        return self.reached >= asked - room


@dataclass(frozen=True)
class PlanesAnswer:
    """A lighting on measuring planes.

    outcomes: of all wishes. watts: the power of all lamps; None if the power of one is unknown.
    floor_m2: the area that it is divided by; 0 without one. all_at_full: whether no lamp could give
    more. lamps: their number, without those that stay as they are. adjusted: the lights, by number,
    that belong to these. cost_delta_e: the mean CIEDE2000 to the painting beyond the distance of an
    answer without wishes; None without a painting. budget_delta_e: the same beyond one whose power
    is not limited, where the limit binds. glare: that observers see; None if it was not measured.
    are_ignored: whether the answer was found without the wishes.
    """

    wished: WishedLight
    weights: Doubles
    outcomes: tuple[WishOutcome, ...]
    watts: float | None
    floor_m2: float
    all_at_full: bool
    lamps: int
    adjusted: tuple[int, ...]
    cost_delta_e: float | None = None
    budget_delta_e: float | None = None
    glare: Glare | None = None
    are_ignored: bool = False

    @property
    def binding_limit(self) -> float | None:
        """The limit of the power in watts, if the lamps take all of it."""
        limits = [x for x in self.outcomes if x.wish.kind == "power"]
        taken = [x.wish.asked for x in limits if x.reached >= x.wish.asked * (1 - MISSED)]
        return min(taken, default=None)

    @cached_property
    def glare_readings(self) -> Mapping[tuple[str, str], GlareReading]:
        """The glare by case, as in `readings`, and observer."""
        glare = self.glare
        if glare is None:
            return {}
        return {
            (case, name): reading
            for case, weights in self.weights_by_case.items()
            for name, reading in glare.readings(weights).items()
        }

    @cached_property
    def readings(self) -> Mapping[tuple[str, str], PlaneReading]:
        """The illuminance on each plane, by case, "" for the light of the scene, and plane."""
        return {
            (case, plane): reading
            for case, weights in self.weights_by_case.items()
            for plane, reading in self.wished.illuminance.readings(weights).items()
        }

    @property
    def weights_by_case(self) -> Mapping[str, Doubles]:
        """The weights (n, 3) of each case; of the light of the scene as "" without cases."""
        lit = {case.name: case.applied_to(self.weights) for case in self.wished.cases}
        return lit or {"": self.weights}

    def more_luminaires(self, outcome: WishOutcome) -> tuple[int, str] | None:
        """Return how many more luminaires would bring a plane to the mean that is wished for, and
        of which photometric file: the one of which fewest would do, if each gave as much light as
        the mean of the luminaires of that file. None if no luminaire lights the plane.
        """
        wish, illuminance = outcome.wish, self.wished.illuminance
        weights = self.weights_by_case[wish.case]
        part = illuminance.matrix[illuminance.points_of(wish.plane)]
        given = np.einsum("pnc,nc->n", part, weights) / max(len(part), 1)
        best: tuple[int, str] | None = None
        for name, lights in _lights_by_file(illuminance.lights).items():
            count = sum(len(illuminance.lights[k].members) for k in lights)
            if (each := float(given[lights].sum()) / count) > 0:
                found = math.ceil((wish.asked - outcome.reached) / each), name
                best = found if best is None else min(best, found)
        return best

    def is_reached(self, plane: str) -> bool:
        """Return whether any lamp that the answer adjusts lights a plane."""
        illuminance = self.wished.illuminance
        return bool(illuminance.matrix[illuminance.points_of(plane)][:, list(self.adjusted)].any())

    @property
    def missed(self) -> tuple[WishOutcome, ...]:
        """The wishes that are not met."""
        return tuple(x for x in self.outcomes if not x.is_met)


def planes_answer(
    wished: WishedLight,
    reduction: Reduction,
    weights: Doubles,
    *,
    floor_m2: float,
    prices: Doubles | None = None,
    glare: Glare | None = None,
    are_ignored: bool = False,
) -> PlanesAnswer:
    """Return what weights (n, 3) give.

    reduction: of the lights. prices: of each wish, (w,), in watts per unit; see `WishOutcome`.
    glare: of all lights, as measured. The others are as in `PlanesAnswer`.
    """
    watts = _power(reduction, wished, weights)
    sums = np.einsum("mnc,nc->m", wished.requirements.rows, weights)
    outcomes = tuple(
        WishOutcome(
            wish,
            _reached(wished, wish, sums, weights, watts),
            None if prices is None else float(prices[k]),
        )
        for k, wish in enumerate(wished.wishes)
    )
    lights = wished.illuminance.lights
    adjusted = tuple(sorted(reduction.movable))
    return PlanesAnswer(
        wished,
        weights,
        outcomes,
        watts,
        floor_m2,
        _is_all_at_full(reduction, weights),
        len({lights[k].lamp or lights[k].name for k in adjusted}),
        adjusted,
        glare=glare,
        are_ignored=are_ignored,
    )


def _lights_by_file(lights: Lights) -> Mapping[str, list[int]]:
    """Return the lights by number that have the photometric web of each file, by its name."""
    file_of = dict[int, str]()
    requests = lights.requests.luminaires
    for pattern in sorted(requests, key=lambda x: x in lights.names):  # a name is after patterns
        for k, light in enumerate(lights):
            names = {light.name, light.lamp, *light.members}
            if any(name == pattern or fnmatchcase(name, pattern) for name in names):
                file_of[k] = requests[pattern].path.name
    return {name: [k for k in file_of if file_of[k] == name] for name in file_of.values()}


def _reached(
    wished: WishedLight, wish: LightWish, sums: Doubles, weights: Doubles, watts: float | None
) -> float:
    """Return what came of a wish, at the sure end of its interval."""
    if wish.kind == "power":
        return float("nan") if watts is None else watts
    # What the rows reach beyond what is asked of them.
    beyond = float((sums - wished.requirements.least)[wish.rows].min())
    if wish.kind in ("mean", "max"):
        return wish.asked + beyond if wish.kind == "mean" else wish.asked - beyond
    case = next((x for x in wished.cases if x.name == wish.case), None)
    lit = weights if case is None else case.applied_to(weights)
    base = wished.illuminance.reading(wish.to or wish.plane, lit).mean
    return wish.asked + beyond / base if base > 0 else 0.0


def _power(reduction: Reduction, wished: WishedLight, weights: Doubles) -> float | None:
    """Return the power of all lamps in watts; None if the power of one is unknown."""
    try:
        check_powers(reduction, wished.illuminance.lights.names, "")
    except ConstraintError:
        return None
    return watts_of(weights, reduction.lamps)


def _is_all_at_full(reduction: Reduction, weights: Doubles) -> bool:
    """Return whether no lamp could give more light."""
    movable, lamps = reduction.movable, reduction.lamps
    return bool(movable) and all(
        k in lamps and (lamps[k].drives_for(weights[k]) >= lamps[k].most * (1 - AT_FULL)).all()
        for k in movable
    )
