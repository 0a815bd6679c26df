"""The freedom of a light to move: how far it may slide, turn and open its cone.

A light's pose is a few numbers: coordinates of its place, of its direction across its axis, of its
cone. A search changes these and asks for the nearest pose that is permitted.
"""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from lightpaint.arrays import Doubles, Floats, Position
from lightpaint.errors import SceneError
from lightpaint.keywords import keywords
from lightpaint.placement.free_space import as_position, far_apart
from lightpaint.scene.properties.pose import FARTHEST, Site, across, rotation_between

#: Degrees that count like a metre of sliding, for one step of a search: of the axis, of the cone.
AIM_UNIT, CONE_UNIT = 20.0, 10.0

#: Least width of a beam's soft edge, in degrees.
EDGE = 0.5

Segment = tuple[Position, Position]


@keywords()
@dataclass(frozen=True)
class Freedom:
    """The poses that a light may take, from where it is now.

    Attributes:
        within: Distance that it may move, in units of the scene.
        box: Two opposite corners of a box, parallel to the axes, that it may hang in.
        line: Two ends of a rail that it may slide along.
        aim: Degrees by which it may turn; True to point anywhere.
        cone: Smallest and largest cutoff of a spot, in degrees.

    Raises:
        SceneError: For values that mean nothing, or more than one of `within`, `box` and `line`.

    Examples:
        >>> lp.Freedom(line=((-1.8, 3.5, 0.6), (-1.8, 3.5, 6.0)), aim=30).aim
        30.0
    """

    within: float | None = None
    box: Segment | None = None
    line: Segment | None = None
    aim: float | bool = False
    cone: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        given = [key for key in ("within", "box", "line") if getattr(self, key) is not None]
        if len(given) > 1:
            raise SceneError(f"{' and '.join(given)} are given: a light has one of them")
        if self.within is not None:
            object.__setattr__(self, "within", _number("within", self.within, FARTHEST))
        for key in ("box", "line"):
            if (ends := getattr(self, key)) is not None:
                object.__setattr__(self, key, _ends(key, ends))
        if not isinstance(self.aim, bool):
            object.__setattr__(self, "aim", _number("aim", self.aim, 180.0))
        if self.cone is not None:
            object.__setattr__(self, "cone", _cone(self.cone))

    @property
    def is_still(self) -> bool:
        """True if it permits nothing but the present pose."""
        return self == Freedom()

    @property
    def slides(self) -> bool:
        """True if the light may leave its place."""
        return not (self.within is None and self.box is None and self.line is None)

    @property
    def turn(self) -> float:
        """The most degrees that it may turn."""
        return (180.0 if self.aim else 0.0) if isinstance(self.aim, bool) else self.aim


@dataclass(frozen=True)
class FreeLight:
    """A light, where it is now, and its freedom."""

    name: str
    site: Site
    freedom: Freedom

    def __post_init__(self) -> None:
        its, site = self.freedom, self.site
        for is_asked, has_it, what in (
            (its.slides, site.position is not None, "a place that could change"),
            (its.turn > 0, site.direction is not None, "a direction that could change"),
            (its.cone is not None, site.cutoff is not None, "a cone"),
        ):
            if is_asked and not has_it:
                raise SceneError(f"light {self.name!r} has not {what}: leave that freedom out")

    @property
    def dimensions(self) -> tuple[int, int, int]:
        """Numbers of coordinates of place, direction and cone."""
        its = self.freedom
        place = 0 if not its.slides else 1 if its.line is not None else 3
        return place, 2 if its.turn else 0, 1 if its.cone is not None else 0

    def stepped(self, site: Site, step: Doubles) -> Site:
        """Return the permitted pose nearest to `site` changed by `step`, (sum of dimensions,).

        Units are those of the scene, AIM_UNIT and CONE_UNIT.
        """
        place, turn, cone = np.split(step, np.cumsum(self.dimensions)[:2])
        if len(place) and site.position is not None:
            way = place if len(place) == 3 else place[0] * self._along
            site = replace(site, position=as_position(np.array(site.position) + way))
        if len(turn) and site.direction is not None:
            sideways = across(site.direction)
            direction = np.array(site.direction) + math.radians(AIM_UNIT) * turn @ sideways
            site = replace(site, direction=as_position(direction / np.linalg.norm(direction)))
        if len(cone) and site.cutoff is not None:
            site = self._opened(site, site.cutoff + CONE_UNIT * float(cone[0]))
        return self.permitted(site)

    def permitted(self, site: Site) -> Site:
        """Return the nearest permitted pose."""
        its, now = self.freedom, self.site
        if site.position is not None and its.slides:
            site = replace(site, position=self._place(np.array(site.position)))
        if site.direction is not None and now.direction is not None and its.turn:
            site = replace(site, direction=_turned(now.direction, site.direction, its.turn))
        if site.cutoff is not None and its.cone is not None:
            site = self._opened(site, site.cutoff)
        return site

    def places(self, count: int, rng: np.random.Generator) -> Floats:
        """Return about `count` permitted places that are far apart, the present one first."""
        here = np.array(self.site.position, dtype=float)[None]
        if not self.freedom.slides or count < 2:
            return here
        many = rng.uniform(-1, 1, (20 * count, 3))
        its = self.freedom
        if its.line is not None:
            middle, half = np.mean(its.line, axis=0), np.subtract(*its.line[::-1]) / 2
            many = middle + many[:, :1] * half
        elif its.box is not None:
            middle, half = np.mean(its.box, axis=0), np.abs(np.subtract(*its.box)) / 2
            many = middle + many * half
        else:
            assert its.within is not None
            many = here + its.within * many[np.linalg.norm(many, axis=1) <= 1]
        return np.concatenate([here, far_apart(many, count - 1, start=here)])

    def directions(self, apart: float) -> Floats:
        """Return permitted directions, about `apart` degrees from each other, the present first."""
        if self.site.direction is None or not self.freedom.turn:
            return np.array(self.site.direction or (0.0, 0.0, 1.0))[None]
        count = max(8, round(4 * math.pi / math.radians(apart) ** 2))
        k = np.arange(count) + 0.5
        z, turn = 1 - 2 * k / count, math.pi * (1 + math.sqrt(5)) * k
        flat = np.sqrt(1 - z**2)
        sphere = np.stack([flat * np.cos(turn), flat * np.sin(turn), z], axis=1)
        # The spiral's pole is the present direction, so that few directions are well placed, too.
        sphere = sphere @ rotation_between((0.0, 0.0, 1.0), self.site.direction).T
        near = sphere @ np.array(self.site.direction) >= math.cos(math.radians(self.freedom.turn))
        return np.concatenate([np.array(self.site.direction)[None], sphere[near]])

    def cones(self) -> Floats:
        """Return permitted cones, (c, 2): cutoff and beam in degrees, the present one first."""
        now = (self.site.cutoff or 0.0, self.site.beam or 0.0)
        if self.freedom.cone is None:
            return np.array([now])
        sizes = np.geomspace(*self.freedom.cone, 4)
        opened = [self._opened(self.site, float(cutoff)) for cutoff in sizes]
        return np.array([now, *((x.cutoff, x.beam) for x in opened)], dtype=float)

    @property
    def _along(self) -> Doubles:
        assert self.freedom.line is not None
        way = np.subtract(*self.freedom.line[::-1])
        return np.asarray(way / np.linalg.norm(way))

    def _place(self, place: Doubles) -> Position:
        its = self.freedom
        if its.line is not None:
            start, end = (np.array(x) for x in its.line)
            share = (place - start) @ (end - start) / ((end - start) @ (end - start))
            return as_position(start + np.clip(share, 0, 1) * (end - start))
        if its.box is not None:
            return as_position(np.clip(place, np.min(its.box, axis=0), np.max(its.box, axis=0)))
        assert its.within is not None
        here = np.array(self.site.position, dtype=float)
        away = float(np.linalg.norm(place - here))
        return as_position(here + (place - here) * min(1, its.within / max(away, 1e-300)))

    def _opened(self, site: Site, cutoff: float) -> Site:
        """Return `site` with a permitted cone nearest to `cutoff`, its beam in proportion."""
        assert self.freedom.cone is not None
        cutoff = float(np.clip(cutoff, *self.freedom.cone))
        share = (self.site.beam or 0.0) / (self.site.cutoff or 1.0)
        beam = max(min(share * cutoff, cutoff - EDGE), EDGE)
        return replace(site, cutoff=cutoff, beam=beam)


def _turned(start: Position, direction: Position, degrees: float) -> Position:
    """Return the direction nearest to `direction` within some degrees of `start`."""
    a, b = np.array(start), np.array(direction)
    angle, most = math.acos(float(np.clip(a @ b, -1, 1))), math.radians(degrees)
    if angle <= most:
        return direction
    side = b - (a @ b) * a
    length = float(np.linalg.norm(side))
    side = side / length if length > 1e-9 else across(start)[0]
    return as_position(math.cos(most) * a + math.sin(most) * side)


def _number(name: str, value: Any, most: float) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = math.nan
    if not 0 < number <= most:
        raise SceneError(f"{name} is {value!r}: expected a number above 0, at most {most:g}")
    return number


def _ends(name: str, value: Any) -> Segment:
    try:
        points = np.array(value, dtype=float)
    except (TypeError, ValueError):
        points = np.zeros(0)
    if points.shape != (2, 3) or not np.abs(points).max() <= FARTHEST:
        raise SceneError(f"{name} is {value!r}: expected two points of three numbers each")
    if name == "line" and np.array_equal(points[0], points[1]):
        raise SceneError(f"line is {value!r}: expected two different points")
    return as_position(points[0]), as_position(points[1])


def _cone(value: Any) -> tuple[float, float]:
    try:
        low, high = (float(v) for v in value)
    except (TypeError, ValueError):
        low, high = math.nan, math.nan
    if not 2 * EDGE < low <= high < 90:
        raise SceneError(f"cone is {value!r}: expected two angles, from {2 * EDGE:g} to 90 degrees")
    return low, high
