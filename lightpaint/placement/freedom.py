"""The freedom of a light to move: where it may hang, how far it may turn and open its cone.

A search sees a pose as a few numbers: coordinates of its place on its rail or surface, of its
direction across its axis, of its cone or its size. It changes these numbers, and moves to the
nearest permitted pose.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from lightpaint.arrays import Doubles, Floats, Position, as_position
from lightpaint.display_text import brief
from lightpaint.errors import SceneError
from lightpaint.keywords import keywords
from lightpaint.placement import permitted_places
from lightpaint.placement.free_space import far_apart
from lightpaint.placement.paths.panel_lights import PanelSite
from lightpaint.scene import FARTHEST
from lightpaint.scene.properties.site import Site, across, rotation_between
from lightpaint.validation import parse_number

#: Least width of a beam's soft edge, in degrees.
EDGE = 0.5

#: All angles between a spot's axis and the edge of its beam.
ANY_BEAM = (EDGE, 90.0)

#: Maximum number of rails, and of surfaces, in one freedom.
MAX_PARTS = 1000

Segment = tuple[Position, Position]

#: Scale of a search step, equivalent to sliding by one unit: degrees of the axis, degrees of the
#: cone, a beam's share of its cone, and the logarithm of a side.
AIM_UNIT, CONE_UNIT, BEAM_UNIT, SIDE_UNIT = 20.0, 10.0, 0.3, 0.7

#: Relative difference of two cones or sides up to which one of them is enough to try.
ALIKE = 0.05

#: Share of a way or a turn that may be left of its freedom at its end; the texts round as much.
AT_END = 0.02

#: Least share of a cone that its beam has, if the beam is free.
LEAST_BEAM = 0.05


@keywords()
@dataclass(frozen=True)
class Freedom:
    """The poses that a light may take, from where it is now.

    Attributes:
        within: Distance that it may move, in units of the scene.
        box: Two opposite corners of a box, parallel to the axes, that it may hang in.
        line: Two ends of a rail that it may slide along.
        rails: Several such rails; it may hang on any of them.
        surfaces: Ids of shapes that it may hang on; with `rails`, on either.
        clear: Distance that it keeps from these surfaces, in units of the scene; None for a small
            part of the room.
        aim: Degrees by which it may turn; True to point anywhere.
        cone: Smallest and largest cutoff of a spot, in degrees.
        beam: Smallest and largest beam width of a spot, in degrees from its axis; True for any in
            its cone. Otherwise the beam keeps its share of the cone.

    Raises:
        SceneError: For invalid values, or more than one kind of place.

    Examples:
        >>> lp.Freedom(line=((-1.8, 3.5, 0.6), (-1.8, 3.5, 6.0)), aim=30).aim
        30.0
    """

    within: float | None = None
    box: Segment | None = None
    line: Segment | None = None
    rails: tuple[Segment, ...] | None = None
    surfaces: tuple[str, ...] | None = None
    clear: float | None = None
    aim: float | bool = False
    cone: tuple[float, float] | None = None
    beam: bool | tuple[float, float] = False

    def __post_init__(self) -> None:
        kinds = ("within", "box", "line", "rails", "surfaces")
        given_keys = [key for key in kinds if getattr(self, key) is not None]
        if len(given_keys) > 1 and given_keys != ["rails", "surfaces"]:
            raise SceneError(
                f"{' and '.join(given_keys)} are given: a light has one of them, or rails and "
                "surfaces"
            )
        if self.within is not None:
            object.__setattr__(self, "within", _number("within", self.within, FARTHEST))
        for key in ("box", "line"):
            if (ends := getattr(self, key)) is not None:
                object.__setattr__(self, key, _ends(key, ends))
        if self.rails is not None:
            object.__setattr__(self, "rails", _rails(self.rails))
        if self.surfaces is not None:
            object.__setattr__(self, "surfaces", _ids(self.surfaces))
        if self.clear is not None:
            if self.surfaces is None:
                raise SceneError("clear is given without surfaces, which it is the distance from")
            object.__setattr__(self, "clear", _number("clear", self.clear, FARTHEST))
        if not isinstance(self.aim, bool):
            object.__setattr__(self, "aim", _number("aim", self.aim, 180.0))
        if self.cone is not None:
            object.__setattr__(self, "cone", _angles("cone", self.cone, 2 * EDGE))
        if not isinstance(self.beam, bool):
            object.__setattr__(self, "beam", _angles("beam", self.beam, EDGE))

    @property
    def is_still(self) -> bool:
        """True if it permits nothing but the current pose."""
        return self == Freedom()

    @property
    def slides(self) -> bool:
        """True if the light may leave its place."""
        return any(
            x is not None for x in (self.within, self.box, self.line, self.rails, self.surfaces)
        )

    @property
    def all_rails(self) -> tuple[Segment, ...]:
        """All rails, `line` among them."""
        return (self.line,) if self.line is not None else self.rails or ()

    @property
    def beams(self) -> tuple[float, float] | None:
        """Smallest and largest beam width in degrees; None if it keeps its share of the cone."""
        if isinstance(self.beam, bool):
            return ANY_BEAM if self.beam else None
        return self.beam

    @property
    def turn(self) -> float:
        """Largest turn in degrees."""
        return (180.0 if self.aim else 0.0) if isinstance(self.aim, bool) else self.aim


def _number(name: str, value: Any, most: float) -> float:
    try:
        number = parse_number(value)
    except (TypeError, ValueError):
        number = math.nan
    if not 0 < number <= most:
        raise SceneError(f"{name} is {brief(value)}: expected a number above 0, at most {most:g}")
    return number


def _ends(name: str, value: Any) -> Segment:
    try:
        points = np.array(value, dtype=float)
    except (TypeError, ValueError):
        points = np.zeros(0)
    if points.shape != (2, 3) or not np.abs(points).max() <= FARTHEST:
        raise SceneError(f"{name} is {brief(value)}: expected two points of three numbers each")
    if name != "box" and np.array_equal(points[0], points[1]):
        raise SceneError(f"{name} is {brief(value)}: expected two different points")
    return as_position(points[0]), as_position(points[1])


def _rails(value: Any) -> tuple[Segment, ...]:
    if isinstance(value, str) or not hasattr(value, "__len__") or not 0 < len(value) <= MAX_PARTS:
        raise SceneError(
            f"rails is {brief(value)}: expected a list of pairs of points, at least one"
        )
    return tuple(_ends("rail", ends) for ends in value)


def _ids(value: Any) -> tuple[str, ...]:
    ids = (value,) if isinstance(value, str) else value
    try:
        ids = tuple(ids)
    except TypeError:
        ids = ()
    if not 0 < len(ids) <= MAX_PARTS or not all(isinstance(x, str) and x for x in ids):
        raise SceneError(f"surfaces is {brief(value)}: expected ids of shapes, at least one")
    return ids


def _angles(name: str, value: Any, least: float) -> tuple[float, float]:
    try:
        low, high = (float(v) for v in value)
    except (TypeError, ValueError):
        low, high = math.nan, math.nan
    if not least < low <= high < 90:
        raise SceneError(
            f"{name} is {brief(value)}: expected two angles, from {least:g} to 90 degrees"
        )
    return low, high


@dataclass(frozen=True)
class FreeLight:
    """A light with its current site and its freedom.

    places: where it may hang; the places of `freedom` if that has no surfaces. sides: smallest and
    largest side of a panel.
    """

    name: str
    site: Site
    freedom: Freedom
    places: permitted_places.Places | None = None
    sides: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        freedom, site = self.freedom, self.site
        for is_asked, has_it, property_name in (
            (freedom.slides, site.position is not None, "place that could change"),
            (freedom.turn > 0, site.direction is not None, "direction that could change"),
            (freedom.cone is not None, site.cutoff is not None, "cone"),
            (freedom.beams is not None, site.cutoff is not None, "beam"),
        ):
            if is_asked and not has_it:
                raise SceneError(
                    f"light {self.name!r} has no {property_name}: leave that freedom out"
                )
        widest = self._cutoffs[1]
        if freedom.beams is not None and freedom.beams[0] > widest - EDGE:
            raise SceneError(
                f"beam of light {self.name!r} begins at {freedom.beams[0]:g} degrees, and its cone "
                f"ends at {widest:g}: give it a wider cone or a narrower beam"
            )
        if self.places is None and site.position is not None:
            position = np.array(site.position, dtype=float)
            object.__setattr__(self, "places", places_of(freedom, position))

    def dimensions(self, site: Site) -> tuple[int, int, int]:
        """Return the numbers of coordinates of place, direction, and cone or size at a pose."""
        freedom = self.freedom
        cone = (freedom.cone is not None) + (freedom.beams is not None)
        return (
            len(self._tangents(site)),
            2 if freedom.turn else 0,
            cone + (self.sides is not None),
        )

    def stepped(self, site: Site, step: Doubles) -> Site:
        """Return the permitted pose nearest to `site` changed by `step`, (sum of dimensions,).

        Units are as in the scene, AIM_UNIT, CONE_UNIT and BEAM_UNIT, or SIDE_UNIT.
        """
        place, turn, cone = np.split(step, np.cumsum(self.dimensions(site))[:2])
        if len(place) and site.position is not None:
            way = place @ self._tangents(site)
            site = replace(site, position=as_position(np.array(site.position) + way))
        if len(turn) and site.direction is not None:
            sideways = across(site.direction)
            direction = np.array(site.direction) + math.radians(AIM_UNIT) * turn @ sideways
            site = replace(site, direction=as_position(direction / np.linalg.norm(direction)))
        if isinstance(site, PanelSite):
            if len(cone):
                site = replace(site, side=site.side * math.exp(SIDE_UNIT * float(cone[0])))
        elif len(cone) and site.cutoff is not None:
            cutoff, share = site.cutoff, (site.beam or 0.0) / site.cutoff
            if self.freedom.cone is not None:
                cutoff += CONE_UNIT * float(cone[0])
            if self.freedom.beams is not None:
                share += BEAM_UNIT * float(cone[-1])
            site = self._opened(site, cutoff, share)
        return self.permitted(site)

    def permitted(self, site: Site) -> Site:
        """Return the permitted pose nearest to `site`."""
        if site.position is not None and self.freedom.slides and self.places is not None:
            place = self.places.nearest(np.array(site.position, dtype=float))
            site = replace(site, position=as_position(place))
        start, turn = self.site.direction, self.freedom.turn
        if site.direction is not None and start is not None and turn < 180:
            turned = _turned(start, site.direction, turn) if turn else start
            site = replace(site, direction=turned)
        if isinstance(site, PanelSite) and isinstance(self.site, PanelSite):
            sides = self.sides or (self.site.side, self.site.side)
            return replace(site, side=float(np.clip(site.side, *sides)))
        if site.cutoff is not None and self._has_free_cone:
            site = self._opened(site, site.cutoff, (site.beam or 0.0) / site.cutoff)
        return site

    def is_slid_to_end(self, site: Site) -> bool:
        """Return whether the pose is at the end of a rail, or the edge of a ball or box.

        Edges of surfaces do not count, since triangles end inside of them.
        """
        if site.position is None or site.position == self.site.position or self.places is None:
            return False
        if not self.freedom.slides or self.freedom.surfaces is not None:
            return False
        tangents, place = self._tangents(site), np.array(site.position, dtype=float)
        way = (place - np.array(self.site.position, dtype=float)) @ tangents.T @ tangents
        step = 2 * AT_END * math.dist(site.position, self.site.position or site.position)
        ahead = way / max(float(np.linalg.norm(way)), 1e-300)
        steps = step * np.concatenate([tangents, -tangents, ahead[None]])
        beyond = [math.dist(self.places.nearest(place + x), place + x) for x in steps]
        return max(beyond) > step / 2

    def is_turned_to_end(self, site: Site) -> bool:
        """Return whether the pose is turned by all that is permitted."""
        if site.direction is None or self.site.direction is None or self.freedom.turn >= 180:
            return False
        cosine = float(np.dot(site.direction, self.site.direction))
        turn = math.degrees(math.acos(max(-1.0, min(1.0, cosine))))
        return 0 < self.freedom.turn * (1 - AT_END) <= turn

    def some_places(self, count: int, rng: np.random.Generator) -> Floats:
        """Return about `count` permitted places that are far apart, the current one first."""
        position = np.array(self.site.position, dtype=float)[None]
        if not self.freedom.slides or count < 2:
            return position
        assert self.places is not None
        many = self.places.random(permitted_places.OVERSAMPLING * count, rng)
        return np.concatenate([position, far_apart(many, count - 1, start=position)])

    def directions(self, apart: float) -> Floats:
        """Return permitted directions, about `apart` degrees apart, the current one first."""
        if self.site.direction is None or not self.freedom.turn:
            return np.array(self.site.direction or (0.0, 0.0, 1.0))[None]
        count = max(8, round(4 * math.pi / math.radians(apart) ** 2))
        k = np.arange(count) + 0.5
        z, turn = 1 - 2 * k / count, math.pi * (1 + math.sqrt(5)) * k
        flat = np.sqrt(1 - z**2)
        sphere = np.stack([flat * np.cos(turn), flat * np.sin(turn), z], axis=1)
        # The spiral's pole is the current direction, so that even a few directions are well placed.
        sphere = sphere @ rotation_between((0.0, 0.0, 1.0), self.site.direction).T
        near = sphere @ np.array(self.site.direction) >= math.cos(math.radians(self.freedom.turn))
        return np.concatenate([np.array(self.site.direction)[None], sphere[near]])

    def cones(self, count: int = 4) -> Floats:
        """Return permitted cones, (c, 2): cutoff and beam in degrees, the current one first."""
        now = (self.site.cutoff or 0.0, self.site.beam or 0.0)
        if self.freedom.cone is None:
            return np.array([now])
        share = now[1] / (now[0] or 1.0)
        cutoffs = _middles(*self.freedom.cone, count)
        cutoffs = cutoffs[np.abs(cutoffs / now[0] - 1) > ALIKE]
        opened = [self._opened(self.site, float(cutoff), share) for cutoff in cutoffs]
        return np.array([now, *((x.cutoff, x.beam) for x in opened)], dtype=float)

    def some_sides(self, count: int) -> Doubles:
        """Return permitted sides of a panel, the present one first."""
        assert isinstance(self.site, PanelSite)
        if self.sides is None:
            return np.array([self.site.side])
        sides = _middles(*self.sides, count)
        return np.array([self.site.side, *sides[np.abs(sides / self.site.side - 1) > ALIKE]])

    def _tangents(self, site: Site) -> Doubles:
        if not self.freedom.slides or self.places is None or site.position is None:
            return np.zeros((0, 3))
        return self.places.tangents(np.array(site.position, dtype=float))

    @property
    def _cutoffs(self) -> tuple[float, float]:
        """The smallest and largest cutoff in degrees."""
        now = self.site.cutoff or 0.0
        return self.freedom.cone or (now, now)

    @property
    def _has_free_cone(self) -> bool:
        return self.freedom.cone is not None or self.freedom.beams is not None

    @cached_property
    def _share(self) -> float:
        """The current width of its beam, as a share of its cone."""
        return (self.site.beam or 0.0) / (self.site.cutoff or 1.0)

    def _opened(self, site: Site, cutoff: float, share: float) -> Site:
        """Return `site` with a permitted cone nearest to `cutoff`, and that share of beam."""
        beams, (least, most) = self.freedom.beams, self._cutoffs
        if beams is None:
            cutoff = float(np.clip(cutoff, least, most))
            beam = self._share * cutoff
        else:
            cutoff = float(np.clip(cutoff, max(least, beams[0] + EDGE), most))
            beam = float(np.clip(max(share, LEAST_BEAM) * cutoff, *beams))
        beam = max(min(beam, cutoff - EDGE), EDGE)
        return replace(site, cutoff=cutoff, beam=beam)


def _middles(low: float, high: float, count: int) -> Doubles:
    """Return the middles of `count` parts of a range of sizes, which are equal as ratios."""
    edges = np.geomspace(low, high, 2 * count + 1)
    return np.asarray(edges[1::2])


def places_of(
    freedom: Freedom, position: Doubles, surfaces: permitted_places.Places | None = None
) -> permitted_places.Places:
    """Return the places of a freedom. position: (3,), the current one. surfaces: of its shapes."""
    parts: list[permitted_places.Places] = [] if surfaces is None else [surfaces]
    if freedom.all_rails:
        parts.append(permitted_places.Rails(np.array(freedom.all_rails, dtype=float)))
    if parts:
        return parts[0] if len(parts) == 1 else permitted_places.EitherPlaces(parts)
    if freedom.box is not None:
        return permitted_places.BoxOfPlaces(
            np.min(freedom.box, axis=0), np.max(freedom.box, axis=0)
        )
    if freedom.within is not None:
        return permitted_places.BallOfPlaces(position, freedom.within)
    return permitted_places.OnePlace(position)


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
