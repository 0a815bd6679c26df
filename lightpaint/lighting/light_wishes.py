"""Wishes for planes as requirements: rows over the weights of all lights (docs/photometry.md).

With E = A w at the points of a plane, all wishes of lighting standards are linear: the mean is at
least what is asked, no point is below a share of the mean, or above a limit, and the mean is at
least a share of another plane's. So is the power of all lamps, which a budget limits.

A has noise. A wish is met by the lower end of a 95 % interval: what a point or a mean gives counts
for less by as much as it is uncertain, and for more where there is a limit from above.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cached_property
from typing import Literal

import numpy as np

from lightpaint import photometry
from lightpaint.arrays import Doubles, Indices
from lightpaint.basis import Lights
from lightpaint.display_text import with_similar_name
from lightpaint.errors import ConstraintError
from lightpaint.lighting.constraints.constraint_table import Requirements
from lightpaint.lighting.unknowns.reduction import Reduction

#: What a wish is about.
Kind = Literal["mean", "uniformity", "max", "ratio", "power"]


@dataclass(frozen=True)
class LightWish:
    """A wish for a plane, or for the power of all lamps.

    plane: its name; "" for power. asked: in lx, watts, or a share. to: the other plane of a ratio.
    rows: its rows of the requirements. size: what its rows miss if nothing of it is met. case: the
    case in which it holds; "" for the case of the scene.
    """

    kind: Kind
    plane: str
    asked: float
    rows: slice
    size: float
    to: str = ""
    case: str = ""

    @property
    def is_hard(self) -> bool:
        """True for a budget, of which nothing is taken back where wishes contradict each other."""
        return self.kind == "power"


@dataclass(frozen=True)
class LitCase:
    """A case on the lights of a solve.

    lights: (c,), the lights by number that it sets. weights: (c, 3), of these.
    """

    name: str
    lights: Indices
    weights: Doubles

    @classmethod
    def of(cls, case: photometry.LightCase, lights: Lights) -> "LitCase":
        """Return a case on `lights`. Raises ConstraintError if it names none."""
        found = dict[int, float]()
        for name, factor in case.factors.items():
            matching = [k for k, light in enumerate(lights.names) if fnmatchcase(light, name)]
            if not matching:
                known = with_similar_name("no light has this name", name, [*lights.names])
                raise ConstraintError(f"case {case.name!r} sets {name!r}: {known}")
            found |= dict.fromkeys(matching, factor)
        places = np.array(sorted(found), np.intp)
        factors = np.array([found[k] for k in places.tolist()]).reshape(-1, 1)
        return cls(case.name, places, factors * lights.current_weights[places])

    @classmethod
    def of_scene(cls, lights: Lights) -> "LitCase":
        """Return the case of the light as it is."""
        return cls("", np.zeros(0, np.intp), lights.current_weights[:0])

    def applied_to(self, weights: Doubles) -> Doubles:
        """Return weights (n, 3) with the weights of this case."""
        weights = weights.copy()
        weights[self.lights] = self.weights
        return weights


@dataclass(frozen=True)
class WishedLight:
    """All wishes, with the requirements that they make.

    illuminance: that is wished for. cases: in which it is; none for the light of the scene alone.
    """

    illuminance: photometry.Illuminance
    wishes: tuple[LightWish, ...]
    requirements: Requirements
    cases: tuple[LitCase, ...] = ()

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
        """Return the multiplier of each wish, (w,), of the multipliers of the rows, (m,)."""
        return np.array([float(required[wish.rows].sum()) for wish in self.wishes])


def wished_light(
    illuminance: photometry.Illuminance,
    budget: photometry.PowerBudget,
    reduction: Reduction,
    *,
    floor_m2: float = 0.0,
    cases: Sequence[photometry.LightCase] = (),
) -> WishedLight:
    """Return the wishes for the planes of `illuminance`, and the budget.

    reduction: of the lights, whose brightest setting tells how noise counts. floor_m2: the area
    that a budget per area is for. cases: in each of which the wishes hold; by default in the light
    of the scene alone. Raises ConstraintError for a budget of lamps of unknown power, a ratio to a
    plane that is not there, a plane without light, and a case of lights that the solve adjusts.
    """
    rows = _Rows(len(illuminance.lights))
    lit_cases = tuple(lit_case(case, illuminance.lights, reduction) for case in cases)
    at_full = brightest(reduction, illuminance)
    for case in lit_cases or (LitCase.of_scene(illuminance.lights),):
        rows.case = case
        for plane in illuminance.planes:
            _add_wishes(rows, plane, illuminance, case.applied_to(at_full))
    if (limit := watts_allowed(budget, floor_m2)) is not None:
        check_powers(reduction, illuminance.lights.names, "a limit of power")
        rows.case = LitCase.of_scene(illuminance.lights)
        rows.add("power", "", limit, np.zeros((1, *rows.shape)), -limit, size=limit, watts=-1.0)
    return WishedLight(illuminance, tuple(rows.wishes), rows.requirements(), lit_cases)


def _add_wishes(
    rows: "_Rows",
    plane: photometry.MeasuringPlane,
    illuminance: photometry.Illuminance,
    weights: Doubles,
) -> None:
    """Add the rows of a plane's wishes. weights: (n, 3), at which noise counts."""
    part, name, wishes = illuminance.points_of(plane.name), plane.name, plane.wishes
    matrix, reading = illuminance.matrix[part], illuminance.reading(name, weights)
    if not reading.mean > 0 and (wishes.mean is not None or wishes.uniformity is not None):
        raise ConstraintError(
            f"plane {name!r} gets no light from any lamp, and there are wishes for it: is it "
            "below the floor, or do its points face away?"
        )
    mean = matrix.mean(axis=0, keepdims=True)
    values, errors = illuminance.of(weights)[part], illuminance.standard_errors(weights)[part]
    point_error = photometry.relative_intervals(values, errors)[:, None, None]
    largest = photometry.NORMAL_95 * photometry.LARGEST_ERROR
    sure_mean = mean * (1 - min(reading.relative_interval, largest))
    size = wishes.mean or max(reading.mean, 1e-9)
    if wishes.mean is not None:
        rows.add("mean", name, wishes.mean, sure_mean, wishes.mean, size=wishes.mean)
    if wishes.uniformity is not None:
        above = matrix * (1 - point_error) - wishes.uniformity * mean
        rows.add("uniformity", name, wishes.uniformity, above, 0.0, size=size)
    if wishes.most is not None:
        below = -matrix * (1 + point_error)
        rows.add("max", name, wishes.most, below, -wishes.most, size=wishes.most)
    for ratio in wishes.ratios:
        names = [x.name for x in illuminance.planes]
        if ratio.to not in names:
            raise ConstraintError(
                f"plane {plane.name!r} has a ratio to {ratio.to!r}, which is not a plane: there is "
                f"{', '.join(names)}"
            )
        other = illuminance.matrix[illuminance.points_of(ratio.to)]
        above = sure_mean - ratio.at_least * other.mean(axis=0, keepdims=True)
        rows.add("ratio", name, ratio.at_least, above, 0.0, size=size, to=ratio.to)


def lit_case(case: photometry.LightCase, lights: Lights, reduction: Reduction) -> LitCase:
    """Return a case on `lights`. Raises ConstraintError if it names none, or an adjusted one."""
    lit = LitCase.of(case, lights)
    if adjusted := [lights.names[k] for k in lit.lights.tolist() if k in reduction.movable]:
        raise ConstraintError(
            f"case {case.name!r} sets {adjusted[0]!r}, which the solve adjusts: lock it in the "
            "lights file (lock = true)"
        )
    return lit


class _Rows:
    """Rows of requirements that are being gathered, with the wishes that they are of."""

    def __init__(self, lights: int) -> None:
        self.shape = (lights, 3)
        self.wishes: list[LightWish] = []
        self.case: LitCase
        self._rows: list[Doubles] = [np.zeros((0, *self.shape))]
        self._least: list[Doubles] = [np.zeros(0)]
        self._watts: list[Doubles] = [np.zeros(0)]
        self._count = 0

    def add(
        self,
        kind: Kind,
        plane: str,
        asked: float,
        rows: Doubles,
        least: float,
        *,
        size: float,
        to: str = "",
        watts: float = 0.0,
    ) -> None:
        """Add the rows (r, n, 3) of a wish in the case, each of which reaches `least`."""
        count, case = len(rows), self.case
        # The light of the case is not the light of the answer.
        given = np.einsum("rlc,lc->r", rows[:, case.lights], case.weights)
        rows = rows.copy()
        rows[:, case.lights] = 0
        place = slice(self._count, self._count + count)
        self.wishes.append(LightWish(kind, plane, asked, place, size, to, case.name))
        self._rows.append(rows)
        self._least.append(least - given)
        self._watts.append(np.full(count, watts))
        self._count += count

    def requirements(self) -> Requirements:
        """Return all rows."""
        parts = self._rows, self._watts, self._least
        rows, watts, least = (np.concatenate(part) for part in parts)
        return Requirements(rows, watts, least)


def brightest(reduction: Reduction, illuminance: photometry.Illuminance) -> Doubles:
    """Return the weights (n, 3) of all lights at full; the weights of the scene where nothing
    limits them.
    """
    _, high = reduction.weight_ranges
    return np.where(np.isfinite(high), high, illuminance.lights.current_weights)


def watts_allowed(budget: photometry.PowerBudget, floor_m2: float) -> float | None:
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
    unknown = [
        names[k]
        for k in sorted(reduction.movable)
        if k not in reduction.lamps or any(x.watts is None for x in reduction.lamps[k].emitters)
    ]
    if unknown:
        more = f" and {len(unknown) - 1} more" if len(unknown) > 1 else ""
        raise ConstraintError(
            f"{purpose} needs the power of each lamp, and the power of {unknown[0]!r}{more} is "
            "unknown: add watts to its table in the lights file, or lock = true if it is to stay"
        )
