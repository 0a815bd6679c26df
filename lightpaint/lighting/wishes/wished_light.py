"""Wishes for planes as requirements: rows over the weights of all lights (docs/photometry.md).

With E = A w at the points of a plane, all wishes of lighting standards are linear: the mean is at
least what is asked, no point is below a share of the mean, or above a limit, and the mean is at
least a share of another plane's. So is the power of all lamps, which a budget limits.

A has noise. A wish is met by the lower end of a 95 % interval: what a point or a mean gives counts
for less by 1.96 relative standard errors, and for more where there is a limit from above.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.errors import ConstraintError
from lightpaint.lighting.constraints.requirements import Requirements
from lightpaint.lighting.unknowns.reduction import Reduction
from lightpaint.photometry.illuminance import Illuminance
from lightpaint.photometry.measuring_plane import MeasuringPlane, PowerBudget

#: What a wish is about.
Kind = Literal["mean", "uniformity", "max", "ratio", "power"]

#: Standard errors of the ends of a 95 % interval.
NORMAL_95 = 1.96

#: Largest relative error that a margin allows for: beyond it, no wish could be met.
LARGEST_ERROR = 0.25


@dataclass(frozen=True)
class Wish:
    """A wish for a plane, or for the power of all lamps.

    plane: its name; "" for power. asked: in lx, watts, or a share. to: the other plane of a ratio.
    rows: its rows of the requirements. size: what its rows miss if nothing of it is met.
    """

    kind: Kind
    plane: str
    asked: float
    rows: slice
    size: float
    to: str = ""

    @property
    def is_hard(self) -> bool:
        """True for a budget, of which nothing is taken back where wishes contradict each other."""
        return self.kind == "power"


@dataclass(frozen=True)
class WishedLight:
    """All wishes, with the requirements that they make.

    illuminance: that is wished for.
    """

    illuminance: Illuminance
    wishes: tuple[Wish, ...]
    requirements: Requirements

    @cached_property
    def is_empty(self) -> bool:
        """True if nothing is wished for."""
        return not self.wishes

    def slack_of(self, shares: Doubles) -> Doubles:
        """Return what rows are lowered by, (m,), if of each wish a share, (w,), is given up."""
        slack = np.zeros(len(self.requirements))
        for wish, share in zip(self.wishes, shares, strict=True):
            slack[wish.rows] = share * wish.size
        return slack

    def multipliers_of(self, required: Doubles) -> Doubles:
        """Return the multiplier of each wish, (w,), of those of the rows, (m,)."""
        return np.array([float(required[wish.rows].sum()) for wish in self.wishes])


def wished_light(
    illuminance: Illuminance, budget: PowerBudget, reduction: Reduction, *, floor_m2: float = 0.0
) -> WishedLight:
    """Return the wishes for the planes of `illuminance`, and the budget.

    reduction: of the lights, whose brightest setting tells how noise counts. floor_m2: the area
    that a budget per area is for. Raises ConstraintError
    for a budget of lamps of unknown power, and a ratio to a plane that is not there.
    """
    rows, least = list[Doubles](), list[Doubles]()
    wishes = list[Wish]()
    weights = brightest(reduction, illuminance)

    def add(
        kind: Kind, plane: str, asked: float, matrix: Doubles, size: float, to: str = ""
    ) -> None:
        begin = sum(len(x) for x in rows)
        wishes.append(Wish(kind, plane, asked, slice(begin, begin + len(matrix)), size, to))
        rows.append(matrix)

    for plane in illuminance.planes:
        part = illuminance.points_of(plane.name)
        matrix, reading = illuminance.matrix[part], illuminance.reading(plane.name, weights)
        mean = matrix.mean(axis=0, keepdims=True)
        point_error = _relative(
            illuminance.standard_errors(weights)[part], illuminance.of(weights)[part]
        )
        mean_error = reading.mean_error / reading.mean if reading.mean > 0 else 0.0
        sure_mean = mean * (1 - NORMAL_95 * min(mean_error, LARGEST_ERROR))
        sure_points = matrix * (1 - NORMAL_95 * point_error)
        wish, size = plane.wishes, plane.wishes.mean or max(reading.mean, 1e-9)
        if wish.mean is not None:
            add("mean", plane.name, wish.mean, sure_mean, wish.mean)
            least.append(np.array([wish.mean]))
        if wish.uniformity is not None:
            add(
                "uniformity",
                plane.name,
                wish.uniformity,
                sure_points - wish.uniformity * mean,
                size,
            )
            least.append(np.zeros(len(matrix)))
        if wish.most is not None:
            add("max", plane.name, wish.most, -matrix * (1 + NORMAL_95 * point_error), wish.most)
            least.append(np.full(len(matrix), -wish.most))
        for ratio in wish.ratios:
            other = illuminance.matrix[_other_plane(illuminance, plane, ratio.to)]
            row = sure_mean - ratio.at_least * other.mean(axis=0, keepdims=True)
            add("ratio", plane.name, ratio.at_least, row, size, ratio.to)
            least.append(np.zeros(1))
    watts = np.zeros(sum(len(x) for x in rows))
    if (limit := watts_allowed(budget, floor_m2)) is not None:
        check_powers(reduction, illuminance.lights.names, "a limit of power")
        add("power", "", limit, np.zeros((1, len(illuminance.lights), 3)), limit)
        least.append(np.array([-limit]))
        watts = np.append(watts, -1.0)
    empty = np.zeros((0, len(illuminance.lights), 3))
    requirements = Requirements(
        np.concatenate([empty, *rows]), watts, np.concatenate([np.zeros(0), *least])
    )
    return WishedLight(illuminance, tuple(wishes), requirements)


def brightest(reduction: Reduction, illuminance: Illuminance) -> Doubles:
    """Return the weights (n, 3) of all lights at full; those of the scene where nothing limits
    them.
    """
    _, high = reduction.weight_ranges
    return np.where(np.isfinite(high), high, illuminance.lights.current_weights)


def watts_allowed(budget: PowerBudget, floor_m2: float) -> float | None:
    """Return the power that a budget allows, in watts; None without one."""
    limits = [] if budget.watts is None else [budget.watts]
    if budget.per_area is not None:
        if not floor_m2:
            raise ConstraintError(
                "per_area limits the power per m², and no plane has an area and faces upwards: "
                "give watts instead"
            )
        limits.append(budget.per_area * floor_m2)
    return min(limits, default=None)


def check_powers(reduction: Reduction, names: Sequence[str], purpose: str) -> None:
    """Raise ConstraintError if the power of a lamp that may be on is unknown."""
    movable = {light for knob in reduction.knobs for light in knob.lights}
    unknown = [
        names[k]
        for k in sorted(movable)
        if k not in reduction.lamps or any(x.watts is None for x in reduction.lamps[k].emitters)
    ]
    if unknown:
        more = f" and {len(unknown) - 1} more" if len(unknown) > 1 else ""
        raise ConstraintError(
            f"{purpose} needs the power of each lamp, and that of {unknown[0]!r}{more} is unknown: "
            "add watts to its table in the lights file"
        )


def _relative(errors: Doubles, values: Doubles) -> float:
    """Return the relative error of points, which all have the same."""
    lit = values > 0
    return float(min((errors[lit] / values[lit]).max(initial=0), LARGEST_ERROR))


def _other_plane(illuminance: Illuminance, plane: MeasuringPlane, to: str) -> slice:
    names = [x.name for x in illuminance.planes]
    if to not in names:
        raise ConstraintError(
            f"plane {plane.name!r} has a ratio to {to!r}, which is not a plane: there is "
            f"{', '.join(names)}"
        )
    return illuminance.points_of(to)
