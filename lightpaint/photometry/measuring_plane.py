"""Measuring planes: points at which illuminance is measured, and what is wished for there; and
presets of wishes: rows of a standard, with where the figures come from.

The figures of presets are those that makers of luminaires print in their tables of the standard.
They are not advice, and a design that must meet the standard needs the standard itself.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from lightpaint.arrays import Doubles, Indices
from lightpaint.display_text import brief
from lightpaint.errors import SceneError
from lightpaint.keywords import keywords


@dataclass(frozen=True)
class WishPreset:
    """Least mean illuminance in lx and least uniformity, as a standard has them.

    activity: the standard's words for the task or the surface. standard: name and year. source:
    where the figures were read.
    """

    activity: str
    mean: float
    uniformity: float
    standard: str
    source: str

    def __str__(self) -> str:
        return (
            f"{self.activity}, {self.standard}: {self.mean:g} lx at a uniformity of "
            f"{self.uniformity:g} (figures of {self.source}: check them)"
        )


_TABLES = "tables printed by makers of luminaires"

#: Presets by the name that a planes file uses.
PRESETS = {
    "office": WishPreset(
        "writing, typing, reading, data processing", 500, 0.6, "EN 12464-1:2021", _TABLES
    ),
    "corridor": WishPreset("circulation areas", 100, 0.4, "EN 12464-1:2021", _TABLES),
    "walls": WishPreset("walls of a room", 75, 0.1, "EN 12464-1:2011", _TABLES),
    "ceiling": WishPreset("ceiling of a room", 50, 0.1, "EN 12464-1:2011", _TABLES),
}


@dataclass(frozen=True)
class Ratio:
    """A wish that the mean of a plane is at least `at_least` times the mean of plane `to`."""

    to: str
    at_least: float


@dataclass(frozen=True)
class Wishes:
    """The wishes for the illuminance on a plane; None for what is not wished for.

    mean: least mean illuminance in lx. uniformity: least ratio of minimum to mean, 0 to 1. most:
    largest illuminance of a point in lx. ratios: least ratios to the means of other planes.
    preset: name of the row of a standard that gave what was not set by itself; "" for none.
    """

    mean: float | None = None
    uniformity: float | None = None
    most: float | None = None
    ratios: tuple[Ratio, ...] = ()
    preset: str = ""

    @property
    def is_empty(self) -> bool:
        """True if nothing is wished for."""
        return (self.mean, self.uniformity, self.most, self.ratios) == (None, None, None, ())


@dataclass(frozen=True)
class PowerBudget:
    """A limit of electrical power: in watts, or in W/m² of the floor; None where not limited.

    area: m² of the floor that power is divided by; None for the area of the largest plane that
    faces upwards.
    """

    watts: float | None = None
    per_area: float | None = None
    area: float | None = None


@dataclass(frozen=True)
class LightCase:
    """A case in which all wishes have to hold, such as a clear noon, or night.

    factors: emission of lights that stay as they are, by name or pattern, relative to now.
    """

    name: str
    factors: Mapping[str, float]


@keywords()
@dataclass(frozen=True)
class MeasuringPlane:
    """Points on a plane or on surfaces, and the directions in which illuminance is measured there.

    Attributes:
        name: Its name in the planes file, and the name of its picture.
        points: (p, 3) in scene units, which are metres.
        normals: (p, 3), unit vectors.
        spacing: Distance of neighbours in metres; 0 for listed points.
        area_m2: Area that the points stand for; 0 for listed points.
        shape: Rows and columns of the grid; None if its outline is ragged, or for listed points.
        cells: (p, 2), row and column of each point in a picture of the plane; rows go upwards.
        wishes: The wishes for it.
        is_cylindrical: Whether cylindrical illuminance around the normals is measured, the mean
            over all directions perpendicular to them.
        covered_by: Ids of the shapes that cover points of its grid closely, one for each point
            that is left out.
        sides: (p, 2, 3), the two sides of each point's cell, across and along, in scene units; None
            for listed points.

    Examples:
        >>> up = np.array([[0.0, 1, 0], [0, 1, 0]])
        >>> cells = np.array([[0, 0], [0, 1]])
        >>> points = np.array([[0, 0.8, 0], [0.5, 0.8, 0]])
        >>> lp.MeasuringPlane("desk", points, up, 0.5, 0.5, (1, 2), cells)
        MeasuringPlane('desk', 2 points, 0.50 m²)
    """

    name: str
    points: Doubles
    normals: Doubles
    spacing: float
    area_m2: float
    shape: tuple[int, int] | None
    cells: Indices
    wishes: Wishes = field(default_factory=Wishes)
    is_cylindrical: bool = False
    covered_by: tuple[str, ...] = ()
    sides: Doubles | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.name, str):
            raise SceneError(f"a plane has the name {brief(self.name)}: expected a text")
        for values in (self.points, self.normals, self.cells):
            if not isinstance(values, np.ndarray):
                raise SceneError(
                    f"plane {self.name!r} has {brief(values)}: expected arrays of points, normals "
                    "and cells"
                )
        count = len(self.points)
        if not count or self.points.shape != (count, 3) or self.normals.shape != (count, 3):
            raise SceneError(
                f"plane {self.name!r} has points {self.points.shape} and normals "
                f"{self.normals.shape}: expected (p, 3) each, with at least one point"
            )
        if self.cells.shape != (count, 2):
            raise SceneError(f"plane {self.name!r} has cells {self.cells.shape}: expected (p, 2)")
        if self.sides is not None and np.shape(self.sides) != (count, 2, 3):
            raise SceneError(
                f"plane {self.name!r} has sides {np.shape(self.sides)}: expected (p, 2, 3)"
            )

    def __len__(self) -> int:
        return len(self.points)

    def __repr__(self) -> str:
        return f"MeasuringPlane({self.name!r}, {len(self)} points, {self.area_m2:.2f} m²)"

    @cached_property
    def picture_size(self) -> tuple[int, int]:
        """Rows and columns of a picture with a pixel for each cell; some may have no point."""
        rows, columns = self.cells.max(axis=0) + 1
        return int(rows), int(columns)

    def picture(self, values: Doubles) -> Doubles:
        """Return values at the points, (p,), as a picture (rows, columns); NaN without a point.

        Raises SceneError for values of another shape.
        """
        if np.shape(values) != (len(self),):
            raise SceneError(
                f"values of the shape {np.shape(values)}: expected {(len(self),)}, one per point"
            )
        picture = np.full(self.picture_size, np.nan)
        picture[self.cells[:, 0], self.cells[:, 1]] = values
        return picture


def plane_title(plane: str, case: str) -> str:
    """Return the name of a plane in a case; "" is the light of the scene."""
    return f"{plane}, {case}" if case else plane


def slices_of(planes: Sequence[MeasuringPlane]) -> dict[str, slice]:
    """Return where the points of each plane lie among the points of all, by name of the plane."""
    ends = np.cumsum([len(plane) for plane in planes]).tolist()
    return {
        plane.name: slice(end - len(plane), end) for plane, end in zip(planes, ends, strict=True)
    }
