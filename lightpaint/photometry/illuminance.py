"""Illuminance at the points of measuring planes, as a linear function of the lights' weights.

A radiance of 1 in all channels stands for u cd/m², so an irradiance (R, G, B) is

    E = u (0.2126 R + 0.7152 G + 0.0722 B) lx

Values are estimates with noise. Two halves of the samples give the half difference of each point,
which alone has one degree of freedom, so a point's error also counts the half differences of its
plane.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.basis import Lights
from lightpaint.display_text import some_names
from lightpaint.errors import SceneError
from lightpaint.keywords import keywords
from lightpaint.photometry.measuring_plane import MeasuringPlane, slices_of

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
