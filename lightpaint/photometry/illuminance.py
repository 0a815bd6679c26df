"""Measuring planes: points at which illuminance is measured, and what is wished for there; and the
illuminance at their points, as a linear function of the lights' weights.

A radiance of 1 in all channels stands for u cd/m², so an irradiance (R, G, B) is

    E = u (0.2126 R + 0.7152 G + 0.0722 B) lx

Values are estimates with noise. Two halves of the samples give the half difference of each point,
which alone has one degree of freedom, so a point's error also counts the half differences of its
plane.

Presets of wishes are rows of a standard. Their figures are those that makers of luminaires print in
their tables of the standard. They are not advice, and a design that must meet the standard needs
the standard itself.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from lightpaint.arrays import Doubles, Indices
from lightpaint.basis import Lights
from lightpaint.display_text import brief, some_names
from lightpaint.errors import SceneError
from lightpaint.keywords import keywords

_TABLES = "tables printed by makers of luminaires"

#: Share of a plane's mean that a point has at least, where errors are related to its light.
DARK_SHARE = 0.3

#: Weight of a plane's mean square error against a point's own, in degrees of freedom.
POOLED_DEGREES = 4

#: Standard errors of the ends of a 95 % interval.
NORMAL_95 = 1.96

#: Largest relative error that a wish allows for: beyond it, none could be met.
LARGEST_ERROR = 0.25

#: Points this many standard errors of a difference above the least one may be the darkest.
CANDIDATE_ERRORS = 3.0


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


@dataclass(frozen=True)
class PlaneReading:
    """The illuminance on a plane, in lx, and its uniformity; errors are standard errors.

    uniformity: the least point over the mean. least_bias: bound on how far the least point is
    expected to lie below the darkest point's true illuminance, since noise makes the minimum of
    several points too low; the bias of the uniformity is `least_bias` / `mean`. points: their
    number.
    """

    mean: float
    mean_error: float
    uniformity: float
    uniformity_error: float
    least: float
    most: float
    points: int
    least_error: float
    least_bias: float

    @property
    def mean_interval(self) -> float:
        """Half of the 95 % interval of the mean, by Student's distribution with as many degrees of
        freedom as there are points.
        """
        return _student(self.points) * self.mean_error

    @property
    def relative_interval(self) -> float:
        """The same, relative to the mean; 0 without light."""
        return self.mean_interval / self.mean if self.mean > 0 else 0.0

    @property
    def uniformity_interval(self) -> float:
        """Half of the 95 % interval of the uniformity, without its bias."""
        return _student(self.points) * self.uniformity_error


def _student(points: int) -> float:
    """Return half of a 95 % interval, in standard errors estimated from so many points."""
    from scipy.special import stdtrit  # late: every command loads this module

    return float(stdtrit(points, 0.975))


@keywords()
@dataclass(frozen=True)
class Illuminance:
    """The illuminance at the points of planes, per light.

    Attributes:
        planes: The planes, whose points follow each other.
        lights: The n lights, in the order of `matrix`.
        matrix: (p, n, 3), lx at each point per unit weight of a light in a channel.
        noise: (p, n, 3), half the difference of two halves of the samples.
        cd_per_unit: cd/m² of a radiance of 1.

    Examples:
        >>> scene = lp.load_scene("room.xml")
        >>> planes = lp.read_planes("room.planes.toml", scene).planes
        >>> found = lp.measure_illuminance(scene, planes, spp=64, cd_per_unit=1000)
        >>> found
        Illuminance(36 points of desk from 2 lights)
        >>> found.of(found.lights.current_weights).shape
        (36,)
    """

    planes: tuple[MeasuringPlane, ...]
    lights: Lights
    matrix: Doubles
    noise: Doubles
    cd_per_unit: float

    def __post_init__(self) -> None:
        expected = sum(len(plane) for plane in self.planes), len(self.lights), 3
        for name, values in (
            ("matrix", self.matrix),
            ("noise", self.noise),
        ):
            if values.shape != expected:
                raise SceneError(f"{name} has the shape {values.shape}: expected {expected}")

    def __repr__(self) -> str:
        points, lights, _ = self.matrix.shape
        names = some_names(plane.name for plane in self.planes)
        return f"Illuminance({points} points of {names} from {lights} lights)"

    @cached_property
    def _slices(self) -> dict[str, slice]:
        return slices_of(self.planes)

    def points_of(self, plane: str) -> slice:
        """Return where the points of a plane lie among all. Raises SceneError without it."""
        if plane not in self._slices:
            raise SceneError(f"no plane {plane!r}: there is {some_names(self._slices)}")
        return self._slices[plane]

    def of(self, weights: Doubles) -> Doubles:
        """Return the illuminance in lx at all points, (p,). weights: (n, 3)."""
        return self._mix(self.matrix, weights)

    def standard_errors(self, weights: Doubles) -> Doubles:
        """Return the standard errors of `of(weights)`, (p,) in lx.

        The error of a point is estimated from its own half difference and, with four times the
        weight, from the half differences of its plane: their root mean square or, if that is more,
        the root mean square of their ratios to the light, times the light of the point. So points
        in a shadow, which get the noise of indirect light alone, are not taken to be too certain.
        """
        values, halves = self.of(weights), self._mix(self.noise, weights)
        errors = np.zeros(len(values))
        for part in self._slices.values():
            light, own = floored(values[part]), halves[part] ** 2
            if light.any():
                pooled = np.maximum(own.mean(), light**2 * np.mean(own / light**2))
                squares = (POOLED_DEGREES * pooled + own) / (POOLED_DEGREES + 1)
                errors[part] = np.sqrt(squares)
        return errors

    def reading(self, plane: str, weights: Doubles) -> PlaneReading:
        """Return the illuminance on a plane. weights: (n, 3). Raises SceneError without it."""
        part = self.points_of(plane)
        values, errors = self.of(weights)[part], self.standard_errors(weights)[part]
        halves = self._mix(self.noise[part], weights)
        mean, least = float(values.mean()), float(values.min())
        # The points are independent, so their own half differences give the error of the mean.
        mean_error = float(np.sqrt((halves**2).sum())) / len(values)
        least_error = float(errors[np.argmin(values)])
        uniformity = least / mean if mean > 0 else 0.0
        relative = math.hypot(least_error / least, mean_error / mean) if least > 0 else 0.0
        return PlaneReading(
            mean=mean,
            mean_error=mean_error,
            uniformity=uniformity,
            uniformity_error=uniformity * relative,
            least=least,
            most=float(values.max()),
            points=len(values),
            least_error=least_error,
            least_bias=_bias_bound(values, errors),
        )

    def readings(self, weights: Doubles) -> dict[str, PlaneReading]:
        """Return the illuminance on all planes, by name. weights: (n, 3)."""
        return {plane.name: self.reading(plane.name, weights) for plane in self.planes}

    def _mix(self, matrix: Doubles, weights: Doubles) -> Doubles:
        """Return Σ matrix · weights, (p,)."""
        shape, expected = np.shape(weights), self.matrix.shape[1:]
        if shape != expected:
            raise SceneError(f"weights of the shape {shape}: expected {expected}, a row per light")
        if not np.isfinite(weights).all():
            raise SceneError("weights that are infinite or no numbers: expected amounts of light")
        return np.asarray(matrix.reshape(len(matrix), np.size(weights)) @ np.ravel(weights))


def floored(values: Doubles) -> Doubles:
    """Return the illuminance of a plane, (p,), at least `DARK_SHARE` of its mean at each point."""
    return np.asarray(np.maximum(np.abs(values), DARK_SHARE * np.abs(values).mean()))


def relative_intervals(values: Doubles, errors: Doubles) -> Doubles:
    """Return half of the 95 % intervals of points, (p,), relative to their light, as far as wishes
    allow for them.

    values, errors: (p,), the light and its standard errors.
    """
    relative = np.full(len(values), LARGEST_ERROR)
    np.divide(errors, values, out=relative, where=values > 0)
    return np.asarray(NORMAL_95 * np.minimum(relative, LARGEST_ERROR))


def _bias_bound(values: Doubles, errors: Doubles) -> float:
    """Return a bound on how far the minimum of noisy values is expected below the true minimum.

    The expected minimum of k normal errors is at least −√(2 ln k) standard errors. k counts the
    points that noise alone may separate from the least one.
    """
    least = int(np.argmin(values))
    differences = np.hypot(errors, errors[least])
    is_candidate = values - values[least] <= CANDIDATE_ERRORS * differences
    largest = float(errors[is_candidate].max())
    return math.sqrt(2 * math.log(int(is_candidate.sum()))) * largest
